//! Skies that are known in closed form: a constant and a few von Mises-Fisher lobes.

use std::f64::consts::{PI, TAU};

use math::{DVec3, Rgb};
use scene::EnvironmentImage;

/// Radiance over directions, grey. The integral of a lobe over the sphere is its weight.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sky {
    pub(crate) name: &'static str,
    pub(crate) base: f64,
    pub(crate) lobes: Vec<Lobe>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lobe {
    pub(crate) weight: f64,
    /// Concentration: the standard deviation is about `1/√κ` radians.
    pub(crate) kappa: f64,
    /// Any length.
    pub(crate) towards: DVec3,
}

impl Sky {
    /// Two broad lights, 29 and 33 degrees wide: the environment in which the claim is tried.
    pub(crate) fn soft() -> Self {
        let lobe = |kappa, x, y, z| Lobe { weight: 3.0, kappa, towards: DVec3::new(x, y, z) };
        Self { name: "soft", base: 0.25, lobes: vec![lobe(4.0, 0.3, 0.8, 0.52), lobe(3.0, -0.5, 0.1, -0.8)] }
    }

    /// Three compact lights, 20, 13 and 7 degrees wide.
    pub(crate) fn compact() -> Self {
        let lobe = |kappa, x, y, z| Lobe { weight: 3.0, kappa, towards: DVec3::new(x, y, z) };
        let lobes = vec![lobe(8.0, 0.3, 0.8, 0.52), lobe(20.0, -0.5, 0.1, -0.8), lobe(60.0, 0.7, -0.2, 0.6)];
        Self { name: "compact", base: 0.25, lobes }
    }

    /// Radiance from a direction.
    pub(crate) fn radiance(&self, dir: DVec3) -> f64 {
        let lobes = self.lobes.iter().map(|lobe| {
            let towards = lobe.towards / lobe.towards.length();
            // Normalised without overflow: κ/(2π(1 - e^{-2κ})) e^{κ(cos - 1)}.
            let top = lobe.kappa / (TAU * -(-2.0 * lobe.kappa).exp_m1());
            lobe.weight * top * (lobe.kappa * (dir.dot(towards) - 1.0)).exp()
        });
        self.base + lobes.sum::<f64>()
    }

    /// Its integral over the sphere.
    pub(crate) fn total(&self) -> f64 {
        4.0 * PI * self.base + self.lobes.iter().map(|lobe| lobe.weight).sum::<f64>()
    }

    /// As a lat-long picture of `2 height` by `height` texels.
    pub(crate) fn image(&self, height: u32) -> EnvironmentImage {
        let width = 2 * height;
        let pixels = (0..width * height)
            .map(|i| {
                let u = (f64::from(i % width) + 0.5) / f64::from(width);
                let v = (f64::from(i / width) + 0.5) / f64::from(height);
                let ((sin, cos), (sin_u, cos_u)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
                Rgb::splat(self.radiance(DVec3::new(sin * sin_u, cos, -sin * cos_u)) as f32)
            })
            .collect();
        EnvironmentImage { width, height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use fiber::quadrature::rule;

    use super::*;

    #[test]
    fn a_sky_holds_its_lights() {
        for sky in [Sky::soft(), Sky::compact()] {
            let mut sum = 0.0;
            for &(x, wx) in rule(160) {
                for &(y, wy) in rule(256) {
                    let (radius, phi) = ((1.0 - x * x).sqrt(), PI * y);
                    sum += wx * wy * PI * sky.radiance(DVec3::new(radius * phi.cos(), x, radius * phi.sin()));
                }
            }
            assert!((sum / sky.total() - 1.0).abs() < 1e-6, "{}: {sum} and {}", sky.name, sky.total());
        }
    }

    #[test]
    fn pictures_hold_the_total_of_the_closed_form() {
        for sky in [Sky::soft(), Sky::compact()] {
            let image = sky.image(128);
            let mut sum = 0.0;
            for (i, pixel) in image.pixels.iter().enumerate() {
                let v = (f64::from(i as u32 / image.width) + 0.5) / f64::from(image.height);
                sum += f64::from(pixel[0]) * (PI * v).sin();
            }
            sum *= 2.0 * PI * PI / f64::from(image.width * image.height);
            // Midpoint rule on 128 rows.
            assert!((sum / sky.total() - 1.0).abs() < 1e-3, "{}: {sum} and {}", sky.name, sky.total());
        }
    }

    #[test]
    fn a_picture_has_its_lights_where_the_sky_has_them() {
        let sky = Sky::compact();
        let image = sky.image(90);
        let brightest = (0..image.pixels.len()).max_by(|&a, &b| image.pixels[a][0].total_cmp(&image.pixels[b][0]));
        let i = brightest.unwrap() as u32;
        let want = DVec3::new(0.7, -0.2, 0.6).normalize();
        let azimuth = (f64::from(i % image.width) + 0.5) / f64::from(image.width) * TAU;
        let polar = (f64::from(i / image.width) + 0.5) / f64::from(image.height) * PI;
        assert!((polar.cos() - want.y).abs() < 0.05, "{polar}");
        // A quarter from the left is +x, the middle +z.
        let flat = DVec3::new(azimuth.sin(), 0.0, -azimuth.cos());
        assert!(flat.dot(DVec3::new(want.x, 0.0, want.z).normalize()) > 0.998, "{azimuth}");
    }
}
