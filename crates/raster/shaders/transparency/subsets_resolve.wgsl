// What the generated `subsets_resolve` is made of.

@group(3) @binding(0) var subsets_payloads: texture_2d_array<u32>;
@group(3) @binding(1) var subsets_depths: texture_2d_array<f32>;
@group(3) @binding(2) var subsets_opacities: texture_2d<f32>;

// Depth of a layer without hair here: behind everything.
const SUBSETS_EMPTY: u32 = 0xffffffffu;

// Depth of a subset's nearest fragment as bits, which order like the depths, and the subset.
fn subsets_layer(pixel: vec2i, layer: u32) -> vec2u {
    let depth = textureLoad(subsets_depths, pixel, layer, 0).x;
    return vec2u(select(SUBSETS_EMPTY, bitcast<u32>(depth), depth > 0.0), layer);
}

// Blends a layer of opacity `alpha` behind `front`, whose `w` is what passes it.
fn subsets_behind(front: vec4f, layer: vec2u, at: vec2f, alpha: f32) -> vec4f {
    let payload = textureLoad(subsets_payloads, vec2i(at), layer.y, 0).xy;
    let color = payload_color(payload, at, bitcast<f32>(layer.x)).rgb;
    return vec4f(front.rgb + front.w * alpha * color, front.w * (1.0 - alpha));
}
