// What the camera sees behind everything: a lat-long image, interpolated as the path tracer does it.

// Twin of `SkyPaint` in `sky.rs`.
struct SkyPaint {
    base: vec3f,  // radiance from everywhere
    turn: f32,    // turns of the image about +y, counter-clockwise seen from above
}

@group(3) @binding(0) var<uniform> sky_paint: SkyPaint;
@group(3) @binding(1) var sky_image: texture_2d<f32>;

// Columns go round, rows end at the poles.
fn sky_texel(at: vec2i, size: vec2i) -> vec3f {
    let column = (at.x + size.x) % size.x;
    let row = clamp(at.y, 0, size.y - 1);
    return textureLoad(sky_image, vec2i(column, row), 0).xyz;
}

fn sky_radiance(d: vec3f) -> vec3f {
    // By hand: the filter of a sampler has steps that show in a smooth sky.
    let size = vec2i(textureDimensions(sky_image));
    let across = length(d.xz);
    let azimuth = select(0.0, atan2(d.x, -d.z), across > 0.0);
    let u = fract(azimuth / 6.28318530718 + sky_paint.turn);
    let v = atan2(across, d.y) / 3.14159265359;
    let place = vec2f(u, v) * vec2f(size) - 0.5;
    let corner = floor(place);
    let share = place - corner;
    let at = vec2i(corner);
    let above = mix(sky_texel(at, size), sky_texel(at + vec2i(1, 0), size), share.x);
    let below = mix(sky_texel(at + vec2i(0, 1), size), sky_texel(at + vec2i(1, 1), size), share.x);
    return sky_paint.base + mix(above, below, share.y);
}

@fragment
fn sky_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var d = view.forward;
    if view.perspective == 1u {
        d = normalize(view_position(at.xy, 1.0) - view.eye);
    }
    // The largest half-precision number: infinity would spoil what is averaged with it.
    return vec4f(min(sky_radiance(d), vec3f(65504.0)), 0.0);
}
