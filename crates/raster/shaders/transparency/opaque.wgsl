// Hair as if every fragment hid what is behind it. The depth test of the hardware keeps the nearest one.

struct OpaqueGathered {
    @location(0) payload: vec2u,
    @location(1) depth: f32,  // linear; the target is 0 where there is no hair
}

// Shades at once.
@fragment
fn opaque_forward(v: HairVertex) -> @location(0) vec4f {
    let f = hair_fragment(v);
    if f.alpha <= 0.0 || view_hidden(v.clip) {
        discard;
    }
    return vec4f(clamp(shade(f), vec3f(0.0), vec3f(60000.0)), 1.0);
}

// Keeps what shading needs.
@fragment
fn opaque_gather(v: HairVertex) -> OpaqueGathered {
    let f = hair_fragment(v);
    if f.alpha <= 0.0 || view_hidden(v.clip) {
        discard;
    }
    return OpaqueGathered(fragment_payload(f), f.depth);
}
