//! Cubic curve spans through four values of any vector type.

use std::ops::{Add, Mul};

/// Point at `t` in `[0, 1]` of the Catmull-Rom span from `p[1]` to `p[2]`.
#[inline]
pub(crate) fn catmull_rom<V: Copy + Add<Output = V> + Mul<f32, Output = V>>(p: [V; 4], t: f32) -> V {
    let (t2, t3) = (t * t, t * t * t);
    p[0] * (-0.5 * t3 + t2 - 0.5 * t)
        + p[1] * (1.5 * t3 - 2.5 * t2 + 1.0)
        + p[2] * (-1.5 * t3 + 2.0 * t2 + 0.5 * t)
        + p[3] * (0.5 * t3 - 0.5 * t2)
}

/// Derivative by `t` of [`catmull_rom`].
#[inline]
pub(crate) fn catmull_rom_derivative<V: Copy + Add<Output = V> + Mul<f32, Output = V>>(p: [V; 4], t: f32) -> V {
    let t2 = t * t;
    p[0] * (-1.5 * t2 + 2.0 * t - 0.5)
        + p[1] * (4.5 * t2 - 5.0 * t)
        + p[2] * (-4.5 * t2 + 4.0 * t + 0.5)
        + p[3] * (1.5 * t2 - t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_pass_through_their_points_and_join_smoothly() {
        let p = [1.0_f32, 3.0, -2.0, 5.0, 0.5];
        let (a, b) = ([p[0], p[1], p[2], p[3]], [p[1], p[2], p[3], p[4]]);
        assert_eq!(catmull_rom(a, 0.0), p[1]);
        assert!((catmull_rom(a, 1.0) - p[2]).abs() < 1e-6);
        let (left, right) = (catmull_rom_derivative(a, 1.0), catmull_rom_derivative(b, 0.0));
        assert!((left - right).abs() < 1e-5);
    }
}
