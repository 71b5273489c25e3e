//! One point of a fiber without visibility: how it is set up, what directions are drawn, and what estimators spread.

use std::f64::consts::{PI, TAU};

use fiber::{DIMS, Deon, DeonSetup, Dir, Field, Hit, Model, Weights};
use math::{DVec3, Frame, Real, Rgb, hash, warp};

/// A fiber as the paper has it: the far field. The width counts for both directions; absorption is grey.
pub(super) fn deon<F: Real>(beta_deg: f64, sigma_a: f64, alpha_deg: f64, weights: Weights) -> Deon<F> {
    let beta = F::of(beta_deg.to_radians());
    Deon {
        beta_m: beta,
        beta_n: beta,
        alpha: F::of(alpha_deg.to_radians()),
        weights,
        field: Field::Far,
        ..Deon::with_absorption(Rgb::splat(F::of(sigma_a)))
    }
}

/// The fiber seen at inclination `theta_k`, radians, and azimuth 0.
pub(super) fn seen<F: Real>(fiber: &Deon<F>, theta_k: f64) -> DeonSetup<F> {
    fiber.prepare(&Hit::new(Dir::new(F::of(theta_k), F::zero()), F::zero()))
}

/// The numbers of sample `index` in `stream`.
pub(super) fn numbers<F: Real>(index: u32, stream: u32) -> [F; DIMS] {
    let mut dimension = 0;
    [F::zero(); DIMS].map(|_| {
        dimension += 1;
        F::of(f64::from(hash::unit(index, hash::mix2(stream, dimension))))
    })
}

/// A direction uniform over the sphere.
pub(super) fn uniform<F: Real>(u: [F; DIMS]) -> Dir<F> {
    Dir::from_sin(F::one() - F::of(2.0) * u[0], F::TAU() * u[1])
}

/// The sphere, steradians: one over the density of [`uniform`].
pub(super) const SPHERE: f64 = 4.0 * PI;

/// A frame turned at random, the same for the same index and seed: its axes in the world.
pub(super) fn frame(index: u32, seed: u32) -> [DVec3; 3] {
    let u = |stream: u32| hash::unit(index, hash::mix2(seed, stream));
    let frame = Frame::around(warp::uniform_sphere([u(101), u(102)]));
    let (sin, cos) = (std::f32::consts::TAU * u(103)).sin_cos();
    let v = frame.v * cos + frame.w * sin;
    [frame.u, v, frame.u.cross(v)].map(|axis| axis.as_dvec3())
}

/// A vector of the fiber's frame in the world.
pub(super) fn to_world(axes: &[DVec3; 3], [u, v, w]: [f64; 3]) -> DVec3 {
    axes[0] * u + axes[1] * v + axes[2] * w
}

/// Radiance of a sky with three compact lights, 20, 13 and 7 degrees wide, each of which integrates to 3.
pub(super) fn sun(dir: DVec3) -> f64 {
    /// Concentrations of von Mises-Fisher lobes, and where they are.
    const LIGHTS: [(f64, DVec3); 3] =
        [(8.0, DVec3::new(0.3, 0.8, 0.52)), (20.0, DVec3::new(-0.5, 0.1, -0.8)), (60.0, DVec3::new(0.7, -0.2, 0.6))];
    let lights = LIGHTS.iter().map(|&(kappa, towards)| {
        // Normalised without overflow: κ/(2π(1 - e^{-2κ})) e^{κ(cos - 1)}.
        let top = kappa / (TAU * -(-2.0 * kappa).exp_m1());
        3.0 * top * (kappa * (dir.dot(towards) / towards.length() - 1.0)).exp()
    });
    0.25 + lights.sum::<f64>()
}

/// Mean and spread of numbers, without keeping them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moments {
    count: f64,
    mean: f64,
    /// Sum of squared departures from the mean.
    spread: f64,
    most: f64,
}

impl Moments {
    pub(super) fn add(&mut self, x: f64) {
        self.count += 1.0;
        let off = x - self.mean;
        self.mean += off / self.count;
        self.spread += off * (x - self.mean);
        self.most = self.most.max(x);
    }

    /// NaN-free: 0 of nothing.
    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    /// Of what the numbers are a sample of; 0 below two.
    pub(super) fn variance(&self) -> f64 {
        self.spread / (self.count - 1.0).max(1.0)
    }

    /// The standard deviation.
    pub(super) fn deviation(&self) -> f64 {
        self.variance().sqrt()
    }

    /// The standard error of the mean.
    pub(super) fn error(&self) -> f64 {
        (self.variance() / self.count.max(1.0)).sqrt()
    }

    /// The largest, and at least 0.
    pub(super) fn most(&self) -> f64 {
        self.most
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        let mut moments = Self::default();
        for x in numbers {
            moments.add(x);
        }
        moments
    }
}

#[cfg(test)]
mod tests {
    use fiber::quadrature::rule;

    use super::*;
    use crate::stats;

    #[test]
    fn moments_are_those_of_the_list() {
        let list = [3.0, -1.0, 7.5, 2.25, 0.0];
        let moments: Moments = list.into_iter().collect();
        assert!((moments.mean() - stats::mean(&list)).abs() < 1e-12);
        assert!((moments.deviation() - stats::deviation(&list)).abs() < 1e-12);
        assert!((moments.error() - moments.deviation() / 5.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(moments.most(), 7.5);
    }

    #[test]
    fn the_sky_holds_its_lights() {
        let mut sum = 0.0;
        for &(x, wx) in rule(160) {
            for &(y, wy) in rule(256) {
                let (radius, phi) = ((1.0 - x * x).sqrt(), PI * y);
                sum += wx * wy * PI * sun(DVec3::new(radius * phi.cos(), x, radius * phi.sin()));
            }
        }
        let want = 0.25 * SPHERE + 9.0;
        assert!((sum / want - 1.0).abs() < 1e-6, "{sum} and {want}");
    }

    #[test]
    fn uniform_directions_have_no_preference() {
        // 4 deviations of the mean of 20,000 components of variance 1/3, a false alarm in 16,000 each.
        let mut sums = [0.0; 3];
        for i in 0..20_000 {
            let dir: Dir<f64> = uniform(numbers(i, 9));
            for (sum, x) in sums.iter_mut().zip(dir.to_local()) {
                *sum += x / 20_000.0;
            }
        }
        assert!(sums.iter().all(|x| x.abs() < 4.0 / (3.0 * 20_000.0_f64).sqrt()), "{sums:?}");
    }

    #[test]
    fn frames_are_right_handed_and_differ() {
        for i in 0..50 {
            let [u, v, w] = frame(i, 3);
            assert!((u.cross(v) - w).length() < 1e-5 && u.dot(v).abs() < 1e-5 && (u.length() - 1.0).abs() < 1e-5);
            assert!((frame(i + 1, 3)[0] - u).length() > 1e-4);
            assert!((to_world(&[u, v, w], [0.0, 1.0, 0.0]) - v).length() < 1e-12);
        }
    }
}
