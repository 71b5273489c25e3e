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

// Optical depth of a layer's own fragment. Never nothing, whatever became of a faint one in its payload: layers that are
// present share out what the pixel has.
fn subsets_own(alpha: f32) -> f32 {
    return fragment_optical_depth(max(alpha, 1e-6));
}

// The same; nothing where there is no hair.
fn subsets_depth(pixel: vec2i, layer: vec2u) -> f32 {
    let payload = textureLoad(subsets_payloads, pixel, layer.y, 0).xy;
    return select(subsets_own(payload_alpha(payload)), 0.0, layer.x == SUBSETS_EMPTY);
}

// Blends a layer, whose optical depth is multiplied by `scale`, behind `front`, whose `w` is what passes it.
fn subsets_behind(front: vec4f, layer: vec2u, at: vec2f, scale: f32) -> vec4f {
    let payload = textureLoad(subsets_payloads, vec2i(at), layer.y, 0).xy;
    let seen = payload_color(payload, at, bitcast<f32>(layer.x));
    let through = exp(-scale * subsets_own(seen.a));
    return vec4f(front.rgb + front.w * (1.0 - through) * seen.rgb, front.w * through);
}
