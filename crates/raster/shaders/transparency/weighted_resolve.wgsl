// The weighted mean of the colours, as opaque as all fragments together.

@group(3) @binding(0) var weighted_colors: texture_2d<f32>;
@group(3) @binding(1) var weighted_depths: texture_2d<f32>;

@fragment
fn weighted_resolve(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let sum = textureLoad(weighted_colors, pixel, 0);
    if sum.w <= 0.0 {
        discard;
    }
    let alpha = 1.0 - exp(-textureLoad(weighted_depths, pixel, 0).x);
    return vec4f(min(sum.rgb / sum.w, vec3f(60000.0)) * alpha, alpha);
}
