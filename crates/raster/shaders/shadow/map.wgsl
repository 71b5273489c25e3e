// Shadow map: what lies behind the nearest fiber is dark.

// So many fibers that nothing gets through any hair.
const SHADOW_MANY: f32 = 64.0;

fn shadow_crossed(place: ShadowPlace, at: vec2i) -> f32 {
    let behind = place.depth - shadow_hair_depth(place, at);
    return select(0.0, SHADOW_MANY, behind > shadow_hair_bias(place));
}

fn shadow_passed(crossed: f32) -> f32 {
    return select(1.0, 0.0, crossed > 0.0);
}
