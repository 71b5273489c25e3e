// The nearest fragments of each pixel without a lock, in two passes over the hair.
//
// A slot holds a key: larger is nearer, 0 is nothing, and the highest bit is free. The second pass sets it where a
// fragment has found its slot.

const K_PLUS_NEAREST: u32 = 0x7fffffffu;
const K_PLUS_TAKEN: u32 = 0x80000000u;

@group(3) @binding(0) var<uniform> k_plus_band: ChainBand;
// K_PLUS_LENGTH keys a pixel.
@group(3) @binding(1) var<storage, read_write> k_plus_slots: array<atomic<u32>>;
@group(3) @binding(2) var<storage, read_write> k_plus_payloads: array<vec2u>;

fn k_plus_key(depth: f32) -> u32 {
    return K_PLUS_NEAREST - chain_bits(depth);
}

@fragment
fn k_plus_depths(v: HairVertex) -> @location(0) vec4f {
    let f = hair_fragment(v);
    if !view_hidden(v.clip) && f.alpha >= CHAIN_LEAST_ALPHA {
        let base = chain_pixel(k_plus_band, v.clip.xy) * K_PLUS_LENGTH;
        var key = k_plus_key(f.depth);
        // Slots only ever come nearer, so what is behind the last one now stays behind it.
        if key > atomicLoad(&k_plus_slots[base + K_PLUS_LENGTH - 1u]) {
            // Each step leaves the nearer of two keys and takes the other one along, in whatever order fragments
            // come by: slot i ends with the i-th nearest.
            for (var i = 0u; i < K_PLUS_LENGTH && key != 0u; i++) {
                key = min(key, atomicMax(&k_plus_slots[base + i], key));
            }
        }
    }
    return vec4f(0.0);
}

@fragment
fn k_plus_store(v: HairVertex) -> @location(0) vec4f {
    let f = hair_fragment(v);
    if view_hidden(v.clip) || f.alpha < CHAIN_LEAST_ALPHA {
        return vec4f(0.0);
    }
    let base = chain_pixel(k_plus_band, v.clip.xy) * K_PLUS_LENGTH;
    let key = k_plus_key(f.depth);
    var place = K_PLUS_LENGTH;
    if key >= (atomicLoad(&k_plus_slots[base + K_PLUS_LENGTH - 1u]) & K_PLUS_NEAREST) {
        for (var i = 0u; i < K_PLUS_LENGTH && place == K_PLUS_LENGTH; i++) {
            if (atomicLoad(&k_plus_slots[base + i]) & K_PLUS_NEAREST) == key {
                // Of fragments at equal depths each takes another slot.
                if atomicOr(&k_plus_slots[base + i], K_PLUS_TAKEN) < K_PLUS_TAKEN {
                    place = i;
                }
            }
        }
    }
    let kept = place < K_PLUS_LENGTH;
    if kept || (K_PLUS_TAIL && K_PLUS_TAIL_COLORS) {
        let payload = fragment_payload(f);
        if kept {
            k_plus_payloads[base + place] = payload;
            return vec4f(0.0);
        }
        let seen = payload_color(payload, v.clip.xy, f.depth);
        let weight = fragment_optical_depth(seen.a);
        // Halves end at 65504.
        return vec4f(min(weight * seen.rgb, vec3f(4000.0)), weight);
    }
    return vec4f(0.0, 0.0, 0.0, select(0.0, fragment_optical_depth(f.alpha), K_PLUS_TAIL));
}
