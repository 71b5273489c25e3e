//! How fast pictures converge in a soft environment with shadows; the scene is shared with [`super::fig4`].

use std::sync::Arc;

use film::{Film, View};
use math::hash;
use scene::Scene;

use crate::chart::{Chart, Curve};
use crate::raster::Raster;
use crate::render::{self, Memory};
use crate::sky::Sky;
use crate::{Context, Error, Measured, Report, Table, number, stats};

/// Width of the lobe, degrees.
const BETA_DEG: f64 = 7.5;

/// Rays per pixel that pictures are compared at.
const COUNTS: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];

/// What is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    Fiber,
    Light,
    /// One of each per sample, by the power heuristic.
    Both,
}

impl Method {
    pub(super) const ALL: [Self; 3] = [Self::Fiber, Self::Light, Self::Both];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Fiber => "fiber",
            Self::Light => "light",
            Self::Both => "both",
        }
    }

    fn integrator(self) -> &'static str {
        match self {
            Self::Fiber => "bcsdf_only",
            Self::Light => "light_only",
            Self::Both => "direct",
        }
    }

    /// Samples per pixel that cost `rays` rays towards light.
    fn samples(self, rays: u32) -> u32 {
        if self == Self::Both { rays.div_ceil(2) } else { rays }
    }
}

/// A ball of 2000 fibers under a sky, lit once.
#[derive(Clone, Debug)]
pub(super) struct Ball {
    assets: Memory,
    side: u32,
    seed: u32,
}

impl Ball {
    pub(super) fn new(context: &Context<'_>, sky: &Sky) -> Result<Self, Error> {
        let mut assets = Memory::default();
        assets.grooms.insert("ball".into(), render::ball(2000, 0.012, 1)?);
        assets.environments.insert("sky".into(), sky.image(128));
        Ok(Self { assets, side: context.pixels(144), seed: context.seed })
    }

    /// The scene with so many samples per pixel. Pixels are narrow, so that the error is that of the light.
    fn scene(&self, method: Method, samples: u32, seed: u32) -> Result<Arc<Scene>, Error> {
        let text = format!(
            "[scene]\nname = \"ball\"\n[camera]\nposition = [0.0, 0.0, 6.0]\ntarget = [0.0, 0.0, 0.0]\nfov_deg = 26.0\n\
             [film]\nwidth = {0}\nheight = {0}\nfilter = \"box\"\nfilter_width_px = 0.1\n\
             [render]\nsamples = {samples}\nmax_depth = 1\nintegrator = \"{1}\"\nseed = {seed}\n\
             [[light]]\ntype = \"environment\"\nfile = \"sky\"\nvisible = false\n\
             [[groom]]\nfile = \"ball\"\nlook = \"main\"\n\
             [look.main]\nmodel = \"hery\"\nroughness_deg = {BETA_DEG:?}\ntilt_deg = 0.0\n",
            self.side,
            method.integrator()
        );
        render::load(&text, &self.assets)
    }

    /// A picture with so many samples per pixel.
    pub(super) fn film(&self, context: &Context<'_>, method: Method, samples: u32) -> Result<Film, Error> {
        let seed = hash::mix3(self.seed, samples, method as u32);
        let step = format!("{} samples: {}", samples, method.name());
        render::film(context, &step, self.scene(method, samples, seed)?)
    }

    /// What the pictures should come to: many samples of both kinds, with numbers of their own.
    pub(super) fn reference(&self, context: &Context<'_>) -> Result<Film, Error> {
        let seed = hash::mix2(self.seed, 0x5eed);
        render::film(context, "reference", self.scene(Method::Both, context.count(768).max(64), seed)?)
    }
}

/// Root of the mean squared error over the pixels that show hair, relative to their mean light, and the relative
/// difference of the means.
pub(super) fn error(film: &Film, reference: &Film) -> (f64, f64) {
    let (a, b) = (render::luminance(film), render::luminance(reference));
    let covered = |i: usize| reference.pixels()[i].alpha() > 0.5;
    let pairs: Vec<(f64, f64)> =
        a.into_iter().zip(b).enumerate().filter(|(i, _)| covered(*i)).map(|(_, pair)| pair).collect();
    let mean = |pick: fn(&(f64, f64)) -> f64| pairs.iter().map(pick).sum::<f64>() / pairs.len() as f64;
    let (test, want) = (mean(|p| p.0), mean(|p| p.1));
    (stats::rms(pairs.iter().map(|(a, b)| a - b)) / want, test / want - 1.0)
}

/// How pictures of the ball are shown.
pub(super) fn shown(film: &Film) -> Raster {
    Raster::of(&film.image(), View::Srgb, 0.5)
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let ball = Ball::new(context, &Sky::soft())?;
    let reference = ball.reference(context)?;
    if !reference.pixels().iter().any(|pixel| pixel.alpha() > 0.5) {
        return Err(Error::Measure("the ball of fibers is not in the picture"));
    }
    let mut pictures = Vec::new();
    // By method, then by number of rays.
    let mut errors: Vec<Vec<(u32, f64, f64)>> = Vec::new();
    for method in Method::ALL {
        let mut row = Vec::new();
        for rays in COUNTS {
            // Both at once need two rays.
            if method == Method::Both && rays == 1 {
                continue;
            }
            let film = ball.film(context, method, method.samples(rays))?;
            let (rmse, bias) = error(&film, &reference);
            row.push((rays, rmse, bias));
            if rays == 16 {
                pictures.push(shown(&film));
            }
        }
        errors.push(row);
    }
    pictures.push(shown(&reference));
    let at = |method: Method, rays: u32| {
        errors[method as usize].iter().find(|(n, ..)| *n == rays).map_or((f64::NAN, f64::NAN), |&(_, e, b)| (e, b))
    };
    let (fiber, light, both) = (at(Method::Fiber, 16).0, at(Method::Light, 16).0, at(Method::Both, 16).0);
    let ratio = fiber / at(Method::Light, 64).0;
    let bias = at(Method::Fiber, 64).1;
    // What the reference itself is off by adds to every error.
    let logs = |method: Method| -> Vec<(f64, f64)> {
        errors[method as usize].iter().map(|&(n, e, _)| (f64::from(n).ln(), e.ln())).collect()
    };

    let measured = vec![
        Measured::new("error of 16 fiber samples over that of 64 light samples", ratio, "").between(0.0, 1.0).decides(),
        Measured::new("mean of 64 fiber samples against the reference", 100.0 * bias, "%").between(-2.0, 2.0).decides(),
        Measured::new("variance of light over fiber samples, 16 rays each", (light / fiber).powi(2), "")
            .between(2.0, f64::INFINITY),
        Measured::new("variance of both together over fiber samples, 16 rays each", (both / fiber).powi(2), ""),
        Measured::new("error of 16 fiber samples", 100.0 * fiber, "%"),
        Measured::new("error of 16 light samples", 100.0 * light, "%"),
        Measured::new("error of 8 of each", 100.0 * both, "%"),
        Measured::new("error against number, fiber samples: power", stats::slope(&logs(Method::Fiber)), "")
            .between(-1.2, -0.4),
        Measured::new("error against number, light samples: power", stats::slope(&logs(Method::Light)), "")
            .between(-1.2, -0.4),
    ];
    let mut report = Report::new(
        "Under arbitrary light with full shadows sampling the fiber converges rapidly to the truth, which the paper \
         gets from 256 light samples.",
        format!(
            "at 16 samples the error is {} % for the fiber and {} % for the light; 16 fiber samples against 64 light \
             samples: {} times the error",
            number(100.0 * fiber),
            number(100.0 * light),
            number(ratio)
        ),
        measured,
    );
    report.text = vec![
        format!(
            "A ball of 2000 fibers, β = {BETA_DEG} degrees, under a sky of two broad lights, given to the renderer as a \
             picture of 256 x 128 texels whose light samples follow its luminance exactly. Light scatters once, and \
             shadows are traced. Pixels are a tenth of their width wide, so that the error is that of the light and not \
             of the edges of hair."
        ),
        "Methods are compared at equal numbers of rays: for both together, half of them go to the light. The error is \
         the root of the mean squared difference to a reference of many samples of both kinds, over the pixels that \
         show hair, relative to their mean. Samples within a pixel are stratified, so errors may fall faster than with \
         the root of their number."
            .into(),
        "The paper's light is not published; ours is the sky in which its Fig. 4 is tried as well.".into(),
    ];
    let mut table = Table::new("Relative error by rays.", ["rays", "fiber", "light", "both"]);
    for rays in COUNTS {
        let cell = |method| match at(method, rays).0 {
            e if e.is_nan() => "-".to_owned(),
            e => format!("{} %", number(100.0 * e)),
        };
        table.row([rays.to_string(), cell(Method::Fiber), cell(Method::Light), cell(Method::Both)]);
    }
    report.tables.push(table);
    report.pictures.push(
        Raster::sheet(&pictures, 4, 4)
            .picture("ball", "From left to right: 16 fiber samples, 16 light samples, 8 of each, reference.")?,
    );
    report.pictures.push(
        Chart {
            title: "Error with shadows".into(),
            x: "rays towards light, per pixel".into(),
            y: "relative error".into(),
            x_log: true,
            y_log: true,
            curves: Method::ALL
                .into_iter()
                .map(|method| {
                    let points = errors[method as usize].iter().map(|&(n, e, _)| [f64::from(n), e]).collect();
                    Curve::marked(method.name(), points)
                })
                .chain([Curve::dashed("one over the root", vec![[1.0, light * 4.0], [64.0, light / 2.0]])])
                .collect(),
            ..Chart::default()
        }
        .picture("error", "Error of the picture against the number of rays.")?,
    );
    Ok(report)
}
