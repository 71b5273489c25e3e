//! The caustic of TRT and its smoothing.
//!
//! Where `Φ(2, γ)` turns back, two roots meet and the light per azimuth becomes infinite, though not its
//! integral. Real fibers are not that regular: Marschner et al. take the peaks out and put Gaussians, the
//! glints, in their place.
//!
//! - Source: Marschner et al. 2003; Hunz 2016, Algorithm 1, with the angle, the azimuth and the curvature of
//!   the fold all taken from the curve that gives the roots, and an offset of 0 where there is no fold.
//! - Energy: not kept in general. In the limit of narrow glints `strength = 0.5` keeps it, at 15 degrees 0.94.

use std::f64::consts::TAU;

use math::Real;

use super::roots::ExitCurve;
use crate::wrap_angle;

/// How the caustic of TRT is smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Caustic<F = f32> {
    /// Brightness of the glints, `k_G`; 0.5 to 5.
    pub strength: F,
    /// Azimuthal standard deviation of a glint, `w_c`, radians; 10 to 25 degrees.
    pub width: F,
    /// Range of Bravais' index beyond 2 over which the merged glints fade, `Δη'`; 0.2 to 0.4.
    pub fade: F,
    /// Largest stretch of offsets that a glint gathers, `Δh_M`; 0.5.
    pub limit: F,
}

impl<F: Real> Default for Caustic<F> {
    /// Strength 1, width 15 degrees, fade 0.3, limit 0.5.
    fn default() -> Self {
        Self { strength: F::one(), width: F::of(15.0_f64.to_radians()), fade: F::of(0.3), limit: F::of(0.5) }
    }
}

impl<F: Real> Caustic<F> {
    /// The same in another precision.
    #[inline]
    pub fn cast<G: Real>(self) -> Caustic<G> {
        Caustic {
            strength: G::of(self.strength.f64()),
            width: G::of(self.width.f64()),
            fade: G::of(self.fade.f64()),
            limit: G::of(self.limit.f64()),
        }
    }
}

/// Where an exit curve turns back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// Angle of incidence `γ_c > 0`; there is another fold at `-γ_c`.
    pub gamma: f64,
    /// Offset `h_c = sin γ_c`.
    pub h: f64,
    /// Azimuth `φ_c` of the caustic, in `[-π, π]`; the other one is at `-φ_c`.
    pub azimuth: f64,
    /// `|d²Φ/dh²|` there.
    pub curvature: f64,
}

impl Fold {
    /// The fold of a curve, if it has one: for TRT where Bravais' index is below 2.
    #[inline]
    pub fn of(curve: &ExitCurve) -> Option<Self> {
        let gamma = curve.turn()?;
        let (h, cos) = gamma.sin_cos();
        // The slope is 0 at the fold, so that only one term of the chain rule is left.
        let curvature = (curve.bending(gamma) / (cos * cos)).abs();
        Some(Self { gamma, h, azimuth: wrap_angle(curve.azimuth(gamma)), curvature })
    }
}

/// [`Caustic`] at one inclination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Azimuth `φ_c` of one glint; the other is at `-φ_c`.
    pub centre: f64,
    /// Offset `h_c` whose attenuation the glints have.
    pub h: f64,
    /// Share `t` of the smoothing that is in force: 1 with a fold, fading to 0 beyond.
    pub blend: f64,
    /// Light in one glint per unit of attenuation: `t k_G Δh`.
    pub gain: f64,
    /// Standard deviation, radians.
    pub width: f64,
}

impl Smoothing {
    /// For the exit curve of TRT.
    #[inline]
    pub fn new(caustic: &Caustic<f64>, curve: &ExitCurve) -> Self {
        let width = caustic.width.max(1e-4);
        let (centre, h, blend, spread) = match Fold::of(curve) {
            Some(fold) => {
                let spread = 2.0 * (2.0 * width / fold.curvature).sqrt();
                (fold.azimuth, fold.h, 1.0, spread.min(caustic.limit))
            }
            None => {
                // Along the fiber the index is infinite, which the clamp bears.
                let beyond = ((curve.inverse_index().recip() - 2.0) / caustic.fade.max(1e-9)).clamp(0.0, 1.0);
                (0.0, 0.0, 1.0 - beyond * beyond * (3.0 - 2.0 * beyond), caustic.limit)
            }
        };
        Self { centre, h, blend, gain: blend * caustic.strength * spread, width }
    }

    /// `exp(-x²/2w_c²)` of the distances to the two glints, the nearest images.
    #[inline]
    fn bells(&self, phi: f64) -> [f64; 2] {
        [phi - self.centre, phi + self.centre].map(|x| (-0.5 * (wrap_angle(x) / self.width).powi(2)).exp())
    }

    /// What is left of the light of the roots at azimuth `phi`: 0 at a caustic, 1 far from it.
    #[inline]
    pub fn kept(&self, phi: f64) -> f64 {
        self.bells(phi).iter().map(|bell| 1.0 - self.blend * bell).product()
    }

    /// What the glints add at azimuth `phi`, per unit of the attenuation at [`h`](Self::h).
    #[inline]
    pub fn added(&self, phi: f64) -> f64 {
        let [a, b] = self.bells(phi);
        self.gain * (a + b) / (self.width * TAU.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lobe::roots::{Roots, inverse_index};

    #[test]
    fn folds_are_where_the_papers_have_them() {
        // η' = 1.55 at normal incidence: h_c² = (4 - η'²)/3, and the azimuths of both kinds of root.
        let b = inverse_index(1.0, 1.55);
        let exact = Fold::of(&ExitCurve::new(Roots::Exact, 2, b)).expect("an index below 2 folds");
        assert!((exact.h * exact.h - (4.0 - 1.55 * 1.55) / 3.0).abs() < 1e-14);
        assert!((exact.azimuth.to_degrees() - 18.62).abs() < 0.005, "{}", exact.azimuth.to_degrees());
        let cubic = Fold::of(&ExitCurve::new(Roots::Cubic, 2, b)).expect("an index below 2 folds");
        assert!((cubic.azimuth.to_degrees() - 20.49).abs() < 0.005, "{}", cubic.azimuth.to_degrees());

        for roots in [Roots::Exact, Roots::Cubic] {
            assert!(Fold::of(&ExitCurve::new(roots, 2, 1.0 / 2.001)).is_none());
            assert!(Fold::of(&ExitCurve::new(roots, 2, 1.0 / 1.999)).is_some());
            assert!(Fold::of(&ExitCurve::new(roots, 2, 0.0)).is_none());
        }
    }

    #[test]
    fn curvatures_are_second_derivatives_in_the_offset() {
        let mut checked = 0;
        for roots in [Roots::Exact, Roots::Cubic] {
            for b in [0.52, 0.6, 1.0 / 1.55, 0.7] {
                let curve = ExitCurve::new(roots, 2, b);
                let fold = Fold::of(&curve).expect("an index below 2 folds");
                let step = 1e-4;
                let at = |h: f64| curve.azimuth(h.asin());
                let second = (at(fold.h + step) - 2.0 * at(fold.h) + at(fold.h - step)) / (step * step);
                // The difference quotient errs by step²/12 times a fourth derivative of up to some thousands.
                assert!((second.abs() / fold.curvature - 1.0).abs() < 1e-4, "{curve:?}: {second}, {fold:?}");
                checked += 1;
            }
        }
        assert_eq!(checked, 8);
    }

    #[test]
    fn the_glints_hold_their_gain() {
        // Trapezoid over the circle: exact for Gaussians this smooth.
        let caustic = Caustic::<f64>::default();
        for b in [0.7, 1.0 / 1.55, 0.51, 0.48, 0.3, 0.0] {
            let smoothing = Smoothing::new(&caustic, &ExitCurve::new(Roots::Exact, 2, b));
            let turn = TAU / 720.0;
            let light: f64 = (0..720).map(|i| smoothing.added((f64::from(i) + 0.5) * turn - TAU / 2.0) * turn).sum();
            assert!((light - 2.0 * smoothing.gain).abs() < 1e-9, "{b}: {light}");
            assert!(smoothing.kept(smoothing.centre).abs() < 1e-15 || smoothing.blend < 1.0);
            assert!(smoothing.kept(2.8) > 0.99);
        }
        // Faded out along the fiber.
        assert_eq!(Smoothing::new(&caustic, &ExitCurve::new(Roots::Exact, 2, 0.0)).blend, 0.0);
    }
}
