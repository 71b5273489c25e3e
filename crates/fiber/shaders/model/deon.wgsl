// d'Eon et al. 2011, near and far field. Twin of `model/deon.rs`.
//
// The far field takes a fixed rule over the cross-section (see `quadrature.wgsl`): right for `beta_n` from
// 7.5 degrees, with which TT has 3.75; narrower lobes need a table.

const DEON_KNOWN: u32 = 1u;  // `attenuation`: at the known inclination; 0 is at half the difference

struct Deon {
    sigma_a: vec3f,  // per radius
    eta: f32,
    beta_m: f32,     // rad, of lobe R; TT half, TRT and residual twice
    beta_n: f32,     // rad, likewise
    alpha: f32,      // rad
    residual: u32,   // whether higher orders are kept
    attenuation: u32,
    field: u32,      // see `field.wgsl`
}

fn deon_eval(m: Deon, known: Dir, h: f32, s: Dir) -> Lobes {
    return deon_eval_wide(m, known, h, FIELD_ANY_WIDTH, s);
}

// On a fiber that looks `width_px` pixels wide.
fn deon_eval_wide(m: Deon, known: Dir, h: f32, width_px: f32, s: Dir) -> Lobes {
    var cos2 = known.cos_theta * known.cos_theta;
    if m.attenuation != DEON_KNOWN {
        cos2 = cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta);
    }
    let optics = optics_new(cos2, m.eta);
    let near_share = field_near_share(m.field, width_px);
    var near = lobes_zero();
    if near_share > 0.0 {
        near = deon_near(m, optics, h, s.phi - known.phi);
    }
    var far = lobes_zero();
    if near_share < 1.0 {
        far = deon_far(m, optics, azimuth(known, s));
    }
    let n = field_blend(near_share, near, far);
    let l = deon_longitudinal(m, known, s);
    return Lobes(n.r * l.x, n.tt * l.y, n.trt * l.z, n.residual * l.w);
}

// Longitudinal densities of R, TT, TRT and the residual lobe.
fn deon_longitudinal(m: Deon, known: Dir, s: Dir) -> vec4f {
    let beta = max(m.beta_m * vec4f(1.0, 0.5, 2.0, 2.0), vec4f(MIN_WIDTH));
    let v = beta * beta;
    let shift = m.alpha * vec4f(2.0, -1.0, -4.0, 0.0);
    var l = vec4f(0.0);
    for (var p = 0; p < 4; p++) {
        if p < 3 || m.residual != 0u {
            let cone = cone_specular(known.sin_theta, known.cos_theta, shift[p]);
            l[p] = longitudinal_density(v[p], cone, s.sin_theta, s.cos_theta);
        }
    }
    return l;
}

fn deon_azimuthal_widths(m: Deon) -> vec3f {
    return max(m.beta_n * vec3f(1.0, 0.5, 2.0), vec3f(MIN_WIDTH));
}

// A_p D_p at one offset; `phi` is relative to the known direction.
fn deon_near(m: Deon, optics: Optics, h: f32, phi: f32) -> Lobes {
    let beta = deon_azimuthal_widths(m);
    let path = optics_path_at(optics, h);
    let a = path_attenuation(path, m.sigma_a);
    return Lobes(
        a.r * wrapped_gaussian(beta.x, wrap_angle(phi - path_exit_azimuth(path, 0.0))),
        a.tt * wrapped_gaussian(beta.y, wrap_angle(phi - path_exit_azimuth(path, 1.0))),
        a.trt * wrapped_gaussian(beta.z, wrap_angle(phi - path_exit_azimuth(path, 2.0))),
        a.residual / TAU,
    );
}

// ½ ∫ A_p D_p dh over the cross-section.
fn deon_far(m: Deon, optics: Optics, phi: f32) -> Lobes {
    let beta = deon_azimuthal_widths(m);
    var n = lobes_zero();
    for (var j = 0; j < CROSS_SECTION_NODES; j++) {
        let node = CROSS_SECTION[j];
        let gamma = HALF_PI * node.x;
        let cos_gamma = cos(gamma);
        let path = optics_path(optics, sin(gamma), gamma, cos_gamma);
        let a = path_attenuation(path, m.sigma_a);
        // Both signs of gamma at once: the attenuation is even, the exit azimuth odd about p pi.
        let c = 0.5 * node.y * HALF_PI * cos_gamma;
        n.r += a.r * (c * deon_pair(beta.x, phi, path, 0.0));
        n.tt += a.tt * (c * deon_pair(beta.y, phi, path, 1.0));
        n.trt += a.trt * (c * deon_pair(beta.z, phi, path, 2.0));
        n.residual += a.residual * (2.0 * c / TAU);
    }
    return n;
}

fn deon_pair(beta: f32, phi: f32, path: Path, p: f32) -> f32 {
    let turn = p * PI;
    let odd = path_exit_azimuth(path, p) - turn;
    return wrapped_gaussian(beta, wrap_angle(phi - turn - odd)) + wrapped_gaussian(beta, wrap_angle(phi - turn + odd));
}
