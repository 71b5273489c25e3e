//! A lat-long picture of light from all around, sampled exactly by its luminance.
//!
//! Directions are those of `scene::EnvironmentImage`: top +y, left edge -z, a quarter +x, middle +z.
//! `rotation` turns the picture about +y, counter-clockwise seen from above.
//!
//! Radiance is the bilinear interpolation of the texels, and the density is proportional to exactly that
//! (times the solid angle at the middle of a row of cells), so that a small sun does not throw fireflies
//! into its neighbour texels.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use math::{Rgb, Vec3};
use scene::EnvironmentImage;

#[derive(Debug)]
pub(crate) struct ImageEnvironment {
    image: Arc<EnvironmentImage>,
    scale: Rgb,
    rotation: f32,
    /// Luminance of the scaled texels.
    luminance: Vec<f32>,
    /// Running share of the rows of cells: `height + 2` numbers from 0 to 1.
    rows: Vec<f32>,
    /// Running share of the cells within each row: `width + 1` numbers each.
    columns: Vec<f32>,
    /// Integral of luminance times `sin θ` over the unit square.
    total: f64,
}

/// A cell between four texel centres. Rows of cells: one of half height above the first row of texels,
/// one between each two, one of half height below the last.
struct Cell {
    corners: [f32; 4],
}

impl ImageEnvironment {
    pub(crate) fn new(image: Arc<EnvironmentImage>, scale: Rgb, rotation: f32) -> Self {
        let (w, h) = (image.width as usize, image.height as usize);
        let luminance: Vec<f32> = image.pixels.iter().map(|&p| (p * scale).luminance()).collect();
        let rotation = rotation.rem_euclid(TAU);
        let mut this = Self { image, scale, rotation, luminance, rows: Vec::new(), columns: Vec::new(), total: 0.0 };
        let (mut rows, mut columns) = (vec![0.0_f64], Vec::with_capacity((h + 1) * (w + 1)));
        for row in 0..=h {
            let mut sum = 0.0_f64;
            let mut running = vec![0.0_f64];
            for column in 0..w {
                let c = this.cell(row, column).corners;
                sum += f64::from(c.iter().sum::<f32>()) * 0.25;
                running.push(sum);
            }
            let top = sum.max(f64::MIN_POSITIVE);
            columns.extend(running.iter().map(|x| (x / top) as f32));
            let weight = sum / w as f64 * f64::from(this.row_height(row)) * f64::from(this.row_sin(row));
            rows.push(rows[row] + weight);
        }
        this.total = rows[h + 1];
        let top = this.total.max(f64::MIN_POSITIVE);
        this.rows = rows.iter().map(|x| (x / top) as f32).collect();
        this.columns = columns;
        this
    }

    /// Mean radiance over the sphere, luminance.
    pub(crate) fn mean_luminance(&self) -> f32 {
        // ∫ L dω / 4π with dω = 2π² sin θ du dv.
        (self.total * std::f64::consts::PI / 2.0) as f32
    }

    fn row_height(&self, row: usize) -> f32 {
        let h = self.image.height as usize;
        if row == 0 || row == h { 0.5 / h as f32 } else { 1.0 / h as f32 }
    }

    /// Top edge of a row of cells, in `[0, 1]`.
    fn row_top(&self, row: usize) -> f32 {
        if row == 0 { 0.0 } else { (row as f32 - 0.5) / self.image.height as f32 }
    }

    fn row_sin(&self, row: usize) -> f32 {
        (PI * (self.row_top(row) + 0.5 * self.row_height(row))).sin()
    }

    /// Texels around a cell: top left, top right, bottom left, bottom right.
    fn texels(&self, row: usize, column: usize) -> [usize; 4] {
        let (w, h) = (self.image.width as usize, self.image.height as usize);
        let (above, below) = (row.saturating_sub(1), row.min(h - 1));
        let (left, right) = (column, (column + 1) % w);
        [above * w + left, above * w + right, below * w + left, below * w + right]
    }

    fn cell(&self, row: usize, column: usize) -> Cell {
        Cell { corners: self.texels(row, column).map(|i| self.luminance[i]) }
    }

    /// Picture coordinates of a direction: `u` to the right, `v` down, and the sine of the polar angle.
    fn to_uv(&self, dir: Vec3) -> (f32, f32, f32) {
        let sin = (dir.x * dir.x + dir.z * dir.z).sqrt();
        let azimuth = dir.x.atan2(-dir.z) + self.rotation;
        let u = (azimuth / TAU).rem_euclid(1.0);
        (u, sin.atan2(dir.y) / PI, sin)
    }

    fn to_dir(&self, u: f32, v: f32) -> (Vec3, f32) {
        let (sin, cos) = (PI * v).sin_cos();
        let azimuth = u * TAU - self.rotation;
        (Vec3::new(sin * azimuth.sin(), cos, -sin * azimuth.cos()), sin)
    }

    /// Cell and position in it.
    fn locate(&self, u: f32, v: f32) -> (usize, usize, f32, f32) {
        let (w, h) = (self.image.width as usize, self.image.height as usize);
        let x = (u * w as f32 - 0.5).rem_euclid(w as f32);
        let column = (x as usize).min(w - 1);
        let y = (v * h as f32 + 0.5).clamp(0.0, h as f32);
        let row = (y as usize).min(h);
        let t = (v - self.row_top(row)) / self.row_height(row);
        (row, column, (x - column as f32).clamp(0.0, 1.0), t.clamp(0.0, 1.0))
    }

    /// Radiance from a direction.
    pub(crate) fn radiance(&self, dir: Vec3) -> Rgb {
        let (u, v, _) = self.to_uv(dir);
        let (row, column, s, t) = self.locate(u, v);
        let [a, b, c, d] = self.texels(row, column).map(|i| self.image.pixels[i]);
        ((a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t) * self.scale
    }

    /// Density of [`sample`](Self::sample), per steradian.
    pub(crate) fn pdf(&self, dir: Vec3) -> f32 {
        let (u, v, sin) = self.to_uv(dir);
        let (row, column, s, t) = self.locate(u, v);
        let [a, b, c, d] = self.cell(row, column).corners;
        let l = (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t;
        self.density(l, row, sin)
    }

    fn density(&self, luminance: f32, row: usize, sin: f32) -> f32 {
        if self.total <= 0.0 || sin <= 1e-7 {
            return 0.0;
        }
        (f64::from(luminance) * f64::from(self.row_sin(row)) / (self.total * 2.0 * std::f64::consts::PI.powi(2))) as f32
            / sin
    }

    /// Draws a direction; its density comes with it.
    pub(crate) fn sample(&self, xi: [f32; 2]) -> Option<(Vec3, f32)> {
        if self.total <= 0.0 {
            return None;
        }
        let w = self.image.width as usize;
        let (row, eta) = pick(&self.rows, xi[1]);
        let columns = &self.columns[row * (w + 1)..(row + 1) * (w + 1)];
        let (column, xi) = pick(columns, xi[0]);
        let [a, b, c, d] = self.cell(row, column).corners;
        let t = linear(eta, a + b, c + d);
        let s = linear(xi, a * (1.0 - t) + c * t, b * (1.0 - t) + d * t);
        let u = ((column as f32 + 0.5 + s) / w as f32).rem_euclid(1.0);
        let v = self.row_top(row) + t * self.row_height(row);
        let (dir, sin) = self.to_dir(u, v);
        let l = (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t;
        let pdf = self.density(l, row, sin);
        (pdf > 0.0).then_some((dir, pdf))
    }
}

/// The interval of a running share that `xi` falls into, and where in it.
fn pick(running: &[f32], xi: f32) -> (usize, f32) {
    let i = running.partition_point(|&x| x <= xi).clamp(1, running.len() - 1) - 1;
    let width = running[i + 1] - running[i];
    (i, if width > 0.0 { ((xi - running[i]) / width).clamp(0.0, 0.999_999_9) } else { 0.5 })
}

/// Draws from the density on `[0, 1]` that goes straight from `a` to `b`.
fn linear(xi: f32, a: f32, b: f32) -> f32 {
    if a + b <= 0.0 {
        return xi;
    }
    // The stable root; a = b = equal is its limit.
    let root = (a * a + xi * (b * b - a * a)).max(0.0).sqrt();
    (xi * (a + b) / (a + root)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::{hash, warp};

    /// A dim sky with a small sun a thousand times brighter.
    fn sky() -> ImageEnvironment {
        let (w, h) = (32_u32, 16_u32);
        let pixels = (0..w * h)
            .map(|i| {
                let base = 0.2 + hash::unit(i, 1);
                let sun = if i == 5 * w + 31 { 1000.0 } else { 0.0 };
                Rgb::new(base + sun, base + sun, 2.0 * base + sun)
            })
            .collect();
        let image = EnvironmentImage { width: w, height: h, pixels };
        ImageEnvironment::new(Arc::new(image), Rgb::splat(0.5), 0.7)
    }

    #[test]
    fn the_density_integrates_to_one_and_matches_the_sampler() {
        let env = sky();
        let n = 200_000;
        let sum: f64 =
            (0..n).map(|i| f64::from(env.pdf(warp::uniform_sphere([hash::unit(i, 2), hash::unit(i, 3)])))).sum();
        let integral = sum / f64::from(n) * 4.0 * std::f64::consts::PI;
        // The sun makes the relative deviation of one sample about 15: 4 σ = 0.14.
        assert!((integral - 1.0).abs() < 0.14, "{integral}");
        // E[f/p] with f = 1 is the sphere's area, and the density at a sample is what the sampler said.
        let mut area = 0.0;
        for i in 0..n {
            let (dir, pdf) = env.sample([hash::unit(i, 4), hash::unit(i, 5)]).unwrap();
            assert!((env.pdf(dir) / pdf - 1.0).abs() < 2e-2, "{} and {pdf}", env.pdf(dir));
            area += f64::from(1.0 / pdf);
        }
        area /= f64::from(n);
        // Deviation of one sample: up to about 12.57 × 20; 4 σ of the mean 0.9.
        assert!((area - 12.566).abs() < 0.9, "{area}");
    }

    #[test]
    fn sampling_by_luminance_has_next_to_no_variance_for_grey() {
        let env = sky();
        for i in 0..10_000 {
            let (dir, pdf) = env.sample([hash::unit(i, 4), hash::unit(i, 5)]).unwrap();
            let estimate = env.radiance(dir).luminance() / pdf;
            // What is left is sin θ within a row of cells; rows of half height at the poles vary most.
            let mean = env.mean_luminance() * 4.0 * PI;
            if dir.y.abs() < 0.9 {
                assert!((estimate / mean - 1.0).abs() < 0.3, "{estimate} and {mean}");
            }
        }
    }

    #[test]
    fn the_middle_of_the_picture_is_plus_z() {
        let mut pixels = vec![Rgb::black(); 64 * 32];
        for y in 14..18 {
            for x in 30..34 {
                pixels[y * 64 + x] = Rgb::white();
            }
        }
        let image = Arc::new(EnvironmentImage { width: 64, height: 32, pixels });
        let env = ImageEnvironment::new(image.clone(), Rgb::white(), 0.0);
        assert!(env.radiance(Vec3::Z).luminance() > 0.99);
        assert!(env.radiance(Vec3::NEG_Z).is_black());
        // Turned a quarter counter-clockwise seen from above, +z goes to +x.
        let turned = ImageEnvironment::new(image, Rgb::white(), std::f32::consts::FRAC_PI_2);
        assert!(turned.radiance(Vec3::X).luminance() > 0.99);
    }
}
