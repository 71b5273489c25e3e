//! Light from all around as a few parallel beams, and as the picture behind the hair.
//!
//! Directions, rotation and interpolation are those of the path tracer: a texel is the middle of a bilinear patch,
//! and the rows at the poles reach up to them.
//!
//! A constant environment becomes beams in the directions of a spherical Fibonacci lattice. An image is cut along
//! its texels into patches of about equal power, always the strongest one next, across its longer side, where the
//! halves are most alike; a patch becomes one beam with the patch's light and its mean direction. So all light is
//! kept, in every channel, whatever the number of beams.
//!
//! Where there is an ambient part too, it comes first: `H` is the [damped](Harmonics::damped) projection of the
//! image `L` on spherical harmonics. Beams carry `max(L - H, 0)`, and the ambient is the damped projection of what
//! they leave, `min(L, H)`. Projection and damping keep the mean, so both together have the light of `L` exactly.
//!
//! Source: the median cut of Debevec 2005, "A median cut algorithm for light probe sampling", in any number of
//! steps instead of powers of two.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use math::{DVec3, Rgb, Vec3};
use scene::EnvironmentImage;

use super::harmonics::Harmonics;

/// What the camera sees where there is nothing: the sum of all layers. Black without any.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sky {
    /// The environments that the camera sees.
    pub(crate) layers: Vec<SkyLayer>,
}

/// One visible environment.
#[derive(Clone, Debug)]
pub(crate) enum SkyLayer {
    /// The same radiance everywhere, W/(m² sr).
    Constant(Rgb),
    /// A lat-long image.
    Image {
        /// The texels.
        image: Arc<EnvironmentImage>,
        /// What they are multiplied by.
        factor: Rgb,
        /// Radians by which the image is turned about +y, counter-clockwise seen from above.
        rotation: f32,
    },
}

impl Sky {
    /// Radiance from the unit direction `d`, W/(m² sr).
    pub(crate) fn radiance(&self, d: Vec3) -> Rgb {
        self.layers.iter().map(|layer| layer.radiance(d)).sum()
    }
}

impl SkyLayer {
    /// Radiance from the unit direction `d`, W/(m² sr).
    pub(crate) fn radiance(&self, d: Vec3) -> Rgb {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Image { image, factor, rotation } => {
                let (w, h) = (image.width as usize, image.height as usize);
                let azimuth = d.x.atan2(-d.z) + rotation;
                let u = f64::from(azimuth) / TAU;
                let v = f64::from(d.x.hypot(d.z).atan2(d.y)) / PI;
                let (across, down) = (between_columns(u, w), between_rows(v, h));
                let mut sum = Rgb::black();
                for (row, share) in down {
                    for (column, part) in across {
                        sum += image.pixels[row * w + column] * (share * part) as f32;
                    }
                }
                sum * *factor
            }
        }
    }
}

/// Light that arrives in parallel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beam {
    /// Unit direction to where it comes from.
    pub(super) towards: Vec3,
    /// W/m² on a surface that faces it.
    pub(super) irradiance: Rgb,
    /// Half angle of the cap of the sky that it stands for, radians, `(0, π]`.
    pub(super) half_angle: f32,
}

/// `count` directions spread evenly over the sphere: the spherical Fibonacci lattice.
pub(super) fn evenly(count: usize) -> Vec<DVec3> {
    let golden_angle = PI * (3.0 - 5.0_f64.sqrt());
    let at = |i: usize| {
        let y = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (i as f64 * golden_angle).sin_cos();
        let r = (1.0 - y * y).sqrt();
        DVec3::new(r * sin, y, r * cos)
    };
    (0..count).map(at).collect()
}

/// A constant environment as `count` equal beams.
pub(super) fn constant(radiance: Rgb, count: usize) -> Vec<Beam> {
    let piece = 4.0 * PI / count.max(1) as f64;
    let beam = |towards: DVec3| Beam {
        towards: towards.as_vec3(),
        irradiance: radiance * piece as f32,
        half_angle: cap(piece),
    };
    evenly(count).into_iter().map(beam).collect()
}

/// An image as at most `count` beams, after the part that harmonics can hold was taken away if `ambient` says so.
///
/// There are fewer beams only where fewer texels have light left. With `ambient` and no beams the harmonics have
/// everything.
pub(super) fn image(
    image: &EnvironmentImage,
    factor: Rgb,
    rotation: f32,
    count: usize,
    ambient: bool,
) -> (Vec<Beam>, Option<Harmonics>) {
    let mut grid = Grid::new(image, factor, rotation);
    if !ambient {
        return (grid.beams(count), None);
    }
    let smooth = grid.project().damped();
    if count == 0 {
        return (Vec::new(), Some(smooth));
    }
    let rest = grid.split_off_above(&smooth);
    (rest.beams(count), Some(grid.project().damped()))
}

/// Half angle of the cap with that solid angle.
fn cap(solid_angle: f64) -> f32 {
    (1.0 - solid_angle / TAU).clamp(-1.0, 1.0).acos() as f32
}

/// The two columns beside the picture coordinate `u` (to the right, wraps) and their shares.
fn between_columns(u: f64, width: usize) -> [(usize, f64); 2] {
    let x = (u * width as f64 - 0.5).rem_euclid(width as f64);
    // Rounding may reach the width itself.
    let left = (x as usize).min(width - 1);
    let t = (x - left as f64).clamp(0.0, 1.0);
    [(left, 1.0 - t), ((left + 1) % width, t)]
}

/// The two rows beside `v` (down, 0 to 1) and their shares.
fn between_rows(v: f64, height: usize) -> [(usize, f64); 2] {
    let y = (v * height as f64 - 0.5).clamp(0.0, (height - 1) as f64);
    let above = y as usize;
    let t = y - above as f64;
    [(above, 1.0 - t), ((above + 1).min(height - 1), t)]
}

/// `∫ hat(θ) sin θ dθ` of every row, where `hat` is the share that the row has in a bilinear interpolation: the sum
/// is exactly 2.
fn row_weights(height: usize) -> Vec<f64> {
    if height == 1 {
        return vec![2.0];
    }
    let step = PI / height as f64;
    let inner = 2.0 * (1.0 - step.cos()) / step;
    // All of the half row at the pole, and half a hat.
    let end = 1.0 - ((1.5 * step).sin() - (0.5 * step).sin()) / step;
    let at = |row: usize| if row == 0 || row + 1 == height { end } else { ((row as f64 + 0.5) * step).sin() * inner };
    (0..height).map(at).collect()
}

/// Sizes between which the image is worked on: smaller ones are interpolated, so that even an image of two rows is
/// integrated well, larger ones averaged, so that none takes long. A cell of the finest is 0.35 degrees wide.
const COARSEST: [usize; 2] = [128, 64];
const FINEST: [usize; 2] = [1024, 512];

/// One axis of the grid: of which texels, in which shares, each cell is made.
struct Axis {
    /// Middle of the cells in picture coordinates, `(0, 1)`.
    middles: Vec<f64>,
    /// `dφ` or `sin θ dθ` of the cells.
    weights: Vec<f64>,
    taps: Vec<Vec<(usize, f64)>>,
}

impl Axis {
    /// `texels` have these weights; `cell` gives the weight of a cell between two picture coordinates, for cells
    /// that are smaller than a texel.
    fn new(
        texels: &[f64],
        [coarsest, finest]: [usize; 2],
        beside: impl Fn(f64) -> [(usize, f64); 2],
        cell: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let n = texels.len();
        if n < coarsest {
            let cells = n * coarsest.div_ceil(n);
            let edge = |i: usize| i as f64 / cells as f64;
            let middle = |i: usize| (i as f64 + 0.5) / cells as f64;
            return Self {
                middles: (0..cells).map(middle).collect(),
                weights: (0..cells).map(|i| cell(edge(i), edge(i + 1))).collect(),
                taps: (0..cells).map(|i| beside(middle(i)).to_vec()).collect(),
            };
        }
        let cells = n.min(finest);
        let texels_of = |i: usize| i * n / cells..(i + 1) * n / cells;
        let weight = |i: usize| texels[texels_of(i)].iter().sum::<f64>();
        Self {
            middles: (0..cells).map(|i| (texels_of(i).start + texels_of(i).end) as f64 / (2 * n) as f64).collect(),
            weights: (0..cells).map(weight).collect(),
            taps: (0..cells).map(|i| texels_of(i).map(|t| (t, texels[t] / weight(i))).collect()).collect(),
        }
    }
}

/// The image, scaled, as cells of known solid angle.
struct Grid {
    /// Mean radiance of the cells, row after row from the zenith.
    cells: Vec<Rgb<f64>>,
    /// `dφ` of the columns; the sum is 2π.
    columns: Vec<f64>,
    /// `sin θ dθ` of the rows; the sum is 2.
    rows: Vec<f64>,
    /// `(sin, cos)` of the azimuths of the columns, rotation included, and of the polar angles of the rows.
    azimuths: Vec<(f64, f64)>,
    polar: Vec<(f64, f64)>,
}

impl Grid {
    fn new(image: &EnvironmentImage, factor: Rgb, rotation: f32) -> Self {
        let (w, h) = (image.width as usize, image.height as usize);
        let across = Axis::new(
            &vec![TAU / w as f64; w],
            [COARSEST[0], FINEST[0]],
            |u| between_columns(u, w),
            |left, right| TAU * (right - left),
        );
        let texel_rows = row_weights(h);
        let down = Axis::new(
            &texel_rows,
            [COARSEST[1], FINEST[1]],
            |v| between_rows(v, h),
            |top, bottom| (PI * top).cos() - (PI * bottom).cos(),
        );
        let factor = factor.cast::<f64>();
        let mut cells = Vec::with_capacity(across.weights.len() * down.weights.len());
        let mut row = vec![Rgb::<f64>::black(); w];
        for taps in &down.taps {
            row.fill(Rgb::black());
            for &(y, share) in taps {
                for (sum, texel) in row.iter_mut().zip(&image.pixels[y * w..(y + 1) * w]) {
                    *sum += texel.cast::<f64>() * share;
                }
            }
            cells
                .extend(across.taps.iter().map(|taps| taps.iter().map(|&(x, share)| row[x] * share).sum::<Rgb<f64>>()));
        }
        let rotation = f64::from(rotation);
        let mut grid = Self {
            cells,
            columns: across.weights,
            rows: down.weights,
            azimuths: across.middles.iter().map(|u| (u * TAU - rotation).sin_cos()).collect(),
            polar: down.middles.iter().map(|v| (v * PI).sin_cos()).collect(),
        };
        // Rows finer than the image's are weighed at their middle, which is not quite exact; the sum is.
        let mut exact = Rgb::<f64>::black();
        for (texels, weight) in image.pixels.chunks_exact(w).zip(&texel_rows) {
            exact += texels.iter().map(|texel| texel.cast::<f64>()).sum::<Rgb<f64>>() * (weight * TAU / w as f64);
        }
        let found = grid.total();
        let correction = factor.zip(exact.zip(found, |a, b| if b > 0.0 { a / b } else { 1.0 }), |f, c| f * c);
        for cell in &mut grid.cells {
            *cell *= correction;
        }
        grid
    }

    /// Cells with their column and row.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (w, h) = (self.columns.len(), self.rows.len());
        (0..h).flat_map(move |y| (0..w).map(move |x| (x, y)))
    }

    /// Direction of the middle of a cell, to where the light comes from.
    fn direction(&self, x: usize, y: usize) -> DVec3 {
        let ((sin_azimuth, cos_azimuth), (sin, cos)) = (self.azimuths[x], self.polar[y]);
        DVec3::new(sin * sin_azimuth, cos, -sin * cos_azimuth)
    }

    fn solid_angle(&self, x: usize, y: usize) -> f64 {
        self.columns[x] * self.rows[y]
    }

    /// Radiance times solid angle of a cell, W/m².
    fn light(&self, x: usize, y: usize) -> Rgb<f64> {
        self.cells[y * self.columns.len() + x] * self.solid_angle(x, y)
    }

    fn total(&self) -> Rgb<f64> {
        self.places().map(|(x, y)| self.light(x, y)).sum()
    }

    fn project(&self) -> Harmonics {
        Harmonics::project(self.places().map(|(x, y)| (self.direction(x, y), self.light(x, y))))
    }

    /// Keeps what is not above the ambient light; what is comes back.
    fn split_off_above(&mut self, ambient: &Harmonics) -> Self {
        let mut above = Vec::with_capacity(self.cells.len());
        for (i, (x, y)) in self.places().enumerate() {
            let cell = self.cells[i];
            let kept = cell.zip(ambient.signed(self.direction(x, y)), |cell, ambient| cell.min(ambient.max(0.0)));
            above.push(cell - kept);
            self.cells[i] = kept;
        }
        Self {
            cells: above,
            columns: self.columns.clone(),
            rows: self.rows.clone(),
            azimuths: self.azimuths.clone(),
            polar: self.polar.clone(),
        }
    }

    /// At most `count` beams with all the light.
    fn beams(&self, count: usize) -> Vec<Beam> {
        let power: Vec<f64> = self.places().map(|(x, y)| self.light(x, y).luminance()).collect();
        let whole = self.patch(&power, 0..self.columns.len(), 0..self.rows.len());
        let mut patches: Vec<Patch> = whole.into_iter().collect();
        while patches.len() < count {
            let strongest = patches
                .iter()
                .enumerate()
                .filter(|(_, patch)| patch.x.len() > 1 || patch.y.len() > 1)
                .max_by(|(i, a), (j, b)| a.power.total_cmp(&b.power).then(j.cmp(i)))
                .map(|(i, _)| i);
            let Some(strongest) = strongest else { break };
            let patch = patches.swap_remove(strongest);
            patches.extend(self.halves(&power, &patch));
        }
        if count == 0 { Vec::new() } else { patches.iter().map(|patch| self.beam(&power, patch)).collect() }
    }

    /// Power of the columns and of the rows of a rectangle of cells.
    fn profiles(&self, power: &[f64], x: &Range<usize>, y: &Range<usize>) -> [Vec<f64>; 2] {
        let w = self.columns.len();
        let (mut across, mut down) = (vec![0.0; x.len()], vec![0.0; y.len()]);
        for (sum, row) in down.iter_mut().zip(y.clone()) {
            for (column, power) in across.iter_mut().zip(&power[row * w + x.start..row * w + x.end]) {
                *column += power;
                *sum += power;
            }
        }
        [across, down]
    }

    /// A rectangle of cells, less the dark rows and columns at its edges; `None` if it is all dark.
    fn patch(&self, power: &[f64], x: Range<usize>, y: Range<usize>) -> Option<Patch> {
        let [across, down] = self.profiles(power, &x, &y);
        let lit = |profile: &[f64], start: usize| {
            let first = profile.iter().position(|&p| p > 0.0)?;
            let last = profile.iter().rposition(|&p| p > 0.0)?;
            Some(start + first..start + last + 1)
        };
        Some(Patch { x: lit(&across, x.start)?, y: lit(&down, y.start)?, power: across.iter().sum() })
    }

    /// Cuts a patch of more than one cell; neither half is dark, since its outer rows and columns are not.
    fn halves(&self, power: &[f64], patch: &Patch) -> impl Iterator<Item = Patch> + use<> {
        let [across, down] = self.profiles(power, &patch.x, &patch.y);
        let height = patch.y.len() as f64 * PI / self.rows.len() as f64;
        let widest = self.polar[patch.y.clone()].iter().map(|&(sin, _)| sin).fold(0.0, f64::max);
        let width = self.columns[patch.x.clone()].iter().sum::<f64>() * widest;
        let (x, y) = (patch.x.clone(), patch.y.clone());
        let [first, second] = if x.len() > 1 && (width >= height || y.len() == 1) {
            let at = x.start + most_even(&across);
            [self.patch(power, x.start..at, y.clone()), self.patch(power, at..x.end, y)]
        } else {
            let at = y.start + most_even(&down);
            [self.patch(power, x.clone(), y.start..at), self.patch(power, x, at..y.end)]
        };
        first.into_iter().chain(second)
    }

    fn beam(&self, power: &[f64], patch: &Patch) -> Beam {
        let w = self.columns.len();
        let (mut light, mut mean, mut solid_angle) = (Rgb::<f64>::black(), DVec3::ZERO, 0.0);
        for y in patch.y.clone() {
            for x in patch.x.clone() {
                light += self.light(x, y);
                mean += self.direction(x, y) * power[y * w + x];
                solid_angle += self.solid_angle(x, y);
            }
        }
        // Light from opposite sides has no mean direction; the middle of the patch is as good as any.
        let middle = self.direction((patch.x.start + patch.x.end) / 2, (patch.y.start + patch.y.end) / 2);
        let mean = mean / patch.power;
        let towards = if mean.length() > 1e-6 { mean } else { middle };
        Beam {
            towards: towards.as_vec3().normalize_or(Vec3::Y),
            irradiance: light.cast(),
            half_angle: cap(solid_angle),
        }
    }
}

/// A rectangle of cells with light in it.
struct Patch {
    x: Range<usize>,
    y: Range<usize>,
    /// Luminance, W/m², greater than 0.
    power: f64,
}

/// Where to cut so that both sides have most nearly the same: an index from 1 to `len - 1`.
fn most_even(profile: &[f64]) -> usize {
    let half = 0.5 * profile.iter().sum::<f64>();
    let (mut sum, mut best) = (0.0, (1, f64::INFINITY));
    for (i, power) in profile.iter().enumerate().take(profile.len() - 1) {
        sum += power;
        let off = (sum - half).abs();
        if off < best.1 {
            best = (i + 1, off);
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::hash;

    /// Noise with a sun of one texel, in other colours than the rest.
    fn noisy(width: u32, height: u32) -> EnvironmentImage {
        let sun = (height / 4) * width + width / 3;
        let texel = |i: u32| {
            let base = hash::unit(i, 11);
            if i == sun { Rgb::new(900.0, 700.0, 400.0) } else { Rgb::new(0.2 + base, 0.3 + base, 0.2 + 2.0 * base) }
        };
        EnvironmentImage { width, height, pixels: (0..width * height).map(texel).collect() }
    }

    const FACTOR: Rgb = Rgb([0.5, 0.7, 1.1]);
    const ROTATION: f32 = 0.7;

    /// ∫ L dω by brute force: the radiance that the sky has at a million directions, in bands of equal height.
    fn integral(layer: &SkyLayer) -> Rgb<f64> {
        let (across, down) = (1600, 640);
        let mut sum = Rgb::<f64>::black();
        for row in 0..down {
            let (sin, cos) = ((f64::from(row) + 0.5) * PI / f64::from(down)).sin_cos();
            let band =
                (f64::from(row) * PI / f64::from(down)).cos() - (f64::from(row + 1) * PI / f64::from(down)).cos();
            for column in 0..across {
                let (s, c) = ((f64::from(column) + 0.5) * TAU / f64::from(across)).sin_cos();
                let d = DVec3::new(sin * s, cos, sin * c).as_vec3();
                sum += layer.radiance(d).cast::<f64>() * (band * TAU / f64::from(across));
            }
        }
        sum
    }

    fn layer(picture: &EnvironmentImage) -> SkyLayer {
        SkyLayer::Image { image: Arc::new(picture.clone()), factor: FACTOR, rotation: ROTATION }
    }

    fn total(beams: &[Beam]) -> Rgb<f64> {
        beams.iter().map(|beam| beam.irradiance.cast::<f64>()).sum()
    }

    #[track_caller]
    fn close(found: Rgb<f64>, expected: Rgb<f64>, limit: f64) {
        let off = found.zip(expected, |a, b| (a / b - 1.0).abs()).max_channel();
        assert!(off < limit, "{found:?} is not {expected:?}: {off}");
    }

    #[test]
    fn rows_weigh_as_much_as_the_sphere() {
        for height in [1, 2, 3, 19, 64, 511] {
            let sum: f64 = row_weights(height).iter().sum();
            // Each row is a difference of two terms that are larger than it: by its number of rows.
            assert!((sum - 2.0).abs() < 1e-13 * (height * height).max(10) as f64, "{height}: {sum}");
        }
    }

    #[test]
    fn the_sky_is_where_the_path_tracer_has_it() {
        // One bright texel each at the left edge, a quarter, the middle and three quarters of the equator.
        let mut picture = EnvironmentImage { width: 64, height: 33, pixels: vec![Rgb::black(); 64 * 33] };
        for (quarter, value) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            // The quarters lie on the border of two texels.
            for x in [(quarter * 16 + 63) % 64, quarter * 16] {
                picture.pixels[16 * 64 + x] = Rgb::splat(value);
            }
        }
        let at = |rotation: f32, d: Vec3| {
            SkyLayer::Image { image: Arc::new(picture.clone()), factor: Rgb::white(), rotation }.radiance(d)[0]
        };
        for (value, d) in [(1.0, Vec3::NEG_Z), (2.0, Vec3::X), (3.0, Vec3::Z), (4.0, Vec3::NEG_X)] {
            assert!((at(0.0, d) - value).abs() < 1e-3, "{d}: {}", at(0.0, d));
        }
        // A quarter counter-clockwise seen from above: what was at +z is at +x.
        assert!((at(std::f32::consts::FRAC_PI_2, Vec3::X) - 3.0).abs() < 1e-3);
        // Rows begin at the zenith.
        let mut top = EnvironmentImage { width: 8, height: 4, pixels: vec![Rgb::black(); 32] };
        top.pixels[..8].fill(Rgb::white());
        let top = SkyLayer::Image { image: Arc::new(top), factor: Rgb::white(), rotation: 0.3 };
        assert!(top.radiance(Vec3::Y)[0] > 0.999 && top.radiance(Vec3::NEG_Y)[0] == 0.0);
    }

    #[test]
    fn beams_carry_all_the_light_of_an_image() {
        // Between, below and above the sizes that are worked on as they are; one row, one column, one texel.
        for (width, height) in [(130, 70), (37, 19), (4, 2), (1, 1), (5, 1), (1, 6), (1100, 530)] {
            let picture = noisy(width, height);
            let expected = integral(&layer(&picture));
            for count in [1, 7, 16] {
                let (beams, ambient) = image(&picture, FACTOR, ROTATION, count, false);
                assert!(ambient.is_none() && beams.len() == count, "{width} x {height}: {} beams", beams.len());
                assert!(beams.iter().all(|beam| (beam.towards.length() - 1.0).abs() < 1e-5));
                // What is off is the brute force: 2e-4 at most, where its steps are nearly as wide as a texel.
                close(total(&beams), expected, 1e-3);
            }
        }
    }

    #[test]
    fn beams_and_ambient_together_carry_all_the_light() {
        for (width, height) in [(130, 70), (37, 19), (4, 2)] {
            let picture = noisy(width, height);
            let expected = integral(&layer(&picture));
            for count in [0, 5, 16] {
                let (beams, ambient) = image(&picture, FACTOR, ROTATION, count, true);
                let ambient = ambient.expect("an ambient part");
                let light = total(&beams) + ambient.mean().cast::<f64>() * (4.0 * PI);
                close(light, expected, 1e-3);
                assert!(beams.len() <= count);
                for d in evenly(500) {
                    assert!(ambient.signed(d).0.iter().all(|&x| x >= 0.0), "{d}");
                }
            }
        }
    }

    #[test]
    fn a_sun_gets_a_beam_of_its_own_at_the_right_place() {
        let picture = noisy(128, 64);
        // Where the texel of the sun is: column 42, row 16.
        let azimuth = (42.5 / 128.0) * TAU - f64::from(ROTATION);
        let polar = 16.5 / 64.0 * PI;
        let sun = DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos()).as_vec3();
        assert!(layer(&picture).radiance(sun)[0] > 0.99 * 900.0 * FACTOR[0]);
        for ambient in [false, true] {
            let (beams, _) = image(&picture, FACTOR, ROTATION, 24, ambient);
            let brightest = beams.iter().max_by(|a, b| a.irradiance[0].total_cmp(&b.irradiance[0])).unwrap();
            assert!(brightest.towards.dot(sun) > 1.0 - 1e-6, "{ambient}: {} and {sun}", brightest.towards);
            let texel = TAU / 128.0 * row_weights(64)[16];
            let alone = 900.0 * FACTOR[0] * texel as f32;
            assert!((brightest.irradiance[0] / alone - 1.0).abs() < 0.02, "{} and {alone}", brightest.irradiance[0]);
        }
    }

    #[test]
    fn directions_follow_the_rotation() {
        let picture = noisy(64, 32);
        let (plain, _) = image(&picture, FACTOR, 0.0, 9, false);
        let turned = image(&picture, FACTOR, std::f32::consts::FRAC_PI_2, 9, false).0;
        for (a, b) in plain.iter().zip(&turned) {
            // +z goes to +x and +x to -z.
            let expected = Vec3::new(a.towards.z, a.towards.y, -a.towards.x);
            assert!(b.towards.distance(expected) < 1e-5 && a.irradiance == b.irradiance, "{a:?} and {b:?}");
        }
    }

    #[test]
    fn a_constant_environment_lights_all_sides_alike() {
        let radiance = Rgb::new(0.2, 0.3, 0.4);
        // Measured over 4000 normals: 8 % at most for 16 beams, 3.4 % for 32, 1.6 % for 64.
        for (count, limit) in [(16, 0.1), (32, 0.04), (64, 0.02)] {
            let beams = constant(radiance, count);
            close(total(&beams), radiance.cast::<f64>() * (4.0 * PI), 1e-5);
            for n in evenly(1000) {
                let n = n.as_vec3();
                let lit: f32 = beams.iter().map(|beam| beam.irradiance[1] * beam.towards.dot(n).max(0.0)).sum();
                let off = (f64::from(lit) / (PI * 0.3) - 1.0).abs();
                assert!(off < limit, "{count} beams, {n}: {off}");
            }
        }
        // As an image it has no more than the ambient holds, whatever its size.
        for (width, height) in [(4, 2), (64, 32), (200, 100)] {
            let pixels = vec![radiance; (width * height) as usize];
            let (beams, ambient) = image(&EnvironmentImage { width, height, pixels }, Rgb::white(), 0.0, 16, true);
            let left = total(&beams).max_channel() / (4.0 * PI * 0.4);
            assert!(left < 2e-3, "{width} x {height}: {left}");
            close(ambient.expect("an ambient part").mean().cast(), radiance.cast(), 3e-3);
        }
    }

    #[test]
    fn darkness_has_no_beams() {
        let picture = EnvironmentImage { width: 8, height: 4, pixels: vec![Rgb::black(); 32] };
        let (beams, ambient) = image(&picture, FACTOR, 0.0, 16, true);
        assert!(beams.is_empty());
        assert_eq!(ambient, Some(Harmonics::constant(Rgb::black())));
        // A single texel with light is one beam, not sixteen.
        let mut picture = EnvironmentImage { width: 256, height: 128, pixels: vec![Rgb::black(); 256 * 128] };
        picture.pixels[40 * 256 + 99] = Rgb::new(0.0, 0.0, 5.0);
        assert_eq!(image(&picture, FACTOR, 0.0, 16, false).0.len(), 1);
    }
}
