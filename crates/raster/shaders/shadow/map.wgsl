// Shadow map: what lies behind the nearest fiber is dark.

// One fiber or none: how many there are is not known.
fn shadow_crossed(place: ShadowPlace, at: vec2i) -> f32 {
    let behind = place.depth - shadow_hair_depth(place, at);
    return select(0.0, 1.0, behind > shadow_hair_bias(place));
}

// Whatever the opacity of a fiber.
fn shadow_passed(crossed: f32) -> f32 {
    return select(1.0, 0.0, crossed > 0.0);
}
