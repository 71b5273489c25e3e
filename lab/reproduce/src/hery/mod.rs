//! Hery & Ramamoorthi 2012, "Importance sampling of reflection from hair fibers".
//!
//! | module | what the paper shows |
//! |---|---|
//! | [`fig1`] | ten widths of the highlight, resolved with few samples |
//! | [`fig2`] | a white dome: one sample of the fiber against many of the light |
//! | [`fig3`] | fast convergence in a soft environment, with shadows |
//! | [`fig4`] | four samples of the fiber are worth about 24 of the light |
//! | [`fig5`] | a look of two lobes |
//! | [`energy`] | that the sampler conserves energy, and what becomes of the value |

mod energy;
mod fig1;
mod fig2;
mod fig3;
mod fig4;
mod fig5;
mod point;

use fiber::{Hery, HeryLobe, HeryMode};
use math::Rgb;

use crate::{Experiment, Paper};

/// In the order of the paper.
pub(crate) static EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: "hery-fig1",
        paper: Paper::Hery2012,
        figure: "Fig. 1",
        title: "Ten widths of the highlight",
        run: fig1::run,
    },
    Experiment {
        name: "hery-fig2",
        paper: Paper::Hery2012,
        figure: "Fig. 2",
        title: "A white dome: one fiber sample against 1, 16 and 256 light samples",
        run: fig2::run,
    },
    Experiment {
        name: "hery-fig3",
        paper: Paper::Hery2012,
        figure: "Fig. 3",
        title: "Convergence in a soft environment with shadows",
        run: fig3::run,
    },
    Experiment {
        name: "hery-fig4",
        paper: Paper::Hery2012,
        figure: "Fig. 4",
        title: "Four fiber samples against 24 light samples",
        run: fig4::run,
    },
    Experiment {
        name: "hery-fig5",
        paper: Paper::Hery2012,
        figure: "Fig. 5",
        title: "A look of two lobes",
        run: fig5::run,
    },
    Experiment {
        name: "hery-energy",
        paper: Paper::Hery2012,
        figure: "Sec. 3.3, 3.6 and 4",
        title: "Energy of the folded sampler and of the printed value",
        run: energy::run,
    },
];

/// One lobe; angles in degrees.
fn lobe(tint: Rgb<f64>, beta_deg: f64, alpha_deg: f64) -> HeryLobe<f64> {
    HeryLobe { tint, beta: beta_deg.to_radians(), alpha: alpha_deg.to_radians() }
}

/// A fiber with one lobe that reflects everything, not tilted.
fn white(beta_deg: f64, mode: HeryMode) -> Hery<f64> {
    Hery { lobes: [lobe(Rgb::white(), beta_deg, 0.0), HeryLobe::none()], mode, cos_theta_d: false }
}
