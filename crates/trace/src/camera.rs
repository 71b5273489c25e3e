//! A perspective camera with a thin lens, and the pixel filter by importance sampling.

use accel::Ray;
use math::{Vec3, normal, warp};
use scene::{Camera, FilmSettings, Filter};

/// The filter's shape as a map from a uniform number to an offset in pixels.
///
/// Every sample then counts for one pixel only and equally: pixels stay independent.
#[derive(Clone, Debug)]
pub(crate) enum PixelFilter {
    Box {
        width: f32,
    },
    /// Cut off at half the width, with a standard deviation of a quarter of it.
    Gaussian {
        width: f32,
    },
    /// The inverse of the distribution function, tabulated.
    BlackmanHarris {
        width: f32,
        inverse: Vec<f32>,
    },
}

/// Half the width of the Gaussian filter in standard deviations.
const GAUSSIAN_CUT: f64 = 2.0;

impl PixelFilter {
    pub(crate) fn new(filter: Filter, width: f32) -> Self {
        match filter {
            Filter::Box => Self::Box { width },
            Filter::Gaussian => Self::Gaussian { width },
            Filter::BlackmanHarris => {
                // Four-term window on [-½, ½]; its integral is closed: Σ a_i sin(2πi x)/(2πi).
                const A: [f64; 4] = [0.358_75, 0.488_29, 0.141_28, 0.011_68];
                let tau = std::f64::consts::TAU;
                let below = |x: f64| {
                    let ripples: f64 = (1..4).map(|i| A[i] * (tau * i as f64 * x).sin() / (tau * i as f64)).sum();
                    0.5 + (A[0] * x + ripples) / A[0]
                };
                let n = 1024;
                let inverse = (0..=n)
                    .map(|i| {
                        let target = f64::from(i) / f64::from(n);
                        let (mut lo, mut hi) = (-0.5, 0.5);
                        for _ in 0..60 {
                            let x = 0.5 * (lo + hi);
                            if below(x) < target { lo = x } else { hi = x }
                        }
                        (0.5 * (lo + hi)) as f32
                    })
                    .collect();
                Self::BlackmanHarris { width, inverse }
            }
        }
    }

    /// Offset from the pixel's centre, pixels.
    pub(crate) fn offset(&self, xi: f32) -> f32 {
        match self {
            Self::Box { width } => width * (xi - 0.5),
            Self::Gaussian { width } => {
                let edge = normal::cdf(-GAUSSIAN_CUT);
                let x = normal::quantile(edge + f64::from(xi) * (1.0 - 2.0 * edge));
                width * 0.5 * (x / GAUSSIAN_CUT).clamp(-1.0, 1.0) as f32
            }
            Self::BlackmanHarris { width, inverse } => {
                let at = xi * (inverse.len() - 1) as f32;
                let i = (at as usize).min(inverse.len() - 2);
                width * math::lerp(inverse[i], inverse[i + 1], at - i as f32)
            }
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct PreparedCamera {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Half extents of the picture at distance 1.
    half: [f32; 2],
    /// Height of a pixel at distance 1.
    pixel: f32,
    size: [f32; 2],
    aperture_radius: f32,
    focus_distance: f32,
    filter: PixelFilter,
}

impl PreparedCamera {
    pub(crate) fn new(camera: &Camera, film: &FilmSettings) -> Self {
        let [right, up, forward] = camera.axes();
        let half_y = (0.5 * camera.fov_y).tan();
        let size = [film.width as f32, film.height as f32];
        Self {
            position: camera.position,
            right,
            up,
            forward,
            half: [half_y * size[0] / size[1], half_y],
            pixel: 2.0 * half_y / size[1],
            size,
            aperture_radius: camera.aperture_radius,
            focus_distance: camera.focus_distance,
            filter: PixelFilter::new(film.filter, film.filter_width),
        }
    }

    /// How many pixels wide something of this diameter looks at `position`.
    pub(crate) fn width_px(&self, position: Vec3, diameter: f32) -> f32 {
        let depth = (position - self.position).dot(self.forward);
        // In the plane of the lens itself everything is infinitely wide.
        if depth > 0.0 { diameter / (self.pixel * depth) } else { f32::INFINITY }
    }

    /// The ray of pixel `(x, y)`; `u` is filter x, y and lens x, y.
    pub(crate) fn ray(&self, x: u32, y: u32, u: [f32; 4]) -> Ray {
        let px = (x as f32 + 0.5 + self.filter.offset(u[0])) / self.size[0];
        let py = (y as f32 + 0.5 + self.filter.offset(u[1])) / self.size[1];
        let across = self.right * ((2.0 * px - 1.0) * self.half[0]) + self.up * ((1.0 - 2.0 * py) * self.half[1]);
        let dir = (self.forward + across).normalize();
        if self.aperture_radius <= 0.0 {
            return Ray::new(self.position, dir);
        }
        let lens = warp::disk([u[2], u[3]]) * self.aperture_radius;
        let origin = self.position + self.right * lens.x + self.up * lens.y;
        // The sharp plane lies at right angles to the view.
        let focus = self.position + dir * (self.focus_distance / dir.dot(self.forward));
        Ray::new(origin, (focus - origin).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_centred_and_as_wide_as_asked() {
        for (filter, deviation) in [
            // Standard deviations per unit of width: 1/√12, a Gaussian cut at 2σ, and for the window
            // √([a0/12 + Σ (-1)^i a_i/(2π²i²)]/a0).
            (Filter::Box, 0.288_7),
            (Filter::Gaussian, 0.219_9),
            (Filter::BlackmanHarris, 0.138_5),
        ] {
            let f = PixelFilter::new(filter, 1.5);
            let n = 100_000;
            let offsets: Vec<f64> = (0..n).map(|i| f64::from(f.offset((i as f32 + 0.5) / n as f32))).collect();
            let mean = offsets.iter().sum::<f64>() / f64::from(n);
            let var = offsets.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
            assert!(mean.abs() < 1e-4, "{filter:?}: {mean}");
            assert!((var.sqrt() / 1.5 - deviation).abs() < 2e-3, "{filter:?}: {}", var.sqrt() / 1.5);
            assert!(offsets.iter().all(|x| x.abs() <= 0.7501));
        }
    }
}
