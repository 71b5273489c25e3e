//! Small statistics for measurements.

/// The mean; NaN of nothing.
pub fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// The standard deviation of what `x` is a sample of; NaN below two.
pub fn deviation(x: &[f64]) -> f64 {
    let m = mean(x);
    (x.iter().map(|x| (x - m).powi(2)).sum::<f64>() / (x.len() as f64 - 1.0)).sqrt()
}

/// The root of the mean square; NaN of nothing.
pub fn rms(x: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for x in x {
        sum += x * x;
        n += 1.0;
    }
    (sum / n).sqrt()
}

/// The value below which the share `p` of `x` lies, straight between neighbours; NaN of nothing.
pub fn quantile(x: &[f64], p: f64) -> f64 {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = p.clamp(0.0, 1.0) * last as f64;
    let below = at as usize;
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]) * (at - below as f64)
}

/// Slope of the straight line through `points` by least squares; NaN where there is none.
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mx = points.iter().map(|p| p.0).sum::<f64>() / n;
    let my = points.iter().map(|p| p.1).sum::<f64>() / n;
    let (sxy, sxx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - mx) * (p.1 - my), xx + (p.0 - mx).powi(2)));
    sxy / sxx
}

/// A bell curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bell {
    /// Where its top is.
    pub centre: f64,
    /// Its standard deviation.
    pub deviation: f64,
    /// Its height.
    pub height: f64,
}

/// The bell curve through `points`, of which those above `share` of the highest count; `None` where they do not
/// bend like one.
///
/// A parabola through the logarithms, weighted by the squared values (Guo 2011): as exact as a fit of the curve
/// itself for small errors, and without iteration.
pub fn bell(points: &[(f64, f64)], share: f64) -> Option<Bell> {
    let top = points.iter().map(|p| p.1).fold(0.0, f64::max);
    let used = || points.iter().filter(move |p| p.1 > share * top && p.1 > 0.0);
    let weight: f64 = used().map(|p| p.1 * p.1).sum();
    let middle = used().map(|p| p.1 * p.1 * p.0).sum::<f64>() / weight;
    let spread = (used().map(|p| p.1 * p.1 * (p.0 - middle).powi(2)).sum::<f64>() / weight).sqrt();
    if !(spread > 0.0) {
        return None;
    }
    // Normal equations of ln y = a + b t + c t² with t centred and of unit size, so that they are well conditioned.
    let mut m = [[0.0; 4]; 3];
    for &(x, y) in used() {
        let t = (x - middle) / spread;
        let w = y * y;
        let powers = [1.0, t, t * t];
        for (row, p) in m.iter_mut().zip(powers) {
            for (cell, q) in row.iter_mut().zip(powers) {
                *cell += w * p * q;
            }
            row[3] += w * p * y.ln();
        }
    }
    let [a, b, c] = solve(m)?;
    if !(c < 0.0) {
        return None;
    }
    Some(Bell {
        centre: middle - spread * b / (2.0 * c),
        deviation: spread / (-2.0 * c).sqrt(),
        height: (a - b * b / (4.0 * c)).exp(),
    })
}

/// Solves three linear equations, the right side in the last column; `None` where they are dependent.
pub(crate) fn solve(mut m: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    for i in 0..3 {
        let pivot = (i..3).max_by(|&a, &b| m[a][i].abs().total_cmp(&m[b][i].abs()))?;
        m.swap(i, pivot);
        let row = m[i];
        if !(row[i].abs() > 0.0) {
            return None;
        }
        for (j, other) in m.iter_mut().enumerate() {
            if j != i {
                let factor = other[i] / row[i];
                for (cell, x) in other.iter_mut().zip(row) {
                    *cell -= factor * x;
                }
            }
        }
    }
    let x = [m[0][3] / m[0][0], m[1][3] / m[1][1], m[2][3] / m[2][2]];
    x.iter().all(|x| x.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_samples_have_the_moments_of_the_textbook() {
        let x = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!(mean(&x), 5.0);
        assert!((deviation(&x) - (32.0_f64 / 7.0).sqrt()).abs() < 1e-15);
        assert!((rms([3.0, 4.0]) - 12.5_f64.sqrt()).abs() < 1e-15);
        assert!(mean(&[]).is_nan() && deviation(&[1.0]).is_nan());
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        let x = [40.0, 10.0, 30.0, 20.0];
        assert_eq!((quantile(&x, 0.0), quantile(&x, 1.0), quantile(&x, 0.5)), (10.0, 40.0, 25.0));
        assert_eq!(quantile(&[7.0], 0.3), 7.0);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn a_power_law_has_its_exponent_as_slope() {
        let points: Vec<(f64, f64)> = [1.0, 4.0, 16.0, 64.0].map(|n: f64| (n.ln(), (3.0 / n.sqrt()).ln())).into();
        assert!((slope(&points) + 0.5).abs() < 1e-12);
        assert!(slope(&[(1.0, 1.0)]).is_nan());
    }

    #[test]
    fn a_bell_is_found_again() {
        let want = Bell { centre: 0.17, deviation: 0.04, height: 3.5 };
        let points: Vec<(f64, f64)> = (0..200)
            .map(|i| -0.5 + f64::from(i) * 0.006)
            .map(|x| (x, want.height * (-0.5 * ((x - want.centre) / want.deviation).powi(2)).exp()))
            .collect();
        let got = bell(&points, 0.3).unwrap();
        assert!((got.centre - want.centre).abs() < 1e-10, "{got:?}");
        assert!((got.deviation / want.deviation - 1.0).abs() < 1e-9, "{got:?}");
        assert!((got.height / want.height - 1.0).abs() < 1e-9, "{got:?}");
        // What rises only, or is flat, is no bell.
        assert_eq!(bell(&[(0.0, 1.0), (1.0, 2.0)], 0.3), None);
        assert_eq!(bell(&[], 0.3), None);
    }
}
