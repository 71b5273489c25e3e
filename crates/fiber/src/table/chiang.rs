//! Chiang et al. 2016 in the far field: three textures for the azimuthal terms.
//!
//! Textures, channels and axes are those of [`deon`](super::deon), with the cosine of the known inclination for rows.

use super::section::{self, Section};
use super::{Table2, Tables, Untabulated, checked};
use crate::lobe::azimuthal::Kernel;
use crate::{Chiang, Dir, Fiber, Field, Lobes, wrap_angle};

/// [`Chiang`] as textures; see [`bake`].
#[derive(Clone, Debug, PartialEq)]
pub struct ChiangTables {
    exact: Chiang<f64>,
    single: Chiang<f32>,
    /// `N_R`, and `N_TT` in three channels.
    pub r_tt: Table2,
    /// `N_TRT`.
    pub trt: Table2,
    /// `N_res`.
    pub residual: Table2,
}

/// Bakes the far field of `model`, whatever its `field`; `size` texels a side.
///
/// Error ([`TableError::max_rel_to_peak`](super::TableError::max_rel_to_peak)) for azimuthal roughnesses from 0.2:
/// at most 0.3 % at 64, 0.1 % at 128, 0.03 % at 256.
///
/// # Errors
///
/// A size outside 2 to [`LARGEST`](super::LARGEST).
pub fn bake(model: &Chiang<f64>, size: u32) -> Result<ChiangTables, Untabulated> {
    let size = checked(size)?;
    let section = Section {
        eta: model.eta,
        sigma_a: model.sigma_a,
        kernel: Kernel::Logistic,
        scales: [model.azimuthal_scale(); 3],
    };
    let [r_tt, trt, residual] = section.bake(size);
    Ok(ChiangTables { exact: *model, single: model.cast(), r_tt, trt, residual })
}

impl ChiangTables {
    /// Texture coordinates in `r_tt` and `trt`; in `residual` the second of them. Twin of `chiang_table_coords`.
    #[inline]
    pub fn coords(&self, known: Dir, s: Dir) -> [f32; 2] {
        section::coords(self.trt.size()[0], wrap_angle(s.phi - known.phi), known.cos_theta)
    }

    /// `fcos` from the texels at [`coords`](Self::coords). Twin of `chiang_from_tables`.
    #[inline]
    pub fn combine(&self, known: Dir, s: Dir, r_tt: [f32; 4], trt: [f32; 4], residual: [f32; 4]) -> Lobes {
        let l = section::longitudinal(self.single.variances(), self.single.alpha, known, s);
        section::combine(l, r_tt, trt, residual)
    }
}

impl Tables for ChiangTables {
    fn exact(&self) -> Fiber<f64> {
        Fiber::Chiang(Chiang { field: Field::Far, ..self.exact })
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
