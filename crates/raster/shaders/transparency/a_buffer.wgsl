// Puts every fragment at the front of its pixel's list. Nodes count from 1; 0 ends a list.

@group(3) @binding(0) var<uniform> a_buffer_band: ChainBand;
// Counters of the bands, then the first node of every pixel.
@group(3) @binding(1) var<storage, read_write> a_buffer_heads: array<atomic<u32>>;
// Depth bits, next node.
@group(3) @binding(2) var<storage, read_write> a_buffer_links: array<vec2u>;
@group(3) @binding(3) var<storage, read_write> a_buffer_payloads: array<vec2u>;

@fragment
fn a_buffer_fill(v: HairVertex) -> @location(0) vec4f {
    let f = hair_fragment(v);
    if !view_hidden(v.clip) && f.alpha >= CHAIN_LEAST_ALPHA {
        // The counter goes on where memory ends: it says how much is missing.
        let node = atomicAdd(&a_buffer_heads[a_buffer_band.slot], 1u);
        if node < a_buffer_band.capacity {
            a_buffer_payloads[node] = fragment_payload(f);
            let next = atomicExchange(&a_buffer_heads[A_BUFFER_COUNTERS + chain_pixel(a_buffer_band, v.clip.xy)], node + 1u);
            a_buffer_links[node] = vec2u(chain_bits(f.depth), next);
        }
    }
    return vec4f(0.0);
}
