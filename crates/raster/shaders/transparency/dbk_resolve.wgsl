// Blends the lists front to back, and then the hair behind the layer.

@group(3) @binding(0) var<uniform> dbk_band: ChainBand;
@group(3) @binding(1) var<storage, read> dbk_heads: array<u32>;
@group(3) @binding(2) var<storage, read> dbk_links: array<vec2u>;
@group(3) @binding(3) var<storage, read> dbk_payloads: array<vec2u>;
@group(3) @binding(4) var dbk_behind_payloads: texture_2d<u32>;
@group(3) @binding(5) var dbk_behind_depths: texture_2d<f32>;
@group(3) @binding(6) var dbk_rest: texture_2d<f32>;

@fragment
fn dbk_resolve(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let head = dbk_heads[chain_pixel(dbk_band, at.xy)];
    // All hair behind the layer makes up the opacity, though only its nearest fragment has a colour.
    let behind_depth = textureLoad(dbk_behind_depths, pixel, 0).x;
    let rest = select(0.0, textureLoad(dbk_rest, pixel, 0).x, behind_depth > 0.0);
    if head == 0u && rest <= 0.0 {
        discard;
    }
    var color = vec3f(0.0);
    var through = 1.0;
    // The farthest fragment that was blended.
    var last = vec2u(0u);
    var more = true;
    // <declare the chain>
    // The list is walked once for each chain full of fragments.
    while more {
        var left = 0u;
        var node = head;
        while node != 0u {
            let link = dbk_links[node - 1u];
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
        more = left > CHAIN_LENGTH;
        // What is behind the layer comes as one more fragment after the list, so that shading is in the text once.
        let items = min(left, CHAIN_LENGTH) + u32(!more && rest > 0.0);
        for (var i = 0u; i < items && through > CHAIN_OPAQUE; i++) {
            let behind = chain_0.x == CHAIN_EMPTY;
            var payload = vec2u(0u);
            var depth = behind_depth;
            if behind {
                payload = textureLoad(dbk_behind_payloads, pixel, 0).xy;
            } else {
                payload = dbk_payloads[chain_0.y - 1u];
                depth = bitcast<f32>(chain_0.x);
            }
            let seen = payload_color(payload, at.xy, depth);
            let alpha = select(seen.a, 1.0 - exp(-rest), behind);
            color += (through * alpha) * seen.rgb;
            through *= 1.0 - alpha;
            // <take the nearest from the chain>
        }
        more = more && through > CHAIN_OPAQUE;
    }
    return vec4f(color, 1.0 - through);
}
