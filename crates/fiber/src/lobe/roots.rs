//! Where light leaves a smooth cylinder, `Φ(p, γ)`, and where it entered to leave there: the inverse.
//!
//! - Source: Marschner et al. 2003; Hunz 2016, section 3.3, for the cubic. Two facts the papers do not
//!   state are built in: there may be no root at all (TT leaves within `π - 2 asin(1/η')` of straight on,
//!   TRT not far from backwards), and the cubic of TRT passes half a turn where `η'` is close to 1, so that
//!   a second image of the azimuth has roots too.
//! - Double precision throughout: next to a fold a root has only half the digits of the azimuth, and
//!   single precision would leave four of them.
//!
//! | symbol | meaning |
//! |---|---|
//! | `γ` | angle of incidence in the normal plane, `h = sin γ` |
//! | `b` | `1/η'`, the inverse of Bravais' index |
//! | `c` | `asin b`, the largest angle of refraction |
//! | `Φ` | `pπ + f(γ)` with `f` odd |

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::wrap_angle;

/// Which exit azimuth is inverted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Roots {
    /// Snell's law: one root in closed form for TT, safeguarded Newton steps for TRT. The default.
    #[default]
    Exact,
    /// The papers' cubic in place of Snell's law. It moves TT by 3.5 % and TRT by 12 % in the mean at
    /// normal incidence, and the caustic from 18.6 to 20.5 degrees for an index of 1.55.
    Cubic,
}

/// `1/η' = cos θ / sqrt(η² - sin² θ)` for the squared cosine of the inclination; 0 along the fiber.
#[inline]
pub fn inverse_index(cos2: f64, eta: f64) -> f64 {
    (cos2 / (eta * eta - 1.0 + cos2).max(1e-12)).max(0.0).sqrt()
}

/// An angle of incidence whose light leaves at the azimuth asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Root {
    /// `γ` in `[-π/2, π/2]`, radians.
    pub gamma: f64,
    /// `dΦ/dγ` there: 0 at a fold.
    pub slope: f64,
}

/// More roots than any curve has: three for each of two images of the azimuth.
const MOST: usize = 6;

/// The roots for one azimuth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RootSet {
    roots: [Root; MOST],
    count: usize,
}

impl RootSet {
    /// The roots found, in no particular order; none if no light leaves there.
    #[inline]
    pub fn as_slice(&self) -> &[Root] {
        &self.roots[..self.count]
    }

    #[inline]
    fn push(&mut self, root: Root) {
        debug_assert!(self.count < MOST, "more than {MOST} roots");
        if self.count < MOST {
            self.roots[self.count] = root;
            self.count += 1;
        }
    }
}

/// The exit azimuth of one lobe at one inclination, as a function of the angle of incidence.
#[derive(Clone, Copy, Debug)]
pub struct ExitCurve {
    roots: Roots,
    p: f64,
    /// Whether half a turn is added: odd `p`.
    odd: bool,
    b: f64,
    /// The cubic is `linear γ - cubic γ³`.
    linear: f64,
    cubic: f64,
    /// Angle of the fold, where there is one.
    turn: Option<f64>,
}

impl ExitCurve {
    /// For lobe `p <= 2` (0 R, 1 TT, 2 TRT) and the [`inverse_index`] `b` in `[0, 1)`.
    #[inline]
    pub fn new(roots: Roots, p: usize, b: f64) -> Self {
        debug_assert!(p <= 2, "lobe {p} has more roots than are looked for");
        let segments = p as f64;
        let c = b.min(1.0).asin();
        let linear = 6.0 * segments * c / PI - 2.0;
        let cubic = 8.0 * segments * c / (PI * PI * PI);
        let turn = match roots {
            Roots::Exact => {
                // dΦ/dγ = 0 ⟺ p² (1 - s²) = η'² - s², with s = sin γ; multiplied by b² to stay finite.
                let s2 = ((segments * b).powi(2) - 1.0) / ((segments * segments - 1.0) * b * b);
                (p >= 2 && s2 > 0.0 && s2 < 1.0).then(|| s2.sqrt().asin())
            }
            Roots::Cubic => {
                let square = linear / (3.0 * cubic);
                (linear > 0.0 && square < FRAC_PI_2 * FRAC_PI_2).then(|| square.sqrt())
            }
        };
        Self { roots, p: segments, odd: p % 2 == 1, b, linear, cubic, turn }
    }

    /// `1/η'`.
    #[inline]
    pub fn inverse_index(&self) -> f64 {
        self.b
    }

    /// `Φ(p, γ)` relative to the known direction, radians, not wrapped.
    #[inline]
    pub fn azimuth(&self, gamma: f64) -> f64 {
        self.p * PI + self.bend(gamma)
    }

    /// `f(γ) = Φ - pπ`, an odd function.
    #[inline]
    pub fn bend(&self, gamma: f64) -> f64 {
        match self.roots {
            Roots::Exact => 2.0 * (self.p * (self.b * gamma.sin()).clamp(-1.0, 1.0).asin() - gamma),
            Roots::Cubic => (self.linear - self.cubic * gamma * gamma) * gamma,
        }
    }

    /// `dΦ/dγ`.
    #[inline]
    pub fn slope(&self, gamma: f64) -> f64 {
        match self.roots {
            Roots::Exact => {
                let (sin, cos) = gamma.sin_cos();
                2.0 * (self.p * self.b * cos / self.cos_inside(sin) - 1.0)
            }
            Roots::Cubic => self.linear - 3.0 * self.cubic * gamma * gamma,
        }
    }

    /// `d²Φ/dγ²`.
    #[inline]
    pub fn bending(&self, gamma: f64) -> f64 {
        match self.roots {
            Roots::Exact => {
                let sin = gamma.sin();
                -2.0 * self.p * self.b * sin * (1.0 - self.b * self.b) / self.cos_inside(sin).powi(3)
            }
            Roots::Cubic => -6.0 * self.cubic * gamma,
        }
    }

    /// The positive `γ` at which `Φ` turns back, if it does.
    #[inline]
    pub fn turn(&self) -> Option<f64> {
        self.turn
    }

    /// `cos γ_t` for `sin γ`, never 0.
    #[inline]
    fn cos_inside(&self, sin: f64) -> f64 {
        (1.0 - (self.b * sin).powi(2)).max(1e-24).sqrt()
    }

    /// Every `γ` in `[-π/2, π/2]` with `Φ(p, γ) ≡ phi` modulo a whole turn.
    ///
    /// At a fold itself the two roots that meet there are both returned, with a slope near 0.
    pub fn solve(&self, phi: f64) -> RootSet {
        let mut found = RootSet::default();
        let phi = wrap_angle(phi);
        // Φ - pπ is odd: solve for its positive values only, so that φ and -φ have the same digits.
        let (target, mirrored) = if self.odd { (PI - phi.abs(), phi > 0.0) } else { (phi.abs(), phi < 0.0) };
        let sign = if mirrored { -1.0 } else { 1.0 };

        if self.odd && self.roots == Roots::Exact {
            // 2(γ_t - γ) is the target and sin γ_t = b sin γ: two equations, linear in tan γ_t.
            let (sin, cos) = (0.5 * target).sin_cos();
            let gamma = -(self.b * sin).atan2(1.0 - self.b * cos) - 0.5 * target;
            if gamma >= -FRAC_PI_2 {
                found.push(Root { gamma: sign * gamma, slope: self.slope(gamma) });
            }
            return found;
        }

        let (ends, pieces) = match self.turn {
            None => ([-FRAC_PI_2, FRAC_PI_2, FRAC_PI_2, FRAC_PI_2], 1),
            Some(turn) => ([-FRAC_PI_2, -turn, turn, FRAC_PI_2], 3),
        };
        let (edge, peak) = (self.bend(FRAC_PI_2), self.turn.map_or(0.0, |turn| self.bend(turn)));
        let at_ends = if pieces == 1 { [-edge, edge, edge, edge] } else { [-edge, -peak, peak, edge] };
        for image in [target, target - TAU] {
            for piece in 0..pieces {
                let (from, to) = (piece, piece + 1);
                if (at_ends[from] - image) * (at_ends[to] - image) <= 0.0 {
                    let gamma = self.invert(ends[from], ends[to], at_ends[to] > at_ends[from], image);
                    found.push(Root { gamma: sign * gamma, slope: self.slope(gamma) });
                }
            }
        }
        found
    }

    /// The `γ` in the monotone piece `[lo, hi]` where `f` is `target`: Newton's steps, and the middle of the
    /// bracket where a step would leave it.
    fn invert(&self, mut lo: f64, mut hi: f64, rising: bool, target: f64) -> f64 {
        let mut gamma = 0.5 * (lo + hi);
        // 60 halvings alone reach the last digit; Newton needs about 5 steps.
        for _ in 0..60 {
            let miss = self.bend(gamma) - target;
            if (miss > 0.0) == rising {
                hi = gamma;
            } else {
                lo = gamma;
            }
            let newton = gamma - miss / self.slope(gamma);
            let inside = newton >= lo && newton <= hi;
            let next = if inside { newton } else { 0.5 * (lo + hi) };
            // f itself is only known to a few 1e-16.
            if (inside && miss.abs() <= 1e-15) || next == gamma {
                return next;
            }
            gamma = next;
        }
        gamma
    }
}

#[cfg(test)]
mod tests {
    use math::hash;

    use super::*;

    /// Inverse indices from along the fiber to an index of nearly 1, both kinds of curve.
    fn curves() -> Vec<ExitCurve> {
        let mut curves = Vec::new();
        for roots in [Roots::Exact, Roots::Cubic] {
            for p in 0..3 {
                for b in [0.0, 0.01, 0.3, 0.499, 0.501, 0.6, 1.0 / 1.55, 0.8, 0.95, 0.999] {
                    curves.push(ExitCurve::new(roots, p, b));
                }
            }
        }
        curves
    }

    fn unit(stream: u32, index: u32) -> f64 {
        f64::from(hash::unit(index, stream)) + 0.5 / 16_777_216.0
    }

    #[test]
    fn every_angle_is_a_root_of_its_own_azimuth() {
        let mut checked = 0;
        for (stream, curve) in curves().iter().enumerate() {
            for i in 0..500 {
                let gamma = PI * unit(stream as u32, i) - FRAC_PI_2;
                // Next to a fold the azimuth has lost the digits of the angle.
                if curve.slope(gamma).abs() < 1e-3 {
                    continue;
                }
                // Any number of turns away.
                let phi = curve.azimuth(gamma) + TAU * (f64::from(i % 5) - 2.0);
                let roots = curve.solve(phi);
                let nearest = roots.as_slice().iter().map(|root| (root.gamma - gamma).abs());
                let nearest = nearest.fold(f64::INFINITY, f64::min);
                // Roundings of an azimuth of a few turns, and of the arcsine at the rim, over the smallest slope.
                assert!(nearest < 1e-10, "{curve:?} at {gamma}: the nearest root is {nearest} away");
                checked += 1;
            }
        }
        assert!(checked > 29_000, "{checked}");
    }

    #[test]
    fn every_root_leaves_at_the_azimuth_asked_for() {
        let mut checked = 0;
        for (stream, curve) in curves().iter().enumerate() {
            for i in 0..500 {
                let phi = TAU * unit(900 + stream as u32, i) - PI;
                for root in curve.solve(phi).as_slice() {
                    let miss = wrap_angle(curve.azimuth(root.gamma) - phi);
                    assert!(miss.abs() < 1e-12, "{curve:?} at φ = {phi}: {root:?} misses by {miss}");
                    assert!(root.gamma.abs() <= FRAC_PI_2);
                    assert!((root.slope - curve.slope(root.gamma)).abs() <= 1e-12 * root.slope.abs() + 1e-12);
                    checked += 1;
                }
            }
        }
        assert!(checked > 15_000, "{checked}");
    }

    #[test]
    fn roots_are_as_many_as_the_curve_crosses() {
        // Brute force: sign changes of sin((Φ - φ)/2) over a fine grid of angles.
        const STEPS: u32 = 4000;
        let mut seen = [0_u32; MOST + 1];
        for (stream, curve) in curves().iter().enumerate() {
            for i in 0..60 {
                let x = unit(500 + stream as u32, i);
                // All around, near backwards where TRT folds, near straight on.
                let phi = [TAU * x - PI, 0.8 * x - 0.4, PI - 0.2 * x][i as usize % 3];
                let roots = curve.solve(phi);
                // Two crossings next to a fold fall between the nodes of the grid.
                if roots.as_slice().iter().any(|root| root.slope.abs() < 0.02 || root.gamma.abs() > 1.569) {
                    continue;
                }
                let side = |j: u32| {
                    let gamma = PI * f64::from(j) / f64::from(STEPS) - FRAC_PI_2;
                    (0.5 * (curve.azimuth(gamma) - phi)).sin() > 0.0
                };
                let crossings = (0..STEPS).filter(|&j| side(j) != side(j + 1)).count();
                assert_eq!(roots.as_slice().len(), crossings, "{curve:?} at φ = {phi}");
                seen[crossings] += 1;
            }
        }
        // All that there can be are among them; four by the cubic's second image.
        assert!(seen[0] > 300 && seen[1] > 1000 && seen[2] > 20 && seen[3] > 50 && seen[4] > 0, "{seen:?}");
    }

    #[test]
    fn slopes_are_derivatives() {
        for curve in curves() {
            for i in 0..50 {
                let gamma = 3.0 * unit(77, i) - 1.5;
                let step = 1e-5;
                let slope = (curve.bend(gamma + step) - curve.bend(gamma - step)) / (2.0 * step);
                let bending = (curve.slope(gamma + step) - curve.slope(gamma - step)) / (2.0 * step);
                // The third and fourth derivatives grow towards the rim where the index is near 1.
                assert!((slope - curve.slope(gamma)).abs() < 1e-6, "{curve:?} at {gamma}");
                assert!((bending - curve.bending(gamma)).abs() < 1e-4, "{curve:?} at {gamma}");
            }
        }
    }
}
