//! Photons through a cylinder with a scattering core, one by one: what the fur model is measured against.
//!
//! Tests only. Refraction and reflection at the outer surface are vector laws with Fresnel's factors, the core
//! scatters with Henyey and Greenstein's phase function, and nothing is taken from the model's own formulas.
//! Absorption is left to the caller, who gets the lengths of the way in either material.

use math::hash;

/// A smooth cylinder of radius 1 with a concentric core that scatters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cylinder {
    /// Index of refraction, the same in both parts.
    pub(crate) eta: f64,
    /// Radius of the core.
    pub(crate) radius: f64,
    /// Scattering coefficient of the core, per cylinder radius.
    pub(crate) scattering: f64,
    /// Mean cosine of the scattering angle.
    pub(crate) anisotropy: f64,
}

/// How a photon left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exit {
    /// Azimuth relative to where it came from.
    pub(crate) phi: f64,
    /// Sine of the inclination.
    pub(crate) sin_theta: f64,
    /// Length of its way outside the core.
    pub(crate) cortex: f64,
    /// Length of its way inside the core.
    pub(crate) medulla: f64,
    /// How often it reached the surface from inside; 0 for light that never entered.
    pub(crate) arrivals: u32,
    /// How often it had reached the surface when it was first scattered; `None` if it never was.
    pub(crate) scattered_after: Option<u32>,
}

/// A stream of uniform numbers in `(0, 1)`.
pub(crate) struct Random {
    seed: u32,
    index: u32,
}

impl Random {
    pub(crate) fn new(seed: u32) -> Self {
        Self { seed: hash::mix2(seed, 0x0f00_c0de), index: 0 }
    }

    fn unit(&mut self) -> f64 {
        self.index = self.index.wrapping_add(1);
        // One round more than a renderer needs: these numbers are compared with errors of a few thousandths.
        let word = hash::mix(hash::mix2(self.seed, self.index).wrapping_add(self.seed));
        (f64::from(word) + 0.5) / 4_294_967_296.0
    }
}

/// Follows one photon that arrives from the inclination with the sine `sin_k` at the offset `h`; azimuth 0.
/// `None` for one that glides along the cylinder and does not come out.
pub(crate) fn trace(cylinder: &Cylinder, sin_k: f64, h: f64, random: &mut Random) -> Option<Exit> {
    let eta = cylinder.eta;
    let cos_k = (1.0 - sin_k * sin_k).sqrt();
    let mut at = [(1.0 - h * h).sqrt(), -h];
    let arriving = [-sin_k, -cos_k, 0.0];
    let cos_i = cos_k * at[0];
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).sqrt();
    let (mut cortex, mut medulla, mut arrivals, mut scattered_after) = (0.0, 0.0, 0, None);
    if random.unit() < reflectance(cos_t, eta).0 {
        let out = along_normal(arriving, at, 2.0 * cos_i);
        return Some(Exit { phi: out[2].atan2(out[1]), sin_theta: out[0], cortex, medulla, arrivals, scattered_after });
    }
    let mut u = along_normal(arriving.map(|x| x / eta), at, cos_i / eta - cos_t);

    while arrivals < 20_000 {
        if let Some([near, _]) = crossings(at, u, cylinder.radius).filter(|[near, _]| *near > 0.0) {
            cortex += near;
            at = moved(at, u, near);
            loop {
                let way = crossings(at, u, cylinder.radius).map_or(0.0, |[_, far]| far.max(0.0));
                let flight = -random.unit().ln() / cylinder.scattering;
                let step = flight.min(way);
                medulla += step;
                at = moved(at, u, step);
                if flight >= way {
                    break;
                }
                scattered_after.get_or_insert(arrivals);
                u = scattered(u, cylinder.anisotropy, random);
            }
        }
        let [_, far] = crossings(at, u, 1.0)?;
        cortex += far;
        at = moved(at, u, far);
        let radius = at[0].hypot(at[1]);
        at = at.map(|x| x / radius);
        arrivals += 1;
        let cos_t = u[1] * at[0] + u[2] * at[1];
        let (reflected, cos_o) = reflectance(cos_t, eta);
        if random.unit() >= reflected {
            let out = along_normal(u.map(|x| x * eta), at, cos_o - eta * cos_t);
            let (phi, sin_theta) = (out[2].atan2(out[1]), out[0]);
            return Some(Exit { phi, sin_theta, cortex, medulla, arrivals, scattered_after });
        }
        u = along_normal(u, at, -2.0 * cos_t);
    }
    None
}

/// Reflectance at the cosine inside, and the cosine outside.
fn reflectance(cos_t: f64, eta: f64) -> (f64, f64) {
    let sin2_o = eta * eta * (1.0 - cos_t * cos_t);
    if sin2_o >= 1.0 {
        return (1.0, 0.0);
    }
    let cos_o = (1.0 - sin2_o).sqrt();
    let s = (cos_o - eta * cos_t) / (cos_o + eta * cos_t);
    let p = (eta * cos_o - cos_t) / (eta * cos_o + cos_t);
    (0.5 * (s * s + p * p), cos_o)
}

/// A vector plus a multiple of the outward normal at the point.
fn along_normal(u: [f64; 3], at: [f64; 2], times: f64) -> [f64; 3] {
    [u[0], u[1] + times * at[0], u[2] + times * at[1]]
}

fn moved(at: [f64; 2], u: [f64; 3], step: f64) -> [f64; 2] {
    [at[0] + step * u[1], at[1] + step * u[2]]
}

/// Distances to where the ray enters and leaves a cylinder of this radius.
fn crossings(at: [f64; 2], u: [f64; 3], radius: f64) -> Option<[f64; 2]> {
    let a = u[1] * u[1] + u[2] * u[2];
    let b = at[0] * u[1] + at[1] * u[2];
    let discriminant = b * b - a * (at[0] * at[0] + at[1] * at[1] - radius * radius);
    if a < 1e-16 || discriminant <= 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    Some([(-b - root) / a, (-b + root) / a])
}

/// A direction drawn by the phase function of Henyey and Greenstein.
fn scattered(u: [f64; 3], g: f64, random: &mut Random) -> [f64; 3] {
    let (xi, turn) = (random.unit(), std::f64::consts::TAU * random.unit());
    let cos = if g.abs() < 1e-3 {
        2.0 * xi - 1.0
    } else {
        let t = (1.0 - g * g) / (1.0 - g + 2.0 * g * xi);
        ((1.0 + g * g - t * t) / (2.0 * g)).clamp(-1.0, 1.0)
    };
    let sin = (1.0 - cos * cos).sqrt();
    // Two directions across: the axis that u is least along, made perpendicular, and the cross product.
    let least = if u[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let dot = u[0] * least[0] + u[1] * least[1];
    let v: [f64; 3] = std::array::from_fn(|i| least[i] - dot * u[i]);
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let v = v.map(|x| x / length);
    let w = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let (a, b) = (sin * turn.cos(), sin * turn.sin());
    let new: [f64; 3] = std::array::from_fn(|i| cos * u[i] + a * v[i] + b * w[i]);
    let length = (new[0] * new[0] + new[1] * new[1] + new[2] * new[2]).sqrt();
    new.map(|x| x / length)
}
