//! Stateless randomness: every random number is a function of what it is for.

/// A well-mixed 32-bit hash of one word.
///
/// Source: the "lowbias32" integer hash found by C. Wellons' hash prospector.
#[inline]
pub fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A hash of two words; the order matters.
#[inline]
pub fn mix2(a: u32, b: u32) -> u32 {
    mix(mix(a).wrapping_add(0x9e37_79b9) ^ b.wrapping_mul(0x85eb_ca6b))
}

/// A hash of three words; the order matters.
#[inline]
pub fn mix3(a: u32, b: u32, c: u32) -> u32 {
    mix2(mix2(a, b), c)
}

/// A number in `[0, 1)` for `index` in the stream `stream`.
#[inline]
pub fn unit(index: u32, stream: u32) -> f32 {
    to_unit(mix2(stream, index))
}

/// The top 24 bits of a word as a number in `[0, 1)`.
#[inline]
pub fn to_unit(word: u32) -> f32 {
    (word >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A number in `[-1, 1)` for `index` in the stream `stream`.
#[inline]
pub fn signed(index: u32, stream: u32) -> f32 {
    2.0 * unit(index, stream) - 1.0
}

/// A normally distributed number for `index` in the stream `stream`: mean 0, standard deviation 1.
#[inline]
pub fn gaussian(index: u32, stream: u32) -> f32 {
    // Half a step inside the interval: the quantile of 0 is infinite.
    crate::normal::quantile(f64::from(unit(index, stream)) + 0.5 / 16_777_216.0) as f32
}

/// Smooth noise along a line: period none, range about `[-1, 1]`, one feature per unit of `x`.
///
/// Gradient noise with a quintic fade, so first and second derivatives are continuous.
pub fn noise_1d(x: f32, stream: u32) -> f32 {
    let cell = x.floor();
    let t = x - cell;
    let i = cell as i64 as u32;
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let a = signed(i, stream) * t;
    let b = signed(i.wrapping_add(1), stream) * (t - 1.0);
    2.0 * (a + (b - a) * fade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_numbers_fill_the_interval_evenly() {
        // 64 bins of 4096 expected: χ² with 63 degrees of freedom exceeds 120 with probability 2e-5;
        // the stream is fixed, so this either always passes or never does.
        let mut bins = [0_u32; 64];
        for i in 0..64 * 4096 {
            bins[(unit(i, 7) * 64.0) as usize] += 1;
        }
        let chi2: f64 = bins.iter().map(|&n| (f64::from(n) - 4096.0).powi(2) / 4096.0).sum();
        assert!(chi2 < 120.0, "{chi2}");
    }

    #[test]
    fn noise_is_continuous_and_bounded() {
        let mut last = noise_1d(-3.0, 5);
        for i in 1..6000 {
            let n = noise_1d(-3.0 + i as f32 * 1e-3, 5);
            assert!((n - last).abs() < 0.02 && n.abs() <= 1.0);
            last = n;
        }
    }
}
