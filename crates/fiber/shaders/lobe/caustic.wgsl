// The caustic of TRT, blurred so that it is finite. Twin of `lobe/caustic.rs`.

const CAUSTIC_MIN_WIDTH: f32 = 1e-4;

struct Caustic {
    strength: f32,  // of the glints that replace it
    width: f32,     // rad
    fade: f32,      // of Bravais' index beyond 2
    limit: f32,     // of the offset
}

// Where the caustic is and how much of it is blurred.
struct CausticPlace {
    h: f32,       // offset of its path
    phi: f32,     // rad, to either side
    extent: f32,  // Δh
    share: f32,   // 1 where there is a caustic, falling to 0 beyond
}

fn caustic_place(caustic: Caustic, mode: u32, inv_bravais: f32) -> CausticPlace {
    let bravais = 1.0 / max(inv_bravais, 1e-6);
    if bravais >= 2.0 {
        let t = clamp((bravais - 2.0) / max(caustic.fade, 1e-6), 0.0, 1.0);
        return CausticPlace(0.0, 0.0, caustic.limit, 1.0 - t * t * (3.0 - 2.0 * t));
    }
    let gamma = roots_turning_point(mode, 2.0, inv_bravais);
    let h = sin(gamma);
    let cos_gamma = max(cos(gamma), 1e-6);
    let phi = wrap_angle(roots_exit(mode, 2.0, inv_bravais, gamma).x);
    // d²Φ/dh² there.
    var bend = 0.0;
    if mode == ROOTS_CUBIC {
        bend = 96.0 * safe_asin(inv_bravais) / (PI * PI * PI) * gamma / (cos_gamma * cos_gamma);
    } else {
        let q = max(bravais * bravais - h * h, 1e-12);
        bend = abs(4.0 * h / (q * sqrt(q)) - 2.0 * h / (cos_gamma * cos_gamma * cos_gamma));
    }
    let extent = 2.0 * sqrt(2.0 * max(caustic.width, CAUSTIC_MIN_WIDTH) / max(bend, 1e-12));
    return CausticPlace(h, phi, min(extent, caustic.limit), 1.0);
}

// `n`, the sum over roots towards `phi`, with the caustic cut out and the glints put in; `a` is the attenuation
// of the caustic's own path.
fn caustic_smooth(caustic: Caustic, place: CausticPlace, n: vec3f, a: vec3f, phi: f32) -> vec3f {
    let width = max(caustic.width, CAUSTIC_MIN_WIDTH);
    let left = wrap_angle(phi - place.phi) / width;
    let right = wrap_angle(phi + place.phi) / width;
    let g = vec2f(exp(-0.5 * left * left), exp(-0.5 * right * right));
    let cut = (1.0 - place.share * g.x) * (1.0 - place.share * g.y);
    let glints = place.share * caustic.strength * place.extent * (g.x + g.y) * 0.39894228 / width;
    return n * cut + a * glints;
}
