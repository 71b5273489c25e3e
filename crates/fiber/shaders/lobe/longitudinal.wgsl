// Densities over the inclination of the scattered direction. Twin of `lobe/longitudinal.rs`.

const MIN_VARIANCE: f32 = 1e-7;
const MIN_WIDTH: f32 = 3.16227766e-4;  // its square root

// Where a lobe is centred.
struct Cone {
    sin: f32,
    cos: f32,  // folded to be non-negative
}

// The specular cone of the known inclination, shifted by `shift` radians: -theta_k + shift.
fn cone_specular(sin_k: f32, cos_k: f32, shift: f32) -> Cone {
    let s = sin(shift);
    let c = cos(shift);
    return Cone(cos_k * s - sin_k * c, abs(cos_k * c + sin_k * s));
}

// L(v, theta_cone, theta_s), per unit of cos(theta_s) dtheta_s; no factor overflows for any variance.
fn longitudinal_density(v: f32, cone: Cone, sin_s: f32, cos_s: f32) -> f32 {
    let a = cone.cos - cos_s;
    let b = cone.sin - sin_s;
    let q = 0.5 * (a * a + b * b);
    return bessel_i0e(cone.cos * cos_s / v) * exp(-q / v) / (v * (1.0 - exp(-2.0 / v)));
}

// Unit-area Gaussian of standard deviation `sigma`.
fn gaussian(sigma: f32, x: f32) -> f32 {
    let y = x / sigma;
    return 0.39894228 / sigma * exp(-0.5 * y * y);
}

// Share of a standard normal below `x`; absolute error 1e-7 (polynomial 7.1.26 of Abramowitz & Stegun).
fn normal_cdf(x: f32) -> f32 {
    let y = 0.70710678 * abs(x);
    let t = 1.0 / (1.0 + 0.3275911 * y);
    var p = 1.061405429;
    p = p * t - 1.453152027;
    p = p * t + 1.421413741;
    p = p * t - 0.284496736;
    p = p * t + 0.254829592;
    let tail = 0.5 * p * t * exp(-y * y);
    return select(tail, 1.0 - tail, x > 0.0);
}

// A Gaussian in the half angle, truncated so that theta_s stays within a right angle.
struct Truncated {
    mu: f32,
    beta: f32,
    kept: f32,
}

fn truncated_new(mu: f32, beta: f32) -> Truncated {
    let m = clamp(mu, -HALF_PI, HALF_PI);
    let width = 2.0 * beta;
    return Truncated(m, beta, normal_cdf((HALF_PI - m) / width) - normal_cdf((-HALF_PI - m) / width));
}

// Density in theta_s, per radian.
fn truncated_density(truncated: Truncated, theta_s: f32) -> f32 {
    return gaussian(2.0 * truncated.beta, theta_s - truncated.mu) / truncated.kept;
}
