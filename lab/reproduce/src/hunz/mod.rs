//! Hunz 2016: real-time hair rendering with Kajiya-Kay, Marschner and the artist-friendly model.
//!
//! | module | what the thesis shows |
//! |---|---|
//! | [`fig29`] | Kajiya-Kay with three exponents |
//! | [`fig30`] | the lobes of Marschner's model, narrow and wide |
//! | [`fig32`] | three hair colours by three models, the simpler ones matched to Marschner's |
//! | [`fig46`] | the three models side by side, lit from the front and from behind |
//! | [`caustic`] | that a cubic replaces Snell's law, and Gaussians the caustics |
//! | [`energy`] | that Marschner's model conserves energy |
//! | [`ellipse`] | that an index which depends on the azimuth stands for an elliptical fiber |
//!
//! [`head`] is the scene of the pictures, [`matching`] brings the parameters of one model close to another.

mod caustic;
mod ellipse;
mod energy;
mod fig29;
mod fig30;
mod fig32;
mod fig46;
mod head;
mod matching;

use math::Rgb;

use crate::{Experiment, Paper, number};

/// In the order of the thesis; what is not a figure comes last.
pub(crate) static EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: "hunz-fig29",
        paper: Paper::Hunz2016,
        figure: "Fig. 29",
        title: "Kajiya-Kay with three exponents",
        run: fig29::run,
    },
    Experiment {
        name: "hunz-fig30",
        paper: Paper::Hunz2016,
        figure: "Fig. 30",
        title: "The lobes of Marschner's model, narrow and wide",
        run: fig30::run,
    },
    Experiment {
        name: "hunz-fig32",
        paper: Paper::Hunz2016,
        figure: "Fig. 32",
        title: "Three hair colours: simpler models matched to Marschner's",
        run: fig32::run,
    },
    Experiment {
        name: "hunz-fig46",
        paper: Paper::Hunz2016,
        figure: "Fig. 31 and 46",
        title: "Three models side by side, from the front and from behind",
        run: fig46::run,
    },
    Experiment {
        name: "hunz-caustic",
        paper: Paper::Hunz2016,
        figure: "Eq. 44 to 57 and Alg. 1",
        title: "A cubic for Snell's law, and Gaussians for caustics",
        run: caustic::run,
    },
    Experiment {
        name: "hunz-energy",
        paper: Paper::Hunz2016,
        figure: "Eq. 37 to 40 and Sec. 6.1.1",
        title: "Does Marschner's model conserve energy?",
        run: energy::run,
    },
    Experiment {
        name: "hunz-ellipse",
        paper: Paper::Hunz2016,
        figure: "Eq. 58 and 59",
        title: "An index that stands for an elliptical fiber",
        run: ellipse::run,
    },
];

/// A quotient that stays a number where there is nothing to divide by.
fn ratio(a: f64, b: f64) -> f64 {
    a / b.max(1e-9)
}

/// Three channels for a cell.
fn rgb(c: Rgb<f64>) -> String {
    format!("{} {} {}", number(c[0]), number(c[1]), number(c[2]))
}
