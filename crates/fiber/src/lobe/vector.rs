//! Eight numbers at once: the elementary functions that quadratures over the cross-section need.
//!
//! No fused multiply-add and no approximate reciprocals: every instruction set gives the same bits.
//! Everything is inlined into the function that was made for an instruction set; closures and array
//! adaptors are avoided because they would stay outside it.

use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdCvtTruncate, SimdFloat, f32x8, i32x8, mask32x8};

use super::bessel::{LARGE_F32 as LARGE, SMALL_F32 as SMALL};

/// Lanes of a vector.
pub(crate) const LANES: usize = 8;

/// `e^x` for `x <= 0` (and a little above); 0 below -87. Relative error below 2e-7.
///
/// Source: range reduction by the two-part logarithm of 2 and the polynomial of the Cephes library.
#[inline(always)]
pub(crate) fn exp<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let low = x.simd_lt(f32x8::splat(simd, -87.0));
    let x = x.max(f32x8::splat(simd, -87.0));
    let n = (x * f32x8::splat(simd, std::f32::consts::LOG2_E)).round_ties_even();
    let r = x - n * f32x8::splat(simd, 0.693_359_4) + n * f32x8::splat(simd, 2.121_944_4e-4);
    let mut y = f32x8::splat(simd, 1.987_569_1e-4);
    y = y * r + f32x8::splat(simd, 1.398_199_9e-3);
    y = y * r + f32x8::splat(simd, 8.333_452e-3);
    y = y * r + f32x8::splat(simd, 4.166_579_6e-2);
    y = y * r + f32x8::splat(simd, 1.666_666_5e-1);
    y = y * r + f32x8::splat(simd, 5.000_000_3e-1);
    y = y * r * r + r + f32x8::splat(simd, 1.0);
    let power = (i32x8::truncate_from(n) + i32x8::splat(simd, 127)) << 23_u32;
    low.select(f32x8::splat(simd, 0.0), y * power.bitcast::<f32x8<S>>())
}

/// `asin x` for `x` in `[0, 1]`. Error below 2e-7.
#[inline(always)]
pub(crate) fn asin<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let small = x.simd_lt(f32x8::splat(simd, 0.5));
    let half_rest = (f32x8::splat(simd, 1.0) - x) * f32x8::splat(simd, 0.5);
    let z = small.select(x * x, half_rest);
    let t = small.select(x, half_rest.sqrt());
    let mut p = f32x8::splat(simd, 4.216_32e-2);
    p = p * z + f32x8::splat(simd, 2.418_131e-2);
    p = p * z + f32x8::splat(simd, 4.547_002_6e-2);
    p = p * z + f32x8::splat(simd, 7.495_300_3e-2);
    p = p * z + f32x8::splat(simd, 1.666_675_2e-1);
    let y = t + t * z * p;
    small.select(y, f32x8::splat(simd, std::f32::consts::FRAC_PI_2) - f32x8::splat(simd, 2.0) * y)
}

/// `|x|` after wrapping into `[-π, π]`.
#[inline(always)]
pub(crate) fn abs_wrapped<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    let turns = (x * f32x8::splat(simd, 1.0 / std::f32::consts::TAU)).round_ties_even();
    (x - turns * f32x8::splat(simd, std::f32::consts::TAU)).abs()
}

/// `I0(z) e^{-z}` for `z >= 0`, but without the exponential where `lower` (`z < 3.75`) is true.
///
/// Source: polynomials 9.8.1 and 9.8.2 of Abramowitz & Stegun, as in [`i0e`](super::bessel::i0e).
#[inline(always)]
pub(crate) fn i0e_without_exponential<S: Simd>(simd: S, z: f32x8<S>, lower: mask32x8<S>) -> f32x8<S> {
    let t = z * f32x8::splat(simd, 1.0 / 3.75);
    let y = t * t;
    let mut small = f32x8::splat(simd, SMALL[6]);
    let mut i = 6;
    while i > 0 {
        i -= 1;
        small = small * y + f32x8::splat(simd, SMALL[i]);
    }
    let z = z.max(f32x8::splat(simd, 3.75));
    let y = f32x8::splat(simd, 3.75) / z;
    let mut large = f32x8::splat(simd, LARGE[8]);
    let mut i = 8;
    while i > 0 {
        i -= 1;
        large = large * y + f32x8::splat(simd, LARGE[i]);
    }
    lower.select(small, large / z.sqrt())
}

/// The lanes added up, always in the same order.
#[inline(always)]
pub(crate) fn sum<S: Simd>(x: f32x8<S>) -> f32 {
    let [a, b, c, d, e, f, g, h] = x.to_array();
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// Runs code made for the best instruction set of the machine.
macro_rules! vectorised {
    ($simd:ident => $work:expr) => {{
        static LEVEL: std::sync::OnceLock<fearless_simd::Level> = std::sync::OnceLock::new();
        let level = *LEVEL.get_or_init(fearless_simd::Level::new);
        fearless_simd::dispatch!(level, $simd => $work)
    }};
}
pub(crate) use vectorised;

#[cfg(test)]
mod tests {
    use super::*;

    fn through(level: fearless_simd::Level, x: [f32; LANES], which: u8) -> [f32; LANES] {
        #[inline(always)]
        fn work<S: Simd>(simd: S, x: [f32; LANES], which: u8) -> [f32; LANES] {
            let x = f32x8::load_array(simd, x);
            match which {
                0 => exp(simd, x).to_array(),
                1 => asin(simd, x).to_array(),
                _ => abs_wrapped(simd, x).to_array(),
            }
        }
        fearless_simd::dispatch!(level, simd => work(simd, x, which))
    }

    fn each(from: f32, to: f32, which: u8, mut check: impl FnMut(f64, f64)) {
        let n = 20_000;
        for chunk in 0..n / LANES {
            let x: [f32; LANES] =
                std::array::from_fn(|i| from + (to - from) * ((chunk * LANES + i) as f32 / (n - 1) as f32));
            let best = through(fearless_simd::Level::new(), x, which);
            assert_eq!(best, through(fearless_simd::Level::baseline(), x, which), "instruction sets differ");
            for (x, y) in x.iter().zip(best) {
                check(f64::from(*x), f64::from(y));
            }
        }
    }

    #[test]
    fn exponentials_are_right_to_the_last_bits() {
        each(-86.5, 1.0, 0, |x, y| assert!((y / x.exp() - 1.0).abs() < 3e-7, "exp {x} is {y}"));
        each(-1e6, -87.1, 0, |_, y| assert_eq!(y, 0.0));
    }

    #[test]
    fn arc_sines_are_right_to_the_last_bits() {
        each(0.0, 1.0, 1, |x, y| assert!((y - x.asin()).abs() < 3e-7, "asin {x} is {y}"));
    }

    #[test]
    fn wrapping_keeps_the_cosine() {
        each(-20.0, 20.0, 2, |x, y| {
            assert!(
                (0.0..=std::f64::consts::PI + 1e-5).contains(&y) && (y.cos() - x.cos()).abs() < 4e-6,
                "|wrap {x}| is {y}"
            );
        });
    }
}
