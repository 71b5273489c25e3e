// Optical depth of all hair of a pixel; the target adds.

@fragment
fn subsets_opacity(v: HairVertex) -> @location(0) f32 {
    let f = hair_fragment(v);
    if f.alpha <= 0.0 || view_hidden(v.clip) {
        discard;
    }
    // An opaque fragment counts as one that lets 1/256 through.
    return -log(1.0 - min(f.alpha, 0.9961));
}
