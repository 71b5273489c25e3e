//! Absorption inside the fiber, from what artists know: pigments or a colour.
//!
//! Unit throughout: optical depth per fiber *radius*, so that no scene scale is needed; light that
//! crosses one radius keeps `exp(-sigma)` of its power, per linear Rec.709 channel.

use math::{Real, Rgb};

/// Which published triplets turn pigment concentrations into absorption.
///
/// Equal concentrations are not equal colours between the two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MelaninConstants {
    /// d'Eon et al. 2011, used by pbrt-v4 and Mitsuba 3: eumelanin (0.419, 0.697, 1.37), pheomelanin
    /// (0.187, 0.4, 1.05).
    #[default]
    Pbrt,
    /// Blender Cycles: eumelanin (0.506, 0.841, 1.653), pheomelanin (0.343, 0.733, 1.924).
    Cycles,
}

impl MelaninConstants {
    /// `[eumelanin, pheomelanin]` absorption per unit of concentration.
    pub fn triplets(self) -> [[f64; 3]; 2] {
        match self {
            Self::Pbrt => [[0.419, 0.697, 1.37], [0.187, 0.4, 1.05]],
            Self::Cycles => [[0.506, 0.841, 1.653], [0.343, 0.733, 1.924]],
        }
    }
}

/// From pigment concentrations, both `>= 0` and dimensionless; about 8 of eumelanin is black, 1.3 brown,
/// 0.3 blonde; pheomelanin adds red.
#[inline]
pub fn from_melanin<F: Real>(eumelanin: F, pheomelanin: F, constants: MelaninConstants) -> Rgb<F> {
    let [e, p] = constants.triplets().map(|t| Rgb(t.map(F::of)));
    e * eumelanin + p * pheomelanin
}

/// From Cycles' controls: `melanin` in `[0, 1]` (0.25 blonde, 0.5 reddish, 0.75 brown, 1 black) and
/// `redness` in `[0, 1]`, the share of pheomelanin.
#[inline]
pub fn from_cycles_melanin<F: Real>(melanin: F, redness: F) -> Rgb<F> {
    from_cycles_melanin_with(melanin, redness, MelaninConstants::Cycles)
}

/// [`from_cycles_melanin`] with other triplets.
#[inline]
pub fn from_cycles_melanin_with<F: Real>(melanin: F, redness: F, constants: MelaninConstants) -> Rgb<F> {
    let amount = -(F::one() - melanin).max(F::of(1e-4)).ln();
    from_melanin(amount * (F::one() - redness), amount * redness, constants)
}

/// From the colour that a dense groom shows after multiple scattering, for a fiber of azimuthal
/// roughness `beta_n` (Chiang's, in `[0, 1]`); the colour is clamped into `[1e-4, 1 - 1e-4]`.
///
/// Source: the fit of Chiang et al. 2016.
#[inline]
pub fn from_color<F: Real>(color: Rgb<F>, beta_n: F) -> Rgb<F> {
    let fit = [5.969, -0.215, 2.532, -10.73, 5.574, 0.245];
    let scale = fit.iter().rev().fold(F::zero(), |acc, &c| acc * beta_n + F::of(c));
    color.map(|c| (c.clamp_to(F::of(1e-4), F::of(1.0 - 1e-4)).ln() / scale).sqr())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pigments_absorb_blue_most_and_add_up() {
        for constants in [MelaninConstants::Pbrt, MelaninConstants::Cycles] {
            let s = from_melanin(1.0_f64, 0.0, constants);
            assert!(s[0] < s[1] && s[1] < s[2]);
            let both = from_melanin(0.5, 2.0, constants);
            let apart = from_melanin(0.5, 0.0, constants) + from_melanin(0.0, 2.0, constants);
            assert!((both - apart).0.iter().all(|d: &f64| d.abs() < 1e-15));
        }
        assert!(from_melanin(1.0_f64, 0.0, MelaninConstants::Pbrt) != from_melanin(1.0, 0.0, MelaninConstants::Cycles));
    }

    #[test]
    fn darker_colours_absorb_more() {
        let light = from_color(Rgb::splat(0.8_f64), 0.3);
        let dark = from_color(Rgb::splat(0.2_f64), 0.3);
        assert!(light[0] < dark[0]);
        // β_N = 0: the fit's constant term alone, (ln 0.5 / 5.969)².
        let half = from_color(Rgb::splat(0.5_f64), 0.0);
        assert!((half[1] - (0.5_f64.ln() / 5.969).powi(2)).abs() < 1e-15);
        assert!(from_color(Rgb::splat(0.0_f64), 0.3).is_finite());
    }

    #[test]
    fn cycles_controls_reach_black_without_infinity() {
        let black = from_cycles_melanin(1.0_f64, 0.0);
        assert!((black[0] - 1e-4_f64.ln().abs() * 0.506).abs() < 1e-12);
        assert_eq!(from_cycles_melanin(0.0_f64, 0.7), Rgb::black());
    }
}
