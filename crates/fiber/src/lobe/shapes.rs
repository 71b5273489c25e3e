//! The shapes of all lobes of a near-field model at once: `L_p N_p` of R, TT, TRT and the residual lobe.
//!
//! In double precision this is the sum of its parts. In single precision the seven exponentials share one
//! vector, and so do the four Bessel functions: half the time of a near-field evaluation was there.

use fearless_simd::{Select, Simd, SimdBase, f32x8};
use math::Real;

use super::azimuthal::Kernel;
use super::longitudinal::Lobe;
use super::vector::{self, LANES, vectorised};
use crate::wrap_angle;

/// Longitudinal and azimuthal lobes with everything that no direction changes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shapes<F> {
    pub(crate) lobes: [Lobe<F>; 4],
    pub(crate) kernel: Kernel,
    /// Scale of the kernel of R, TT, TRT, radians.
    pub(crate) scales: [F; 3],
    /// Factor of the exponent of the kernel, and its norm.
    inv: [F; 3],
    norms: [F; 3],
}

impl<F: Real> Shapes<F> {
    pub(crate) fn new(lobes: [Lobe<F>; 4], kernel: Kernel, scales: [F; 3]) -> Self {
        let inv = scales.map(|s| match kernel {
            Kernel::Gaussian => F::of(-0.5) / s.sqr(),
            Kernel::Logistic => -s.recip(),
        });
        let norm = |s: F| match kernel {
            Kernel::Gaussian => F::of(0.398_942_280_401_432_7) / s,
            Kernel::Logistic => {
                let x = F::PI() / (F::of(2.0) * s);
                // tanh x is 1 to the last bit beyond this.
                let cut = if x > F::of(20.0) { F::one() } else { x.tanh() };
                (s * cut).recip()
            }
        };
        let same = scales[1] == scales[0] && scales[2] == scales[0];
        let norms = if same { [norm(scales[0]); 3] } else { scales.map(norm) };
        Self { lobes, kernel, scales, inv, norms }
    }

    /// Longitudinal densities alone.
    #[inline]
    pub(crate) fn longitudinal(&self, sin_s: F, cos_s: F) -> [F; 4] {
        [0, 1, 2, 3].map(|p| self.lobes[p].density(sin_s, cos_s))
    }

    /// `L_p N_p` towards an inclination; `x` is the azimuth from the exits of R, TT, TRT, any number of turns.
    #[inline]
    pub(crate) fn at(&self, sin_s: F, cos_s: F, x: [F; 3]) -> [F; 4] {
        if F::DOUBLE {
            let l = self.longitudinal(sin_s, cos_s);
            let n = |p: usize| self.kernel.at(self.scales[p], wrap_angle(x[p]));
            [l[0] * n(0), l[1] * n(1), l[2] * n(2), l[3] / F::TAU()]
        } else {
            let pack = |a: [F; 4], b: [F; 3], rest: f32| {
                [a[0], a[1], a[2], a[3], b[0], b[1], b[2], F::of(f64::from(rest))].map(|x| x.f64() as f32)
            };
            let each = |f: fn(&Lobe<F>) -> F| [0, 1, 2, 3].map(|p| f(&self.lobes[p]));
            let zero = [F::zero(); 3];
            let single = Single {
                cone_sin: pack(each(|l| l.cone.sin), zero, 0.0),
                cone_cos: pack(each(|l| l.cone.cos), zero, 0.0),
                // The azimuthal lanes hold the factor of x or x².
                factor: pack(each(|l| l.inv_v), self.inv, 0.0),
                norm: pack(each(|l| l.norm), self.norms, 1.0),
                x: pack([F::zero(); 4], x, 0.0),
                kernel: self.kernel,
                widest: self.scales[0].max(self.scales[1]).max(self.scales[2]).f64() as f32,
            };
            let (sin_s, cos_s) = (sin_s.f64() as f32, cos_s.f64() as f32);
            let y = vectorised!(simd => shapes_at_once(simd, &single, sin_s, cos_s));
            [y[0] * y[4], y[1] * y[5], y[2] * y[6], y[3] * (1.0 / std::f32::consts::TAU)].map(|x| F::of(f64::from(x)))
        }
    }
}

/// Lanes 0 to 3: longitudinal lobes; 4 to 6: azimuthal kernels; 7: nothing.
struct Single {
    cone_sin: [f32; LANES],
    cone_cos: [f32; LANES],
    factor: [f32; LANES],
    norm: [f32; LANES],
    x: [f32; LANES],
    kernel: Kernel,
    widest: f32,
}

#[inline(always)]
fn shapes_at_once<S: Simd>(simd: S, single: &Single, sin_s: f32, cos_s: f32) -> [f32; LANES] {
    let azimuthal = f32x8::load_array(simd, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]).simd_gt(f32x8::splat(simd, 0.5));
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let factor = f32x8::load_array_ref(simd, &single.factor);

    // Longitudinal: exp(-q/v) I0e(z), with the exponential of I0e's lower branch in the same exponent.
    let cone_sin = f32x8::load_array_ref(simd, &single.cone_sin);
    let cone_cos = f32x8::load_array_ref(simd, &single.cone_cos);
    let (a, b) = (cone_cos - f32x8::splat(simd, cos_s), cone_sin - f32x8::splat(simd, sin_s));
    let q = (a * a + b * b) * f32x8::splat(simd, 0.5);
    let z = (cone_cos * f32x8::splat(simd, cos_s) * factor).max(zero);
    let lower = z.simd_lt(f32x8::splat(simd, 3.75));
    let exponent = zero - q * factor - lower.select(z, zero);

    // Azimuthal.
    let x = vector::abs_wrapped(simd, f32x8::load_array_ref(simd, &single.x));
    let gaussian = matches!(single.kernel, Kernel::Gaussian);
    let azimuth_exponent = if gaussian { x * x * factor } else { x * factor };

    let e = vector::exp(simd, azimuthal.select(azimuth_exponent, exponent));
    let norm = f32x8::load_array_ref(simd, &single.norm);
    let bessel = vector::i0e_without_exponential(simd, z, lower);
    let around = if gaussian {
        let mut sum = e;
        let mut turn = std::f32::consts::TAU;
        while turn - std::f32::consts::PI < 6.0 * single.widest {
            let (a, b) = (x - f32x8::splat(simd, turn), x + f32x8::splat(simd, turn));
            sum = sum + vector::exp(simd, a * a * factor) + vector::exp(simd, b * b * factor);
            turn += std::f32::consts::TAU;
        }
        sum
    } else {
        e / ((one + e) * (one + e))
    };
    (azimuthal.select(around, e * bessel) * norm).to_array()
}
