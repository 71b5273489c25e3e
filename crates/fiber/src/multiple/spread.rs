//! Dual scattering without quadrature: textures from which a shader makes, of any model, what
//! [`DualScattering::eval`] makes by asking the model hundreds of times.
//!
//! The expensive part of dual scattering is the fiber in light that was scattered on its way: the mean of `fcos` over
//! the directions that such light arrives from, a cone in inclination times a half circle in azimuth. Seen from one
//! known direction every lobe of every model is nearly a product: an azimuthal density, and a blurred cone along the
//! fiber. So the mean is nearly a product too. Its azimuthal factor depends on two angles and is a texture, the
//! **glow**; along the fiber, two blurs make one whose variances add up.
//!
//! - Source: derived here, for the dual scattering of `docs/models/dual_scattering.md`, whose closure is taken to be
//!   [`Closure::Medium`].
//! - Field: far; light that other fibers scattered has no offset to remember. Draws are made in the near field of
//!   models that have one.
//! - Error against [`DualScattering::eval`], of the scattered light, summed over directions within 70 degrees: 1 % for
//!   lobes that are blurred cones (Chiang, d'Eon, fur), 2 % for Gaussians and powers of cosines, 4 % for the cosine of
//!   a diffuse part in light that is scattered little. In single directions far off all lobes, more.
//!
//! | symbol | meaning |
//! |---|---|
//! | `A_p(φ)` | light of lobe `p` per azimuth: `∫ fcos_p cos θ_s dθ_s` |
//! | `G_p(φ)` | glow: `A_p` folded with `½ cos ψ` over the half circle around the light |
//! | `θ_p`, `v_p` | inclination and variance of the blurred cone that has the moments of lobe `p` |
//! | `σ²`, `Δ` | variance and shift of the light on its way, see [`Front`] |
//! | `L` | [longitudinal density](longitudinal::density) |
//!
//! `⟨fcos⟩ = Σ_p G_p(φ) L(v_p + σ², θ_p, θ_light - Δ)`.
//!
//! A blurred cone of variance `v` has `E sin θ = M S` and `E sin² θ = v M + (1 - 3 v M) S²`, with `S` the sine of the
//! cone's inclination and `M = coth(1/v) - v`. So `S` and `v` follow from the first two moments of the sine, at the
//! poles too, where moments of the angle would be of what the poles have cut off.
//!
//! # Textures
//!
//! Three for the glow, columns `|φ|/π` from 0 to 1 with the ends on centres, rows `θ_k`:
//!
//! | texture | channels |
//! |---|---|
//! | first | `G_R` red; `G_TT` red, green, blue |
//! | second | `G_R` green; `G_TRT` red, green, blue |
//! | third | `G_R` blue; `G_residual` red, green, blue |
//!
//! One of [`ROWS`] rows for the curves, columns `θ`:
//!
//! | rows | what | fourth channel |
//! |---|---|---|
//! | 0, 1, 2 | attenuation, shift, variance of light that a fiber scatters [forward](super::dual_scattering::Tables::forward) | 0 |
//! | 3, 4, 5 | the same of what is [returned](super::dual_scattering::Tables::returned) | 0 |
//! | 6, 7, 8 | the same of what is [passed](super::dual_scattering::Tables::passed) | 0 |
//! | 9 | `θ_p + θ_k` of R, TT, TRT, residual, radians | |
//! | 10 | `v_p` of R, TT, TRT, residual, rad² | |
//! | 11 | albedo: all light that one fiber scatters | 1 |
//!
//! Entry `i` of `n` belongs to `θ = ((i + ½) / n - ½) π`, so that the texture coordinate is `½ + θ/π`.
//!
//! ```
//! use fiber::multiple::dual_scattering::{DualScattering, Options};
//! use fiber::multiple::spread::Spread;
//! use fiber::{Chiang, Dir, Fiber, Hit, Model, Scatter};
//! use math::Rgb;
//!
//! let blonde = Fiber::Chiang(Chiang::<f32>::with_absorption(Rgb::new(0.06, 0.1, 0.2)));
//! let hair = DualScattering::new(blonde, Options { entries: 16, samples: 1024, ..Options::default() });
//! let spread = Spread::new(&hair, 24, 16);
//!
//! // Behind four fibers nothing arrives but scattered light, whatever the fiber makes of direct light.
//! let (known, light) = (Dir::new(0.0, 0.0), Dir::new(0.1, 3.0));
//! let direct = blonde.prepare(&Hit::new(known, 0.0)).eval(light);
//! let glow = spread.eval(known, light, direct, &spread.uniform(4.0, light.theta()));
//! assert!(glow[0] > 2.0 * glow[2]);
//! ```

use std::f64::consts::PI;

use math::{Real, Rgb};

use super::dual_scattering::{
    Closure, DualScattering, EVEN, Front, Options, Side, lookup, points, table_theta, widened,
};
use crate::lobe::longitudinal::{self, Cone, MIN_VARIANCE};
use crate::table::{Table2, coordinate};
use crate::{Chiang, DIMS, Deon, Dir, Fiber, Field, GroomFiber, Hit, Lobes, Model, Scatter, Weights, wrap_angle};

/// Rows of the curves.
pub const ROWS: u32 = 12;

/// First row of what a fiber scatters forward.
const FORWARD: u32 = 0;
/// First row of what is returned to the light's side.
const RETURNED: u32 = 3;
/// First row of what is passed to the far side.
const PASSED: u32 = 6;
/// Row of the cones.
const MEANS: u32 = 9;
/// Row of their variances.
const VARIANCES: u32 = 10;
/// Row of the albedo.
const ALBEDO: u32 = 11;

/// Draws from the model per known inclination: the glow is good to 1 %.
const DRAWS: usize = 1024;

/// Steps of the azimuth, over half a turn, in which draws are gathered.
const STEPS: usize = 128;

/// The broadest blur; wider ones are even to 1 %.
const MAX_VARIANCE: f64 = 100.0;

/// [`DualScattering`] as textures.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    options: Options,
    glow: [Table2; 3],
    curves: Table2,
}

/// One known inclination.
struct Row {
    /// Glow of all lobes per column.
    glow: Vec<Lobes<f64>>,
    /// `θ_p + θ_k`.
    means: [f32; 4],
    variances: [f32; 4],
    albedo: Rgb<f64>,
}

impl Spread {
    /// Bakes textures for the model of `dual`: `columns` of the azimuth and `rows` of the inclination, both at least 2.
    ///
    /// Draws 1024 times a row from the model. `dual` is to be made with [`Closure::Medium`]: what the fibers behind
    /// return is copied from its tables, but light is spread and weighed as in a medium.
    pub fn new(dual: &DualScattering, columns: u32, rows: u32) -> Self {
        let (columns, rows) = (columns.max(2), rows.max(2));
        let fiber = near(*dual.model());
        let groom = fiber.for_groom();
        let draws: Vec<[f64; 1 + DIMS]> = points(DRAWS).collect();
        let kernel = kernel(columns as usize);
        let theta = |row: u32| table_theta(row as usize, rows as usize);
        let baked: Vec<Row> =
            (0..rows).map(|row| bake(&groom, fiber.is_round(), theta(row), &draws, &kernel)).collect();

        // R has three channels too: one in front of each of the others.
        let glow = std::array::from_fn(|i| {
            Table2::new([columns, rows], |column, row| {
                let lobes = &baked[row as usize].glow[column as usize];
                let [r, g, b] = lobes[i + 1].0;
                [lobes[0][i], r, g, b].map(|x| x as f32)
            })
        });
        let tables = dual.tables();
        let curves = Table2::new([rows, ROWS], |column, row| {
            let (theta, baked) = (theta(column) as f32, &baked[column as usize]);
            match row {
                FORWARD..RETURNED => entry(&lookup(tables.forward, theta), row),
                RETURNED..PASSED => entry(&lookup(tables.returned, theta), row - RETURNED),
                PASSED..MEANS => entry(&lookup(tables.passed, theta), row - PASSED),
                MEANS => baked.means,
                VARIANCES => baked.variances,
                _ => {
                    let [r, g, b] = baked.albedo.0.map(|x| x as f32);
                    [r, g, b, 1.0]
                }
            }
        });
        Self { options: *dual.options(), glow, curves }
    }

    /// Columns and rows of the glow.
    pub fn size(&self) -> [u32; 2] {
        self.glow[0].size()
    }

    /// The glow.
    pub fn textures(&self) -> [&Table2; 3] {
        self.glow.each_ref()
    }

    /// The curves over the inclination.
    pub fn curves(&self) -> &Table2 {
        &self.curves
    }

    /// The same textures with every texel in half precision.
    pub fn halved(&self) -> Self {
        Self { options: self.options, glow: self.textures().map(Table2::halved), curves: self.curves.halved() }
    }

    /// Share of the light that one fiber scatters, for a known inclination in radians.
    pub fn albedo(&self, theta: f32) -> Rgb {
        self.curve(ALBEDO, theta)
    }

    /// [`DualScattering::uniform`] from the curves. Twin of `spread_uniform`.
    pub fn uniform(&self, n: f32, theta: f32) -> Front {
        let side = self.side(FORWARD, -theta);
        let (met, crossed) = (n.clamp(0.0, 1.0), n.max(1.0));
        if met <= 0.0 {
            return Front::open();
        }
        Front {
            direct: 1.0 - met,
            transmittance: side.attenuation.map(|a| met * a.max(0.0).powf(crossed)),
            shift: side.shift * crossed,
            variance: side.variance * crossed,
        }
    }

    /// Texture coordinates in the glow. Twin of `spread_glow_coords`.
    #[inline]
    pub fn coords(&self, known: Dir, light: Dir) -> [f32; 2] {
        let x = wrap_angle(light.phi - known.phi).abs() / std::f32::consts::PI;
        [coordinate(x, self.size()[0]), theta_coord(known.theta())]
    }

    /// `fcos` of the fiber and its surroundings: outgoing radiance per irradiance of a light from `light`.
    ///
    /// `direct` is `fcos` of the fiber alone, `front` what lies between the place and the light. Twin of
    /// `spread_eval`.
    pub fn eval(&self, known: Dir, light: Dir, direct: Lobes, front: &Front) -> Rgb {
        let options = &self.options;
        let theta_d = 0.5 * (known.theta() - light.theta());
        let same_side = (light.phi - known.phi).cos() >= 0.0;
        let around = self.side(if same_side { RETURNED } else { PASSED }, theta_d);
        let even = around.attenuation * (EVEN as f32 * options.density_backward);
        let back = even * returned(known, light, around.shift, around.variance);
        let sum = (direct.sum() + back) * front.direct;
        if front.direct >= 1.0 {
            return sum;
        }
        let (shift, variance) = (around.shift + front.shift, around.variance + front.variance);
        let scattered = even * returned(known, light, shift, variance) * (Closure::Medium.flux() as f32);
        let glow = self.glow(known, light, front);
        sum + (glow + scattered) * front.transmittance * options.density_forward
    }

    /// The fiber in light that was scattered on its way.
    fn glow(&self, known: Dir, light: Dir, front: &Front) -> Rgb {
        let [u, v] = self.coords(known, light);
        let [a, b, c] = self.textures().map(|texture| texture.sample(u, v));
        let last = |texel: [f32; 4]| Rgb([texel[1], texel[2], texel[3]]);
        let lobes = [Rgb([a[0], b[0], c[0]]), last(a), last(b), last(c)];
        let (means, variances) = (self.texel(MEANS, known.theta()), self.texel(VARIANCES, known.theta()));
        // Light is seen from where it was last scattered, in every channel.
        let from = front.shift.0.map(|shift| Cone::specular(-light.sin_theta, light.cos_theta, -shift));
        let mut sum = Rgb::black();
        for p in 0..4 {
            let cone = Cone::specular(known.sin_theta, known.cos_theta, means[p]);
            for channel in 0..3 {
                let variance = widened(variances[p] + front.variance[channel]);
                let Cone { sin, cos, .. } = from[channel];
                sum[channel] += lobes[p][channel] * longitudinal::density(variance, cone, sin, cos);
            }
        }
        sum
    }

    fn texel(&self, row: u32, theta: f32) -> [f32; 4] {
        self.curves.sample(theta_coord(theta), (row as f32 + 0.5) / ROWS as f32)
    }

    fn curve(&self, row: u32, theta: f32) -> Rgb {
        let [r, g, b, _] = self.texel(row, theta);
        Rgb([r, g, b])
    }

    fn side(&self, first: u32, theta: f32) -> Side {
        Side {
            attenuation: self.curve(first, theta),
            shift: self.curve(first + 1, theta),
            variance: self.curve(first + 2, theta),
        }
    }
}

/// Texture coordinate of an inclination. Twin of `spread_theta_coord`.
#[inline]
fn theta_coord(theta: f32) -> f32 {
    0.5 + theta / std::f32::consts::PI
}

/// Longitudinal densities at `light` of cones about the known direction.
fn returned(known: Dir, light: Dir, shift: Rgb, variance: Rgb) -> Rgb {
    shift.zip(variance, |shift, variance| {
        let cone = Cone::specular(known.sin_theta, known.cos_theta, shift);
        longitudinal::density(widened(variance), cone, light.sin_theta, light.cos_theta)
    })
}

/// Attenuation, shift or variance as a texel.
fn entry(side: &Side, which: u32) -> [f32; 4] {
    let [r, g, b] = [side.attenuation, side.shift, side.variance][which as usize].0;
    [r, g, b, 0.0]
}

/// The model in its near field, whose average over the offset is the far field, and which costs no quadrature.
fn near(fiber: Fiber) -> Fiber {
    match fiber {
        Fiber::Deon(m) => Fiber::Deon(Deon { field: Field::Near, weights: Weights::Marginal, ..m }),
        Fiber::Chiang(m) => Fiber::Chiang(Chiang { field: Field::Near, ..m }),
        other => other,
    }
}

/// How much light from a column's azimuth is scattered by each step of the azimuth: rows are columns of the texture.
///
/// Light fills the half circle around its azimuth with `½ cos ψ`. What is known of a lobe is its light at `φ` and `-φ`
/// together, half of it either side.
fn kernel(columns: usize) -> Vec<Vec<f64>> {
    let spread = |psi: f64| 0.5 * psi.cos().max(0.0);
    let column = |i: usize| {
        let phi = PI * i as f64 / (columns - 1) as f64;
        let step = |j: usize| PI * j as f64 / STEPS as f64;
        (0..=STEPS).map(|j| 0.5 * (spread(phi - step(j)) + spread(phi + step(j)))).collect()
    };
    (0..columns).map(column).collect()
}

/// Draws from the model for one known inclination.
fn bake(model: &GroomFiber, is_round: bool, theta: f64, draws: &[[f64; 1 + DIMS]], kernel: &[Vec<f64>]) -> Row {
    let mut around = vec![Lobes::<f64>::zero(); STEPS + 1];
    // Sums of weight, weight × sin θ and weight × sin² θ.
    let mut moments = [[0.0_f64; 3]; 4];
    let mut albedo = Rgb::<f64>::black();
    let share = 1.0 / draws.len() as f64;
    for &[h, a, b, c, d, e] in draws {
        // Either half of the cross-section scatters like the other one, mirrored, and azimuths are gathered without
        // their sign. An elliptical fiber has no offset, but looks different from every side.
        let phi_k = if is_round { 0.0 } else { (2.0 * PI * h) as f32 };
        let hit = Hit::new(Dir::new(theta as f32, phi_k), h as f32);
        // The largest number below 1 in double precision may be rounded up to 1.
        let u = [a, b, c, d, e].map(|u| (u as f32).min(<f32 as Real>::ONE_MINUS_EPSILON));
        let Some(sample) = model.prepare(&hit).sample(u) else { continue };
        let place = f64::from(wrap_angle(sample.dir.phi - phi_k).abs()) / PI * STEPS as f64;
        let step = (place as usize).min(STEPS - 1);
        let beyond = (place - step as f64).clamp(0.0, 1.0);
        let sin = f64::from(sample.dir.sin_theta);
        for (p, moments) in moments.iter_mut().enumerate() {
            let weight = sample.weight[p].cast::<f64>() * share;
            around[step][p] += weight * (1.0 - beyond);
            around[step + 1][p] += weight * beyond;
            albedo += weight;
            let grey = weight[0] + weight[1] + weight[2];
            for (power, sum) in moments.iter_mut().enumerate() {
                *sum += grey * sin.powi(power as i32);
            }
        }
    }
    let glow = kernel.iter().map(|column| {
        let mut sum = Lobes::<f64>::zero();
        for (lobes, &weight) in around.iter().zip(column) {
            for p in 0..4 {
                sum[p] += lobes[p] * weight;
            }
        }
        sum
    });
    let cones = moments.map(|[all, first, second]| {
        // A lobe without light lies anywhere.
        if all > 0.0 { blurred_cone(first / all, second / all) } else { (-theta.sin(), MAX_VARIANCE) }
    });
    Row {
        glow: glow.collect(),
        means: cones.map(|(sin, _)| (sin.asin() + theta) as f32),
        variances: cones.map(|(_, variance)| variance as f32),
        albedo,
    }
}

/// Mean cosine of a spherical Gaussian of variance `v`: `coth(1/v) - v`.
fn mean_cosine(v: f64) -> f64 {
    v.recip().tanh().recip() - v
}

/// Sine of the inclination, and variance, of the blurred cone whose sine has these first two moments.
///
/// Moments that no blurred cone has get the nearest that lies on the sphere.
fn blurred_cone(first: f64, second: f64) -> (f64, f64) {
    let second_of = |v: f64| {
        let m = mean_cosine(v);
        v * m + (1.0 - 3.0 * v * m) * (first / m).powi(2)
    };
    // Too broad: the cone would lie beyond a pole, or the sine scatter more.
    let too_broad = |v: f64| mean_cosine(v) < first.abs() || second_of(v) > second;
    let (mut low, mut high) = (MIN_VARIANCE, MAX_VARIANCE);
    if too_broad(low) {
        return (first.clamp(-1.0, 1.0), low);
    }
    if too_broad(high) {
        // In the logarithm: variances span nine orders of magnitude.
        for _ in 0..50 {
            let middle = (low * high).sqrt();
            if too_broad(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
    } else {
        low = high;
    }
    ((first / mean_cosine(low)).clamp(-1.0, 1.0), low)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::quadrature::integrate;

    #[test]
    fn cones_are_found_from_their_moments() {
        for v in [1e-4_f64, 0.01, 0.1, 0.5, 2.0] {
            for theta in [-1.5, -0.7, 0.0, 0.3, 1.2_f64] {
                let cone = Cone { sin: theta.sin(), cos: theta.cos(), raw_cos: theta.cos() };
                // Near the cone alone, so that the nodes see it when it is narrow.
                let reach = 12.0 * v.sqrt();
                let (low, high) = ((theta - reach).max(-FRAC_PI_2), (theta + reach).min(FRAC_PI_2));
                let moment = |power: i32| {
                    integrate(low, high, 256, |t| {
                        longitudinal::density(v, cone, t.sin(), t.cos()) * t.cos() * t.sin().powi(power)
                    })
                };
                assert!((moment(0) - 1.0).abs() < 1e-10, "{v} {theta}: {}", moment(0));
                let (sin, variance) = blurred_cone(moment(1), moment(2));
                // A narrow variance is a small difference of moments next to 1: digits are lost.
                assert!((variance / v - 1.0).abs() < 1e-7, "{v} {theta}: {variance}");
                assert!((sin - theta.sin()).abs() < 1e-9, "{v} {theta}: {sin}");
            }
        }
    }

    #[test]
    fn impossible_moments_get_a_cone_nevertheless() {
        for (first, second) in [(0.0, 0.0), (1.0, 1.0), (0.5, 0.1), (0.9, 1.0), (0.0, 1.0), (0.01, 0.3334)] {
            let (sin, variance) = blurred_cone(first, second);
            assert!(sin.abs() <= 1.0 && (MIN_VARIANCE..=MAX_VARIANCE).contains(&variance), "{first} {second}");
        }
    }

    #[test]
    fn light_of_all_azimuths_is_kept() {
        // Every step sends out 1 over the whole turn. Trapezoid of a kinked function: second order in the step.
        let columns = 721;
        let kernel = kernel(columns);
        for j in 0..=STEPS {
            let inner: f64 = kernel[1..columns - 1].iter().map(|column| column[j]).sum();
            let turn = 2.0 * (inner + 0.5 * (kernel[0][j] + kernel[columns - 1][j])) * PI / (columns - 1) as f64;
            assert!((turn - 1.0).abs() < 1e-5, "{j}: {turn}");
        }
    }
}
