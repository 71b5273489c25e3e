//! d'Eon et al. 2011 in the far field: three textures for the azimuthal terms.
//!
//! | texture | channels | columns | rows |
//! |---|---|---|---|
//! | `r_tt` | `N_R`, `N_TT` red, green, blue | `\|φ\|/π` | `cos θ` |
//! | `trt` | `N_TRT` red, green, blue | `\|φ\|/π` | `cos θ` |
//! | `residual` | `N_res` red, green, blue | one | `cos θ` |
//!
//! `θ` is the inclination of the attenuation: `θ_d`, or `θ_k` with [`Attenuation::Known`]. Both axes go from 0 to 1,
//! evenly, with their ends on the centres of texels. Longitudinal densities are no tables: they are exact.
//!
//! All `N_p` are even in `φ`, and smooth: the kernel has blurred the caustics. (Even steps of the azimuth are four
//! times nearer here than the uneven ones that Marschner's glints want.)

use super::section::{self, Section};
use super::{Table2, Tables, Untabulated, checked};
use crate::dir::cos2_half_difference;
use crate::lobe::azimuthal::Kernel;
use crate::lobe::longitudinal::deon_widths;
use crate::{Attenuation, Deon, Dir, Fiber, Field, Lobes, Weights, wrap_angle};

/// [`Deon`] as textures; see [`bake`].
#[derive(Clone, Debug, PartialEq)]
pub struct DeonTables {
    exact: Deon<f64>,
    single: Deon<f32>,
    /// `N_R`, and `N_TT` in three channels.
    pub r_tt: Table2,
    /// `N_TRT`.
    pub trt: Table2,
    /// `N_res`.
    pub residual: Table2,
}

/// Bakes the far field of `model`, whatever its `field`; `size` texels a side.
///
/// Error ([`TableError::max_rel_to_peak`](super::TableError::max_rel_to_peak)) for azimuthal widths from 5 degrees:
/// at most 0.5 % at 64, 0.1 % at 128, 0.03 % at 256. It goes with the square of the distance of the texels over
/// the width.
///
/// # Errors
///
/// A size outside 2 to [`LARGEST`](super::LARGEST).
pub fn bake(model: &Deon<f64>, size: u32) -> Result<DeonTables, Untabulated> {
    let size = checked(size)?;
    let section = Section {
        eta: model.eta,
        sigma_a: model.sigma_a,
        kernel: Kernel::Gaussian,
        scales: {
            let [r, tt, trt, _] = deon_widths(model.beta_n);
            [r, tt, trt]
        },
    };
    let [r_tt, trt, residual] = section.bake(size);
    Ok(DeonTables { exact: *model, single: model.cast(), r_tt, trt, residual })
}

impl DeonTables {
    /// Texture coordinates in `r_tt` and `trt`; in `residual` the second of them. Twin of `deon_table_coords`.
    #[inline]
    pub fn coords(&self, known: Dir, s: Dir) -> [f32; 2] {
        let cos = match self.single.attenuation {
            Attenuation::Known => known.cos_theta,
            Attenuation::Difference => {
                cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta).sqrt()
            }
        };
        section::coords(self.trt.size()[0], wrap_angle(s.phi - known.phi), cos)
    }

    /// `fcos` from the texels at [`coords`](Self::coords). Twin of `deon_from_tables`.
    #[inline]
    pub fn combine(&self, known: Dir, s: Dir, r_tt: [f32; 4], trt: [f32; 4], residual: [f32; 4]) -> Lobes {
        let variances = deon_widths(self.single.beta_m).map(|width| width * width);
        let mut l = section::longitudinal(variances, self.single.alpha, known, s);
        if !self.single.residual {
            l[3] = 0.0;
        }
        section::combine(l, r_tt, trt, residual)
    }
}

impl Tables for DeonTables {
    fn exact(&self) -> Fiber<f64> {
        // Weights change no value; these cost no quadrature.
        Fiber::Deon(Deon { field: Field::Far, weights: Weights::Joint, ..self.exact })
    }

    fn eval(&self, known: Dir, s: Dir) -> Lobes {
        let [u, v] = self.coords(known, s);
        let residual = self.residual.sample(0.5, v);
        self.combine(known, s, self.r_tt.sample(u, v), self.trt.sample(u, v), residual)
    }

    fn textures(&self) -> [&Table2; 3] {
        [&self.r_tt, &self.trt, &self.residual]
    }

    fn halved(&self) -> Self {
        let [r_tt, trt, residual] = self.textures().map(Table2::halved);
        Self { r_tt, trt, residual, ..self.clone() }
    }
}
