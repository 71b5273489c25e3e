use std::fmt::{Debug, Display, LowerExp};
use std::iter::Sum;

use num_traits::{Float, FloatConst, NumAssign};

/// A floating-point number: `f32` in the renderers, `f64` where a formula is checked.
///
/// Formulas are written once against this trait, so that the single-precision form that renders is the
/// same text as the double-precision form that is held against the oracles.
pub trait Real:
    Float + FloatConst + NumAssign + Sum + Debug + Display + LowerExp + Default + Send + Sync + 'static
{
    /// Whether this is the double-precision form; some series choose their length by it.
    const DOUBLE: bool;
    /// The largest value below 1: samples live in `[0, ONE_MINUS_EPSILON]`.
    const ONE_MINUS_EPSILON: Self;

    /// The nearest value to a double-precision constant.
    fn of(x: f64) -> Self;

    /// This value in double precision.
    fn f64(self) -> f64;

    /// `π / 2`.
    #[inline]
    fn half_pi() -> Self {
        Self::FRAC_PI_2()
    }

    /// `sqrt(max(0, x))`.
    #[inline]
    fn safe_sqrt(self) -> Self {
        self.max(Self::zero()).sqrt()
    }

    /// `asin` of the value clamped to `[-1, 1]`.
    #[inline]
    fn safe_asin(self) -> Self {
        self.clamp_to(-Self::one(), Self::one()).asin()
    }

    /// `x²`.
    #[inline]
    fn sqr(self) -> Self {
        self * self
    }

    /// Clamped into `[lo, hi]`; NaN becomes `lo`.
    #[inline]
    fn clamp_to(self, lo: Self, hi: Self) -> Self {
        self.max(lo).min(hi)
    }
}

impl Real for f32 {
    const DOUBLE: bool = false;
    const ONE_MINUS_EPSILON: Self = 1.0 - f32::EPSILON / 2.0;

    #[inline]
    fn of(x: f64) -> Self {
        x as f32
    }

    #[inline]
    fn f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    const DOUBLE: bool = true;
    const ONE_MINUS_EPSILON: Self = 1.0 - f64::EPSILON / 2.0;

    #[inline]
    fn of(x: f64) -> Self {
        x
    }

    #[inline]
    fn f64(self) -> f64 {
        self
    }
}
