use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Neg, Sub};

use crate::Real;

/// A colour or a spectrum of three bands, linear Rec.709/sRGB unless a name says otherwise.
///
/// Component-wise arithmetic; there is no clamping.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb<F = f32>(pub [F; 3]);

/// Luminance of red, green and blue, Rec.709.
pub const LUMINANCE: [f64; 3] = [0.212_671, 0.715_160, 0.072_169];

impl<F: Real> Rgb<F> {
    /// From red, green and blue.
    #[inline]
    pub fn new(r: F, g: F, b: F) -> Self {
        Self([r, g, b])
    }

    /// The same value in all three channels.
    #[inline]
    pub fn splat(x: F) -> Self {
        Self([x, x, x])
    }

    /// No light.
    #[inline]
    pub fn black() -> Self {
        Self::splat(F::zero())
    }

    /// One in every channel.
    #[inline]
    pub fn white() -> Self {
        Self::splat(F::one())
    }

    /// Applies `f` to every channel.
    #[inline]
    pub fn map(self, f: impl FnMut(F) -> F) -> Self {
        Self(self.0.map(f))
    }

    /// Applies `f` to every pair of channels.
    #[inline]
    pub fn zip(self, other: Self, mut f: impl FnMut(F, F) -> F) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([f(a, x), f(b, y), f(c, z)])
    }

    /// Rec.709 luminance.
    #[inline]
    pub fn luminance(self) -> F {
        let [r, g, b] = self.0;
        let [wr, wg, wb] = LUMINANCE.map(F::of);
        wr * r + wg * g + wb * b
    }

    /// The largest channel.
    #[inline]
    pub fn max_channel(self) -> F {
        self.0[0].max(self.0[1]).max(self.0[2])
    }

    /// Whether every channel is a finite number.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }

    /// Whether every channel is exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0.iter().all(|x| x.is_zero())
    }

    /// The same colour in another precision.
    #[inline]
    pub fn cast<G: Real>(self) -> Rgb<G> {
        Rgb(self.0.map(|x| G::of(x.f64())))
    }
}

macro_rules! per_channel {
    ($op:ident, $method:ident, $sign:tt) => {
        impl<F: Real> $op for Rgb<F> {
            type Output = Self;

            #[inline]
            fn $method(self, rhs: Self) -> Self {
                self.zip(rhs, |a, b| a $sign b)
            }
        }

        impl<F: Real> $op<F> for Rgb<F> {
            type Output = Self;

            #[inline]
            fn $method(self, rhs: F) -> Self {
                self.map(|a| a $sign rhs)
            }
        }
    };
}
per_channel!(Add, add, +);
per_channel!(Sub, sub, -);
per_channel!(Mul, mul, *);
per_channel!(Div, div, /);

impl<F: Real> Neg for Rgb<F> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<F: Real> AddAssign for Rgb<F> {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        *self = *self + rhs;
    }
}

impl<F: Real> MulAssign for Rgb<F> {
    #[inline]
    fn mul_assign(&mut self, rhs: Self) {
        *self = *self * rhs;
    }
}

impl<F: Real> MulAssign<F> for Rgb<F> {
    #[inline]
    fn mul_assign(&mut self, rhs: F) {
        *self = *self * rhs;
    }
}

impl<F: Real> Sum for Rgb<F> {
    fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::black(), |a, b| a + b)
    }
}

impl<F> Index<usize> for Rgb<F> {
    type Output = F;

    #[inline]
    fn index(&self, channel: usize) -> &F {
        &self.0[channel]
    }
}

impl<F> IndexMut<usize> for Rgb<F> {
    #[inline]
    fn index_mut(&mut self, channel: usize) -> &mut F {
        &mut self.0[channel]
    }
}

impl<F> From<[F; 3]> for Rgb<F> {
    fn from(rgb: [F; 3]) -> Self {
        Self(rgb)
    }
}
