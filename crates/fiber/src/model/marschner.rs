//! Marschner et al. 2003: the model that all later ones start from, with an exact sampler.
//!
//! - Source: Marschner, Jensen, Cammarano, Worley, Hanrahan 2003, as Hunz 2016 (section 3.3) writes it, with
//!   the errata of the project's model notes: the chord is `2 cos γ_t / cos θ_t`, the Fresnel factors use one
//!   angle of refraction, the second index of the ellipse has `-η`. The sampler is this project's.
//! - Field: far; the offset of the hit is ignored.
//! - Energy: about 0.95 (widths of 7.5 degrees) of what the cross-section lets out, not exactly: the
//!   Gaussians are not cut at the poles. From 80 degrees on it rises, without absorption to 1.5 at 89
//!   degrees. [`MarschnerNorm::AsPrinted`] returns twice that. Glints with a strength above 1 make light.
//! - Reciprocal: `S` does not change when the directions are exchanged, for every tilt and eccentricity.
//! - Weights `fcos / pdf`, as far as tried, stay below about 11 for a round fiber and below about 30 for an
//!   elliptical one, up to 89.9 degrees; with raw caustics (`caustic: None`) an ellipse has no bound: the
//!   sampler's caustic is the circular one.
//!
//! | symbol | meaning |
//! |---|---|
//! | `p` | lobe: 0 R, 1 TT, 2 TRT |
//! | `M_p` | Gaussian in `θ_h - α_p`, standard deviation `β_p`, times `κ` |
//! | `θ_h`, `θ_d` | half sum and half difference of the inclinations |
//! | `N_p` | light per azimuth: the roots of `Φ(p, γ) = φ`, each with `A_p cos γ / (2 dΦ/dγ)` |
//! | `A_p` | attenuation of the path |
//! | `φ_h` | `(φ_k + φ_s)/2`, absolute: measured from the major axis |
//! | `w_p(h)` | probability of lobe `p` at offset `h` |

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use math::{Real, Rgb, normal};

use super::lambertian::{Lambertian, LambertianSetup};
use super::{DIMS, Lobes, Model, R, RESIDUAL, Sample, Scatter, TRT, TT, finish, pick};
use crate::dir::cos2_half_difference;
use crate::lobe::attenuation::Optics;
use crate::lobe::azimuthal::{standard_normal, wrapped_gaussian};
use crate::lobe::caustic::{Caustic, Smoothing};
use crate::lobe::longitudinal::Truncated;
use crate::lobe::roots::{ExitCurve, Roots, inverse_index};
use crate::quadrature::rule;
use crate::wrap_angle;
use crate::{Dir, Hit};

/// Factor `κ` of the longitudinal Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MarschnerNorm {
    /// `κ = ½`, because `dθ_h = ½ dθ_s`: a white fiber returns about what it receives. The default.
    #[default]
    Normalised,
    /// `κ = 1`, as the papers print it: a white fiber returns about twice what it receives.
    AsPrinted,
}

/// The model of Marschner et al.
///
/// ```
/// use fiber::{Dir, Hit, Marschner, Model, Scatter, TRT};
/// use math::Rgb;
///
/// // The glints: the second highlight is brighter 18 degrees to the side than 60.
/// let blond = Marschner::<f64>::with_absorption(Rgb([0.2, 0.3, 0.5]));
/// let point = blond.prepare(&Hit::new(Dir::new(0.2, 0.0), 0.0));
/// let trt = |degrees: f64| point.eval(Dir::new(-0.2, degrees.to_radians()))[TRT].luminance();
/// assert!(trt(18.0) > 2.0 * trt(60.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marschner<F = f32> {
    /// Index of refraction relative to the outside, above 1; 1.55 for keratin in air.
    pub eta: F,
    /// Absorption per fiber radius.
    pub sigma_a: Rgb<F>,
    /// Longitudinal width of R: standard deviation of `θ_h`, radians; 5 to 10 degrees. TT has half of it,
    /// TRT twice.
    pub beta_m: F,
    /// Shift of R in `θ_h`, radians; -10 to -5 degrees, negative to the root. TT has `-α/2`, TRT `-3α/2`.
    pub alpha: F,
    /// Eccentricity `a`: minor over major axis of the cross-section, 0.85 to 1. The major axis is at
    /// azimuth 0 of the fiber's frame. Acts on TRT, by an index that depends on `φ_h`.
    pub eccentricity: F,
    /// Exact roots or the papers' cubic.
    pub roots: Roots,
    /// Factor of the longitudinal Gaussians.
    pub norm: MarschnerNorm,
    /// Smoothing of the caustics of TRT; `None` leaves them infinite.
    pub caustic: Option<Caustic<F>>,
    /// Albedo of a [`Lambertian`](crate::Lambertian) part, `0..=1`: the residual lobe. Black is none.
    pub diffuse: Rgb<F>,
}

impl<F: Real> Marschner<F> {
    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> Marschner<G> {
        let of = |x: F| G::of(x.f64());
        Marschner {
            eta: of(self.eta),
            sigma_a: self.sigma_a.cast(),
            beta_m: of(self.beta_m),
            alpha: of(self.alpha),
            eccentricity: of(self.eccentricity),
            roots: self.roots,
            norm: self.norm,
            caustic: self.caustic.map(Caustic::cast),
            diffuse: self.diffuse.cast(),
        }
    }

    /// Hair with this absorption and everything else at its default: width 7.5 degrees, shift -5 degrees,
    /// round, exact roots, normalised, smoothed caustics, no diffuse part.
    pub fn with_absorption(sigma_a: Rgb<F>) -> Self {
        Self {
            eta: F::of(1.55),
            sigma_a,
            beta_m: F::of(7.5_f64.to_radians()),
            alpha: F::of(-5.0_f64.to_radians()),
            eccentricity: F::one(),
            roots: Roots::default(),
            norm: MarschnerNorm::default(),
            caustic: Some(Caustic::default()),
            diffuse: Rgb::black(),
        }
    }

    /// Shifts `α_p` of R, TT, TRT in `θ_h`, radians: each lobe is centred at `-θ_k + 2α_p`.
    pub fn shifts(&self) -> [F; 3] {
        [1.0, -0.5, -1.5].map(|x| F::of(x) * self.alpha)
    }

    /// Standard deviations `β_p` of R, TT, TRT in `θ_h`, radians: twice that in `θ_s`.
    pub fn widths(&self) -> [F; 3] {
        [1.0, 0.5, 2.0].map(|x| (F::of(x) * self.beta_m).max(F::of(MIN_WIDTH)))
    }

    /// The index `η*` that stands for the ellipse in TRT, `φ_h` from the major axis in radians; `η` itself
    /// for a round fiber, else at least 1.05.
    pub fn index_at(&self, phi_h: F) -> F {
        F::of(self.double().ellipse_index(phi_h.f64()))
    }

    /// Longitudinal factors `M_p = κ g(β_p, θ_h - α_p)` of R, TT and TRT, per radian of `θ_h`, from sines and
    /// cosines of the two inclinations. `1/cos² θ_d` is not included: with [`azimuthal`](Self::azimuthal),
    /// `fcos = Σ_p M_p N_p cos θ_s / cos² θ_d`.
    pub fn longitudinal(&self, sin_k: F, cos_k: F, sin_s: F, cos_s: F) -> [F; 3] {
        let theta = |sin: F, cos: F| sin.f64().atan2(cos.f64());
        self.double().along(0.5 * (theta(sin_k, cos_k) + theta(sin_s, cos_s))).map(F::of)
    }

    /// Azimuthal factors `N_p` of R, TT and TRT, per radian, with the attenuation in them.
    ///
    /// `cos2_theta_d` is `cos² θ_d` in `[0, 1]`, `phi` the azimuth relative to the known direction, `phi_h` the
    /// mean of the two absolute azimuths, which only an elliptical fiber looks at; radians.
    pub fn azimuthal(&self, cos2_theta_d: F, phi: F, phi_h: F) -> [Rgb<F>; 3] {
        let cos2 = cos2_theta_d.f64().clamp(0.0, 1.0);
        self.double().section(cos2, phi.f64(), phi_h.f64(), |_, _, _| {}).map(Rgb::cast)
    }

    /// The same model in double precision. All of it is computed there: roots next to a caustic have half
    /// the digits of the azimuth.
    fn double(&self) -> Marschner<f64> {
        Marschner {
            // Without a step in the index there is no refraction to solve for.
            eta: self.eta.f64().max(1.001),
            sigma_a: self.sigma_a.cast(),
            beta_m: self.beta_m.f64(),
            alpha: self.alpha.f64(),
            eccentricity: self.eccentricity.f64(),
            roots: self.roots,
            norm: self.norm,
            caustic: self.caustic.map(Caustic::cast),
            diffuse: self.diffuse.cast(),
        }
    }
}

/// Narrower widths (0.02 degrees, in radians) are treated as this.
const MIN_WIDTH: f64 = 3.5e-4;

/// Floor of `cos² θ_d`: along the fiber the value would be infinite.
const MIN_COS2_D: f64 = 1e-5;

/// Floor of `cos θ_s` in the density, so that it stays finite at the poles; it misses 1e-6 radians there.
const MIN_COS_S: f64 = 1e-6;

/// Roots closer to a fold than this have no digits left; exactly at it they would be infinite.
const MIN_SLOPE: f64 = 1e-7;

/// What every lobe is drawn with at least, whatever its share of the light: keeps weights bounded where
/// the light goes another way than the ideally specular path says.
const MIN_SHARE: f64 = 0.05 / 3.0;

/// Where a ray enters: angle of incidence, its sine (the offset) and its cosine.
#[derive(Clone, Copy, Debug)]
struct Offset {
    gamma: f64,
    h: f64,
    cos: f64,
}

impl Offset {
    #[inline]
    fn at_angle(gamma: f64) -> Self {
        let (h, cos) = gamma.sin_cos();
        Self { gamma, h, cos: cos.max(0.0) }
    }

    #[inline]
    fn at(h: f64) -> Self {
        Self { gamma: h.clamp(-1.0, 1.0).asin(), h, cos: (1.0 - h * h).max(0.0).sqrt() }
    }

    /// `A_p` here.
    #[inline]
    fn attenuation(self, optics: &Optics<f64>, sigma_a: Rgb<f64>) -> [Rgb<f64>; 4] {
        optics.path(self.h, self.gamma, self.cos).attenuation(sigma_a)
    }
}

/// Visits the roots for one azimuth, each with its `cos γ / (2 |dΦ/dγ|) = 1 / (2 |dΦ/dh|)`.
#[inline]
fn visit_roots(curve: &ExitCurve, phi: f64, mut visit: impl FnMut(Offset, f64)) {
    for root in curve.solve(phi).as_slice() {
        let slope = root.slope.abs();
        if slope >= MIN_SLOPE {
            let offset = Offset::at_angle(root.gamma);
            visit(offset, offset.cos / (2.0 * slope));
        }
    }
}

impl Marschner<f64> {
    #[inline]
    fn is_round(&self) -> bool {
        self.eccentricity == 1.0
    }

    /// `η*(φ_h)`.
    fn ellipse_index(&self, phi_h: f64) -> f64 {
        if self.is_round() {
            return self.eta;
        }
        let a2 = self.eccentricity.max(0.1).powi(2);
        // Light along the longer diameter meets the sharper bend, which acts like a higher index: the far side
        // is in focus where a² η / (η - 1) = 2. The thesis measures φ_h from the other axis.
        let major = 2.0 * (self.eta - 1.0) / a2 - self.eta + 2.0;
        let minor = 2.0 * (self.eta - 1.0) * a2 - self.eta + 2.0;
        (0.5 * ((major + minor) + (2.0 * phi_h).cos() * (major - minor))).max(1.05)
    }

    /// `M_p`.
    fn along(&self, theta_h: f64) -> [f64; 3] {
        let kappa = match self.norm {
            MarschnerNorm::Normalised => 0.5,
            MarschnerNorm::AsPrinted => 1.0,
        };
        let (shifts, widths) = (self.shifts(), self.widths());
        [R, TT, TRT].map(|p| kappa * normal::pdf((theta_h - shifts[p]) / widths[p]) / widths[p])
    }

    /// `N_p`. `seen` is told lobe, offset and `1 / (2 |dΦ/dh|)` of every root of the *circular* fiber, which
    /// are what the sampler draws.
    fn section(&self, cos2: f64, phi: f64, phi_h: f64, mut seen: impl FnMut(usize, Offset, f64)) -> [Rgb<f64>; 3] {
        let phi = wrap_angle(phi);
        let optics = Optics::new(cos2, self.eta);
        let b = inverse_index(cos2, self.eta);

        // R has one root, everywhere: γ = -φ/2, with a slope of -2.
        let offset = Offset::at_angle(-0.5 * phi);
        let density = 0.25 * offset.cos;
        seen(R, offset, density);
        let r = offset.attenuation(&optics, Rgb::black())[R] * density;

        let mut tt = Rgb::black();
        visit_roots(&ExitCurve::new(self.roots, TT, b), phi, |offset, density| {
            seen(TT, offset, density);
            tt += offset.attenuation(&optics, self.sigma_a)[TT] * density;
        });

        let curve = ExitCurve::new(self.roots, TRT, b);
        let trt = if self.is_round() {
            self.trt(&optics, &curve, phi, |offset, density| seen(TRT, offset, density))
        } else {
            visit_roots(&curve, phi, |offset, density| seen(TRT, offset, density));
            let eta = self.ellipse_index(phi_h);
            let curve = ExitCurve::new(self.roots, TRT, inverse_index(cos2, eta));
            self.trt(&Optics::new(cos2, eta), &curve, phi, |_, _| {})
        };
        [r, tt, trt]
    }

    /// `N_TRT`, smoothed if so wished.
    fn trt(&self, optics: &Optics<f64>, curve: &ExitCurve, phi: f64, mut seen: impl FnMut(Offset, f64)) -> Rgb<f64> {
        let mut n = Rgb::black();
        visit_roots(curve, phi, |offset, density| {
            seen(offset, density);
            n += offset.attenuation(optics, self.sigma_a)[TRT] * density;
        });
        if let Some(caustic) = &self.caustic {
            let smoothing = Smoothing::new(caustic, curve);
            n *= smoothing.kept(phi);
            if smoothing.gain > 0.0 {
                n += Offset::at(smoothing.h).attenuation(optics, self.sigma_a)[TRT] * smoothing.added(phi);
            }
        }
        n
    }
}

/// How the sampler chooses a lobe for an offset.
#[derive(Clone, Copy, Debug)]
struct Selection {
    optics: Optics<f64>,
    sigma_a: Rgb<f64>,
    /// Share of TRT that is drawn by way of offsets; the rest is drawn as glints or evenly.
    trt: f64,
}

impl Selection {
    /// Luminance of the light that leaves by R, TT, TRT.
    #[inline]
    fn light(&self, offset: Offset) -> [f64; 3] {
        let a = offset.attenuation(&self.optics, self.sigma_a);
        [R, TT, TRT].map(|p| a[p].luminance())
    }

    /// `w_p(h)`, with a fourth entry of 0.
    #[inline]
    fn shares(&self, offset: Offset) -> [f64; 4] {
        let [r, tt, trt] = self.light(offset);
        let trt = trt * self.trt;
        let total = r + tt + trt;
        let share = |x: f64| if total > 0.0 { MIN_SHARE + (1.0 - 3.0 * MIN_SHARE) * x / total } else { 1.0 / 3.0 };
        [share(r), share(tt), share(trt), 0.0]
    }
}

/// Sources that directions are drawn from: the path through a random offset.
const PATHS: usize = 0;
/// The glints of TRT: Gaussians about the caustics, which reach beyond all roots.
const GLINTS: usize = 1;
/// TRT over all azimuths, for an ellipse whose roots lie elsewhere than the circle's.
const EVEN: usize = 2;
/// The diffuse part.
const FILL: usize = 3;

/// Everything but the diffuse part, in double precision.
#[derive(Clone, Copy, Debug)]
struct Point {
    model: Marschner<f64>,
    known: Dir<f64>,
    theta_k: f64,
    along: [Truncated<f64>; 3],
    selection: Selection,
    /// Probabilities of the sources above.
    sources: [f64; 4],
}

impl Point {
    fn new(model: Marschner<f64>, known: Dir<f64>) -> Self {
        let theta_k = known.theta();
        let (shifts, widths) = (model.shifts(), model.widths());
        // The ideally specular path has θ_d = -θ_k; along the fiber all of it is reflection, while the
        // width of the lobes brings paths in that are not.
        let cos2 = known.cos_theta.sqr().max(widths[R].min(0.5).sin().sqr()).min(1.0);
        let optics = Optics::new(cos2, model.eta);
        let glints = model.caustic.is_some();
        let even = !model.is_round();
        let half = |halved: bool| if halved { 0.5 } else { 1.0 };
        let selection = Selection { optics, sigma_a: model.sigma_a, trt: half(glints) * half(even) };

        let fill = model.diffuse.luminance().max(0.0);
        let mut sources = [1.0, 0.0, 0.0, 0.0];
        if glints || even || fill > 0.0 {
            // Any probabilities are right; these follow the light.
            let mut light = [0.0; 3];
            for &(x, weight) in rule(16) {
                let offset = Offset::at_angle(FRAC_PI_2 * x);
                for (sum, lum) in light.iter_mut().zip(selection.light(offset)) {
                    *sum += 0.5 * weight * FRAC_PI_2 * offset.cos * lum;
                }
            }
            let mut energy = [light[R] + light[TT] + selection.trt * light[TRT], 0.0, 0.0, fill];
            if let Some(caustic) = &model.caustic {
                let curve = ExitCurve::new(model.roots, TRT, inverse_index(cos2, model.eta));
                let smoothing = Smoothing::new(caustic, &curve);
                let bright = selection.light(Offset::at(smoothing.h))[TRT];
                energy[GLINTS] = 2.0 * smoothing.gain * bright + 0.25 * light[TRT];
            }
            if even {
                energy[EVEN] = 0.5 * light[TRT];
            }
            let active = [true, glints, even, fill > 0.0];
            let count = active.iter().filter(|&&on| on).count() as f64;
            let total: f64 = energy.iter().sum();
            for (source, probability) in sources.iter_mut().enumerate() {
                let share = if total > 0.0 { energy[source] / total } else { 1.0 / count };
                // No source that something depends on is ever without a chance.
                *probability = if active[source] { 0.97 * share + 0.03 / count } else { 0.0 };
            }
        }
        let along = [R, TT, TRT].map(|p| Truncated::new(2.0 * shifts[p] - theta_k, widths[p]));
        Self { model, known, theta_k, along, selection, sources }
    }

    /// `cos² θ_d`.
    #[inline]
    fn cos2(&self, s: Dir<f64>) -> f64 {
        cos2_half_difference(self.known.sin_theta, self.known.cos_theta, s.sin_theta, s.cos_theta)
    }

    /// `fcos` of R, TT, TRT; `seen` as in [`Marschner::section`].
    fn eval(&self, s: Dir<f64>, seen: impl FnMut(usize, Offset, f64)) -> [Rgb<f64>; 3] {
        let cos2 = self.cos2(s);
        let phi_h = 0.5 * (self.known.phi + s.phi);
        let n = self.model.section(cos2, s.phi - self.known.phi, phi_h, seen);
        let m = self.model.along(0.5 * (self.theta_k + s.theta()));
        let cosines = s.cos_theta / cos2.max(MIN_COS2_D);
        [R, TT, TRT].map(|p| n[p] * (m[p] * cosines))
    }

    /// `fcos` of R, TT, TRT, and the density of all sources but the diffuse one.
    fn eval_pdf(&self, s: Dir<f64>) -> ([Rgb<f64>; 3], f64) {
        let mut around = [0.0; 3];
        let fcos = self.eval(s, |p, offset, density| around[p] += self.selection.shares(offset)[p] * density);

        for density in &mut around {
            *density *= self.sources[PATHS];
        }
        if let Some(smoothing) = self.glints(s) {
            let phi = s.phi - self.known.phi;
            let bell = |centre: f64| wrapped_gaussian(smoothing.width, wrap_angle(phi - centre));
            around[TRT] += self.sources[GLINTS] * 0.5 * (bell(smoothing.centre) + bell(-smoothing.centre));
        }
        around[TRT] += self.sources[EVEN] / TAU;

        let theta = s.theta();
        let across: f64 = (0..3).map(|p| self.along[p].density(theta) * around[p]).sum();
        (fcos, across / s.cos_theta.max(MIN_COS_S))
    }

    /// The glints that the sampler draws towards the inclination of `s`: those of the circular fiber.
    #[inline]
    fn glints(&self, s: Dir<f64>) -> Option<Smoothing> {
        self.model.caustic.as_ref().map(|caustic| Smoothing::new(caustic, &self.exit_curve(TRT, s)))
    }

    #[inline]
    fn exit_curve(&self, p: usize, s: Dir<f64>) -> ExitCurve {
        ExitCurve::new(self.model.roots, p, inverse_index(self.cos2(s), self.model.eta))
    }

    /// Draws from a source other than the diffuse one; `xi` is what the choice of it left over.
    fn draw(&self, source: usize, xi: f64, u: [f64; DIMS]) -> (Dir<f64>, usize) {
        let (p, offset) = if source == PATHS {
            let offset = Offset::at(2.0 * xi - 1.0);
            (pick(&self.selection.shares(offset), u[1]).0, offset)
        } else {
            (TRT, Offset::at(0.0))
        };
        let mut dir = Dir::new(self.along[p].sample(u[2]), self.known.phi);
        let phi = match source {
            PATHS => self.exit_curve(p, dir).azimuth(offset.gamma),
            GLINTS => self.glints(dir).map_or(0.0, |smoothing| {
                let side = if u[1] < 0.5 { -1.0 } else { 1.0 };
                side * smoothing.centre + smoothing.width * standard_normal(u[3])
            }),
            _ => TAU * u[3] - PI,
        };
        dir.phi += wrap_angle(phi);
        (dir, p)
    }
}

/// [`Marschner`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct MarschnerSetup<F: Real = f32> {
    point: Point,
    diffuse: Rgb<F>,
    /// A white Lambertian fiber: shape and density of the diffuse part.
    fill: LambertianSetup<F>,
}

impl<F: Real> Model<F> for Marschner<F> {
    type Setup = MarschnerSetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> MarschnerSetup<F> {
        MarschnerSetup {
            point: Point::new(self.double(), hit.known.cast()),
            diffuse: self.diffuse,
            fill: Lambertian { albedo: Rgb::white() }.prepare(hit),
        }
    }
}

impl<F: Real> MarschnerSetup<F> {
    /// All lobes together, with the diffuse part of shape `fill`.
    #[inline]
    fn lobes(&self, [r, tt, trt]: [Rgb<f64>; 3], fill: F) -> Lobes<F> {
        Lobes([r.cast(), tt.cast(), trt.cast(), self.diffuse * fill])
    }
}

impl<F: Real> Scatter<F> for MarschnerSetup<F> {
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        self.lobes(self.point.eval(s.cast(), |_, _, _| {}), self.fill.pdf(s))
    }

    fn pdf(&self, s: Dir<F>) -> F {
        self.eval_pdf(s).1
    }

    fn eval_pdf(&self, s: Dir<F>) -> (Lobes<F>, F) {
        let fill = self.fill.pdf(s);
        let (fcos, pdf) = self.point.eval_pdf(s.cast());
        (self.lobes(fcos, fill), F::of(pdf) + F::of(self.point.sources[FILL]) * fill)
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let (source, xi) = pick(&self.point.sources, u[0].f64());
        let (dir, lobe) = if source == FILL {
            let xi = F::of(xi).min(F::ONE_MINUS_EPSILON);
            (self.fill.sample([xi, u[1], u[2], u[3], u[4]])?.dir, RESIDUAL)
        } else {
            let (dir, lobe) = self.point.draw(source, xi, u.map(F::f64));
            (dir.cast(), lobe)
        };
        let (fcos, pdf) = self.eval_pdf(dir);
        finish(dir, fcos, pdf, lobe)
    }
}
