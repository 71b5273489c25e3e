// Deep opacity maps: up to four layers that follow the nearest fiber. Layer k holds the fibers from the nearest one to
// the layer's far side; the last layer in use, and those that are not, hold all.

fn shadow_crossed(place: ShadowPlace, at: vec2i) -> f32 {
    let behind = place.depth - shadow_hair_depth(place, at);
    let hair = lamps.list[place.lamp].hair;
    let ends = lamps.ends * (hair.y - hair.x);
    let sums = textureLoad(shadow_opacity_map, at, place.layer, 0);
    if behind <= 0.0 {
        return 0.0;
    }
    if behind < ends.x {
        return sums.x * behind / ends.x;
    }
    if behind < ends.y {
        return mix(sums.x, sums.y, (behind - ends.x) / (ends.y - ends.x));
    }
    if behind < ends.z {
        return mix(sums.y, sums.z, (behind - ends.y) / (ends.z - ends.y));
    }
    if behind < ends.w {
        return mix(sums.z, sums.w, (behind - ends.z) / (ends.w - ends.z));
    }
    return sums.w;
}

fn shadow_passed(crossed: f32) -> f32 {
    return exp(-lamps.optical * crossed);
}
