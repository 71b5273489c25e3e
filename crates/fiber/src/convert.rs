//! The closest fiber of another model, so that one scene can be looked at through all of them.
//!
//! [`Fiber::converted`] keeps what two models both have. What a model does not know, it gets from the light of the
//! fiber's lobes at normal incidence: their energies, so that it returns as much light as the original.
//!
//! - Source: this project. Angles are brought to one meaning first: widths and shifts of the lobes in `θ_s`.
//! - Energy: for light across the fiber the albedo is kept to 0.02 per channel (0.05 to and from
//!   [`Marschner`], whose Gaussians are cut at the poles), and to 0.06 at 30 degrees for hair. An albedo below that of
//!   the bare surface (0.075 at an index of 1.55) cannot be had of the models that refract. A fiber that makes light
//!   is first dimmed to make none.
//!
//! What all models are brought to: shifts and widths of R, TT and TRT in `θ_s`, the azimuthal width of R, absorption.
//!
//! | | shifts | widths | around | absorption |
//! |---|---|---|---|---|
//! | d'Eon, fur | `2α, -α, -4α` | `β_m, β_m/2, 2β_m` | `β_n` | `σ_a` (1) |
//! | Chiang | `2α, -α, -4α` | `√v_p` | `s / √(π/8)` (2) | `σ_a` |
//! | Marschner | `2α_p`: `2α, -α, -3α` | `2β_p` | half of the glints' | `σ_a` |
//! | Sadeghi | `2α_p` | `2β_p` | half of the glints' | (3) |
//! | Kajiya-Kay | `2α₁, -α₁, 2α₂` | `1/√(m₁+1)`, half, `1/√(m₂+1)` | 7.5 degrees | (3) |
//! | Hery | `2α₁, -α₁, 2α₂` | `2β₁, β₁, 2β₂` | 7.5 degrees | (3) |
//! | Lambertian | d'Eon's, of -3 degrees | d'Eon's, of 7.5 degrees | 7.5 degrees | (3) |
//!
//! 1. Of fur with a medulla or with more than one layer: (3).
//! 2. The Gaussian that is as high as the logistic distribution of scale `s`.
//! 3. The absorption at which a dielectric cylinder returns what the fiber returns.
//!
//! What is made of that:
//!
//! | | from |
//! |---|---|
//! | d'Eon | width and half the shift of R, width around, absorption, index, whether there is a residual lobe (4) |
//! | Chiang | the same; roughnesses by bisection of the model's own polynomials, within `0..=1` |
//! | Fur | as d'Eon, one layer, no medulla: d'Eon's near field with [`Attenuation::Known`] |
//! | Marschner | half the width and half the shift of R; round; glints twice as wide as around (5) |
//! | Sadeghi | per lobe its energy, half its width and shift; half of the residual light to TT and TRT each (6) |
//! | Kajiya-Kay | highlights R and TRT: energy, `m = 1/width² - 1`, half the shift; everything else is diffuse |
//! | Hery | first lobe R; the second has shift and width of TRT, and everything but R |
//! | Lambertian | the albedo |
//!
//! 4. With the attenuation at the known angle where the original has it there.
//! 5. As strong as keeps the light of TRT, and with a diffuse part for the residual lobe.
//! 6. The backlight is as wide as TT leaves the cylinder, the glints are at the caustic.
//!
//! Lost on the way: the cross-section and the diffuse part of Marschner's model (where a model has no place for it),
//! its norm, modes that make light, the medulla's own light, and how samples are weighted.
//!
//! ```
//! use fiber::convert::Kind;
//! use fiber::{Chiang, Deon, Fiber};
//! use math::Rgb;
//!
//! let hair = Fiber::Deon(Deon::<f64>::with_absorption(Rgb::new(0.2, 0.3, 0.5)));
//! let Fiber::Chiang(chiang) = hair.converted(Kind::Chiang) else { unreachable!() };
//! // The same hair in other words: equal variances, equal absorption.
//! assert!((chiang.variances()[0].sqrt().to_degrees() - 7.5).abs() < 1e-9);
//! assert_eq!(chiang.sigma_a, Rgb::new(0.2, 0.3, 0.5));
//! ```

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use math::{Real, Rgb};

use crate::lobe::attenuation::Optics;
use crate::lobe::longitudinal::deon_widths;
use crate::quadrature::{integrate, rule};
use crate::{
    ArtistLobe, Attenuation, Caustic, Chiang, Deon, Dir, Fiber, Field, Fur, Glint, Hery, HeryLobe, HeryMode, Highlight,
    Hit, KajiyaKay, KajiyaKayMode, Lambertian, Lobes, Marschner, MarschnerNorm, Medulla, Model, R, RESIDUAL, Roots,
    Sadeghi, SadeghiMode, Scatter, TRT, TT, Weights, wrap_angle,
};

/// Which model a fiber is of, without its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// d'Eon et al. 2011.
    Deon,
    /// Chiang et al. 2016.
    Chiang,
    /// An opaque diffuse cylinder.
    Lambertian,
    /// Kajiya & Kay 1989.
    KajiyaKay,
    /// Hery & Ramamoorthi 2012.
    Hery,
    /// Marschner et al. 2003.
    Marschner,
    /// Sadeghi et al. 2010.
    Sadeghi,
    /// Fur with a medulla.
    Fur,
}

impl Kind {
    /// All models, in the order of [`Fiber`].
    pub const ALL: [Self; 8] = [
        Self::Deon,
        Self::Chiang,
        Self::Lambertian,
        Self::KajiyaKay,
        Self::Hery,
        Self::Marschner,
        Self::Sadeghi,
        Self::Fur,
    ];

    /// The model's name, as in scene files: [`Fiber::name`].
    pub fn name(self) -> &'static str {
        match self {
            Self::Deon => "deon",
            Self::Chiang => "chiang",
            Self::Lambertian => "lambertian",
            Self::KajiyaKay => "kajiya_kay",
            Self::Hery => "hery",
            Self::Marschner => "marschner",
            Self::Sadeghi => "sadeghi",
            Self::Fur => "fur",
        }
    }

    /// The model of that name, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

impl<F: Real> Fiber<F> {
    /// Which model it is of.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Deon(_) => Kind::Deon,
            Self::Chiang(_) => Kind::Chiang,
            Self::Lambertian(_) => Kind::Lambertian,
            Self::KajiyaKay(_) => Kind::KajiyaKay,
            Self::Hery(_) => Kind::Hery,
            Self::Marschner(_) => Kind::Marschner,
            Self::Sadeghi(_) => Kind::Sadeghi,
            Self::Fur(_) => Kind::Fur,
        }
    }

    /// The closest fiber of the model `to`; itself, if it is of that model. See [`convert`](crate::convert).
    pub fn converted(&self, to: Kind) -> Self {
        if self.kind() == to { *self } else { Look::of(&self.cast()).fiber(to).cast() }
    }
}

/// Azimuthal and longitudinal width where a model has none, radians.
const WIDTH: f64 = 7.5 * PI / 180.0;
/// Tilt of the scales where a model has none, radians.
const TILT: f64 = -3.0 * PI / 180.0;
/// Index where a model has none.
const ETA: f64 = 1.55;
/// `√(π/8)`: scale of the logistic distribution as high as a Gaussian of standard deviation 1.
const LOGISTIC: f64 = 0.626_657_068_657_750_1;
/// Absorption beyond this is black.
const BLACKEST: f64 = 100.0;
/// Nodes over one half of the cross-section.
const OFFSETS: usize = 48;

/// What a fiber looks like, whatever its model.
struct Look {
    eta: f64,
    sigma_a: Rgb<f64>,
    /// Share of light across the fiber that leaves by each lobe.
    energies: [Rgb<f64>; 4],
    /// Standard deviations of R, TT, TRT in `θ_s`, radians.
    widths: [f64; 3],
    /// Where R, TT, TRT lie relative to `-θ_k`, radians.
    shifts: [f64; 3],
    /// Azimuthal standard deviation of R, radians.
    beta_n: f64,
    residual: bool,
    attenuation: Attenuation,
    field: Field,
}

impl Look {
    fn of(fiber: &Fiber<f64>) -> Self {
        let mut look = match fiber {
            Fiber::Deon(m) => Self {
                attenuation: m.attenuation,
                field: m.field,
                ..Self::dielectric(m.eta, m.sigma_a, m.beta_m, m.beta_n, m.alpha, m.residual)
            },
            Fiber::Chiang(m) => {
                let [width, ..] = m.variances().map(f64::sqrt);
                let beta_n = m.azimuthal_scale() / LOGISTIC;
                let look = Self::dielectric(m.eta, m.sigma_a, width, beta_n, m.alpha, true);
                Self { attenuation: Attenuation::Known, field: m.field, ..look }
            }
            Fiber::Fur(m) => Self::of_fur(m),
            Fiber::Marschner(m) => {
                let glint = m.caustic.unwrap_or_default().width;
                let residual = !m.diffuse.is_black();
                let mut look = Self::dielectric(m.eta, m.sigma_a, 2.0 * m.beta_m, 0.5 * glint, m.alpha, residual);
                look.energies[RESIDUAL] = m.diffuse;
                Self { shifts: m.shifts().map(|shift| 2.0 * shift), ..look }
            }
            Fiber::Sadeghi(m) => Self {
                widths: m.lobes.map(|lobe| 2.0 * lobe.width),
                shifts: m.lobes.map(|lobe| 2.0 * lobe.shift),
                beta_n: 0.5 * m.glint.width,
                ..Self::painted(of_sadeghi(m))
            },
            Fiber::KajiyaKay(m) => {
                let [first, second] = m.highlights;
                let width = |highlight: Highlight<f64>| (highlight.exponent.max(0.0) + 1.0).recip().sqrt();
                let second = (!second.color.is_black()).then(|| [width(second), 2.0 * second.shift]);
                let look = Self::painted(measured(&m.prepare(&across())));
                look.with_highlights([width(first), 2.0 * first.shift], second)
            }
            Fiber::Hery(m) => {
                let [first, second] = m.lobes;
                let second = (!second.tint.is_black()).then_some([2.0 * second.beta, 2.0 * second.alpha]);
                let look = Self::painted(measured(&m.prepare(&across())));
                look.with_highlights([2.0 * first.beta, 2.0 * first.alpha], second)
            }
            Fiber::Lambertian(m) => Self::painted(Lobes::only(RESIDUAL, m.albedo).0),
        };
        look.energies = passive(look.energies);
        look
    }

    /// A cylinder that refracts.
    fn dielectric(eta: f64, sigma_a: Rgb<f64>, beta_m: f64, beta_n: f64, alpha: f64, residual: bool) -> Self {
        let mut energies = cross_section(eta, sigma_a);
        if !residual {
            energies[RESIDUAL] = Rgb::black();
        }
        let [r, tt, trt, _] = deon_widths(beta_m);
        Self {
            eta,
            sigma_a,
            energies,
            widths: [r, tt, trt],
            shifts: [2.0 * alpha, -alpha, -4.0 * alpha],
            beta_n,
            residual,
            attenuation: Attenuation::default(),
            field: Field::default(),
        }
    }

    /// A fiber of which only these energies are known.
    fn painted(energies: [Rgb<f64>; 4]) -> Self {
        let energies = passive(energies);
        let sigma_a = absorption(total(&energies), ETA);
        Self { energies, ..Self::dielectric(ETA, sigma_a, WIDTH, WIDTH, TILT, true) }
    }

    /// With highlights whose width and shift in `θ_s` are given; a second one that is missing lies where d'Eon has it.
    fn with_highlights(self, first: [f64; 2], second: Option<[f64; 2]>) -> Self {
        let [width, shift] = first;
        let [second_width, second_shift] = second.unwrap_or([2.0 * width, -2.0 * shift]);
        Self { widths: [width, 0.5 * width, second_width], shifts: [shift, -0.5 * shift, second_shift], ..self }
    }

    fn of_fur(m: &Fur<f64>) -> Self {
        let hollow = m.medulla.radius <= 0.0 || (m.medulla.scattering <= 0.0 && m.medulla.absorption.is_black());
        let energies = half_section(|gamma| m.prepare(&Hit::new(Dir::new(0.0, 0.0), gamma.sin())).energies().0);
        // Without a medulla that does anything, the cortex' absorption is that of d'Eon.
        let plain = hollow && m.layers <= 1.0;
        let sigma_a = if plain { m.sigma_a } else { absorption(total(&energies), m.eta) };
        let look = Self::dielectric(m.eta, sigma_a, m.beta_m, m.beta_n, m.alpha, true);
        Self { energies, attenuation: Attenuation::Known, ..look }
    }

    fn fiber(&self, to: Kind) -> Fiber<f64> {
        let (beta_m, alpha) = (self.widths[R], 0.5 * self.shifts[R]);
        let (eta, sigma_a, beta_n) = (self.eta, self.sigma_a, self.beta_n);
        match to {
            Kind::Deon => Fiber::Deon(Deon {
                eta,
                sigma_a,
                beta_m,
                beta_n,
                alpha,
                residual: self.residual,
                attenuation: self.attenuation,
                weights: Weights::default(),
                field: self.field,
            }),
            Kind::Chiang => {
                let hair = Chiang { alpha, eta, field: self.field, ..Chiang::with_absorption(sigma_a) };
                let along = |beta_m: f64| Chiang { beta_m, ..hair }.variances()[R].sqrt();
                let around = |beta_n: f64| Chiang { beta_n, ..hair }.azimuthal_scale() / LOGISTIC;
                Fiber::Chiang(Chiang { beta_m: inverse(beta_m, along), beta_n: inverse(beta_n, around), ..hair })
            }
            Kind::Fur => Fiber::Fur(Fur { eta, sigma_a, beta_m, beta_n, alpha, layers: 1.0, medulla: Medulla::none() }),
            Kind::Marschner => Fiber::Marschner(self.marschner()),
            Kind::Sadeghi => Fiber::Sadeghi(self.sadeghi()),
            Kind::KajiyaKay => {
                let highlight = |p: usize| Highlight {
                    color: self.energies[p],
                    exponent: (self.widths[p].powi(-2) - 1.0).max(0.0),
                    shift: 0.5 * self.shifts[p],
                };
                Fiber::KajiyaKay(KajiyaKay {
                    diffuse: self.energies[TT] + self.energies[RESIDUAL],
                    highlights: [highlight(R), highlight(TRT)],
                    mode: KajiyaKayMode::Normalised,
                })
            }
            Kind::Hery => {
                let lobe = |p: usize, tint: Rgb<f64>| HeryLobe {
                    tint,
                    beta: 0.5 * self.widths[p],
                    alpha: 0.5 * self.shifts[p],
                };
                let rest = self.energies[TT] + self.energies[TRT] + self.energies[RESIDUAL];
                Fiber::Hery(Hery {
                    lobes: [lobe(R, self.energies[R]), lobe(TRT, rest)],
                    mode: HeryMode::Truncated,
                    cos_theta_d: false,
                })
            }
            Kind::Lambertian => Fiber::Lambertian(Lambertian { albedo: total(&self.energies) }),
        }
    }

    fn marschner(&self) -> Marschner<f64> {
        let energies = cross_section(self.eta, self.sigma_a);
        let caustic = Caustic { width: 2.0 * self.beta_n, ..Caustic::default() };
        let with_strength = |strength: f64| Marschner {
            eta: self.eta,
            sigma_a: self.sigma_a,
            beta_m: 0.5 * self.widths[R],
            alpha: 0.5 * self.shifts[R],
            eccentricity: 1.0,
            roots: Roots::default(),
            norm: MarschnerNorm::Normalised,
            caustic: Some(Caustic { strength, ..caustic }),
            diffuse: if self.residual { energies[RESIDUAL] } else { Rgb::black() },
        };
        // The light of TRT is straight in the strength of its glints.
        let light = |strength: f64| {
            let model = with_strength(strength);
            2.0 * integrate(0.0, PI, 96, |phi| model.azimuthal(1.0, phi, 0.0)[TRT].luminance())
        };
        let (without, with) = (light(0.0), light(1.0));
        if with - without > 1e-9 {
            let strength = (energies[TRT].luminance() - without) / (with - without);
            with_strength(strength.clamp(0.0, 5.0))
        } else {
            with_strength(caustic.strength)
        }
    }

    fn sadeghi(&self) -> Sadeghi<f64> {
        let lobe = |p: usize| {
            let rest = if p == R { 0.0 } else { 0.5 };
            let energy = self.energies[p] + self.energies[RESIDUAL] * rest;
            let intensity = energy.max_channel();
            let color = if intensity > 0.0 { energy / intensity } else { Rgb::black() };
            ArtistLobe { color, intensity, shift: 0.5 * self.shifts[p], width: 0.5 * self.widths[p] }
        };
        let optics = Optics::new(1.0, self.eta);
        let glint = Glint { width: 2.0 * self.beta_n, ..Glint::default() };
        let glint = match optics.turning_point(TRT) {
            Some(gamma) => Glint { angle: wrap_angle(optics.exit_azimuth(TRT, gamma)).abs(), ..glint },
            // No caustic, no glints.
            None => Glint { intensity: 0.0, ..glint },
        };
        Sadeghi {
            lobes: [lobe(R), lobe(TT), lobe(TRT)],
            tt_azimuthal_width: self.backlight(&optics),
            glint,
            mode: SadeghiMode::Normalised,
        }
    }

    /// Standard deviation around the far side of the light that leaves by TT, radians.
    fn backlight(&self, optics: &Optics<f64>) -> f64 {
        let [light, spread, ..] = half_section(|gamma| {
            let path = optics.path_at(gamma.sin());
            // The darkest hair has a width too.
            let light = path.attenuation(self.sigma_a)[TT].max_channel().max(1e-12);
            let bend = path.exit_azimuth(TT) - PI;
            let [light, spread] = [light, light * bend * bend].map(Rgb::splat);
            [light, spread, Rgb::black(), Rgb::black()]
        });
        (spread[0] / light[0] + (0.5 * self.beta_n).powi(2)).sqrt()
    }
}

/// Light comes from across the fiber.
fn across() -> Hit<f64> {
    Hit::new(Dir::new(0.0, 0.0), 0.0)
}

/// `∫ f(γ) cos γ dγ` over the half of the cross-section with `γ > 0`: the mean over the offset of what is even in it.
fn half_section(f: impl Fn(f64) -> [Rgb<f64>; 4]) -> [Rgb<f64>; 4] {
    let mut sum = Lobes::<f64>::zero();
    for &(x, weight) in rule(OFFSETS) {
        let gamma = FRAC_PI_4 * (1.0 + x);
        let weight = FRAC_PI_4 * weight * gamma.cos();
        for (p, lobe) in f(gamma).into_iter().enumerate() {
            sum[p] += lobe * weight;
        }
    }
    sum.0
}

/// Energies of the lobes of a dielectric cylinder for light across it.
fn cross_section(eta: f64, sigma_a: Rgb<f64>) -> [Rgb<f64>; 4] {
    let optics = Optics::new(1.0, eta);
    half_section(|gamma| optics.path_at(gamma.sin()).attenuation(sigma_a))
}

/// Energies of the lobes of a model whose azimuths are cosines of the half angle or even.
fn measured(point: &impl Scatter<f64>) -> [Rgb<f64>; 4] {
    let mut sum = Lobes::<f64>::zero();
    // As fine along the fiber as the narrowest lobes of hair need.
    for &(x, along) in rule(192) {
        let theta = FRAC_PI_2 * x;
        for &(y, around) in rule(8) {
            let phi = FRAC_PI_2 * (1.0 + y);
            // Both halves of the turn are alike.
            let weight = 2.0 * FRAC_PI_2 * FRAC_PI_2 * along * around * theta.cos();
            let value = point.eval(Dir::new(theta, phi));
            for p in [R, TT, TRT, RESIDUAL] {
                sum[p] += value[p] * weight;
            }
        }
    }
    sum.0
}

fn of_sadeghi(m: &Sadeghi<f64>) -> [Rgb<f64>; 4] {
    let heights = match m.mode {
        SadeghiMode::Normalised => [1.0; 3],
        SadeghiMode::Legacy => m.energies(0.0),
    };
    let [r, tt, trt] = [R, TT, TRT].map(|p| m.lobes[p].color * (m.lobes[p].intensity * heights[p]));
    [r, tt, trt, Rgb::black()]
}

fn total(energies: &[Rgb<f64>; 4]) -> Rgb<f64> {
    energies.iter().copied().sum()
}

/// Dimmed, channel by channel, where there is more light than arrives.
fn passive(energies: [Rgb<f64>; 4]) -> [Rgb<f64>; 4] {
    let energies = energies.map(|energy| energy.map(|x| x.max(0.0)));
    let excess = total(&energies).map(|all| all.max(1.0));
    energies.map(|energy| energy / excess)
}

/// The absorption at which a dielectric cylinder returns this share of light across it: 0 where it never returns so
/// much, nearly black where it always returns more.
fn absorption(albedo: Rgb<f64>, eta: f64) -> Rgb<f64> {
    let returned = |sigma_a: Rgb<f64>| total(&cross_section(eta, sigma_a));
    // In the logarithm, all channels at once.
    let (mut low, mut high) = (Rgb::splat(1e-6_f64.ln()), Rgb::splat(BLACKEST.ln()));
    for _ in 0..45 {
        let middle = (low + high) * 0.5;
        let found = returned(middle.map(f64::exp));
        for channel in 0..3 {
            if found[channel] > albedo[channel] {
                low[channel] = middle[channel];
            } else {
                high[channel] = middle[channel];
            }
        }
    }
    let white = returned(Rgb::black());
    let mut sigma_a = high.map(f64::exp);
    for channel in 0..3 {
        if albedo[channel] >= white[channel] {
            sigma_a[channel] = 0.0;
        }
    }
    sigma_a
}

/// Where in `0..=1` a rising function has this value; the nearer end where it has not.
fn inverse(value: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) < value {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}
