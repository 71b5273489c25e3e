// Optical depth of all hair of a pixel; the target adds.

@fragment
fn subsets_opacity(v: HairVertex) -> @location(0) f32 {
    let f = hair_fragment(v);
    if f.alpha <= 0.0 || view_hidden(v.clip) {
        discard;
    }
    return fragment_optical_depth(f.alpha);
}
