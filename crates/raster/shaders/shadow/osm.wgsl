// Opacity shadow maps: 16 slices of equal thickness, four in a texel. Slice k holds the fibers from the front of the
// hair to the slice's far side.

const SHADOW_SLICES: i32 = 16;

fn shadow_slice(place: ShadowPlace, at: vec2i, slice: i32) -> f32 {
    if slice < 0 {
        return 0.0;
    }
    let four = textureLoad(shadow_opacity_map, at, 4 * place.layer + (slice >> 2u), 0);
    let pair = select(four.xy, four.zw, (slice & 2) != 0);
    return select(pair.x, pair.y, (slice & 1) != 0);
}

fn shadow_crossed(place: ShadowPlace, at: vec2i) -> f32 {
    let hair = lamps.list[place.lamp].hair;
    let s = clamp((place.depth - hair.x) / (hair.y - hair.x), 0.0, 1.0) * f32(SHADOW_SLICES);
    let slice = min(i32(s), SHADOW_SLICES - 1);
    return mix(shadow_slice(place, at, slice - 1), shadow_slice(place, at, slice), s - f32(slice));
}

fn shadow_passed(crossed: f32) -> f32 {
    return exp(-lamps.optical * crossed);
}
