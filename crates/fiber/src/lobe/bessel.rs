//! The modified Bessel function of order zero, scaled so that it cannot overflow.

use math::Real;

/// `exp(-|x|) I0(x)`: 1 at 0, falling like `1 / sqrt(2πx)`.
///
/// Double precision: relative error below 1e-15 by Chebyshev series on `[0, 8]` and on `8/x`, fitted for
/// this crate to 40 digits. Single precision: below 3e-7 by the polynomials 9.8.1 and 9.8.2 of
/// Abramowitz & Stegun.
#[inline]
pub fn i0e<F: Real>(x: F) -> F {
    if F::DOUBLE { F::of(i0e_f64(x.f64())) } else { F::of(f64::from(i0e_f32(x.f64() as f32))) }
}

/// Powers of `(x/3.75)²` in `I0(x)`, for `x < 3.75`.
pub(super) const SMALL_F32: [f32; 7] =
    [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3];

/// Powers of `3.75/x` in `sqrt(x) e^{-x} I0(x)`, above.
pub(super) const LARGE_F32: [f32; 9] = [
    0.398_942_3,
    0.013_285_92,
    0.002_253_19,
    -0.001_575_65,
    0.009_162_81,
    -0.020_577_06,
    0.026_355_37,
    -0.016_476_33,
    0.003_923_77,
];

#[inline]
fn i0e_f32(x: f32) -> f32 {
    let x = x.abs();
    let poly = |c: &[f32], y: f32| c.iter().rev().fold(0.0, |acc, &k| acc * y + k);
    if x < 3.75 {
        let y = (x / 3.75) * (x / 3.75);
        (-x).exp() * poly(&SMALL_F32, y)
    } else {
        poly(&LARGE_F32, 3.75 / x) / x.sqrt()
    }
}

fn i0e_f64(x: f64) -> f64 {
    let x = x.abs();
    if x <= 8.0 { chebyshev(&SMALL, x / 4.0 - 1.0) } else { chebyshev(&LARGE, 16.0 / x - 1.0) / x.sqrt() }
}

/// Clenshaw's recurrence for `c0/2 + Σ c_j T_j(t)`.
fn chebyshev(c: &[f64], t: f64) -> f64 {
    let (mut b1, mut b2) = (0.0, 0.0);
    for &k in c[1..].iter().rev() {
        (b1, b2) = (2.0 * t * b1 - b2 + k, b1);
    }
    t * b1 - b2 + 0.5 * c[0]
}

#[rustfmt::skip]
const SMALL: [f64; 30] = [
    0.6767952744094761,
    -0.3046826723431984,
    0.17162090152220877,
    -0.09490109704804764,
    0.04930528423967071,
    -0.02373741480589947,
    0.010546460394594998,
    -0.004324309995050576,
    0.0016394756169413357,
    -0.0005763755745385824,
    0.00018850288509584165,
    -5.754195010082104e-05,
    1.6448448070728896e-05,
    -4.4167383584587505e-06,
    1.1173875391201037e-06,
    -2.670793853940612e-07,
    6.046995022541919e-08,
    -1.300025009986248e-08,
    2.6598237246823866e-09,
    -5.189795601635263e-10,
    9.675809035373237e-11,
    -1.726826291441556e-11,
    2.95505266312964e-12,
    -4.856446783111929e-13,
    7.676185498604936e-14,
    -1.1685332877993451e-14,
    1.715391285555133e-15,
    -2.431279846547955e-16,
    3.3307945188222384e-17,
    -4.4153416464793395e-18,
];

#[rustfmt::skip]
const LARGE: [f64; 27] = [
    0.8044904110141088,
    0.0033691164782556943,
    6.889758346916825e-05,
    2.8913705208347567e-06,
    2.0489185894690638e-07,
    2.266668990498178e-08,
    3.3962320257083865e-09,
    4.94060238822497e-10,
    1.1889147107846439e-11,
    -3.1499165279632416e-11,
    -1.3215811840447713e-11,
    -1.7941785315068062e-12,
    7.180124451383666e-13,
    3.8527783827421426e-13,
    1.54008621752141e-14,
    -4.150569347287222e-14,
    -9.554846698828307e-15,
    3.8116806693526224e-15,
    1.7725601330565263e-15,
    -3.425485619677219e-16,
    -2.8276239805165836e-16,
    3.461222867697461e-17,
    4.46562142029676e-17,
    -4.830504485944182e-18,
    -7.233180487874754e-18,
    9.921475412173699e-19,
    1.193650890845982e-18,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The defining series, summed in double precision: all terms positive, so no cancellation.
    fn series(x: f64) -> f64 {
        let (mut term, mut sum, mut k) = (1.0_f64, 1.0_f64, 1.0);
        while term > sum * 1e-18 {
            term *= (x / (2.0 * k)).powi(2);
            sum += term;
            k += 1.0;
        }
        sum * (-x).exp()
    }

    #[test]
    fn agrees_with_the_series() {
        for i in 0..4000 {
            let x = f64::from(i) * 0.1;
            let want = series(x);
            assert!((i0e(x) / want - 1.0).abs() < 2e-14, "{x}");
            assert!((f64::from(i0e(x as f32)) / series(f64::from(x as f32)) - 1.0).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn large_arguments_follow_the_asymptote() {
        // I0e(x) sqrt(2πx) = 1 + 1/(8x) + 9/(128x²) + O(x⁻³)
        for x in [1e3, 1e5, 1e8, 1e15] {
            let want = 1.0 + 1.0 / (8.0 * x) + 9.0 / (128.0 * x * x);
            assert!((i0e(x) * (std::f64::consts::TAU * x).sqrt() - want).abs() < 1e-10, "{x}");
        }
    }
}
