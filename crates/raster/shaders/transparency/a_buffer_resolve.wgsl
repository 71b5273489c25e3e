// Blends the lists, front to back.

@group(3) @binding(0) var<uniform> a_buffer_band: ChainBand;
@group(3) @binding(1) var<storage, read> a_buffer_heads: array<u32>;
@group(3) @binding(2) var<storage, read> a_buffer_links: array<vec2u>;
@group(3) @binding(3) var<storage, read> a_buffer_payloads: array<vec2u>;

// All fragments: the list is walked once for each chain full of them.
@fragment
fn a_buffer_all(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let head = a_buffer_heads[A_BUFFER_COUNTERS + chain_pixel(a_buffer_band, at.xy)];
    var color = vec3f(0.0);
    var through = 1.0;
    // The farthest fragment that was blended, and how many there are behind it.
    var last = vec2u(0u);
    var left = select(CHAIN_LENGTH + 1u, 0u, head == 0u);
    // <declare the chain>
    while left > CHAIN_LENGTH && through > CHAIN_OPAQUE {
        left = 0u;
        var node = head;
        while node != 0u {
            let link = a_buffer_links[node - 1u];
            var carry = vec2u(link.x, node);
            if chain_before(last, carry) {
                left += 1u;
                if chain_before(carry, chain_last) {
                    // <put `carry` into the chain>
                }
            }
            node = link.y;
        }
        last = chain_last;
        while chain_0.x != CHAIN_EMPTY && through > CHAIN_OPAQUE {
            let seen = payload_color(a_buffer_payloads[chain_0.y - 1u], at.xy, bitcast<f32>(chain_0.x));
            color += (through * seen.a) * seen.rgb;
            through *= 1.0 - seen.a;
            // <take the nearest from the chain>
        }
    }
    return vec4f(color, 1.0 - through);
}

// The foremost ones, and what is behind them as one fragment.
@fragment
fn a_buffer_foremost(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var node = a_buffer_heads[A_BUFFER_COUNTERS + chain_pixel(a_buffer_band, at.xy)];
    // Colours by optical depth, and what gets through.
    var tail = vec4f(0.0);
    var tail_through = 1.0;
    // <declare the chain>
    while node != 0u {
        let link = a_buffer_links[node - 1u];
        var carry = vec2u(link.x, node);
        if A_BUFFER_TAIL || chain_before(carry, chain_last) {
            // <put `carry` into the chain>
        }
        // What the chain has no room for: it will never be among the foremost again.
        if A_BUFFER_TAIL && carry.x != CHAIN_EMPTY {
            let payload = a_buffer_payloads[carry.y - 1u];
            if A_BUFFER_TAIL_COLORS {
                let seen = payload_color(payload, at.xy, bitcast<f32>(carry.x));
                tail += fragment_optical_depth(seen.a) * vec4f(seen.rgb, 1.0);
                tail_through *= 1.0 - seen.a;
            } else {
                tail_through *= 1.0 - payload_alpha(payload);
            }
        }
        node = link.y;
    }
    var color = vec3f(0.0);
    var through = 1.0;
    var front = vec4f(0.0);
    while chain_0.x != CHAIN_EMPTY && through > CHAIN_OPAQUE {
        let seen = payload_color(a_buffer_payloads[chain_0.y - 1u], at.xy, bitcast<f32>(chain_0.x));
        color += (through * seen.a) * seen.rgb;
        through *= 1.0 - seen.a;
        front += fragment_optical_depth(seen.a) * vec4f(seen.rgb, 1.0);
        // <take the nearest from the chain>
    }
    if A_BUFFER_TAIL {
        if !A_BUFFER_TAIL_COLORS {
            tail = front;
        }
        color += (through * (1.0 - tail_through)) * chain_mean(tail);
        through *= tail_through;
    }
    return vec4f(color, 1.0 - through);
}
