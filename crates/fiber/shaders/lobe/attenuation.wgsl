// What a smooth dielectric cylinder does to a ray. Twin of `lobe/attenuation.rs`.

// Power reflectance for unpolarised light that arrives at `cos_i` from outside; `eta` is relative.
fn fresnel(cos_i: f32, eta: f32) -> f32 {
    let c = clamp(cos_i, 0.0, 1.0);
    let sin2_t = (1.0 - c * c) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = sqrt(1.0 - sin2_t);
    let s = (c - eta * cos_t) / (c + eta * cos_t);
    let p = (eta * c - cos_t) / (eta * c + cos_t);
    return 0.5 * (s * s + p * p);
}

// The optics of a fiber for one inclination.
struct Optics {
    eta: f32,
    cos_theta: f32,
    inv_bravais: f32,  // 1 / eta'; 0 along the fiber
    length: f32,       // 2 / cos(theta_t), radii per unit of cos(gamma_t)
}

// Which way a ray takes at one offset.
struct Path {
    gamma_i: f32,
    gamma_t: f32,
    fresnel: f32,
    length: f32,  // of one crossing, in radii
}

fn optics_new(cos2: f32, eta: f32) -> Optics {
    let cos_theta = safe_sqrt(cos2);
    let root = sqrt(max(eta * eta - (1.0 - cos2), 1e-12));
    return Optics(eta, cos_theta, cos_theta / root, 2.0 * eta / root);
}

fn optics_path(optics: Optics, h: f32, gamma_i: f32, cos_gamma_i: f32) -> Path {
    let sin_t = clamp(h * optics.inv_bravais, -1.0, 1.0);
    let cos_t = safe_sqrt(1.0 - sin_t * sin_t);
    let f = fresnel(optics.cos_theta * cos_gamma_i, optics.eta);
    return Path(gamma_i, safe_asin(sin_t), f, optics.length * cos_t);
}

fn optics_path_at(optics: Optics, h: f32) -> Path {
    return optics_path(optics, h, safe_asin(h), safe_sqrt(1.0 - h * h));
}

// Exit azimuth of lobe `p` relative to the known direction, not wrapped.
fn path_exit_azimuth(path: Path, p: f32) -> f32 {
    return 2.0 * (p * path.gamma_t - path.gamma_i) + p * PI;
}

// The share of the light that leaves by each lobe at this offset; all shares add up to 1 without absorption.
fn path_attenuation(path: Path, sigma_a: vec3f) -> Lobes {
    let f = path.fresnel;
    let t = exp(-sigma_a * path.length);
    let tt = t * ((1.0 - f) * (1.0 - f));
    let trt = tt * t * f;
    let rest = 1.0 - f * t;
    // At the rim f is 1: nothing enters, and 0 / 0 must not be asked.
    let residual = select(vec3f(0.0), trt * t * f / max(rest, vec3f(1e-30)), rest > vec3f(0.0));
    return Lobes(vec3f(f), tt, trt, residual);
}
