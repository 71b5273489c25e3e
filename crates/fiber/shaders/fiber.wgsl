// What all fiber shaders share: directions, lobes and a few functions that the language lacks.
//
// Twin of `dir.rs` and of the contract in `model/mod.rs`. Conventions are those of the crate: `u = +x` is the
// tangent from root to tip, angles are radians, both directions point away from the fiber, values are
// `fcos = S cos(theta_s)`. Every file of this folder is pure functions, without bindings and entry points.

const PI: f32 = 3.14159265;
const TAU: f32 = 6.28318531;
const HALF_PI: f32 = 1.57079633;

// A unit direction in the fiber's frame.
struct Dir {
    sin_theta: f32,
    cos_theta: f32,  // never negative
    phi: f32,
}

// A value per lobe.
struct Lobes {
    r: vec3f,
    tt: vec3f,
    trt: vec3f,
    residual: vec3f,
}

fn lobes_zero() -> Lobes {
    return Lobes(vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
}

// The whole: what a renderer multiplies by.
fn lobes_sum(lobes: Lobes) -> vec3f {
    return lobes.r + lobes.tt + lobes.trt + lobes.residual;
}

fn safe_sqrt(x: f32) -> f32 {
    return sqrt(max(x, 0.0));
}

// The arcsine of the value clamped to [-1, 1].
//
// Own polynomial (fitted for these shaders, relative error below 1e-7): the standard leaves the built-in one
// thousands of units in the last place, and hardware uses them.
fn safe_asin(x: f32) -> f32 {
    let a = min(abs(x), 1.0);
    let outer = a > 0.5;
    let z = select(a * a, 0.5 - 0.5 * a, outer);
    let y = select(a, sqrt(z), outer);
    var series = 0.0424293718;
    series = series * z + 0.0239872927;
    series = series * z + 0.0455219296;
    series = series * z + 0.0749468668;
    series = series * z + 0.166667823;
    let small = y + y * z * series;
    let angle = select(small, HALF_PI - 2.0 * small, outer);
    return select(angle, -angle, x < 0.0);
}

// `x` wrapped into [-pi, pi], by whole turns.
fn wrap_angle(x: f32) -> f32 {
    return x - TAU * round(x / TAU);
}

// A direction from a unit vector whose first component lies along the tangent; along the fiber itself the
// azimuth does not exist and is taken as 0.
fn dir_from_local(local: vec3f) -> Dir {
    let across = local.y * local.y + local.z * local.z;
    var phi = 0.0;
    if across >= 1e-12 {
        phi = atan2(local.z, local.y);
    }
    return Dir(clamp(local.x, -1.0, 1.0), min(sqrt(across), 1.0), phi);
}

fn dir_to_local(d: Dir) -> vec3f {
    return vec3f(d.sin_theta, d.cos_theta * cos(d.phi), d.cos_theta * sin(d.phi));
}

// Inclination in radians, from whichever of sine and cosine has the digits.
fn dir_theta(d: Dir) -> f32 {
    if abs(d.sin_theta) < d.cos_theta {
        return safe_asin(d.sin_theta);
    }
    let theta = HALF_PI - safe_asin(d.cos_theta);
    return select(theta, -theta, d.sin_theta < 0.0);
}

// Azimuth of `s` relative to the known direction.
fn azimuth(known: Dir, s: Dir) -> f32 {
    return wrap_angle(s.phi - known.phi);
}

// `cos²((theta_s - theta_k) / 2)`, without inverse trigonometry.
fn cos2_half_difference(sin_k: f32, cos_k: f32, sin_s: f32, cos_s: f32) -> f32 {
    return clamp(0.5 * (1.0 + cos_k * cos_s + sin_k * sin_s), 0.0, 1.0);
}
