// Lamps: what arrives from each, and how its shadow map sees the scene. Stands behind `harmonics.wgsl`; twin of
// `shadow/table.rs`.

const LAMP_DIRECTIONAL: u32 = 0u;
const LAMP_SPOT: u32 = 2u;

const LAMP_COSINE: u32 = 1u;
const LAMP_TWO_SIDED: u32 = 2u;

// A light without extent, and the view of its shadow map.
struct Lamp {
    map_from_world: mat4x4f,  // clip coordinates of the map
    position: vec3f,          // scene units
    kind: u32,                // 1: a point
    direction: vec3f,         // unit, in which light travels
    emission: u32,            // LAMP_COSINE, with LAMP_TWO_SIDED
    color: vec3f,             // irradiance of what faces a directional one; else intensity on the axis
    layer: u32,               // of the maps; all ones: it has none
    eye: vec3f,               // of the map: depth is measured from here, along `forward`
    near: f32,                // depths of the map's clipping planes
    forward: vec3f,           // unit
    far: f32,
    cone: vec2f,              // of a spot: cosines where it begins to fall, and where it ends
    hair: vec2f,              // least and greatest depth of the hair's box
    texel: f32,               // size of a texel: at depth 1, or anywhere in a parallel map
    perspective: u32,         // 1; 0: parallel
}

struct LampTable {
    count: u32,
    side: u32,                  // texels a side of each map
    strength: f32,              // of shadows of hair, [0, 1]
    optical: f32,               // optical depth of one fiber
    ends: vec4f,                // where opacity layers end, shares of the hair's depth
    spacing: f32,               // distance between fibers along a ray, scene units
    width: f32,                 // of the widest fiber, scene units
    ambient: array<vec4f, 9>,   // spherical harmonics of light that nothing shadows
    list: array<Lamp, 32>,
}

@group(2) @binding(12) var<uniform> lamps: LampTable;

// What arrives at a place, shadows apart.
struct LampLight {
    direction: vec3f,   // unit, towards the lamp
    irradiance: vec3f,  // of a surface that faces it
}

fn lamp_count() -> u32 {
    return lamps.count;
}

fn lamp_arriving(i: u32, p: vec3f) -> LampLight {
    let axis = lamps.list[i].direction;
    let color = lamps.list[i].color;
    if lamps.list[i].kind == LAMP_DIRECTIONAL {
        return LampLight(-axis, color);
    }
    let away = p - lamps.list[i].position;
    let distance2 = dot(away, away);
    // At the place of the lamp itself there is no direction to it.
    if !(distance2 > 0.0) {
        return LampLight(-axis, vec3f(0.0));
    }
    let travels = away * inverseSqrt(distance2);
    let along = dot(travels, axis);
    var share = 1.0 / distance2;
    let emission = lamps.list[i].emission;
    if (emission & LAMP_COSINE) != 0u {
        share *= select(max(along, 0.0), abs(along), (emission & LAMP_TWO_SIDED) != 0u);
    }
    if lamps.list[i].kind == LAMP_SPOT {
        let cone = lamps.list[i].cone;
        share *= smoothstep(cone.y, cone.x, along);
    }
    return LampLight(-travels, color * share);
}

// Mean radiance that a fiber seen from direction `d` has around it: weighted with the cosine to `d`.
fn lamp_ambient(d: vec3f) -> vec3f {
    return lamp_ambient_irradiance(d) / HARMONICS_COSINE0;
}

// Ambient irradiance of a surface with normal `n`, W/m².
fn lamp_ambient_irradiance(n: vec3f) -> vec3f {
    return harmonics_irradiance(lamps.ambient, n);
}

// Depth along the view of lamp `i`'s map, of a value (0 near, 1 far) found there.
fn lamp_map_depth(i: u32, value: f32) -> f32 {
    let near = lamps.list[i].near;
    let far = lamps.list[i].far;
    if lamps.list[i].perspective == 1u {
        return near * far / (far - value * (far - near));
    }
    return near + value * (far - near);
}
