// Lists of the fragments inside the layer, and the nearest one behind it.

struct DbkBehind {
    @location(0) payload: vec2u,
    @location(1) depth: f32,
}

@group(3) @binding(0) var<uniform> dbk_band: ChainBand;
@group(3) @binding(1) var dbk_ends: texture_2d<f32>;
// The first node of each pixel of the band. Nodes count from 1; 0 ends a list.
@group(3) @binding(2) var<storage, read_write> dbk_heads: array<atomic<u32>>;
// Depth bits, next node.
@group(3) @binding(3) var<storage, read_write> dbk_links: array<vec2u>;
@group(3) @binding(4) var<storage, read_write> dbk_payloads: array<vec2u>;
@group(3) @binding(5) var<storage, read_write> dbk_counters: array<atomic<u32>>;

// Stores a fragment inside the layer, and gives the target, which adds, the optical depth of one behind it.
@fragment
fn dbk_fill(v: HairVertex) -> @location(0) f32 {
    let f = hair_fragment(v);
    if f.alpha < CHAIN_LEAST_ALPHA || view_hidden(v.clip) {
        discard;
    }
    if f.depth > textureLoad(dbk_ends, vec2i(v.clip.xy), 0).x {
        return fragment_optical_depth(f.alpha);
    }
    // Counts those that find no room too: that is how much room the next frame needs.
    let node = atomicAdd(&dbk_counters[dbk_band.slot], 1u);
    if node < dbk_band.capacity {
        dbk_payloads[node] = fragment_payload(f);
        let next = atomicExchange(&dbk_heads[chain_pixel(dbk_band, v.clip.xy)], node + 1u);
        dbk_links[node] = vec2u(chain_bits(f.depth), next);
    }
    return 0.0;
}

@fragment
fn dbk_behind(v: HairVertex) -> DbkBehind {
    let f = hair_fragment(v);
    let hidden = f.alpha < CHAIN_LEAST_ALPHA || view_hidden(v.clip);
    if hidden || f.depth <= textureLoad(dbk_ends, vec2i(v.clip.xy), 0).x {
        discard;
    }
    return DbkBehind(fragment_payload(f), f.depth);
}
