// Shades the nearest fragment of every pixel.

@group(3) @binding(0) var opaque_payloads: texture_2d<u32>;
@group(3) @binding(1) var opaque_depths: texture_2d<f32>;

@fragment
fn opaque_resolve(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let depth = textureLoad(opaque_depths, pixel, 0).x;
    if depth <= 0.0 {
        discard;
    }
    let payload = textureLoad(opaque_payloads, pixel, 0).xy;
    return vec4f(payload_color(payload, at.xy, depth).rgb, 1.0);
}
