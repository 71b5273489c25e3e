// From a fragment to radiance: every lamp, its shadow, the fiber, and light that other fibers scattered.
//
// What stands in front of this text was put together for the scene: the fiber models in use, `shade_fiber` (their
// values by entry of the palette), the lamps, one shadow technique, and the constants
// `SHADE_DEFERRED`, `SHADE_MULTIPLE`, `SHADE_HARMONICS` (bool), `SHADE_DENSITY_FORWARD`, `SHADE_DENSITY_BACKWARD`
// (f32).

// Rows of the curves; see `multiple/spread.rs` of the fiber library.
const SHADE_ROWS: f32 = 12.0;

// Directions that the longer diameters of elliptical fibers have: 5 bits, which is what a payload has room for.
const SHADE_LOTS: u32 = 32u;
const SHADE_GOLDEN_ANGLE: f32 = 2.39996323;

// Which of them a strand has.
fn shade_lot(strand: u32) -> u32 {
    // A permuted congruential generator; its upper five bits.
    var x = strand * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
    return ((x >> 22u) ^ x) >> 27u;
}

// The axes of a fiber: the first one along the tangent, the second one along the longer diameter of an elliptical
// fiber. That keeps its direction along a strand, and is another one on other strands.
//
// The directions are a Fibonacci lattice on half a sphere; on the other half the ellipses would be the same. So they
// lie evenly about every tangent, as the random ones of the path tracer do on average: many strands look alike in both,
// but no strand has the very axis that it has there.
fn shade_frame(tangent: vec3f, lot: u32) -> mat3x3f {
    let z = (f32(lot) + 0.5) / f32(SHADE_LOTS);
    let turn = f32(lot) * SHADE_GOLDEN_ANGLE;
    let axis = vec3f(sqrt(max(1.0 - z * z, 0.0)) * vec2f(cos(turn), sin(turn)), z);
    var v = axis - tangent * dot(axis, tangent);
    if dot(v, v) < 1e-8 {
        v = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(tangent.x) > 0.5);
        v -= tangent * dot(v, tangent);
    }
    v = normalize(v);
    return mat3x3f(tangent, v, cross(tangent, v));
}

fn shade_dir(frame: mat3x3f, world: vec3f) -> Dir {
    return dir_from_local(world * frame);
}

fn shade_curve(row: f32, theta: f32, layer: u32) -> vec4f {
    let at = vec2f(spread_theta_coord(theta), (row + 0.5) / SHADE_ROWS);
    return textureSampleLevel(shade_curves, shade_sampler, at, layer, 0.0);
}

fn shade_side(row: f32, theta: f32, layer: u32) -> SpreadSide {
    return SpreadSide(
        shade_curve(row, theta, layer).xyz,
        shade_curve(row + 1.0, theta, layer).xyz,
        shade_curve(row + 2.0, theta, layer).xyz,
    );
}

// What reaches a place behind `n` fibers on average, if they lie at random (Poisson) and all like this one.
fn shade_front(n: f32, side: SpreadSide) -> Front {
    let open = exp(-n);
    // Sum over k >= 1 of e^-n n^k / k! a^k.
    let scattered = max(exp(-n * (1.0 - side.attenuation)) - open, vec3f(0.0));
    // Fibers crossed by light that crosses any.
    let crossed = select(n / (1.0 - open), 1.0 + 0.5 * n, n < 1e-3);
    return Front(open, scattered, side.shift * crossed, side.variance * crossed);
}

// Radiance towards the viewer, of a fragment whose strand has this lot; `f.strand` is not looked at.
fn shade_as(f: Fragment, lot: u32) -> vec3f {
    let entry = shade_entries[f.entry];
    let frame = shade_frame(f.tangent, lot);
    let known = shade_dir(frame, view_to_eye(f.position));
    var sum = vec3f(0.0);
    // Lamps that shine here, and how much of them gets through the hair.
    var shining = 0.0;
    var open = 0.0;
    let count = lamp_count();
    for (var i = 0u; i < count; i++) {
        let light = lamp_arriving(i, f.position);
        if all(light.irradiance <= vec3f(0.0)) {
            continue;
        }
        let solid = shadow_solid(i, f.position);
        if solid <= 0.0 && !SHADE_HARMONICS {
            continue;
        }
        let s = shade_dir(frame, light.direction);
        var front = spread_open();
        if SHADE_MULTIPLE {
            front = shade_front(shadow_fibers(i, f.position), shade_side(0.0, -dir_theta(s), entry.layer));
        } else {
            front.direct = shadow_lit(i, f.position);
        }
        shining += 1.0;
        open += front.direct;
        if solid <= 0.0 {
            continue;
        }
        let direct = shade_fiber(entry, known, f.h, f.width_px, s);
        var value = vec3f(0.0);
        if SHADE_MULTIPLE {
            let theta_d = 0.5 * (dir_theta(known) - dir_theta(s));
            let same = cos(s.phi - known.phi) >= 0.0;
            let around = shade_side(select(6.0, 3.0, same), theta_d, entry.layer);
            let at = spread_glow_coords(known, s, vec2f(textureDimensions(shade_glow_a)));
            let theta_k = dir_theta(known);
            value = spread_eval(
                known,
                s,
                direct,
                front,
                around,
                textureSampleLevel(shade_glow_a, shade_sampler, at, entry.layer, 0.0),
                textureSampleLevel(shade_glow_b, shade_sampler, at, entry.layer, 0.0),
                textureSampleLevel(shade_glow_c, shade_sampler, at, entry.layer, 0.0),
                shade_curve(9.0, theta_k, entry.layer),
                shade_curve(10.0, theta_k, entry.layer),
                SHADE_DENSITY_FORWARD,
                SHADE_DENSITY_BACKWARD,
            );
        } else {
            value = lobes_sum(direct) * front.direct;
        }
        sum += light.irradiance * (solid * value);
    }
    if SHADE_HARMONICS {
        // The smooth part of the surroundings has no shadow map: as much of it gets through the hair as of the lamps on
        // average. Lamps that do not shine here say nothing about the hair; behind a mesh they still do.
        let share = select(open / max(shining, 1.0), 1.0, shining == 0.0);
        let albedo = shade_curve(11.0, dir_theta(known), entry.layer).xyz;
        sum += albedo * share * lamp_ambient(view_to_eye(f.position));
    }
    return sum;
}

// Radiance towards the viewer.
fn shade(f: Fragment) -> vec3f {
    return shade_as(f, shade_lot(f.strand));
}

// --- What is kept of a fragment until the picture is put together: eight bytes.

fn payload_octahedral(d: vec3f) -> vec2f {
    let flat = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    if d.z >= 0.0 {
        return flat;
    }
    return (1.0 - abs(flat.yx)) * select(vec2f(-1.0), vec2f(1.0), flat >= vec2f(0.0));
}

fn payload_direction(p: vec2f) -> vec3f {
    var d = vec3f(p, 1.0 - abs(p.x) - abs(p.y));
    if d.z < 0.0 {
        d = vec3f((1.0 - abs(d.yx)) * select(vec2f(-1.0), vec2f(1.0), d.xy >= vec2f(0.0)), d.z);
    }
    return normalize(d);
}

// Shaded forward, radiance and alpha as halves. Deferred, from the lowest bit of the first word on:
//
//     28 bits  tangent, two numbers: 1e-4 rad
//     4 bits   h, the lower ones
//     8 bits   entry of the palette
//     11 bits  square root of alpha: steps shrink with it, and 1e-7 is not nothing yet
//     7 bits   h, the upper ones. In all it is the middle of one of 2048 steps: in the near field it is an azimuth next to
//              narrow lobes, and at its very ends Fresnel reflection is 1
//     1 bit    the fiber is wide enough to be seen from near
//     5 bits   the strand's lot
const PAYLOAD_TANGENT: f32 = 8191.0;
const PAYLOAD_ALPHA: f32 = 2047.0;
const PAYLOAD_H: f32 = 1024.0;
const PAYLOAD_WIDE: u32 = 0x4000000u;
// Where as much of the near field counts as of the far one, pixels; and a width with nothing but the near one.
const PAYLOAD_WIDE_PX: f32 = 1.125;
const PAYLOAD_NEAR_PX: f32 = 2.0;

fn fragment_payload(f: Fragment) -> vec2u {
    if SHADE_DEFERRED {
        let alpha = u32(round(sqrt(clamp(f.alpha, 0.0, 1.0)) * PAYLOAD_ALPHA));
        let h = u32(clamp((1.0 + f.h) * PAYLOAD_H, 0.0, 2.0 * PAYLOAD_H - 1.0));
        let tangent = vec2u(round((1.0 + payload_octahedral(f.tangent)) * PAYLOAD_TANGENT));
        let wide = select(0u, PAYLOAD_WIDE, f.width_px >= PAYLOAD_WIDE_PX);
        return vec2u(
            tangent.x | (tangent.y << 14u) | ((h & 15u) << 28u),
            f.entry | (alpha << 8u) | ((h >> 4u) << 19u) | wide | (shade_lot(f.strand) << 27u),
        );
    }
    let color = clamp(shade(f), vec3f(0.0), vec3f(60000.0));
    return vec2u(pack2x16float(color.xy), pack2x16float(vec2f(color.z, f.alpha)));
}

fn payload_alpha(payload: vec2u) -> f32 {
    if SHADE_DEFERRED {
        let root = f32((payload.y >> 8u) & 2047u) / PAYLOAD_ALPHA;
        return root * root;
    }
    return unpack2x16float(payload.y).y;
}

fn payload_color(payload: vec2u, pixel: vec2f, depth: f32) -> vec4f {
    if SHADE_DEFERRED {
        var f: Fragment;
        f.position = view_position(pixel, depth);
        f.depth = depth;
        let tangent = vec2f(vec2u(payload.x, payload.x >> 14u) & vec2u(16383u));
        f.tangent = payload_direction(tangent / PAYLOAD_TANGENT - 1.0);
        f.alpha = payload_alpha(payload);
        let h = (((payload.y >> 19u) & 127u) << 4u) | (payload.x >> 28u);
        f.h = (f32(h) + 0.5) / PAYLOAD_H - 1.0;
        // The alpha of narrower fibers is their width, as long as hair is opaque.
        f.width_px = select(f.alpha, PAYLOAD_NEAR_PX, (payload.y & PAYLOAD_WIDE) != 0u);
        f.entry = payload.y & 255u;
        return vec4f(shade_as(f, payload.y >> 27u), f.alpha);
    }
    let last = unpack2x16float(payload.y);
    return vec4f(unpack2x16float(payload.x), last.x, last.y);
}
