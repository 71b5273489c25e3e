// Marschner et al. 2003. Twin of `model/marschner.rs`.

const MARSCHNER_AS_PRINTED: u32 = 1u;  // `norm`: twice the light; else normalised

struct Marschner {
    sigma_a: vec3f,     // per radius
    eta: f32,
    diffuse: vec3f,     // Lambertian fill, in the residual lobe
    beta_m: f32,        // rad, of lobe R in the half angle; TT half, TRT double
    alpha: f32,         // rad, of lobe R; TT -1/2, TRT -3/2
    eccentricity: f32,  // minor over major axis; the major axis is at the azimuth 0
    roots: u32,         // see `roots.wgsl`
    norm: u32,
    caustic: Caustic,
    has_caustic: u32,   // whether it is smoothed
}

const MARSCHNER_MIN_WIDTH: f32 = 3.5e-4;

fn marschner_eval(m: Marschner, known: Dir, h: f32, s: Dir) -> Lobes {
    let cos2_d = cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta);
    let theta_h = 0.5 * (dir_theta(known) + dir_theta(s));
    var scale = 0.5 * s.cos_theta / max(cos2_d, 1e-5);
    if m.norm == MARSCHNER_AS_PRINTED {
        scale = 2.0 * scale;
    }
    let widths = max(m.beta_m * vec3f(1.0, 0.5, 2.0), vec3f(MARSCHNER_MIN_WIDTH));
    let n = marschner_azimuthal(m, cos2_d, azimuth(known, s), 0.5 * (known.phi + s.phi));
    return Lobes(
        n.r * (scale * gaussian(widths.x, theta_h - m.alpha)),
        n.tt * (scale * gaussian(widths.y, theta_h + 0.5 * m.alpha)),
        n.trt * (scale * gaussian(widths.z, theta_h + 1.5 * m.alpha)),
        m.diffuse * lambertian_density(known, s),
    );
}

// N_p of R, TT and TRT for the azimuth `phi` relative to the known direction; `phi_h` is the mean azimuth.
fn marschner_azimuthal(m: Marschner, cos2_theta_d: f32, phi: f32, phi_h: f32) -> Lobes {
    // Without a step in the index there is no refraction to solve for.
    let eta = max(m.eta, 1.001);
    let optics = optics_new(cos2_theta_d, eta);
    var n = lobes_zero();
    n.r = marschner_roots(m, optics, 0u, phi);
    n.tt = marschner_roots(m, optics, 1u, phi);
    var elliptic = optics;
    if m.eccentricity != 1.0 {
        elliptic = optics_new(cos2_theta_d, marschner_elliptic_index(eta, m.eccentricity, phi_h));
    }
    n.trt = marschner_roots(m, elliptic, 2u, phi);
    if m.has_caustic != 0u {
        let place = caustic_place(m.caustic, m.roots, elliptic.inv_bravais);
        let a = path_attenuation(optics_path_at(elliptic, place.h), m.sigma_a);
        n.trt = caustic_smooth(m.caustic, place, n.trt, a.trt, phi);
    }
    return n;
}

// Σ A_p / (2 |dΦ/dh|) over the roots.
fn marschner_roots(m: Marschner, optics: Optics, p: u32, phi: f32) -> vec3f {
    let found = roots_solve(m.roots, f32(p), optics.inv_bravais, phi);
    var sum = vec3f(0.0);
    for (var i = 0u; i < found.count; i++) {
        let slope = abs(found.slope[i]);
        // On the caustic itself the sum diverges.
        if slope < 1e-7 {
            continue;
        }
        let gamma = found.gamma[i];
        let cos_gamma = max(cos(gamma), 0.0);
        let a = path_attenuation(optics_path(optics, sin(gamma), gamma, cos_gamma), m.sigma_a);
        var of_lobe = a.r;
        if p == 1u {
            of_lobe = a.tt;
        } else if p == 2u {
            of_lobe = a.trt;
        }
        sum += of_lobe * (0.5 * cos_gamma / slope);
    }
    return sum;
}

// The index that makes a circle of the ellipse, for light that turns about `phi_h`.
fn marschner_elliptic_index(eta: f32, eccentricity: f32, phi_h: f32) -> f32 {
    let a = max(eccentricity, 0.1);
    let a2 = a * a;
    let along = 2.0 * (eta - 1.0) / a2 - eta + 2.0;
    let across = 2.0 * (eta - 1.0) * a2 - eta + 2.0;
    return max(0.5 * (along + across + cos(2.0 * phi_h) * (along - across)), 1.05);
}
