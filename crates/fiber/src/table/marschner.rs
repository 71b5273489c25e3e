//! Marschner et al. 2003: three textures, one along the fiber and two around it.
//!
//! - Source: the packing of Nguyen & Donnelly 2005 (GPU Gems 2, chapter 23) as Hunz 2016, section 3.3.4, has it.
//! - Changed here: the axes, and `1/cos² θ_d`, which is left to the shader. On the printed axes tables of 128 texels
//!   are 20 times as far off, at grazing inclinations; both can be baked, and [`error`](super::error) measures both.
//! - Round fibers with smoothed caustics only: the TRT of an ellipse depends on three angles, and raw caustics are
//!   infinite.
//!
//! | texture | channels | columns | rows |
//! |---|---|---|---|
//! | `longitudinal` | `M_R`, `M_TT`, `M_TRT`, `cos θ_d` | `θ_k` | `θ_s` |
//! | `r_tt` | `N_R`, `N_TT` red, green, blue | `φ` | `cos θ_d` |
//! | `trt` | `N_TRT` red, green, blue | `φ` | `cos θ_d` |
//!
//! | axis | [`Axes::Warped`] | [`Axes::Printed`] |
//! |---|---|---|
//! | inclinations | `θ/π + ½` | `½ + ½ sin θ` |
//! | azimuth | `√(\|φ\|/π)` | `½ + ½ cos φ` |
//! | `cos θ_d` | itself | `½ + ½ cos θ_d`: half the rows are never read |
//! | 0 and 1 are | the centres of the first and last texels | the edges of the texture |
//! | `M_p` | as [`Marschner::longitudinal`] | divided by `cos² θ_d` |
//! | `cos θ_d` for the rows | worked out | read from `longitudinal` |

use std::f64::consts::PI;

use math::Rgb;

use super::{Table2, Tables, Untabulated, checked, coordinate, knot};
use crate::dir::cos2_half_difference;
use crate::{Dir, Fiber, Hit, Lambertian, Lobes, Marschner, Model, R, RESIDUAL, Scatter, TRT, TT, wrap_angle};

/// Floor of `cos² θ_d`, as in the model.
const MIN_COS2_D: f64 = 1e-5;

/// What the axes of the textures are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// Where the model needs texels: inclinations evenly, azimuths densely around 0, because there the glints merge
    /// into a ridge a degree wide. The default.
    #[default]
    Warped,
    /// As in the literature: sines and cosines, which need no inverse trigonometry, but have no texels left at
    /// grazing inclinations.
    Printed,
}

/// Texels a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Of the texture along the fiber.
    pub longitudinal: u32,
    /// Of the two around it.
    pub azimuthal: u32,
}

impl Resolution {
    /// All three textures with `n` texels a side.
    pub fn square(n: u32) -> Self {
        Self { longitudinal: n, azimuthal: n }
    }
}

/// [`Marschner`] as textures; see [`bake`].
#[derive(Clone, Debug, PartialEq)]
pub struct MarschnerTables {
    exact: Marschner<f64>,
    axes: Axes,
    /// `M_R`, `M_TT`, `M_TRT`, `cos θ_d`.
    pub longitudinal: Table2,
    /// `N_R`, and `N_TT` in three channels.
    pub r_tt: Table2,
    /// `N_TRT`.
    pub trt: Table2,
}

/// Bakes a model, on the axes that suit it: [`Axes::Warped`].
///
/// Error ([`TableError::max_rel_to_peak`](super::TableError::max_rel_to_peak)) for widths `beta_m` from 7.5 degrees
/// and glints from 15: at most 5 % at 64 texels a side, 1.3 % at 128, 0.35 % at 256; from 5 degrees and glints from 10:
/// 10 %, 2.6 % and 0.7 %. Nearly all of it comes from the peak of TT along the fiber, `(step/β)²/4` with the
/// step between texels of `longitudinal`; where that counts, give this texture more texels than the others.
///
/// # Errors
///
/// An elliptical fiber, raw caustics, or a size outside 2 to [`LARGEST`](super::LARGEST).
pub fn bake(model: &Marschner<f64>, size: Resolution) -> Result<MarschnerTables, Untabulated> {
    bake_on(model, Axes::Warped, size)
}

/// Bakes a model on given axes.
///
/// # Errors
///
/// As [`bake`].
pub fn bake_on(model: &Marschner<f64>, axes: Axes, size: Resolution) -> Result<MarschnerTables, Untabulated> {
    if model.eccentricity != 1.0 {
        return Err(Untabulated::Elliptical { found: model.eccentricity });
    }
    if model.caustic.is_none() {
        return Err(Untabulated::RawCaustic);
    }
    let (along, n) = (checked(size.longitudinal)?, checked(size.azimuthal)?);
    let mut around = Vec::with_capacity(n as usize * n as usize);
    for row in 0..n {
        let cos = match axes {
            Axes::Warped => knot(row, n),
            // Rows of negative cosines are nobody's; the nearest of them is mixed with the first of the others.
            Axes::Printed => middle(row, n).max(0.0),
        };
        for column in 0..n {
            let phi = match axes {
                Axes::Warped => PI * knot(column, n).powi(2),
                Axes::Printed => middle(column, n).acos(),
            };
            around.push(model.azimuthal(cos * cos, phi, 0.0));
        }
    }
    let at = |column: u32, row: u32| around[(row * n + column) as usize];
    Ok(MarschnerTables {
        exact: *model,
        axes,
        longitudinal: longitudinal(model, axes, along),
        r_tt: Table2::new([n, n], |column, row| {
            let lobes = at(column, row);
            let (r, tt) = (lobes[R], lobes[TT]);
            [r[0], tt[0], tt[1], tt[2]].map(|x| x as f32)
        }),
        trt: Table2::new([n, n], |column, row| {
            let [r, g, b] = at(column, row)[TRT].cast().0;
            [r, g, b, 0.0]
        }),
    })
}

fn longitudinal(model: &Marschner<f64>, axes: Axes, n: u32) -> Table2 {
    let dir = |i: u32| match axes {
        Axes::Warped => Dir::new(PI * (knot(i, n) - 0.5), 0.0),
        Axes::Printed => Dir::from_sin(middle(i, n), 0.0),
    };
    Table2::new([n, n], |column, row| {
        let (k, s) = (dir(column), dir(row));
        let [r, tt, trt] = model.longitudinal(k.sin_theta, k.cos_theta, s.sin_theta, s.cos_theta);
        let cos2 = cos2_half_difference(k.sin_theta, k.cos_theta, s.sin_theta, s.cos_theta);
        let divided = match axes {
            Axes::Warped => 1.0,
            Axes::Printed => cos2.max(MIN_COS2_D),
        };
        [r / divided, tt / divided, trt / divided, cos2.sqrt()].map(|x| x as f32)
    })
}

/// What the centre of texel `i` of `n` stands for where the texture reaches from -1 to 1.
fn middle(i: u32, n: u32) -> f64 {
    2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0
}

impl MarschnerTables {
    /// What the axes are.
    pub fn axes(&self) -> Axes {
        self.axes
    }

    /// Texture coordinates in `longitudinal`. Twin of `marschner_table_coords`.
    #[inline]
    pub fn coords(&self, known: Dir, s: Dir) -> [f32; 2] {
        match self.axes {
            Axes::Warped => {
                let n = self.longitudinal.size()[0];
                [known, s].map(|dir| coordinate(0.5 + dir.theta() / std::f32::consts::PI, n))
            }
            Axes::Printed => [known, s].map(|dir| 0.5 + 0.5 * dir.sin_theta),
        }
    }

    /// Texture coordinates in `r_tt` and `trt`; `m` is the texel of `longitudinal`. Twin of
    /// `marschner_section_coords`.
    #[inline]
    pub fn section_coords(&self, known: Dir, s: Dir, m: [f32; 4]) -> [f32; 2] {
        let phi = wrap_angle(s.phi - known.phi);
        match self.axes {
            Axes::Warped => {
                let n = self.trt.size()[0];
                let cos2 = cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta);
                [coordinate((phi.abs() / std::f32::consts::PI).sqrt(), n), coordinate(cos2.sqrt(), n)]
            }
            Axes::Printed => [0.5 + 0.5 * phi.cos(), 0.5 + 0.5 * m[3]],
        }
    }

    /// `fcos` from the texels. Twin of `marschner_from_tables`.
    #[inline]
    pub fn combine(&self, known: Dir, s: Dir, m: [f32; 4], r_tt: [f32; 4], trt: [f32; 4]) -> Lobes {
        let scale = match self.axes {
            Axes::Warped => {
                let cos2 = cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta);
                s.cos_theta / cos2.max(MIN_COS2_D as f32)
            }
            Axes::Printed => s.cos_theta,
        };
        let fill = Lambertian { albedo: self.exact.diffuse.cast::<f32>() }.prepare(&Hit::new(known, 0.0));
        Lobes([
            Rgb::splat(r_tt[0] * (m[R] * scale)),
            Rgb([r_tt[1], r_tt[2], r_tt[3]]) * (m[TT] * scale),
            Rgb([trt[0], trt[1], trt[2]]) * (m[TRT] * scale),
            fill.eval(s)[RESIDUAL],
        ])
    }
}

impl Tables for MarschnerTables {
    fn exact(&self) -> Fiber<f64> {
        Fiber::Marschner(self.exact)
    }

    fn eval(&self, known: Dir, s: Dir) -> Lobes {
        let [u, v] = self.coords(known, s);
        let m = self.longitudinal.sample(u, v);
        let [u, v] = self.section_coords(known, s, m);
        self.combine(known, s, m, self.r_tt.sample(u, v), self.trt.sample(u, v))
    }

    fn textures(&self) -> [&Table2; 3] {
        [&self.longitudinal, &self.r_tt, &self.trt]
    }

    fn halved(&self) -> Self {
        let [longitudinal, r_tt, trt] = self.textures().map(Table2::halved);
        Self { longitudinal, r_tt, trt, ..self.clone() }
    }
}
