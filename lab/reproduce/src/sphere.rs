//! Directions that are drawn and turned at random: what experiments at a single point of a fiber share.

use std::f64::consts::PI;

use fiber::{DIMS, Dir};
use math::{DVec3, Frame, Real, hash, warp};

/// The numbers of sample `index` in `stream`, uniform over `[0, 1)`.
pub(crate) fn numbers<F: Real>(index: u32, stream: u32) -> [F; DIMS] {
    let mut dimension = 0;
    [F::zero(); DIMS].map(|_| {
        dimension += 1;
        F::of(f64::from(hash::unit(index, hash::mix2(stream, dimension))))
    })
}

/// A direction uniform over the sphere, from the first two of the numbers of a sample.
pub(crate) fn uniform<F: Real>(u: [F; DIMS]) -> Dir<F> {
    Dir::from_sin(F::one() - F::of(2.0) * u[0], F::TAU() * u[1])
}

/// The sphere, steradians.
pub(crate) const SPHERE: f64 = 4.0 * PI;

/// Density of [`uniform`], per steradian.
pub(crate) const UNIFORM: f64 = 1.0 / SPHERE;

/// A frame turned at random, the same for the same index and seed: its axes in the world.
pub(crate) fn frame(index: u32, seed: u32) -> [DVec3; 3] {
    let u = |stream: u32| hash::unit(index, hash::mix2(seed, stream));
    let frame = Frame::around(warp::uniform_sphere([u(101), u(102)]));
    let (sin, cos) = (std::f32::consts::TAU * u(103)).sin_cos();
    let v = frame.v * cos + frame.w * sin;
    [frame.u, v, frame.u.cross(v)].map(|axis| axis.as_dvec3())
}

/// A vector of the fiber's frame in the world.
pub(crate) fn to_world(axes: &[DVec3; 3], [u, v, w]: [f64; 3]) -> DVec3 {
    axes[0] * u + axes[1] * v + axes[2] * w
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_directions_have_no_preference() {
        // 4 deviations of the mean of 20,000 components of variance 1/3, a false alarm in 16,000 each.
        let mut sums = [0.0; 3];
        for i in 0..20_000 {
            let dir: Dir<f64> = uniform(numbers(i, 9));
            for (sum, x) in sums.iter_mut().zip(dir.to_local()) {
                *sum += x / 20_000.0;
            }
        }
        assert!(sums.iter().all(|x| x.abs() < 4.0 / (3.0 * 20_000.0_f64).sqrt()), "{sums:?}");
    }

    #[test]
    fn frames_are_right_handed_and_differ() {
        for i in 0..50 {
            let [u, v, w] = frame(i, 3);
            assert!((u.cross(v) - w).length() < 1e-5 && u.dot(v).abs() < 1e-5 && (u.length() - 1.0).abs() < 1e-5);
            assert!((frame(i + 1, 3)[0] - u).length() > 1e-4);
            assert!((to_world(&[u, v, w], [0.0, 1.0, 0.0]) - v).length() < 1e-12);
        }
    }
}
