//! The shapes of all lobes of a near-field model at once: `L_p N_p` of R, TT, TRT and the residual lobe.
//!
//! In double precision this is the sum of its parts. In single precision the seven exponentials share one
//! vector, and so do the four Bessel functions: half the time of a near-field evaluation was there.

use fearless_simd::{Select, Simd, SimdBase, f32x8};
use math::Real;

use super::azimuthal::Kernel;
use super::longitudinal::{Cone, Lobe, Tilt};
use super::vector::{self, LANES, vectorised};
use crate::wrap_angle;

/// Longitudinal and azimuthal lobes with everything that no direction changes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shapes<F> {
    pub(crate) lobes: [Lobe<F>; 4],
    pub(crate) kernel: Kernel,
    /// Scale of the kernel of R, TT, TRT, radians.
    pub(crate) scales: [F; 3],
    /// In single precision: sine and cosine of the cones, factors in the exponents, norms. Lanes 0 to 3 are
    /// longitudinal lobes, 4 to 6 azimuthal kernels (which have no cones), 7 is nothing.
    packed: [[f32; LANES]; 4],
}

fn pack<F: Real>(lobes: &[Lobe<F>; 4], inv: [F; 3], norms: [F; 3]) -> [[f32; LANES]; 4] {
    let lanes = |along: fn(&Lobe<F>) -> F, around: [F; 3], last: f32| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|p| along(&lobes[p]).f64() as f32);
        let [e, f, g] = around.map(|x| x.f64() as f32);
        [a, b, c, d, e, f, g, last]
    };
    let none = [F::zero(); 3];
    [
        lanes(|l| l.cone.sin, none, 0.0),
        lanes(|l| l.cone.cos, none, 0.0),
        lanes(|l| l.inv_v, inv, 0.0),
        lanes(|l| l.norm, norms, 1.0),
    ]
}

impl<F: Real> Shapes<F> {
    fn new(lobes: [Lobe<F>; 4], kernel: Kernel, scales: [F; 3]) -> Self {
        let inv = scales.map(|s| match kernel {
            Kernel::Gaussian => F::of(-0.5) / s.sqr(),
            Kernel::Logistic => -s.recip(),
        });
        let same = scales[1] == scales[0] && scales[2] == scales[0];
        let norms = if same { [kernel.norm(scales[0]); 3] } else { scales.map(|s| kernel.norm(s)) };
        let packed = if F::DOUBLE { [[0.0; LANES]; 4] } else { pack(&lobes, inv, norms) };
        Self { lobes, kernel, scales, packed }
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
            let [a, b, c] = x.map(|x| x.f64() as f32);
            let x = [0.0, 0.0, 0.0, 0.0, a, b, c, 0.0];
            let (sin_s, cos_s) = (sin_s.f64() as f32, cos_s.f64() as f32);
            let widest = self.scales[0].max(self.scales[1]).max(self.scales[2]).f64() as f32;
            let single = Single { packed: &self.packed, x, kernel: self.kernel, widest };
            let y = vectorised!(simd => shapes_at_once(simd, &single, sin_s, cos_s));
            [y[0] * y[4], y[1] * y[5], y[2] * y[6], y[3] * (1.0 / std::f32::consts::TAU)].map(|x| F::of(f64::from(x)))
        }
    }
}

/// What of the shapes no shading point changes: all but where the cones lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blur<F> {
    /// As seen at right angles and without a tilt.
    shapes: Shapes<F>,
    tilt: Tilt<F>,
}

impl<F: Real> Blur<F> {
    /// For longitudinal variances, the tilt of the scales, and the azimuthal kernel of R, TT, TRT.
    pub(crate) fn new(v: [F; 4], alpha: F, kernel: Kernel, scales: [F; 3]) -> Self {
        let tilt = Tilt::new(alpha);
        let straight = Tilt::new(F::zero()).cones(F::zero(), F::one());
        let lobes = [0, 1, 2].map(|p| Lobe::new(v[p], straight[p]));
        // The residual lobe is often as wide as TRT.
        let rest = if v[3] == v[2] { lobes[2] } else { Lobe::new(v[3], straight[3]) };
        Self { shapes: Shapes::new([lobes[0], lobes[1], lobes[2], rest], kernel, scales), tilt }
    }

    /// Where the cones lie for a known inclination.
    #[inline]
    pub(crate) fn cones(&self, sin_k: F, cos_k: F) -> [Cone<F>; 4] {
        self.tilt.cones(sin_k, cos_k)
    }

    /// The shapes around these cones.
    #[inline]
    pub(crate) fn around(&self, cones: [Cone<F>; 4]) -> Shapes<F> {
        let mut shapes = self.shapes;
        for (p, cone) in cones.into_iter().enumerate() {
            shapes.lobes[p].cone = cone;
            shapes.packed[0][p] = cone.sin.f64() as f32;
            shapes.packed[1][p] = cone.cos.f64() as f32;
        }
        shapes
    }
}

/// What the lanes of [`Shapes`] are asked.
struct Single<'a> {
    packed: &'a [[f32; LANES]; 4],
    x: [f32; LANES],
    kernel: Kernel,
    widest: f32,
}

#[inline(always)]
fn shapes_at_once<S: Simd>(simd: S, single: &Single<'_>, sin_s: f32, cos_s: f32) -> [f32; LANES] {
    let azimuthal = f32x8::load_array(simd, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]).simd_gt(f32x8::splat(simd, 0.5));
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let factor = f32x8::load_array_ref(simd, &single.packed[2]);

    // Longitudinal: exp(-q/v) I0e(z), with the exponential of I0e's lower branch in the same exponent.
    let cone_sin = f32x8::load_array_ref(simd, &single.packed[0]);
    let cone_cos = f32x8::load_array_ref(simd, &single.packed[1]);
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
    let norm = f32x8::load_array_ref(simd, &single.packed[3]);
    let bessel = vector::i0e_without_exponential(simd, z, lower);
    let around = if gaussian {
        let mut sum = e;
        let mut turn = std::f32::consts::TAU;
        while turn - std::f32::consts::PI < (6.0 * single.widest).min(60.0) {
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
