use math::Real;

/// `x` wrapped into `[-π, π]`, by whole turns.
#[inline]
pub fn wrap_angle<F: Real>(x: F) -> F {
    x - F::TAU() * (x / F::TAU()).round()
}

/// A unit direction in the fiber's frame, pointing away from the fiber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dir<F = f32> {
    /// Sine of the inclination to the normal plane: the component along the tangent.
    pub sin_theta: F,
    /// Cosine of the inclination, never negative.
    pub cos_theta: F,
    /// Azimuth around the tangent, radians, any number of turns.
    pub phi: F,
}

impl<F: Real> Dir<F> {
    /// From inclination and azimuth, radians. `theta` in `[-π/2, π/2]`.
    #[inline]
    pub fn new(theta: F, phi: F) -> Self {
        let (sin_theta, cos_theta) = theta.sin_cos();
        Self { sin_theta, cos_theta: cos_theta.max(F::zero()), phi }
    }

    /// From the sine of the inclination and the azimuth.
    #[inline]
    pub fn from_sin(sin_theta: F, phi: F) -> Self {
        let s = sin_theta.clamp_to(-F::one(), F::one());
        Self { sin_theta: s, cos_theta: (F::one() - s * s).safe_sqrt(), phi }
    }

    /// From a unit vector `(u, v, w)` whose first component lies along the tangent.
    ///
    /// Along the fiber itself the azimuth does not exist and is taken as 0.
    #[inline]
    pub fn from_local([u, v, w]: [F; 3]) -> Self {
        let across = v * v + w * w;
        let phi = if across < F::of(1e-12) { F::zero() } else { w.atan2(v) };
        // sqrt(v² + w²) and not sqrt(1 - u²): near the tangent the latter has no digits left.
        let cos_theta = across.sqrt();
        Self { sin_theta: u.clamp_to(-F::one(), F::one()), cos_theta: cos_theta.min(F::one()), phi }
    }

    /// The unit vector `(u, v, w)`.
    #[inline]
    pub fn to_local(self) -> [F; 3] {
        let (s, c) = self.phi.sin_cos();
        [self.sin_theta, self.cos_theta * c, self.cos_theta * s]
    }

    /// Inclination in radians.
    #[inline]
    pub fn theta(self) -> F {
        self.sin_theta.atan2(self.cos_theta)
    }

    /// The same direction in another precision.
    #[inline]
    pub fn cast<G: Real>(self) -> Dir<G> {
        Dir {
            sin_theta: G::of(self.sin_theta.f64()),
            cos_theta: G::of(self.cos_theta.f64()),
            phi: G::of(self.phi.f64()),
        }
    }
}

/// Where light is scattered: the known direction and the offset across the fiber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<F = f32> {
    /// The known direction, towards the viewer for a path from the camera.
    pub known: Dir<F>,
    /// Offset in `[-1, 1]`: `-N·t` with the surface normal `N` and `t = normalize(u × known)`.
    /// Far-field models ignore it.
    pub h: F,
    /// How many pixels wide the fiber looks from where the known direction points; infinite where that
    /// has no meaning. Only models whose field is [`Field::Auto`](crate::Field::Auto) look at it.
    pub width_px: F,
}

impl<F: Real> Hit<F> {
    /// A hit; `h` is clamped into `[-1, 1]`.
    #[inline]
    pub fn new(known: Dir<F>, h: F) -> Self {
        Self { known, h: h.clamp_to(-F::one(), F::one()), width_px: F::infinity() }
    }

    /// The same hit on a fiber that looks `width_px` pixels wide.
    #[inline]
    pub fn with_width(self, width_px: F) -> Self {
        Self { width_px, ..self }
    }

    /// Azimuth of `s` relative to the known direction, in `(-π, π]`.
    #[inline]
    pub(crate) fn azimuth(&self, s: Dir<F>) -> F {
        wrap_angle(s.phi - self.known.phi)
    }
}

/// `cos²((theta_s - theta_k) / 2)`, without inverse trigonometry.
#[inline]
pub(crate) fn cos2_half_difference<F: Real>(sin_k: F, cos_k: F, sin_s: F, cos_s: F) -> F {
    (F::of(0.5) * (F::one() + cos_k * cos_s + sin_k * sin_s)).clamp_to(F::zero(), F::one())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_the_direction() {
        for x in [-1e4_f64, -7.0, -3.2, 0.0, 3.2, 7.0, 1e4] {
            let w = wrap_angle(x);
            assert!(w.abs() <= std::f64::consts::PI + 1e-12);
            assert!((w.sin() - x.sin()).abs() < 1e-9, "{x}");
        }
    }

    #[test]
    fn directions_round_trip_through_vectors() {
        for (theta, phi) in [(0.3_f64, 2.0), (-1.2, -0.4), (1.57, 1.0)] {
            let d = Dir::new(theta, phi);
            let back = Dir::from_local(d.to_local());
            assert!((back.theta() - theta).abs() < 1e-9, "{theta}: {}", back.theta());
            assert!(back.cos_theta < 1e-6 || (back.phi - phi).abs() < 1e-9);
        }
    }
}
