//! Sadeghi et al. 2010: the artist-friendly model, three lobes with a knob for everything one sees.
//!
//! - Source: Sadeghi et al. 2010 as given by Hunz 2016, section 3.4, with the azimuths wrapped and the signs
//!   and widths in the Gaussians put right; normalisation, sampler and density: this project.
//! - Field: far.
//! - Energy: [`Normalised`](SadeghiMode::Normalised): every lobe returns exactly `color * intensity`.
//!   [`Legacy`](SadeghiMode::Legacy): nothing is conserved; white lobes with the default intensities return
//!   2.5 times the light seen straight on, and 3.2 times at 80 degrees.
//! - Reciprocal in the legacy mode. The normalisation depends on the known direction and breaks that.
//!
//! | symbol | meaning |
//! |---|---|
//! | `θ_h`, `θ_d` | half angle `(θ_s + θ_k)/2`, half difference `(θ_s - θ_k)/2` |
//! | `C_p`, `I_p` | colour and intensity of lobe `p` |
//! | `α_p`, `β_p` | its shift and width in `θ_h` |
//! | `M'_p` | Gaussian of height 1 in `θ_h - α_p` |
//! | `N'_p` | `cos(φ/2)`; a Gaussian around `π`; `cos(φ/2)` and a Gaussian around either glint |
//! | `I_N,p` | `∫ N'_p dφ` over a turn |
//! | `E_p` | `I_N,p ∫ M'_p cos² θ_s / cos² θ_d dθ_s`, the energy of `M'_p N'_p / cos² θ_d` |

use math::{Real, Rgb, hash, normal};

use super::{DIMS, Lobes, Model, R, Sample, Scatter, TRT, TT, finish};
use crate::lobe::longitudinal::Truncated;
use crate::quadrature::rule;
use crate::{Dir, Hit};

/// Which of the two forms of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SadeghiMode {
    /// Every lobe returns `color * intensity` of the light, whatever its shape; conserves energy where the
    /// intensities add up to at most 1. Not reciprocal.
    #[default]
    Normalised,
    /// As published: Gaussians of height 1, so that the width of a highlight leaves its brightness alone.
    /// Reciprocal, but conserves nothing.
    Legacy,
}

/// One of the three highlights, as an artist sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArtistLobe<F = f32> {
    /// Colour, `0..=1`.
    pub color: Rgb<F>,
    /// Intensity, `>= 0`: the share of the light that comes back when normalised, the height of the lobe in
    /// the legacy mode.
    pub intensity: F,
    /// Position along the fiber: shift `α_p` of the half angle, radians, within ±15 degrees on hair; negative is
    /// towards the root. The highlight moves by twice that.
    pub shift: F,
    /// Width along the fiber: standard deviation `β_p` of the half angle, radians, `> 0`. The highlight is
    /// twice as wide.
    pub width: F,
}

/// The two bright spots of the secondary highlight, either side of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glint<F = f32> {
    /// Height of the spots relative to the rest of the secondary highlight, `>= 0`; 0 is none.
    pub intensity: F,
    /// Azimuthal width: standard deviation, radians, `> 0`.
    pub width: F,
    /// Half the angle between the two, radians, `0..=π`. One value looks combed; see
    /// [`angle_of_strand`](Self::angle_of_strand).
    pub angle: F,
}

impl<F: Real> Glint<F> {
    /// The angle for one strand of many: even between 30 and 45 degrees, always the same for the same strand
    /// and seed. Radians.
    ///
    /// Source: Sadeghi et al. 2010, which vary it per strand; the thesis prints the two ends only.
    pub fn angle_of_strand(strand: u32, seed: u32) -> F {
        F::of((30.0 + 15.0 * f64::from(hash::unit(strand, seed))).to_radians())
    }
}

impl<F: Real> Default for Glint<F> {
    /// As high as the rest, 5 degrees wide, 45 degrees to either side (the thesis' angle; the other two are
    /// this project's choice).
    fn default() -> Self {
        Self { intensity: F::one(), width: F::of(5.0_f64.to_radians()), angle: F::of(45.0_f64.to_radians()) }
    }
}

/// The model of Sadeghi et al.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sadeghi<F = f32> {
    /// Primary highlight R, backlight TT, secondary highlight TRT.
    pub lobes: [ArtistLobe<F>; 3],
    /// Azimuthal width of the backlight: standard deviation, radians, `> 0`.
    pub tt_azimuthal_width: F,
    /// Glints of the secondary highlight.
    pub glint: Glint<F>,
    /// Normalised or legacy.
    pub mode: SadeghiMode,
}

impl<F: Real> Default for Sadeghi<F> {
    /// White lobes where Marschner's model has them.
    ///
    /// Shifts and widths from table 1 of Hunz 2016 (`α_R` -5 and `β_R` 7.5 degrees), intensities 0.45 and 0.3
    /// of R and TRT from its figure 32; TT has what is left to 1. The backlight is 10 degrees wide.
    fn default() -> Self {
        Self::with_colors(Rgb::white(), Rgb::white(), Rgb::white())
    }
}

impl<F: Real> Sadeghi<F> {
    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> Sadeghi<G> {
        let of = |x: F| G::of(x.f64());
        Sadeghi {
            lobes: self.lobes.map(|lobe| ArtistLobe {
                color: lobe.color.cast(),
                intensity: of(lobe.intensity),
                shift: of(lobe.shift),
                width: of(lobe.width),
            }),
            tt_azimuthal_width: of(self.tt_azimuthal_width),
            glint: Glint {
                intensity: of(self.glint.intensity),
                width: of(self.glint.width),
                angle: of(self.glint.angle),
            },
            mode: self.mode,
        }
    }

    /// The default in colours: of the primary highlight, the backlight and the secondary highlight, `0..=1`.
    pub fn with_colors(primary: Rgb<F>, backlight: Rgb<F>, secondary: Rgb<F>) -> Self {
        let (alpha, beta) = ((-5.0_f64).to_radians(), 7.5_f64.to_radians());
        let lobe = |color: Rgb<F>, intensity: f64, shift: f64, width: f64| ArtistLobe {
            color,
            intensity: F::of(intensity),
            shift: F::of(shift * alpha),
            width: F::of(width * beta),
        };
        Self {
            lobes: [lobe(primary, 0.45, 1.0, 1.0), lobe(backlight, 0.25, -0.5, 0.5), lobe(secondary, 0.3, -1.5, 2.0)],
            tt_azimuthal_width: F::of(10.0_f64.to_radians()),
            glint: Glint::default(),
            mode: SadeghiMode::Normalised,
        }
    }

    /// `I_N,p`: the integral of every lobe's azimuthal factor over a turn, radians.
    pub fn azimuthal_integrals(&self) -> [F; 3] {
        let model = self.tamed();
        let root = std::f64::consts::TAU.sqrt();
        let (tt, glint) = (model.tt_azimuthal_width.f64(), model.glint.width.f64());
        let (a, b) = model.glint_limits();
        [
            F::of(4.0),
            F::of(tt * root * (1.0 - 2.0 * normal::cdf(-std::f64::consts::PI / tt))),
            F::of(4.0 + 2.0 * model.glint.intensity.f64() * glint * root * (normal::cdf(b) - normal::cdf(a))),
        ]
    }

    /// `E_p`: what every lobe would return with colour and intensity 1 and without normalisation, for light
    /// from (or a view along) the inclination `theta_k`, radians.
    ///
    /// By 32 nodes. Relative error for the widths of hair: below 1e-7 to 85 degrees, below 1e-3 up to the poles;
    /// below 1e-2 for any width.
    pub fn energies(&self, theta_k: F) -> [F; 3] {
        let model = self.tamed();
        let around = model.azimuthal_integrals();
        std::array::from_fn(|p| around[p] * model.longitudinal_energy(p, theta_k))
    }

    /// Parameters within their ranges, so that nothing divides by zero.
    fn tamed(&self) -> Self {
        let least = F::of(MIN_WIDTH);
        let mut model = *self;
        for lobe in &mut model.lobes {
            lobe.width = lobe.width.max(least);
        }
        model.tt_azimuthal_width = model.tt_azimuthal_width.max(least);
        model.glint = Glint {
            intensity: model.glint.intensity.max(F::zero()),
            width: model.glint.width.max(least),
            angle: model.glint.angle.clamp_to(F::zero(), F::PI()),
        };
        model
    }

    /// The ends of the half turn `[0, π]`, seen from a glint, in its widths.
    fn glint_limits(&self) -> (f64, f64) {
        let (angle, width) = (self.glint.angle.f64(), self.glint.width.f64());
        (-angle / width, (std::f64::consts::PI - angle) / width)
    }

    /// Where `M'_p` is centred in `θ_s`.
    ///
    /// A normalised lobe whose cone lies far beyond a pole would be all noise: it stays three widths away.
    /// The widths and shifts of hair bring a cone two widths beyond at most.
    fn centre(&self, p: usize, theta_k: F) -> F {
        let lobe = &self.lobes[p];
        let centre = F::of(2.0) * lobe.shift - theta_k;
        match self.mode {
            SadeghiMode::Legacy => centre,
            SadeghiMode::Normalised => {
                let most = F::half_pi() + F::of(6.0) * lobe.width;
                centre.clamp_to(-most, most)
            }
        }
    }

    /// `∫ M'_p cos² θ_s / cos² θ_d dθ_s` over the sphere, restricted to where the Gaussian is.
    fn longitudinal_energy(&self, p: usize, theta_k: F) -> F {
        let width = F::of(2.0) * self.lobes[p].width;
        let centre = self.centre(p, theta_k);
        // Beyond a pole only the Gaussian's flank is left, and it falls off sooner than the middle.
        let beyond = (centre.abs() - F::half_pi()).max(F::zero());
        let reach = (beyond.sqr() + (F::of(6.0) * width).sqr()).sqrt() - beyond;
        let peak = centre.clamp_to(-F::half_pi(), F::half_pi());
        let from = (peak - reach).max(-F::half_pi());
        let to = (peak + reach).min(F::half_pi());
        let (middle, half) = (F::of(0.5) * (from + to), F::of(0.5) * (to - from));
        let mut sum = F::zero();
        for &(x, w) in rule(32) {
            let theta = middle + half * F::of(x);
            sum += F::of(w) * bell((theta - centre) / width) * theta.cos().sqr() / cos2_d(theta_k, theta);
        }
        half * sum
    }
}

/// [`Sadeghi`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct SadeghiSetup<F: Real = f32> {
    hit: Hit<F>,
    theta_k: F,
    lobes: [LobeSetup<F>; 3],
    tt_azimuthal_width: F,
    glint: Glint<F>,
    /// The ends of the half turn in widths of a glint.
    glint_limits: (f64, f64),
    /// Probability that a draw from TRT goes to a glint.
    glint_share: F,
}

#[derive(Clone, Copy, Debug)]
struct LobeSetup<F: Real> {
    /// `C_p I_p`, over `E_p` when normalised.
    gain: Rgb<F>,
    /// Centre and standard deviation of `M'_p` in `θ_s`.
    centre: F,
    width: F,
    /// What the inclination is drawn from.
    truncated: Truncated<F>,
    /// Probability of drawing from this lobe.
    share: F,
    /// That over `I_N,p`.
    density: F,
}

/// Least width, radians: the same 0.02 degrees as elsewhere in the crate.
const MIN_WIDTH: f64 = 3.5e-4;

/// Nearer to a pole, in the cosine, nothing is drawn, and the density's denominator is kept here.
const COS_FLOOR: f64 = 1e-6;

impl<F: Real> Model<F> for Sadeghi<F> {
    type Setup = SadeghiSetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> SadeghiSetup<F> {
        let model = self.tamed();
        let theta_k = hit.known.theta();
        let around = model.azimuthal_integrals();

        // In proportion to what the lobes return, roughly in the legacy mode.
        let mut shares: [F; 3] = std::array::from_fn(|p| {
            let lobe = &model.lobes[p];
            let light = lobe.color.luminance() * lobe.intensity;
            match model.mode {
                SadeghiMode::Normalised => light,
                SadeghiMode::Legacy => light * around[p] * lobe.width,
            }
        });
        let total = shares[R] + shares[TT] + shares[TRT];
        shares = if total > F::zero() { shares.map(|x| x / total) } else { [F::one(), F::zero(), F::zero()] };

        let lobes = std::array::from_fn(|p| {
            let lobe = &model.lobes[p];
            let gain = lobe.color * lobe.intensity;
            let gain = match model.mode {
                SadeghiMode::Legacy => gain,
                SadeghiMode::Normalised if gain.is_black() => gain,
                SadeghiMode::Normalised => {
                    let energy = around[p] * model.longitudinal_energy(p, theta_k);
                    if energy > F::zero() { gain / energy } else { Rgb::black() }
                }
            };
            LobeSetup {
                gain,
                centre: model.centre(p, theta_k),
                width: F::of(2.0) * lobe.width,
                truncated: Truncated::new(F::of(2.0) * lobe.shift - theta_k, lobe.width),
                share: shares[p],
                density: shares[p] / around[p],
            }
        });
        SadeghiSetup {
            hit: *hit,
            theta_k,
            lobes,
            tt_azimuthal_width: model.tt_azimuthal_width,
            glint: model.glint,
            glint_limits: model.glint_limits(),
            glint_share: (around[TRT] - around[R]) / around[TRT],
        }
    }
}

impl<F: Real> SadeghiSetup<F> {
    /// `N'_p` towards `s`. The azimuth enters by its magnitude alone: the model is bilaterally symmetric.
    #[inline]
    fn around(&self, s: Dir<F>) -> [F; 3] {
        let phi = self.hit.azimuth(s).abs();
        let base = (F::of(0.5) * phi).cos().max(F::zero());
        let backlight = bell((F::PI() - phi) / self.tt_azimuthal_width);
        let glint = self.glint.intensity * bell((phi - self.glint.angle) / self.glint.width);
        [base, backlight, base + glint]
    }

    #[inline]
    fn value(&self, s: Dir<F>, theta: F, around: [F; 3]) -> Lobes<F> {
        let cosines = s.cos_theta / cos2_d(self.theta_k, theta);
        let mut lobes = Lobes::zero();
        for (p, lobe) in self.lobes.iter().enumerate() {
            if lobe.share > F::zero() {
                lobes[p] = lobe.gain * (bell((theta - lobe.centre) / lobe.width) * around[p] * cosines);
            }
        }
        lobes
    }

    #[inline]
    fn density(&self, s: Dir<F>, theta: F, around: [F; 3]) -> F {
        let mut sum = F::zero();
        for (lobe, n) in self.lobes.iter().zip(around) {
            if lobe.share > F::zero() {
                sum += lobe.density * n * lobe.truncated.density(theta);
            }
        }
        sum / s.cos_theta.max(F::of(COS_FLOOR))
    }

    /// The lobe for a uniform number: always one that has a share.
    #[inline]
    fn pick(&self, xi: F) -> usize {
        let (mut picked, mut left) = (R, xi);
        for (p, lobe) in self.lobes.iter().enumerate() {
            if lobe.share > F::zero() {
                picked = p;
                if left < lobe.share {
                    break;
                }
                left -= lobe.share;
            }
        }
        picked
    }
}

impl<F: Real> Scatter<F> for SadeghiSetup<F> {
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        self.value(s, s.theta(), self.around(s))
    }

    fn pdf(&self, s: Dir<F>) -> F {
        self.density(s, s.theta(), self.around(s))
    }

    fn eval_pdf(&self, s: Dir<F>) -> (Lobes<F>, F) {
        let (theta, around) = (s.theta(), self.around(s));
        (self.value(s, theta, around), self.density(s, theta, around))
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let lobe = self.pick(u[0]);
        let theta = self.lobes[lobe].truncated.sample(u[1]);
        let phi = if lobe == TT {
            let end = std::f64::consts::PI / self.tt_azimuthal_width.f64();
            F::PI() + self.tt_azimuthal_width * F::of(cut_normal(-end, end, u[2].f64()))
        } else if lobe == TRT && u[3] < self.glint_share {
            let (a, b) = self.glint_limits;
            let side = self.glint.angle + self.glint.width * F::of(cut_normal(a, b, u[2].f64()));
            if u[3] < F::of(0.5) * self.glint_share { side } else { -side }
        } else {
            // cos(φ/2) has the distribution function (1 + sin(φ/2))/2.
            F::of(2.0) * (F::of(2.0) * u[2] - F::one()).safe_asin()
        };
        let dir = Dir::new(theta, self.hit.known.phi + phi);
        if dir.cos_theta < F::of(COS_FLOOR) {
            return None;
        }
        let (fcos, pdf) = self.eval_pdf(dir);
        finish(dir, fcos, pdf, lobe)
    }
}

/// A Gaussian of height 1 and standard deviation 1.
#[inline]
fn bell<F: Real>(x: F) -> F {
    (F::of(-0.5) * x.sqr()).exp()
}

/// `cos² θ_d`, kept off zero.
#[inline]
fn cos2_d<F: Real>(theta_k: F, theta_s: F) -> F {
    (F::of(0.5) * (theta_s - theta_k)).cos().sqr().max(F::of(1e-10))
}

/// A draw from a standard normal cut to `[a, b]`, which contains 0.
#[inline]
fn cut_normal(a: f64, b: f64, xi: f64) -> f64 {
    let (below, above) = (normal::cdf(a), normal::cdf(b));
    normal::quantile(below + xi * (above - below)).clamp(a, b)
}
