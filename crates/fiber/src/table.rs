//! Models as textures, for renderers that have no time for roots and quadrature.
//!
//! What depends on two numbers alone is baked into textures of four channels, and the rest stays formula:
//! [`marschner`] has three textures, as in the literature; [`deon`] and [`chiang`] have their far-field azimuthal
//! terms in textures and keep their longitudinal densities, which are cheap. Shaders take texels by
//! `shaders/table.wgsl`, the twin of what [`Tables::eval`] does here.
//!
//! Textures are to be sampled with a linear filter and clamped to the edge; [`Table2::sample`] is that, to the
//! rounding. (Hardware keeps about eight bits of the place between two texels, which moves a value by up to 1/512 of
//! the step from one texel to the next.) Filtering of `rgba32float` is not everywhere; of `rgba16float` it is:
//! [`Table2::to_f16`].
//!
//! ```
//! use fiber::table::{self, Tables, deon};
//!
//! let hair = fiber::Deon::with_absorption(math::Rgb::new(0.2, 0.3, 0.5));
//! let tables = deon::bake(&hair, 64)?;
//! // Three textures, the third one texel wide.
//! assert_eq!(tables.textures().map(|texture| texture.size()), [[64, 64], [64, 64], [1, 64]]);
//! // Nowhere off by more than half a percent of the brightest direction.
//! assert!(table::error(&tables, 1).max_rel_to_peak < 0.005);
//! # Ok::<(), table::Untabulated>(())
//! ```

pub mod chiang;
pub mod deon;
pub mod marschner;

mod half;
mod section;

use std::f64::consts::TAU;

use math::hash;

pub use half::{from_half, to_half};

use crate::{DIMS, Dir, Fiber, Hit, Lobes, Model, Scatter};

/// Most texels a side of any table.
pub const LARGEST: u32 = 4096;

/// A texture of two dimensions and four channels, 32 bits each.
#[derive(Clone, Debug, PartialEq)]
pub struct Table2 {
    size: [u32; 2],
    texels: Vec<[f32; 4]>,
}

impl Table2 {
    /// Channels of a texel.
    pub const CHANNELS: u32 = 4;

    /// A texture of `size` (columns, then rows; each at least 1), filled by `texel(column, row)`, row by row.
    pub fn new(size: [u32; 2], mut texel: impl FnMut(u32, u32) -> [f32; 4]) -> Self {
        let size = size.map(|n| n.max(1));
        let mut texels = Vec::with_capacity(size[0] as usize * size[1] as usize);
        for row in 0..size[1] {
            for column in 0..size[0] {
                texels.push(texel(column, row));
            }
        }
        Self { size, texels }
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// All texels, row by row: what to upload as `rgba32float`.
    pub fn texels(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// All texels as [half-precision numbers](to_half), row by row: what to upload as `rgba16float`.
    pub fn to_f16(&self) -> Vec<[u16; 4]> {
        self.texels.iter().map(|texel| texel.map(to_half)).collect()
    }

    /// The texture as it is after a round trip through half precision.
    pub fn halved(&self) -> Self {
        let texels = self.texels.iter().map(|texel| texel.map(|x| from_half(to_half(x)))).collect();
        Self { size: self.size, texels }
    }

    /// The value at texture coordinates, by a linear filter, clamped to the edge.
    ///
    /// Texel `i` of `n` has its centre at `(i + ½)/n`; `u` goes along rows, `v` along columns.
    #[inline]
    pub fn sample(&self, u: f32, v: f32) -> [f32; 4] {
        let ([left, right], across) = neighbours(u, self.size[0]);
        let ([top, bottom], down) = neighbours(v, self.size[1]);
        let at = |column: usize, row: usize| self.texels[row * self.size[0] as usize + column];
        let (a, b, c, d) = (at(left, top), at(right, top), at(left, bottom), at(right, bottom));
        std::array::from_fn(|channel| {
            let upper = a[channel] * (1.0 - across) + b[channel] * across;
            let lower = c[channel] * (1.0 - across) + d[channel] * across;
            upper * (1.0 - down) + lower * down
        })
    }
}

/// The two texels of `n` that a linear filter mixes at coordinate `x`, and the share of the second.
#[inline]
fn neighbours(x: f32, n: u32) -> ([usize; 2], f32) {
    let place = x.clamp(0.0, 1.0) * n as f32 - 0.5;
    let below = place.floor();
    let edge = i64::from(n) - 1;
    let texel = |i: i64| i.clamp(0, edge) as usize;
    ([texel(below as i64), texel(below as i64 + 1)], place - below)
}

/// Texture coordinate of `x` in `[0, 1]` among `n` texels, so that 0 and 1 are the centres of the first and the last.
///
/// Between the centres a filter interpolates; in the half texel outside of them it would only repeat.
#[inline]
pub fn coordinate(x: f32, n: u32) -> f32 {
    (0.5 + x * n.saturating_sub(1) as f32) / n as f32
}

/// What the texel `i` of `n >= 2` stands for: the inverse of [`coordinate`].
#[inline]
fn knot(i: u32, n: u32) -> f64 {
    f64::from(i) / (f64::from(n) - 1.0)
}

/// Why a fiber cannot be baked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Untabulated {
    /// A size that no table has.
    #[error("a table of {found} texels a side was asked for; it must have 2 to {}", LARGEST)]
    Size {
        /// Texels a side.
        found: u32,
    },
    /// An elliptical cross-section.
    #[error("a fiber of eccentricity {found} has no tables: its TRT depends on three angles; only a round one has (1)")]
    Elliptical {
        /// Minor over major axis.
        found: f64,
    },
    /// Caustics that are not smoothed.
    #[error("raw caustics are infinite and have no tables; smooth them")]
    RawCaustic,
}

/// `n`, if a table may have so many texels a side.
fn checked(n: u32) -> Result<u32, Untabulated> {
    if (2..=LARGEST).contains(&n) { Ok(n) } else { Err(Untabulated::Size { found: n }) }
}

/// A baked model.
pub trait Tables {
    /// The model that the tables stand for, in double precision.
    fn exact(&self) -> Fiber<f64>;

    /// `fcos` per lobe, by way of the textures.
    fn eval(&self, known: Dir, s: Dir) -> Lobes;

    /// All textures, in the order in which the shaders take their texels.
    fn textures(&self) -> [&Table2; 3];

    /// The same tables with every texel in half precision.
    fn halved(&self) -> Self
    where
        Self: Sized;
}

/// How far tables are from their model; see [`error`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableError {
    /// Largest difference of a channel of `fcos`, all lobes together, per steradian.
    pub max_abs: f64,
    /// Largest difference over the largest value for the same known direction.
    pub max_rel_to_peak: f64,
    /// Sum of all differences over the sum of all values.
    pub mean_rel: f64,
}

/// Inclinations up to which [`error`] looks, radians: 85 degrees.
pub const ERROR_LIMIT: f64 = 85.0 * std::f64::consts::PI / 180.0;

/// Known directions that [`error`] looks from, and sampled ones for each.
const KNOWN: u32 = 64;
const SAMPLED: u32 = 128;

/// Measures tables against their model, on seeded directions that no texel was made for.
///
/// 64 known directions, evenly in inclination, each with 64 directions evenly on the sphere and 64 drawn where the
/// model sends light; inclinations up to [`ERROR_LIMIT`] on both sides.
pub fn error(tables: &impl Tables, seed: u32) -> TableError {
    let exact = tables.exact();
    let mut found = TableError { max_abs: 0.0, max_rel_to_peak: 0.0, mean_rel: 0.0 };
    let (mut missed, mut whole) = (0.0, 0.0);
    for k in 0..KNOWN {
        let unit = |j: u32, dim: u32| f64::from(hash::to_unit(hash::mix3(seed, k * (SAMPLED + 1) + j, dim)));
        // Rounded first, so that both sides see the same directions.
        let known: Dir = Dir::<f64>::new((2.0 * unit(SAMPLED, 0) - 1.0) * ERROR_LIMIT, TAU * unit(SAMPLED, 1)).cast();
        let point = exact.prepare(&Hit::new(known.cast(), 0.0));
        let (mut worst, mut peak) = (0.0, 0.0);
        for j in 0..SAMPLED {
            let s: Option<Dir<f64>> = if j % 2 == 0 {
                Some(Dir::from_sin(2.0 * unit(j, 0) - 1.0, TAU * unit(j, 1)))
            } else {
                let u: [f64; DIMS] = std::array::from_fn(|dim| unit(j, dim as u32));
                point.sample(u).map(|sample| sample.dir)
            };
            let Some(s) = s.filter(|s| s.theta().abs() <= ERROR_LIMIT) else { continue };
            let s: Dir = s.cast();
            let want = point.eval(s.cast()).sum();
            let got = tables.eval(known, s).sum().cast::<f64>();
            let miss = (got - want).map(f64::abs);
            for channel in 0..3 {
                worst = larger(worst, miss[channel]);
                peak = larger(peak, want[channel]);
                missed += miss[channel];
                whole += want[channel];
            }
        }
        found.max_abs = larger(found.max_abs, worst);
        found.max_rel_to_peak = larger(found.max_rel_to_peak, if peak > 0.0 { worst / peak } else { worst });
    }
    found.mean_rel = if whole > 0.0 { missed / whole } else { missed };
    found
}

/// The larger one; what is no number is larger than all, so that it is not lost.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
