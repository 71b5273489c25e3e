// Hery & Ramamoorthi 2012, one lobe or two. Twin of `model/hery.rs`.

const HERY_FAITHFUL: u32 = 1u;            // `mode`: the value of the paper; 0 is truncated
const HERY_FAITHFUL_EXACT_PDF: u32 = 2u;  // the same, cut where the paper's sampler cannot go

struct HeryLobe {
    tint: vec3f,  // black is no lobe
    beta: f32,    // rad, standard deviation of the half angle
    alpha: f32,   // rad, shift of the half angle
}

struct Hery {
    lobes: array<HeryLobe, 2>,
    mode: u32,
    cos_theta_d: u32,  // whether (cos(theta_s) / cos(theta_d))² multiplies the value
}

fn hery_eval(m: Hery, known: Dir, h: f32, s: Dir) -> Lobes {
    let half = max(cos(0.5 * azimuth(known, s)), 0.0);
    var scale = half / (4.0 * max(s.cos_theta, 1e-4));
    if m.cos_theta_d != 0u {
        let cos2_d = cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta);
        scale *= s.cos_theta * s.cos_theta / max(cos2_d, 1e-10);
    }
    let theta_k = dir_theta(known);
    let theta = dir_theta(s);
    var lobes = lobes_zero();
    lobes.r = hery_lobe(m.lobes[0], m.mode, theta_k, theta) * scale;
    lobes.trt = hery_lobe(m.lobes[1], m.mode, theta_k, theta) * scale;
    return lobes;
}

// One lobe without the factors that both share.
fn hery_lobe(lobe: HeryLobe, mode: u32, theta_k: f32, theta_s: f32) -> vec3f {
    if all(lobe.tint == vec3f(0.0)) {
        return lobe.tint;
    }
    let beta = max(lobe.beta, 3.5e-4);
    if mode == 0u {
        return lobe.tint * truncated_density(truncated_new(2.0 * lobe.alpha - theta_k, beta), theta_s);
    }
    let x = 0.5 * (theta_s + theta_k) - lobe.alpha;
    if mode == HERY_FAITHFUL_EXACT_PDF {
        let most = HALF_PI - abs(0.5 * theta_k - lobe.alpha);
        let over = select(PI, -PI, theta_s < 0.0) - theta_s;
        let folded = 0.5 * (over + theta_k) - lobe.alpha;
        if abs(x) > most && abs(folded) > most {
            return vec3f(0.0);
        }
    }
    return lobe.tint * (0.5 * gaussian(beta, x));
}
