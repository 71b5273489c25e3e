// Looking shadows up: from a point to texels, and the mean over those around it. A technique says what one texel
// means: `shadow_crossed` (fibers between the lamp and the place) and `shadow_passed` (what gets through so many). All
// that is asked of a lamp follows from the mean of what gets through.
//
// The filter averages what gets through, not the fibers crossed: the texels stand for the light that arrives around
// the place, and light adds up. Averaged fibers would darken every gap, since exp is convex.
//
// `SHADOW_RADIUS` (texels to either side) stands in front of this text.

@group(2) @binding(13) var shadow_hair_map: texture_depth_2d_array;
@group(2) @binding(14) var shadow_solid_map: texture_depth_2d_array;
@group(2) @binding(15) var shadow_opacity_map: texture_2d_array<f32>;

const SHADOW_ROW: i32 = 2 * SHADOW_RADIUS + 1;
const SHADOW_TEXELS: i32 = SHADOW_ROW * SHADOW_ROW;

// A place as the map of one lamp sees it.
struct ShadowPlace {
    lamp: u32,
    layer: i32,
    depth: f32,  // along the map's view, scene units
    texel: f32,  // size of a texel there, scene units
    at: vec2f,   // in texels; centres are at halves
    inside: bool,
}

// One texel of the filter.
struct ShadowTap {
    at: vec2i,
    weight: f32,  // all of them sum to 1
}

fn shadow_place(i: u32, p: vec3f) -> ShadowPlace {
    var place: ShadowPlace;
    place.lamp = i;
    let layer = lamps.list[i].layer;
    // What a map does not reach is lit: hair has no shadow there.
    place.inside = false;
    if layer == 0xffffffffu {
        return place;
    }
    let clip = lamps.list[i].map_from_world * vec4f(p, 1.0);
    if !(clip.w > 0.0) {
        return place;
    }
    let side = f32(lamps.side);
    place.layer = i32(layer);
    place.depth = dot(p - lamps.list[i].eye, lamps.list[i].forward);
    place.texel = lamps.list[i].texel * select(1.0, place.depth, lamps.list[i].perspective == 1u);
    place.at = (vec2f(0.5, -0.5) * clip.xy / clip.w + 0.5) * side;
    place.inside = all(place.at >= vec2f(0.0)) && all(place.at < vec2f(side));
    return place;
}

// Texel `k` of the filter. The weights are those of a window two radii wide around the place: it touches as many texels
// as the filter has, and what it gives changes evenly when the place moves.
fn shadow_tap(place: ShadowPlace, k: i32) -> ShadowTap {
    let middle = vec2i(floor(place.at));
    let most = vec2i(i32(lamps.side) - 1);
    if SHADOW_RADIUS == 0 {
        return ShadowTap(clamp(middle, vec2i(0), most), 1.0);
    }
    let step = vec2i(k % SHADOW_ROW, k / SHADOW_ROW) - SHADOW_RADIUS;
    let off = place.at - vec2f(middle) - 0.5;
    let reach = f32(SHADOW_RADIUS);
    let share = clamp(reach + 0.5 - abs(vec2f(step) - off), vec2f(0.0), vec2f(1.0));
    return ShadowTap(clamp(middle + step, vec2i(0), most), share.x * share.y / (4.0 * reach * reach));
}

// Depth of the nearest hair of a texel.
fn shadow_hair_depth(place: ShadowPlace, at: vec2i) -> f32 {
    return lamp_map_depth(place.lamp, textureLoad(shadow_hair_map, at, place.layer, 0));
}

// How far behind the nearest hair a place must lie to be behind another fiber: within it, a fiber's own texels count,
// which are as deep as its slope makes them, and the band that the lamp saw is turned against the one that is shaded.
fn shadow_hair_bias(place: ShadowPlace) -> f32 {
    return 1.5 * place.texel + lamps.width;
}

// 1 where no mesh is in the way of lamp `i`, 0 where one is.
fn shadow_solid(i: u32, p: vec3f) -> f32 {
    let place = shadow_place(i, p);
    if !place.inside {
        return 1.0;
    }
    // Meshes shadow themselves too. The farthest texel is a radius and a half away: surfaces that are inclined to the
    // light by up to 50 to 60 degrees differ by less than this on the way there, and those beyond have little light.
    let limit = place.depth - 1.5 * f32(1 + SHADOW_RADIUS) * place.texel;
    var lit = 0.0;
    for (var k = 0; k < SHADOW_TEXELS; k++) {
        let tap = shadow_tap(place, k);
        let first = lamp_map_depth(i, textureLoad(shadow_solid_map, tap.at, place.layer, 0));
        lit += select(0.0, tap.weight, first >= limit);
    }
    // Weights sum to 1 but for rounding.
    return min(lit, 1.0);
}

// Share of the light of lamp `i` that gets through the hair to `p`.
fn shadow_lit(i: u32, p: vec3f) -> f32 {
    let place = shadow_place(i, p);
    if !place.inside {
        return 1.0;
    }
    var lit = 0.0;
    for (var k = 0; k < SHADOW_TEXELS; k++) {
        let tap = shadow_tap(place, k);
        lit += tap.weight * shadow_passed(shadow_crossed(place, tap.at));
    }
    // 1 - strength (1 - lit), in a form that keeps the digits of little light. Weights sum to 1 but for rounding.
    return min((1.0 - lamps.strength) + lamps.strength * lit, 1.0);
}

// So many fibers of optical depth 1 let as much light of lamp `i` through to `p` as the hair does: filter, opacity of a
// fiber and strength are in it, so that light that was scattered on its way agrees with light that was not. At most 64,
// of which nothing is left.
fn shadow_fibers(i: u32, p: vec3f) -> f32 {
    // A logarithm next to 1 may come out on its wrong side.
    return max(-log(max(shadow_lit(i, p), 1e-28)), 0.0);
}
