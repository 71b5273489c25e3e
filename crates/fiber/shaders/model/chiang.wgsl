// Chiang et al. 2016, near and far field. Twin of `model/chiang.rs`.
//
// The far field takes a fixed rule over the cross-section (see `quadrature.wgsl`): right for `beta_n` from 0.2.

struct Chiang {
    sigma_a: vec3f,  // per radius
    eta: f32,
    beta_m: f32,     // in (0, 1]
    beta_n: f32,     // in (0, 1]
    alpha: f32,      // rad
    field: u32,      // see `field.wgsl`
}

fn chiang_eval(m: Chiang, known: Dir, h: f32, s: Dir) -> Lobes {
    return chiang_eval_wide(m, known, h, FIELD_ANY_WIDTH, s);
}

// On a fiber that looks `width_px` pixels wide.
fn chiang_eval_wide(m: Chiang, known: Dir, h: f32, width_px: f32, s: Dir) -> Lobes {
    let optics = optics_new(known.cos_theta * known.cos_theta, m.eta);
    let scale = chiang_azimuthal_scale(m.beta_n);
    let phi = azimuth(known, s);
    let near_share = field_near_share(m.field, width_px);
    var near = lobes_zero();
    if near_share > 0.0 {
        near = chiang_add(near, m.sigma_a, scale, optics_path_at(optics, h), phi, 1.0);
    }
    var far = lobes_zero();
    if near_share < 1.0 {
        far = chiang_far(m.sigma_a, scale, optics, phi);
    }
    let n = field_blend(near_share, near, far);

    let v = chiang_variances(m.beta_m);
    let shift = m.alpha * vec4f(2.0, -1.0, -4.0, 0.0);
    var l = vec4f(0.0);
    for (var p = 0; p < 4; p++) {
        let cone = cone_specular(known.sin_theta, known.cos_theta, shift[p]);
        l[p] = longitudinal_density(v[p], cone, s.sin_theta, s.cos_theta);
    }
    return Lobes(n.r * l.x, n.tt * l.y, n.trt * l.z, n.residual * l.w);
}

// ½ ∫ A_p N_p dh over the cross-section.
fn chiang_far(sigma_a: vec3f, scale: f32, optics: Optics, phi: f32) -> Lobes {
    var n = lobes_zero();
    for (var j = 0; j < CROSS_SECTION_NODES; j++) {
        let node = CROSS_SECTION[j];
        let gamma = HALF_PI * node.x;
        let cos_gamma = cos(gamma);
        let path = optics_path(optics, sin(gamma), gamma, cos_gamma);
        let mirrored = Path(-gamma, -path.gamma_t, path.fresnel, path.length);
        let c = 0.5 * node.y * HALF_PI * cos_gamma;
        n = chiang_add(n, sigma_a, scale, path, phi, c);
        n = chiang_add(n, sigma_a, scale, mirrored, phi, c);
    }
    return n;
}

// Longitudinal variances of R, TT, TRT and the residual lobe, rad².
fn chiang_variances(beta_m: f32) -> vec4f {
    let b2 = beta_m * beta_m;
    let b4 = b2 * b2;
    let b16 = b4 * b4 * b4 * b4;
    let w = 0.726 * beta_m + 0.812 * b2 + 3.7 * (b16 * b4);
    let v = max(w * w, MIN_VARIANCE);
    return vec4f(v, max(0.25 * v, MIN_VARIANCE), 4.0 * v, 4.0 * v);
}

// Scale of the azimuthal logistic, rad.
fn chiang_azimuthal_scale(beta_n: f32) -> f32 {
    let b2 = beta_n * beta_n;
    let b4 = b2 * b2;
    let b16 = b4 * b4 * b4 * b4;
    return max(0.626657069 * (0.265 * beta_n + 1.194 * b2 + 5.372 * (b16 * b4 * b2)), 1e-4);
}

// `n` plus `weight` times A_p N_p of one path.
fn chiang_add(n: Lobes, sigma_a: vec3f, scale: f32, path: Path, phi: f32, weight: f32) -> Lobes {
    let a = path_attenuation(path, sigma_a);
    return Lobes(
        n.r + a.r * (weight * trimmed_logistic(scale, wrap_angle(phi - path_exit_azimuth(path, 0.0)))),
        n.tt + a.tt * (weight * trimmed_logistic(scale, wrap_angle(phi - path_exit_azimuth(path, 1.0)))),
        n.trt + a.trt * (weight * trimmed_logistic(scale, wrap_angle(phi - path_exit_azimuth(path, 2.0)))),
        n.residual + a.residual * (weight / TAU),
    );
}
