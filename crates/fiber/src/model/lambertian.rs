//! Lambertian fiber: an opaque cylinder whose surface is perfectly diffuse.
//!
//! The yardstick of the crate: everything about it is known in closed form, so when it fails a shared
//! test, suspect the test first.
//!
//! - Source: d'Eon, Marschner, Hanika 2013, section 4; their eq. 9 holds for the azimuth in `[0, π]`.
//! - Field: far; the offset across the fiber is integrated out (and drawn anew by the sampler).
//! - Energy: `∫ fcos dω` is exactly `albedo` for every known direction.
//! - Reciprocal: `S` does not change when the directions are exchanged.

use math::{Real, Rgb};

use super::{DIMS, Lobes, Model, RESIDUAL, Sample, Scatter};
use crate::{Dir, Hit};

/// An opaque, perfectly diffuse fiber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambertian<F = f32> {
    /// Share of the incident power that leaves again, per channel, `0..=1`.
    pub albedo: Rgb<F>,
}

impl<F: Real> Lambertian<F> {
    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> Lambertian<G> {
        Lambertian { albedo: self.albedo.cast() }
    }
}

/// [`Lambertian`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct LambertianSetup<F: Real = f32> {
    albedo: Rgb<F>,
    hit: Hit<F>,
}

impl<F: Real> Model<F> for Lambertian<F> {
    type Setup = LambertianSetup<F>;

    #[inline]
    fn prepare(&self, hit: &Hit<F>) -> LambertianSetup<F> {
        LambertianSetup { albedo: self.albedo, hit: *hit }
    }
}

impl<F: Real> Scatter<F> for LambertianSetup<F> {
    #[inline]
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        Lobes::only(RESIDUAL, self.albedo * self.pdf(s))
    }

    #[inline]
    fn pdf(&self, s: Dir<F>) -> F {
        let x = self.hit.azimuth(s).abs();
        let lit = ((F::PI() - x) * x.cos() + x.sin()).max(F::zero());
        lit * s.cos_theta / (F::of(4.0) * F::PI())
    }

    #[inline]
    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        if self.albedo.is_black() {
            return None;
        }
        let h = F::of(2.0) * u[0] - F::one();
        // The normal at offset h lies at azimuth -asin h from the known direction.
        let normal_phi = self.hit.known.phi - h.safe_asin();
        let dir = cosine_about(normal_phi, u[1], u[2]);
        let pdf = self.pdf(dir);
        (pdf > F::zero()).then_some(Sample {
            dir,
            weight: Lobes::only(RESIDUAL, self.albedo),
            pdf: Some(pdf),
            lobe: RESIDUAL,
        })
    }
}

/// A cosine-distributed direction about the normal at azimuth `normal_phi` in the normal plane.
#[inline]
fn cosine_about<F: Real>(normal_phi: F, a: F, b: F) -> Dir<F> {
    let radius = a.sqrt();
    let (sin, cos) = (F::TAU() * b).sin_cos();
    let along = radius * sin;
    let across = radius * cos;
    let up = (F::one() - a).safe_sqrt();
    // In the frame (normal, tangential azimuth, tangent): up, across, along.
    Dir { sin_theta: along, cos_theta: (up * up + across * across).sqrt(), phi: normal_phi + across.atan2(up) }
}
