//! A look of two lobes, white and blue, on fur.

use fiber::{Dir, Hery, HeryMode, Hit, Model, R, Scatter, TRT};
use film::{Film, View};
use math::Rgb;

use super::lobe;
use crate::raster::Raster;
use crate::render::{self, Memory};
use crate::sphere::numbers;
use crate::stats::{Bell, bell};
use crate::{Context, Error, Measured, Report, Table, number, stats};

/// Strength, width and shift of the lobes as published, degrees.
const FIRST: (f64, f64, f64) = (0.17, 5.0, -2.0);
const SECOND: (f64, f64, f64) = (1.0, 10.0, 5.0);
/// What "a saturated blue" is taken for.
const BLUE: [f64; 3] = [0.02, 0.10, 1.0];
/// Inclination at which energies are measured, radians.
const THETA_K: f64 = 0.3;

fn fiber() -> Hery<f64> {
    let blue = Rgb(BLUE) * SECOND.0;
    Hery {
        lobes: [lobe(Rgb::splat(FIRST.0), FIRST.1, FIRST.2), lobe(blue, SECOND.1, SECOND.2)],
        mode: HeryMode::Truncated,
        cos_theta_d: false,
    }
}

/// Lines of a look: the first lobe, the second, or both.
fn look(first: bool, second: bool) -> String {
    let (white, (_, beta1, alpha1)) = (format!("{:?}", FIRST.0), FIRST);
    let (blue, (_, beta2, alpha2)) = (format!("{:?}", BLUE.map(|x| x * SECOND.0)), SECOND);
    match (first, second) {
        (true, false) => format!("tint = {white}\nroughness_deg = {beta1:?}\ntilt_deg = {alpha1:?}\n"),
        (false, _) => format!("tint = {blue}\nroughness_deg = {beta2:?}\ntilt_deg = {alpha2:?}\n"),
        (true, true) => format!(
            "tint = {white}\nroughness_deg = {beta1:?}\ntilt_deg = {alpha1:?}\n\
             tint2 = {blue}\nroughness2_deg = {beta2:?}\ntilt2_deg = {alpha2:?}\n"
        ),
    }
}

/// Fur on a dark ball, lit once by a key, a rim and a dim sky.
fn picture(context: &Context<'_>, step: &str, look: &str) -> Result<Film, Error> {
    let side = context.pixels(208);
    let strands = context.count(30_000).clamp(300, 60_000);
    let text = format!(
        "[scene]\nname = \"fur\"\n[camera]\norbit = {{ azimuth_deg = 20.0, elevation_deg = 10.0 }}\nfov_deg = 26.0\n\
         [film]\nwidth = {side}\nheight = {side}\n\
         [render]\nsamples = {}\nintegrator = \"direct\"\nseed = {}\n\
         [[light]]\ntype = \"rectangle\"\ncenter = [-14.0, 20.0, 26.0]\naim = [0.0, 0.0, 0.0]\nwidth = 12.0\n\
         height = 12.0\nradiance = 16.0\n\
         [[light]]\ntype = \"rectangle\"\ncenter = [18.0, 14.0, -22.0]\naim = [0.0, 0.0, 0.0]\nwidth = 14.0\n\
         height = 14.0\nradiance = 12.0\n\
         [[light]]\ntype = \"environment\"\nradiance = 0.3\nvisible = false\n\
         [[mesh]]\nname = \"ball\"\nshape = {{ sphere = {{ radius = 4.9 }} }}\nalbedo = 0.03\n\
         [[groom]]\nname = \"fur\"\nlook = \"main\"\nwidth = {{ scale = 2.5 }}\n\
         procedural = {{ preset = \"fur\", strands = {strands}, seed = 3, ellipsoid = {{ radii = [5.0, 5.0, 5.0] }} }}\n\
         [look.main]\nmodel = \"hery\"\n{look}",
        context.count(48),
        context.seed
    );
    render::film(context, step, render::load(&text, &Memory::default())?)
}

/// Where a lobe lies in `θ_s` and how wide it is, degrees, seen at right angles to the fiber.
fn along(fiber: &Hery<f64>, which: usize) -> Option<Bell> {
    let point = fiber.prepare(&Hit::new(Dir::new(0.0, 0.0), 0.0));
    let points: Vec<(f64, f64)> = (-800..=800)
        .map(|i| f64::from(i) * 0.1)
        .map(|deg| {
            let dir = Dir::new(deg.to_radians(), 0.0);
            // Without the cosine of the solid angle the lobe is a Gaussian.
            (deg, point.eval(dir)[which].luminance() * dir.cos_theta)
        })
        .collect();
    bell(&points, 0.1)
}

/// Mean weight of the sampler per channel, with its standard error.
fn energy(fiber: &Hery<f64>, count: u32, stream: u32) -> [(f64, f64); 3] {
    let point = fiber.prepare(&Hit::new(Dir::new(THETA_K, 0.0), 0.0));
    let weights: Vec<Rgb<f64>> = (0..count)
        .map(|i| point.sample(numbers(i, stream)).map_or(Rgb::black(), |sample| sample.weight.sum()))
        .collect();
    [0, 1, 2].map(|channel| {
        let x: Vec<f64> = weights.iter().map(|w| w[channel]).collect();
        (stats::mean(&x), stats::deviation(&x) / (x.len() as f64).sqrt())
    })
}

fn rgb(c: Rgb<f64>) -> String {
    format!("{} {} {}", number(c[0]), number(c[1]), number(c[2]))
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let films = [("white lobe", look(true, false)), ("blue lobe", look(false, true)), ("both lobes", look(true, true))]
        .map(|(step, look)| picture(context, step, &look));
    let [white, blue, both] = films;
    let (white, blue, both) = (white?, blue?, both?);
    // Fur alone: the ball below is not of this look.
    let hair: Vec<bool> = both.pixels().iter().map(|p| p.strand() != film::NO_STRAND && p.alpha() > 0.99).collect();
    if !hair.contains(&true) {
        return Err(Error::Measure("the fur is not in the picture"));
    }
    // Fibers alone: what the ball reflects between them is in every picture, and the sum would count it twice.
    let mean = |film: &Film| {
        let kept = film.pixels().iter().zip(&hair).filter(|(_, keep)| **keep);
        let (mut sum, mut n) = (Rgb::<f64>::black(), 0.0_f64);
        for (pixel, _) in kept {
            sum += pixel.lobes().into_iter().map(|lobe| lobe.cast::<f64>()).sum::<Rgb<f64>>();
            n += 1.0;
        }
        sum * n.recip()
    };
    let (white_mean, blue_mean, both_mean) = (mean(&white), mean(&blue), mean(&both));
    let sum = white_mean + blue_mean;
    let off = sum.zip(both_mean, |a, b| (a / b - 1.0).abs()).max_channel();

    let fiber = fiber();
    let (Some(first), Some(second)) = (along(&fiber, R), along(&fiber, TRT)) else {
        return Err(Error::Measure("a lobe has no shape"));
    };
    let sampled = energy(&fiber, context.count(200_000), context.seed);
    let tints = fiber.lobes[0].tint + fiber.lobes[1].tint;
    // In standard errors, and what is left of single-precision uniform numbers.
    let errors = (0..3).map(|c| (sampled[c].0 - tints[c]).abs() / (sampled[c].1 + 1e-9)).fold(0.0, f64::max);

    let measured = vec![
        Measured::new("picture of both lobes against the sum of each alone, worst channel", 100.0 * off, "%")
            .between(0.0, 1.0)
            .decides(),
        Measured::new("white lobe: place in θ_s, seen at right angles", first.centre, "degrees")
            .about(2.0 * FIRST.2, 0.02)
            .decides(),
        Measured::new("white lobe: width in θ_s", first.deviation, "degrees").about(2.0 * FIRST.1, 0.02).decides(),
        Measured::new("blue lobe: place in θ_s, seen at right angles", second.centre, "degrees")
            .about(2.0 * SECOND.2, 0.02)
            .decides(),
        Measured::new("blue lobe: width in θ_s", second.deviation, "degrees").about(2.0 * SECOND.1, 0.02).decides(),
        Measured::new("sampled energy against the sum of the tints, worst channel", errors, "standard errors")
            .between(0.0, 4.0)
            .decides(),
        Measured::new("energy of a white dome that comes back, blue", sampled[2].0, "").between(0.0, 1.0),
        Measured::new("noise of the picture of both", 100.0 * both.noise(), "%"),
    ];
    let gains = sampled[2].0 > 1.0;
    let figure = format!(
        "two highlights {}° apart, and pictures add up within {} %; together the lobes return {} of blue light",
        number(second.centre - first.centre),
        number(100.0 * off),
        number(sampled[2].0)
    );
    let mut report = Report::new(
        "Two lobes of the model, a weak narrow white one and a strong wide saturated blue one, shifted apart, carry a \
         production look; strength, colour, width and shift give the artist room enough.",
        figure,
        measured,
    );
    report.text = vec![
        format!(
            "The lobes are those of the paper: K_s {}, β {}°, α {}°, white; K_s {}, β {}°, α {}°, a saturated blue, for \
             which we took {BLUE:?}. They sit on fur that our groomer grows on a ball, lit by two area lights and a dim \
             sky, once: light that scatters more often is left out, as is the small diffuse part of the original, whose \
             scene is not published.",
            FIRST.0, FIRST.1, FIRST.2, SECOND.0, SECOND.1, SECOND.2
        ),
        "Values add, so the picture of both lobes should be the sum of the pictures of each, up to noise. A shift α \
         moves a lobe by 2α in the direction of light, and β makes it 2β wide there; both are read off the value."
            .into(),
        format!(
            "The tints add up to {:.2} in blue, {}. The paper speaks of energy for one lobe; with two it is for the \
             artist to keep their sum below 1, and Cuticle warns where it is not.",
            tints[2],
            if gains {
                "so fibers reflect more than they receive there, and light that scatters often would \
                 grow"
            } else {
                "which a fiber can reflect"
            }
        ),
    ];
    let mut table = Table::new(
        "Mean light of the fur, red, green and blue, and what a white dome gives back.",
        ["", "white lobe", "blue lobe", "sum", "both"],
    );
    table.row(["picture".to_owned(), rgb(white_mean), rgb(blue_mean), rgb(sum), rgb(both_mean)]);
    table.row([
        "white dome, one fiber".to_owned(),
        rgb(fiber.lobes[0].tint),
        rgb(fiber.lobes[1].tint),
        rgb(tints),
        rgb(Rgb(sampled.map(|(mean, _)| mean))),
    ]);
    report.tables.push(table);
    let pictures = [&white, &blue, &both].map(|film| Raster::of(&film.image(), View::Filmic, 1.0));
    report.pictures.push(
        Raster::sheet(&pictures, 3, 4)
            .picture("fur", "From left to right: the white lobe alone, the blue lobe alone, both.")?,
    );
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_lie_where_their_shifts_put_them() {
        let fiber = fiber();
        for (which, (_, beta, alpha)) in [(R, FIRST), (TRT, SECOND)] {
            let bell = along(&fiber, which).unwrap();
            assert!((bell.centre - 2.0 * alpha).abs() < 1e-6 && (bell.deviation - 2.0 * beta).abs() < 1e-6, "{bell:?}");
        }
    }
}
