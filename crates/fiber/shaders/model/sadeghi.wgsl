// Sadeghi et al. 2010: the artist-friendly model. Twin of `model/sadeghi.rs`.
//
// When normalised, the energy of every lobe is integrated anew for every value (32 exponentials per lobe): it
// depends on the known inclination and the lobe alone, so a renderer with many lights bakes it.

const SADEGHI_LEGACY: u32 = 1u;  // `mode`: as published; else every lobe returns `color * intensity`

struct ArtistLobe {
    color: vec3f,
    intensity: f32,
    shift: f32,  // rad, of the half angle
    width: f32,  // rad, standard deviation of the half angle
}

struct Glint {
    intensity: f32,
    width: f32,  // rad, standard deviation
    angle: f32,  // rad, to either side
}

struct Sadeghi {
    lobes: array<ArtistLobe, 3>,
    tt_azimuthal_width: f32,  // rad, standard deviation
    glint: Glint,
    mode: u32,
}

const SADEGHI_MIN_WIDTH: f32 = 3.5e-4;

fn sadeghi_eval(m: Sadeghi, known: Dir, h: f32, s: Dir) -> Lobes {
    let theta_k = dir_theta(known);
    let theta = dir_theta(s);
    let cosines = s.cos_theta / sadeghi_cos2_d(theta_k, theta);

    // The azimuth enters by its magnitude alone.
    let phi = abs(azimuth(known, s));
    let base = max(cos(0.5 * phi), 0.0);
    let tt = max(m.tt_azimuthal_width, SADEGHI_MIN_WIDTH);
    let glint = max(m.glint.width, SADEGHI_MIN_WIDTH);
    let angle = clamp(m.glint.angle, 0.0, PI);
    let glint_height = max(m.glint.intensity, 0.0);
    let around = vec3f(
        base,
        sadeghi_bell((PI - phi) / tt),
        base + glint_height * sadeghi_bell((phi - angle) / glint),
    );
    // Their integrals over a turn.
    let kept = normal_cdf((PI - angle) / glint) - normal_cdf(-angle / glint);
    let root = 2.50662827;
    let turn = vec3f(
        4.0,
        tt * root * (1.0 - 2.0 * normal_cdf(-PI / tt)),
        4.0 + 2.0 * glint_height * glint * root * kept,
    );
    return Lobes(
        sadeghi_lobe(m.lobes[0], m.mode, theta_k, theta, around.x * cosines, turn.x),
        sadeghi_lobe(m.lobes[1], m.mode, theta_k, theta, around.y * cosines, turn.y),
        sadeghi_lobe(m.lobes[2], m.mode, theta_k, theta, around.z * cosines, turn.z),
        vec3f(0.0),
    );
}

// One lobe; `around` is everything that does not depend on it but its azimuthal factor, `turn` that factor's
// integral.
fn sadeghi_lobe(lobe: ArtistLobe, mode: u32, theta_k: f32, theta_s: f32, around: f32, turn: f32) -> vec3f {
    let width = 2.0 * max(lobe.width, SADEGHI_MIN_WIDTH);
    var centre = 2.0 * clamp(lobe.shift, -0.5 * HALF_PI, 0.5 * HALF_PI) - theta_k;
    var gain = lobe.color * lobe.intensity;
    if all(gain == vec3f(0.0)) {
        return gain;
    }
    if mode != SADEGHI_LEGACY {
        // A lobe whose cone lies far beyond a pole stays three widths away.
        let most = HALF_PI + 3.0 * width;
        centre = clamp(centre, -most, most);
        let energy = turn * sadeghi_longitudinal_energy(width, centre, theta_k);
        if energy <= 0.0 {
            return vec3f(0.0);
        }
        gain = gain / energy;
    }
    return gain * (sadeghi_bell((theta_s - centre) / width) * around);
}

// ∫ M' cos²(theta_s) / cos²(theta_d) dtheta_s, restricted to where the Gaussian is.
fn sadeghi_longitudinal_energy(width: f32, centre: f32, theta_k: f32) -> f32 {
    let beyond = max(abs(centre) - HALF_PI, 0.0);
    let reach = sqrt(beyond * beyond + 36.0 * width * width) - beyond;
    let peak = clamp(centre, -HALF_PI, HALF_PI);
    let low = max(peak - reach, -HALF_PI);
    let high = min(peak + reach, HALF_PI);
    let middle = 0.5 * (low + high);
    let half_width = 0.5 * (high - low);
    var sum = 0.0;
    for (var j = 0; j < INCLINATION_NODES; j++) {
        let node = INCLINATION[j];
        sum += node.y * sadeghi_energy_at(width, centre, theta_k, middle + half_width * node.x);
        sum += node.y * sadeghi_energy_at(width, centre, theta_k, middle - half_width * node.x);
    }
    return half_width * sum;
}

fn sadeghi_energy_at(width: f32, centre: f32, theta_k: f32, theta: f32) -> f32 {
    let cos_s = cos(theta);
    return sadeghi_bell((theta - centre) / width) * cos_s * cos_s / sadeghi_cos2_d(theta_k, theta);
}

// A Gaussian of height 1 and standard deviation 1.
fn sadeghi_bell(x: f32) -> f32 {
    return exp(-0.5 * x * x);
}

// cos²(theta_d), kept off zero.
fn sadeghi_cos2_d(theta_k: f32, theta_s: f32) -> f32 {
    let c = cos(0.5 * (theta_s - theta_k));
    return max(c * c, 1e-10);
}
