//! Gauss-Legendre rules, made once and kept.

use std::sync::OnceLock;

/// The rules that exist; [`rule`] rounds up to the next.
pub const SIZES: [usize; 14] = [8, 16, 24, 32, 48, 64, 80, 96, 112, 128, 160, 192, 224, 256];

/// A rule on `[-1, 1]`: nodes in ascending order with their weights, which sum to 2.
pub type Rule = [(f64, f64)];

/// The smallest kept rule with at least `n` nodes (the largest kept one beyond that).
pub fn rule(n: usize) -> &'static Rule {
    static RULES: [OnceLock<Vec<(f64, f64)>>; SIZES.len()] = [const { OnceLock::new() }; SIZES.len()];
    let i = SIZES.iter().position(|&size| size >= n).unwrap_or(SIZES.len() - 1);
    RULES[i].get_or_init(|| gauss_legendre(SIZES[i]))
}

/// Nodes and weights of any order, by Newton's method on the Legendre polynomial.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut nodes = vec![(0.0, 0.0); n];
    let order = n as f64;
    for i in 0..n.div_ceil(2) {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (order + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p0, mut p1) = (1.0, x);
            for k in 2..=n {
                let k = k as f64;
                (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
            }
            slope = order * (x * p1 - p0) / (x * x - 1.0);
            let step = p1 / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        let w = 2.0 / ((1.0 - x * x) * slope * slope);
        nodes[i] = (-x, w);
        nodes[n - 1 - i] = (x, w);
    }
    nodes
}

/// `∫ f` from `a` to `b` with `n` nodes (see [`rule`]).
pub fn integrate(a: f64, b: f64, n: usize, mut f: impl FnMut(f64) -> f64) -> f64 {
    let (centre, half) = (0.5 * (a + b), 0.5 * (b - a));
    half * rule(n).iter().map(|&(x, w)| w * f(centre + half * x)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_exact_for_polynomials() {
        for n in SIZES {
            let degree = (2 * n - 2) as i32;
            let got: f64 = rule(n).iter().map(|&(x, w)| w * x.powi(degree)).sum();
            let want = 2.0 / f64::from(degree + 1);
            assert!((got / want - 1.0).abs() < 1e-11, "{n}: {got} and {want}");
        }
    }
}
