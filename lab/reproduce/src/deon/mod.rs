//! d'Eon, Marschner & Hanika 2013, "Importance sampling for physically-based hair fiber models".
//!
//! | module | claim |
//! |---|---|
//! | [`fig1`] | everything may vary along the fiber, as nothing is computed in advance |
//! | [`fig3`] | area lights and environments together, without bias |
//! | [`sampler`] | far less variance than directions drawn evenly |
//! | [`offset`] | the lobe should be chosen after the offset across the fiber |
//! | [`weights`] | what a sample weighs, and how the alternatives to it spread |
//! | [`clamp`] | weights may be cut at 2 without a measurable loss |
//! | [`lambert`] | the closed form of a diffuse cylinder, and its sampler |
//! | [`cost`] | a sample costs about as much as an evaluation |

mod clamp;
mod cost;
mod fig1;
mod fig3;
mod lambert;
mod offset;
mod point;
mod sampler;
mod stage;
mod weights;

use crate::{Experiment, Paper};

/// In the order of the paper, its pictures first.
pub(crate) static EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: "deon-fig1",
        paper: Paper::DEon2013,
        figure: "Fig. 1",
        title: "Absorption, roughness, tilt and index that vary along the fiber",
        run: fig1::run,
    },
    Experiment {
        name: "deon-fig3",
        paper: Paper::DEon2013,
        figure: "Fig. 3 and Sec. 5",
        title: "Area lights and an environment, without bias",
        run: fig3::run,
    },
    Experiment {
        name: "deon-sampler",
        paper: Paper::DEon2013,
        figure: "Sec. 3",
        title: "The sampler against directions drawn evenly",
        run: sampler::run,
    },
    Experiment {
        name: "deon-offset",
        paper: Paper::DEon2013,
        figure: "Sec. 3.4",
        title: "Choosing the lobe after the offset, or before",
        run: offset::run,
    },
    Experiment {
        name: "deon-weights",
        paper: Paper::DEon2013,
        figure: "Sec. 3.4 and 3.5",
        title: "What a sample weighs",
        run: weights::run,
    },
    Experiment {
        name: "deon-clamp",
        paper: Paper::DEon2013,
        figure: "Sec. 3.4",
        title: "What is lost by cutting weights at 2",
        run: clamp::run,
    },
    Experiment {
        name: "lambertian-fibers",
        paper: Paper::DEon2013,
        figure: "Sec. 4",
        title: "Lambertian fibers in closed form",
        run: lambert::run,
    },
    Experiment {
        name: "deon-cost",
        paper: Paper::DEon2013,
        figure: "Sec. 5",
        title: "The price of a sample, in evaluations",
        run: cost::run,
    },
];
