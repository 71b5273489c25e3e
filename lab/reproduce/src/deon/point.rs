//! One point of a fiber without visibility: how it is set up, and what estimators spread.

use fiber::{Deon, DeonSetup, Dir, Field, Hit, Model, Weights};
use math::{Real, Rgb};

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
}
