// Dual scattering from textures, without quadrature. Twin of `multiple/spread.rs`.
//
// A shader samples its textures (linear filter, clamped to the edge, level 0) and hands the texels over:
//
//     forward = SpreadSide of the rows 0, 1, 2 of the curves at u = spread_theta_coord(-theta of the light)
//     front = spread_uniform(n, forward)
//     around = SpreadSide of the rows 3, 4, 5 (6, 7, 8 where the light stands on the far side, cos(phi) < 0)
//         at u = spread_theta_coord((theta of the known direction - theta of the light) / 2)
//     means, variances = the rows 9 and 10 at u = spread_theta_coord(theta of the known direction)
//     at = spread_glow_coords(known, light, size)
//     radiance = spread_eval(known, light, direct, front, around, a(at), b(at), c(at), means, variances, d_f, d_b)
//
// The coordinate of row r of the curves is v = (r + 1/2) / 12.

// Light that was scattered brings this much less through a surface: the mean of the cosine over its half circle.
const SPREAD_FLUX: f32 = 0.785398163;

// What happens to light on its way to a fiber.
struct Front {
    direct: f32,          // share that arrives without having met a fiber
    transmittance: vec3f, // share that arrives scattered; without meaning while `direct` is 1
    shift: vec3f,         // sum of the shifts of the fibers crossed, radians
    variance: vec3f,      // sum of their variances, rad²
}

// One entry of a table: how much light goes one way, and along which inclinations.
struct SpreadSide {
    attenuation: vec3f,
    shift: vec3f,    // mean of theta_s + theta_k, radians
    variance: vec3f, // variance of theta_s + theta_k, rad²
}

// Nothing crossed yet.
fn spread_open() -> Front {
    return Front(1.0, vec3f(1.0), vec3f(0.0), vec3f(0.0));
}

// `n` fibers that all lie like this one; between 0 and 1 a share of `n` meets one fiber.
fn spread_uniform(n: f32, forward: SpreadSide) -> Front {
    let met = clamp(n, 0.0, 1.0);
    if met <= 0.0 {
        return spread_open();
    }
    let crossed = max(n, 1.0);
    let attenuation = max(forward.attenuation, vec3f(0.0));
    let through = met * pow(attenuation, vec3f(crossed));
    return Front(1.0 - met, through, forward.shift * crossed, forward.variance * crossed);
}

// Coordinate of an inclination, in the curves and down the glow: entries are at theta = ((i + 1/2) / n - 1/2) pi.
fn spread_theta_coord(theta: f32) -> f32 {
    return 0.5 + theta / PI;
}

// In the three textures of the glow; `size` is their columns and rows.
fn spread_glow_coords(known: Dir, light: Dir, size: vec2f) -> vec2f {
    let x = abs(azimuth(known, light)) / PI;
    return vec2f((0.5 + x * (size.x - 1.0)) / size.x, spread_theta_coord(dir_theta(known)));
}

// Longitudinal densities of three channels at `light`: cones about the known direction, shifted each by its own.
fn spread_returned(known: Dir, light: Dir, shift: vec3f, variance: vec3f) -> vec3f {
    let v = max(variance, vec3f(MIN_VARIANCE));
    let r = cone_specular(known.sin_theta, known.cos_theta, shift.x);
    let g = cone_specular(known.sin_theta, known.cos_theta, shift.y);
    let b = cone_specular(known.sin_theta, known.cos_theta, shift.z);
    return vec3f(
        longitudinal_density(v.x, r, light.sin_theta, light.cos_theta),
        longitudinal_density(v.y, g, light.sin_theta, light.cos_theta),
        longitudinal_density(v.z, b, light.sin_theta, light.cos_theta),
    );
}

// Longitudinal densities of one lobe, for light that comes from `r`, `g` and `b`.
fn spread_lobe(known: Dir, mean: f32, variance: vec3f, r: Cone, g: Cone, b: Cone) -> vec3f {
    let cone = cone_specular(known.sin_theta, known.cos_theta, mean);
    let v = max(variance, vec3f(MIN_VARIANCE));
    return vec3f(
        longitudinal_density(v.x, cone, r.sin, r.cos),
        longitudinal_density(v.y, cone, g.sin, g.cos),
        longitudinal_density(v.z, cone, b.sin, b.cos),
    );
}

// The fiber in light that was scattered on its way: the mean of fcos over where it arrives from.
fn spread_glow(
    known: Dir, light: Dir, front: Front, glow_a: vec4f, glow_b: vec4f, glow_c: vec4f, means: vec4f, variances: vec4f,
) -> vec3f {
    // Light is seen from where it was last scattered, in every channel.
    let r = cone_specular(-light.sin_theta, light.cos_theta, -front.shift.x);
    let g = cone_specular(-light.sin_theta, light.cos_theta, -front.shift.y);
    let b = cone_specular(-light.sin_theta, light.cos_theta, -front.shift.z);
    let first = vec3f(glow_a.x, glow_b.x, glow_c.x);
    return first * spread_lobe(known, means.x, variances.x + front.variance, r, g, b)
        + glow_a.yzw * spread_lobe(known, means.y, variances.y + front.variance, r, g, b)
        + glow_b.yzw * spread_lobe(known, means.z, variances.z + front.variance, r, g, b)
        + glow_c.yzw * spread_lobe(known, means.w, variances.w + front.variance, r, g, b);
}

// fcos of the fiber and its surroundings: outgoing radiance per irradiance of a light from `light`.
//
// `direct` is fcos of the fiber alone; `around` the side for what the fibers behind return; the rest are texels.
fn spread_eval(
    known: Dir, light: Dir, direct: Lobes, front: Front, around: SpreadSide,
    glow_a: vec4f, glow_b: vec4f, glow_c: vec4f, means: vec4f, variances: vec4f,
    density_forward: f32, density_backward: f32,
) -> vec3f {
    let even = 0.5 * density_backward * around.attenuation;
    let back = even * spread_returned(known, light, around.shift, around.variance);
    let sum = (lobes_sum(direct) + back) * front.direct;
    if front.direct >= 1.0 {
        return sum;
    }
    let shift = around.shift + front.shift;
    let variance = around.variance + front.variance;
    let scattered = SPREAD_FLUX * even * spread_returned(known, light, shift, variance);
    let glow = spread_glow(known, light, front, glow_a, glow_b, glow_c, means, variances);
    return sum + (glow + scattered) * front.transmittance * density_forward;
}
