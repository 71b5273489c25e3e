// Every fragment over what was drawn before it.

@fragment
fn blend_over(v: HairVertex) -> @location(0) vec4f {
    let f = hair_fragment(v);
    if f.alpha <= 0.0 || view_hidden(v.clip) {
        discard;
    }
    let color = clamp(shade(f), vec3f(0.0), vec3f(60000.0));
    return vec4f(color * f.alpha, f.alpha);
}
