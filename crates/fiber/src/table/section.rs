//! Azimuthal terms of a far field as textures: `N_p` over azimuth and inclination.
//!
//! The same integral over the cross-section as in `lobe/cross_section.rs`, in another order: a row of texels has one
//! inclination, so that paths and attenuations are worked out once a row, and a texel costs the kernels alone.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use math::Rgb;

use super::{Table2, coordinate, knot};
use crate::lobe::attenuation::Optics;
use crate::lobe::azimuthal::{Kernel, windows};
use crate::lobe::longitudinal::{Cone, Lobe};
use crate::quadrature::rule;
use crate::{Dir, Lobes, wrap_angle};

/// A fiber's cross-section.
pub(super) struct Section {
    pub(super) eta: f64,
    pub(super) sigma_a: Rgb<f64>,
    pub(super) kernel: Kernel,
    /// Scale of the kernel of R, TT, TRT, radians.
    pub(super) scales: [f64; 3],
}

/// A pair of offsets `±h` at one inclination.
struct Node {
    /// Of `½ ∫ dh`, for one of the two.
    weight: f64,
    /// `Φ_p - pπ`, which is odd in `h`.
    bends: [f64; 3],
    a: [Rgb<f64>; 4],
}

/// `N_R` and `N_TT`; `N_TRT`; `N_res`, one column.
pub(super) type Textures = [Table2; 3];

impl Section {
    /// Textures with `n` rows: columns are `φ/π` from 0 to 1, rows the cosine of the inclination from 0 to 1, both
    /// evenly and with both ends.
    pub(super) fn bake(&self, n: u32) -> Textures {
        let wide = self.scales.map(|scale| self.kernel.nodes(scale, true));
        let most = wide.iter().filter_map(|nodes| *nodes).max().unwrap_or(0);
        let mut around = Vec::with_capacity(n as usize * n as usize);
        let mut residual = Vec::with_capacity(n as usize);
        for row in 0..n {
            let optics = Optics::new(knot(row, n).powi(2), self.eta);
            let nodes = self.nodes(&optics, most.max(48));
            for column in 0..n {
                around.push(self.azimuthal(&optics, &nodes, wide.map(|nodes| nodes.is_some()), PI * knot(column, n)));
            }
            residual.push(nodes.iter().map(|node| node.a[3] * (2.0 * node.weight / TAU)).sum::<Rgb<f64>>());
        }
        let at = |column: u32, row: u32| around[(row * n + column) as usize];
        [
            Table2::new([n, n], |column, row| {
                let [r, tt, _] = at(column, row);
                [r[0], tt[0], tt[1], tt[2]].map(|x| x as f32)
            }),
            Table2::new([n, n], |column, row| rgb(at(column, row)[2])),
            Table2::new([1, n], |_, row| rgb(residual[row as usize])),
        ]
    }

    fn nodes(&self, optics: &Optics<f64>, n: usize) -> Vec<Node> {
        let half = rule(n).iter().filter(|(x, _)| *x > 0.0);
        half.map(|&(x, w)| {
            let gamma = FRAC_PI_2 * x;
            let (h, cos_gamma) = gamma.sin_cos();
            let path = optics.path(h, gamma, cos_gamma);
            Node {
                weight: 0.5 * w * FRAC_PI_2 * cos_gamma,
                bends: [0, 1, 2].map(|p| path.exit_azimuth(p) - p as f64 * PI),
                a: path.attenuation(self.sigma_a),
            }
        })
        .collect()
    }

    /// `N_p` of R, TT, TRT.
    fn azimuthal(&self, optics: &Optics<f64>, nodes: &[Node], wide: [bool; 3], phi: f64) -> [Rgb<f64>; 3] {
        [0, 1, 2].map(|p| {
            let mut n = Rgb::black();
            if wide[p] {
                let x = phi - p as f64 * PI;
                for node in nodes {
                    let d = self.kernel_at(p, x - node.bends[p]) + self.kernel_at(p, x + node.bends[p]);
                    n += node.a[p] * (node.weight * d);
                }
            } else {
                windows(optics, p, self.kernel, self.scales[p], phi, |gamma, d| {
                    let (h, cos_gamma) = gamma.sin_cos();
                    n += optics.path(h, gamma, cos_gamma).attenuation(self.sigma_a)[p] * d;
                });
            }
            n
        })
    }

    fn kernel_at(&self, p: usize, x: f64) -> f64 {
        // Beyond, there is less than the last digit of the peak.
        let reach = match self.kernel {
            Kernel::Gaussian => 9.0,
            Kernel::Logistic => 40.0,
        };
        let x = wrap_angle(x);
        if x.abs() > reach * self.scales[p] { 0.0 } else { self.kernel.at(self.scales[p], x) }
    }
}

fn rgb(x: Rgb<f64>) -> [f32; 4] {
    let [r, g, b] = x.cast().0;
    [r, g, b, 0.0]
}

/// Texture coordinates for an azimuth and the cosine of an inclination.
#[inline]
pub(super) fn coords(n: u32, phi: f32, cos: f32) -> [f32; 2] {
    [coordinate(phi.abs() / std::f32::consts::PI, n), coordinate(cos, n)]
}

/// `L_p` of R, TT, TRT and the residual lobe, from their variances and the tilt.
#[inline]
pub(super) fn longitudinal(variances: [f32; 4], alpha: f32, known: Dir, s: Dir) -> [f32; 4] {
    let shifts = [2.0_f32, -1.0, -4.0, 0.0];
    [0, 1, 2, 3].map(|p| {
        let cone = Cone::specular(known.sin_theta, known.cos_theta, shifts[p] * alpha);
        Lobe::new(variances[p], cone).density(s.sin_theta, s.cos_theta)
    })
}

/// `L_p N_p`, with `N_p` from the textures.
#[inline]
pub(super) fn combine(l: [f32; 4], r_tt: [f32; 4], trt: [f32; 4], residual: [f32; 4]) -> Lobes {
    let first_three = |x: [f32; 4]| Rgb([x[0], x[1], x[2]]);
    Lobes([
        Rgb::splat(r_tt[0] * l[0]),
        Rgb([r_tt[1], r_tt[2], r_tt[3]]) * l[1],
        first_three(trt) * l[2],
        first_three(residual) * l[3],
    ])
}
