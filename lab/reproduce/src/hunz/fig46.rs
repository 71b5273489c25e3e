//! The three models side by side, matched under some lights and tried under others.

use fiber::{Fiber, TT};
use film::{Comparison, Film};
use math::Rgb;
use plot::lobes::measure::{Slice, Viewing, azimuth};

use super::head::{self, Lighting};
use super::matching::{ALIKE, Layers, PERFECT, Shape, marschner, marschner_look, mean_ratio, relative, squared};
use crate::chart::{Chart, Curve};
use crate::raster::Raster;
use crate::{Context, Error, Measured, Report, Table, number};

/// Light brown hair, a colour of figure 32.
const SIGMA_A: [f64; 3] = [0.22, 0.3, 0.4];
const BETA_DEG: f64 = 7.5;
const ALPHA_DEG: f64 = -5.0;

/// Lights that the parameters are made for, and one that they have not seen.
const LIGHTS: [(Lighting, &str); 3] = [(Lighting::Front, "front"), (Lighting::Back, "back"), (Lighting::Side, "side")];
/// The first so many are those that the parameters are made for.
const SEEN: usize = 2;
/// The one from behind.
const BACK: usize = 1;
/// A lobe with less than this share of the squared light has no error worth telling.
const NOTHING: f64 = 1e-4;

/// One model under all lights.
struct Model {
    name: &'static str,
    films: Vec<Film>,
}

impl Model {
    fn new(context: &Context<'_>, name: &'static str, look: &str, lights: usize) -> Result<Self, Error> {
        let films = LIGHTS
            .iter()
            .take(lights)
            .map(|&(lighting, place)| head::film(context, &format!("{name}, light from the {place}"), lighting, look));
        Ok(Self { name, films: films.collect::<Result<_, _>>()? })
    }

    /// The hair under the lights that parameters are made for, each light scaled so that none outweighs the others.
    fn layers(&self, hair: &[Vec<usize>], scale: &[f64]) -> Layers {
        let mut layers = Layers::default();
        for ((film, hair), scale) in self.films.iter().zip(hair).zip(scale).take(SEEN) {
            let one = Layers::of(film, hair);
            for (all, lobe) in layers.lobes.iter_mut().zip(one.lobes) {
                all.extend(lobe.into_iter().map(|light| light * *scale));
            }
        }
        layers
    }
}

/// How far a model is from the goal, by light.
struct Off {
    error: f64,
    /// Of the lobe TT alone; not a number where the goal has next to none.
    tt: f64,
    relmse: f64,
    mean: Rgb<f64>,
}

/// Squared light of a part over that of the whole.
fn share(part: &[Rgb<f64>], whole: &[Rgb<f64>]) -> f64 {
    let dark = vec![Rgb::black(); whole.len()];
    squared(part, &dark) / squared(whole, &dark).max(1e-30)
}

fn off(model: &Model, goal: &Model, hair: &[Vec<usize>]) -> Result<Vec<Off>, Error> {
    let mut out = Vec::new();
    for ((film, goal), hair) in model.films.iter().zip(&goal.films).zip(hair) {
        let (test, want) = (Layers::of(film, hair), Layers::of(goal, hair));
        let compared = Comparison::numbers(&film.image(), &goal.image());
        out.push(Off {
            error: relative(&test.sum(), &want.sum()),
            tt: if share(&want.lobes[TT], &want.sum()) < NOTHING {
                f64::NAN
            } else {
                relative(&test.lobes[TT], &want.lobes[TT])
            },
            relmse: compared.map_err(|error| Error::Picture(error.to_string()))?.relmse_trimmed,
            mean: mean_ratio(&test.sum(), &want.sum()),
        });
    }
    Ok(out)
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let goal = Model::new(context, "Marschner", &marschner_look(SIGMA_A, BETA_DEG, ALPHA_DEG), LIGHTS.len())?;
    let hair = goal.films.iter().map(head::hair).collect::<Result<Vec<_>, _>>()?;
    let scale: Vec<f64> = goal
        .films
        .iter()
        .zip(&hair)
        .map(|(film, hair)| {
            let light = Layers::of(film, hair).sum();
            let dark = vec![Rgb::black(); light.len()];
            squared(&light, &dark).sqrt().max(1e-30).recip()
        })
        .collect();
    let want = goal.layers(&hair, &scale);
    let fiber = marschner(SIGMA_A, BETA_DEG, ALPHA_DEG);
    let shape = Shape::of(&fiber);

    let white = Model::new(context, "white lobes", &shape.sadeghi_look([Rgb::white(); 3]), SEEN)?;
    let strengths = white.layers(&hair, &scale).sadeghi_strengths(&want);
    let sadeghi = Model::new(context, "artist-friendly", &shape.sadeghi_look(strengths), LIGHTS.len())?;
    let white = Model::new(context, "white parts", &shape.kajiya_look([Rgb::white(); 3]), SEEN)?;
    let parts = white.layers(&hair, &scale).kajiya_strengths(&want);
    let kajiya = Model::new(context, "Kajiya-Kay", &shape.kajiya_look(parts), LIGHTS.len())?;
    let (of_sadeghi, of_kajiya) = (off(&sadeghi, &goal, &hair)?, off(&kajiya, &goal, &hair)?);

    let seen = |of: &[Off]| of.iter().take(SEEN).map(|off| off.error).fold(0.0, f64::max);
    let unseen = |of: &[Off]| of.iter().skip(SEEN).map(|off| off.error).fold(0.0, f64::max);
    let tt = of_sadeghi.get(BACK).map_or(f64::NAN, |off| off.tt);
    let measured = vec![
        Measured::new(
            "artist-friendly model, lit from in front and behind: largest error",
            100.0 * seen(&of_sadeghi),
            "%",
        )
        .between(0.0, 100.0 * ALIKE)
        .decides(),
        Measured::new("TT of the artist-friendly model, lit from behind: error (similar)", 100.0 * tt, "%")
            .between(0.0, 100.0 * ALIKE)
            .decides(),
        Measured::new("the same (no perfect match)", 100.0 * tt, "%").between(100.0 * PERFECT, f64::INFINITY).decides(),
        Measured::new(
            "artist-friendly model, light and view it was not matched for: error",
            100.0 * unseen(&of_sadeghi),
            "%",
        )
        .between(0.0, 100.0 * ALIKE)
        .decides(),
        Measured::new("Kajiya-Kay, lit from in front and behind: largest error", 100.0 * seen(&of_kajiya), "%"),
        Measured::new("Kajiya-Kay, light and view it was not matched for: error", 100.0 * unseen(&of_kajiya), "%"),
    ];
    let figure = format!(
        "matched for two lights, the artist-friendly model is off by up to {} % there and {} % under a third, Kajiya-Kay \
         by {} % and {} %",
        number(100.0 * seen(&of_sadeghi)),
        number(100.0 * unseen(&of_sadeghi)),
        number(100.0 * seen(&of_kajiya)),
        number(100.0 * unseen(&of_kajiya))
    );
    let mut report = Report::new(
        "The three models give related pictures of the same curls. The artist-friendly model can come near Marschner's \
         forward scattering TT, but not match it perfectly.",
        figure,
        measured,
    );
    report.text = vec![
        format!(
            "σ_a is {SIGMA_A:?} per radius, β_R {BETA_DEG} and α_R {ALPHA_DEG} degrees; the thesis does not give those of \
             its figures 31 and 46. Its hair is a scanned model, ours curls from our groomer. Light scatters once."
        ),
        "Parameters are found as in `hunz-fig32`, for two pictures at once: one light in front, and a dim one in front \
         with a strong one behind, as in its figure 31; each counts alike. The third row is another view with a light from the side, for \
         which nothing was tuned: a model that only fits pictures fails there, one that scatters light alike does not."
            .into(),
        format!(
            "Error is the root of the squared difference over the hair, relative to its light; alike is below {} %, \
             a perfect match below {} %. Both limits are ours: the thesis compares by eye. Kajiya-Kay has nothing around the \
             fiber: light from behind is light from the front to it, so what it gains there it loses here.",
            number(100.0 * ALIKE),
            number(100.0 * PERFECT)
        ),
    ];
    let mut table = Table::new(
        "How far the models are from Marschner's.",
        ["light", "model", "error", "error of TT", "relMSE of the picture", "mean colour over the target's"],
    );
    for (i, (_, place)) in LIGHTS.iter().enumerate() {
        for (model, of) in [(&sadeghi, &of_sadeghi), (&kajiya, &of_kajiya)] {
            let Some(off) = of.get(i) else { continue };
            let tt = if model.name == kajiya.name || off.tt.is_nan() {
                "-".to_owned()
            } else {
                format!("{} %", number(100.0 * off.tt))
            };
            table.row([
                (*place).to_owned(),
                model.name.to_owned(),
                format!("{} %", number(100.0 * off.error)),
                tt,
                number(off.relmse),
                super::rgb(off.mean),
            ]);
        }
    }
    report.tables.push(table);
    let mut table = Table::new(
        "Strengths found, red, green, blue. Artist-friendly: R, TT, TRT; Kajiya-Kay: diffuse, first and second \
         highlight.",
        ["model", "first", "second", "third"],
    );
    for (name, strengths) in [(sadeghi.name, strengths), (kajiya.name, parts)] {
        let [a, b, c] = strengths.map(super::rgb);
        table.row([name.to_owned(), a, b, c]);
    }
    report.tables.push(table);

    let mut pictures = Vec::new();
    for i in 0..LIGHTS.len() {
        let exposure = head::exposure(&goal.films[i].image());
        pictures.extend([&kajiya, &goal, &sadeghi].map(|model| head::shown(&model.films[i].image(), exposure)));
    }
    report.pictures.push(Raster::sheet(&pictures, 3, 4).picture(
        "models",
        "Columns, as in the thesis: Kajiya-Kay, Marschner, the artist-friendly model. Rows: light from the front, from \
         behind, and the light and view that nothing was matched for. Rows are exposed alike.",
    )?);
    let viewing = Viewing::default();
    let curve = |name: &str, fiber: &Fiber<f64>| {
        let points = azimuth(fiber, &viewing, Slice::Integrated, 360);
        Curve::line(name, points.iter().map(|at| [at.x.to_degrees(), at.lobes.sum().luminance()]).collect())
    };
    let mut curves = vec![curve(goal.name, &Fiber::Marschner(fiber))];
    // The fibers of the pictures, as the scene made them.
    for (name, look) in [(sadeghi.name, shape.sadeghi_look(strengths)), (kajiya.name, shape.kajiya_look(parts))] {
        curves.push(curve(name, &head::fiber(&look)?.cast()));
    }
    report.pictures.push(
        Chart {
            title: "Light around the fiber".into(),
            x: "azimuth of the light from the view, degrees".into(),
            y: "value, integrated along the fiber".into(),
            x_range: Some((-180.0, 180.0)),
            curves,
            ..Chart::default()
        }
        .picture("azimuth", "What the three fibers of the pictures scatter around themselves, seen at right angles.")?,
    );
    Ok(report)
}
