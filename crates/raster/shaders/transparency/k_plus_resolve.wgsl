// Blends the slots, front to back, and counts them row by row, those whose fragment did not come behind the last row.

const K_PLUS_NEAREST: u32 = 0x7fffffffu;
const K_PLUS_TAKEN: u32 = 0x80000000u;

@group(3) @binding(0) var<uniform> k_plus_band: ChainBand;
@group(3) @binding(1) var<storage, read> k_plus_slots: array<u32>;
@group(3) @binding(2) var<storage, read> k_plus_payloads: array<vec2u>;
@group(3) @binding(3) var<storage, read_write> k_plus_counts: array<atomic<u32>>;
// Behind the slots: colour times optical depth, optical depth.
@group(3) @binding(4) var k_plus_tail: texture_2d<f32>;

// Slots that are in order already. Those without a payload belong to fragments whose depth was another one the second
// time: they are in the tail, and are counted as dropped.
@fragment
fn k_plus_ordered(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let base = chain_pixel(k_plus_band, at.xy) * K_PLUS_LENGTH;
    var color = vec3f(0.0);
    var through = 1.0;
    var front = vec4f(0.0);
    var count = 0u;
    var missing = 0u;
    for (var i = 0u; i < K_PLUS_LENGTH; i++) {
        let slot = k_plus_slots[base + i];
        missing += select(0u, 1u, slot != 0u && slot < K_PLUS_TAKEN);
        if slot >= K_PLUS_TAKEN {
            count += 1u;
            if through > CHAIN_OPAQUE {
                let depth = bitcast<f32>(K_PLUS_NEAREST - (slot & K_PLUS_NEAREST));
                let seen = payload_color(k_plus_payloads[base + i], at.xy, depth);
                color += (through * seen.a) * seen.rgb;
                through *= 1.0 - seen.a;
                front += fragment_optical_depth(seen.a) * vec4f(seen.rgb, 1.0);
            }
        }
    }
    if count > 0u {
        atomicAdd(&k_plus_counts[u32(at.y)], count);
    }
    if missing > 0u {
        atomicAdd(&k_plus_counts[arrayLength(&k_plus_counts) - 1u], missing);
    }
    if K_PLUS_TAIL {
        // A sum of halves may have become infinite.
        let tail = min(textureLoad(k_plus_tail, vec2i(at.xy), 0), vec4f(65504.0));
        var mean = chain_mean(front);
        if K_PLUS_TAIL_COLORS {
            mean = chain_mean(tail);
        }
        let tail_through = exp(-tail.a);
        color += (through * (1.0 - tail_through)) * mean;
        through *= tail_through;
    }
    return vec4f(color, 1.0 - through);
}

// Slots in any order.
@fragment
fn k_plus_unordered(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let base = chain_pixel(k_plus_band, at.xy) * K_PLUS_LENGTH;
    var count = 0u;
    // <declare the chain>
    for (var i = 0u; i < K_PLUS_LENGTH; i++) {
        let slot = k_plus_slots[base + i];
        if slot != 0u {
            count += 1u;
            var carry = vec2u(K_PLUS_NEAREST - slot, i);
            // <put `carry` into the chain>
        }
    }
    if count > 0u {
        atomicAdd(&k_plus_counts[u32(at.y)], count);
    }
    var color = vec3f(0.0);
    var through = 1.0;
    while chain_0.x != CHAIN_EMPTY && through > CHAIN_OPAQUE {
        let seen = payload_color(k_plus_payloads[base + chain_0.y], at.xy, bitcast<f32>(chain_0.x));
        color += (through * seen.a) * seen.rgb;
        through *= 1.0 - seen.a;
        // <take the nearest from the chain>
    }
    return vec4f(color, 1.0 - through);
}
