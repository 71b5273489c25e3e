// Approximated deep shadow map: fibers are guessed from the way behind the nearest one.

fn shadow_crossed(place: ShadowPlace, at: vec2i) -> f32 {
    let behind = place.depth - shadow_hair_depth(place, at);
    // The nearest fiber itself is one of them for all that is clearly behind it.
    let nearest = select(0.0, 1.0, behind > shadow_hair_bias(place));
    return max(behind, 0.0) / lamps.spacing + nearest;
}

// (1 - a)^n with a = 1 - exp(-optical), the opacity of one fiber.
fn shadow_passed(crossed: f32) -> f32 {
    return exp(-lamps.optical * crossed);
}
