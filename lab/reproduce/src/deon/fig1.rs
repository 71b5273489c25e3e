//! Absorption, roughness, tilt and index of refraction that vary along the fiber: what that costs, and what it shows.

use std::time::Instant;

use film::Film;

use super::stage::{self, Shot, Stage, Varies};
use crate::raster::Raster;
use crate::{Context, Error, Measured, Report, Table, number, render};

/// Samples per pixel; the paper has 1024.
const SAMPLES: u32 = 64;

/// What is rendered: a name, and what varies.
const PICTURES: [(&str, Varies); 6] = {
    const NONE: Varies = Varies { absorption: false, roughness: false, tilt: false, ior: false };
    [
        ("nothing", NONE),
        ("absorption", Varies { absorption: true, ..NONE }),
        ("roughness", Varies { roughness: true, ..NONE }),
        ("tilt", Varies { tilt: true, ..NONE }),
        ("index", Varies { ior: true, ..NONE }),
        ("all four", Varies::ALL),
    ]
};

struct Taken {
    name: &'static str,
    film: Film,
    /// Seconds, set-up of the scene included.
    seconds: f64,
}

/// Samples per second relative to pictures where nothing varies would mix in how long paths are, so pictures with
/// other absorption are left out.
fn same_paths(name: &str) -> bool {
    !matches!(name, "nothing" | "absorption" | "all four")
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let stage = Stage::new(context)?;
    let take = |name: &'static str, varies: Varies, seed: u32| -> Result<Taken, Error> {
        let look = varies.look(1.0);
        let shot = Shot {
            look: &look,
            area_lights: false,
            integrator: "path",
            samples: context.count(SAMPLES),
            close: None,
            seed,
        };
        let begin = Instant::now();
        let film = stage.film(context, &format!("{name} varies"), &shot)?;
        Ok(Taken { name, film, seconds: begin.elapsed().as_secs_f64() })
    };
    let mut taken = Vec::new();
    for (name, varies) in PICTURES {
        taken.push(take(name, varies, context.seed)?);
    }
    // The first render pays for what is made once, so what nothing costs is taken again, with other noise.
    let again = take("nothing", Varies::default(), context.seed.wrapping_add(1))?;
    let plain = &taken[0];
    let hair: Vec<bool> = plain.film.pixels().iter().map(|pixel| pixel.alpha() > 0.5).collect();
    if !hair.contains(&true) {
        return Err(Error::Measure("the locks are not in the picture"));
    }
    let noise = |taken: &Taken| taken.film.noise();
    let noise_ratio = taken.iter().skip(1).map(|t| noise(t) / noise(plain)).fold(0.0, f64::max);
    let time_ratio = taken.iter().filter(|t| same_paths(t.name)).map(|t| t.seconds / again.seconds).fold(0.0, f64::max);
    let rejected: u64 = taken.iter().map(|t| t.film.rejected()).sum();
    let by_noise = stage::rmse(&again.film, &plain.film);

    let mut measured = vec![
        Measured::new("noise with variation over that without, the worst of the pictures", noise_ratio, "")
            .between(0.0, 1.5)
            .decides(),
        Measured::new("time with varying roughness, tilt or index over that without, the worst", time_ratio, "")
            .between(0.0, 1.5)
            .decides(),
        Measured::new("samples that were not finite", rejected as f64, "").between(0.0, 0.0).decides(),
        Measured::new("difference of two pictures in which nothing varies: noise alone", 100.0 * by_noise, "%"),
    ];
    let mut table = Table::new(
        "What varies, and what that does. Difference: root of the mean squared difference to the picture in which \
         nothing varies, rendered with the same random numbers, relative to its mean. Times are those of one run on a \
         shared machine and contain the set-up of the scene.",
        ["varies", "noise", "difference", "mean red, green, blue", "time"],
    );
    for t in &taken {
        let mean = render::mean_colour(&t.film, |i| hair[i]);
        let difference = stage::rmse(&t.film, &plain.film);
        if t.name == "all four" {
            measured.push(Measured::new("difference when all four vary", 100.0 * difference, "%"));
        }
        table.row([
            t.name.to_owned(),
            format!("{} %", number(100.0 * noise(t))),
            format!("{} %", number(100.0 * difference)),
            mean.0.map(number).join(" "),
            format!("{} s", number(t.seconds)),
        ]);
    }
    let noisiest = taken.iter().map(noise).fold(0.0, f64::max);
    let mut report = Report::new(
        "As the sampler needs nothing computed in advance, absorption may change along the fiber, and noise may be put \
         on index, roughness and tilt, in pictures with an environment and all scattered light.",
        format!(
            "variation raises the noise at most to {} times and the time to {} times of what they are without",
            number(noise_ratio),
            number(time_ratio)
        ),
        measured,
    );
    report.text = vec![
        format!(
            "Three locks of fibers under a sky given as a picture, light followed through up to 64 scattering events, \
             {} samples a pixel. Without variation fibers are golden brown, 8 degrees wide in both directions, tilted \
             by -3 degrees, with an index of 1.55. Absorption runs from dark at the root to light at the tip and has \
             noise on top; the noise of roughness goes up to 6 degrees either way, that of tilt up to 5 degrees, that \
             of the index up to 0.25, with 14 features a strand, others on every strand.",
            context.count(SAMPLES)
        ),
        "A parameter that varies is evaluated at every place where light scatters, so it costs what that evaluation \
         costs; no table is made, whatever varies. Noise here is the standard error over the luminance, averaged over \
         the picture. Times of pictures with another absorption cannot be compared, since their paths have other \
         lengths."
            .into(),
        format!(
            "The paper's pictures have 1024 samples a pixel; at the rate of the root, the {} % of the noisiest of ours \
             would be {} % there. Its grooms and skies are not published; these are ours.",
            number(100.0 * noisiest),
            number(100.0 * noisiest * (f64::from(context.count(SAMPLES)) / 1024.0).sqrt())
        ),
    ];
    report.tables.push(table);
    let pictures: Vec<Raster> = taken.iter().map(|t| stage::shown(&t.film)).collect();
    report.pictures.push(Raster::sheet(&pictures, 3, 4).picture(
        "variation",
        "From left to right and top to bottom, what varies along the fibers: nothing, absorption, roughness, tilt, \
         index, all four.",
    )?);
    Ok(report)
}
