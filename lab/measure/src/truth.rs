//! The interactive renderer against the path tracer: same scene, same camera, same size.
//!
//! There are two truths. *Direct*: light that scatters once, against drawing without light from other fibers. *Full*:
//! all paths, against drawing with dual scattering. Each [`Combination`] of techniques is held against both.
//!
//! So that only the renderers differ, the path tracer gets the raster's pixel: a box as wide as a pixel, and no lens.
//! A combination with another model than the look's is still held against the look: its error is that of the
//! technique and of the other model together.

use std::path::Path;
use std::sync::Arc;

use film::{Comparison, Film, Image, NO_STRAND, View, difference_image};
use job::Cancel;
use raster::{
    AdapterDescription, DepthShift, DualScattering, Gpu, KPlusForm, Kind, Renderer, Report, Settings, Shading, Shadow,
    ShadowTechnique, Sort, Transparency,
};
use scene::{Filter, Integrator, Scene};

use crate::page::SOFTWARE;
use crate::session::{Progress, Remarks, fitting};
use crate::sheet::{developed_sheet, view_of};
use crate::table::{escaped, number};
use crate::transparency::K;
use crate::{Error, Table, nearest};

/// How a page begins; what begins otherwise is somebody else's file.
pub const PAGE_TITLE: &str = "# Renderers compared\n";

/// Models, as combinations name them.
const MODELS: [(&str, Option<Kind>); 6] = [
    ("look", None),
    ("marschner", Some(Kind::Marschner)),
    ("kajiya-kay", Some(Kind::KajiyaKay)),
    ("sadeghi", Some(Kind::Sadeghi)),
    ("deon", Some(Kind::Deon)),
    ("chiang", Some(Kind::Chiang)),
];

/// Shadows.
const SHADOWS: [ShadowTechnique; 5] = [
    ShadowTechnique::None,
    ShadowTechnique::Map,
    ShadowTechnique::Adsm { spacing: None },
    ShadowTechnique::Osm,
    ShadowTechnique::DOM,
];

/// Transparency.
const TRANSPARENCY: [Transparency; 7] = [
    Transparency::Opaque,
    Transparency::Weighted,
    Transparency::Blend { sort: Sort::Strands },
    Transparency::RandomSubsets { k: K },
    Transparency::KPlus { k: K, form: KPlusForm::LockFree },
    Transparency::Dbk { shift: DepthShift::Automatic { opacity: 0.99 } },
    Transparency::ABuffer { foremost: None },
];

/// A model, a shadow, a transparency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combination {
    model: &'static str,
    kind: Option<Kind>,
    shadow: ShadowTechnique,
    transparency: Transparency,
}

/// There is no combination of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no combination {found:?}{}; write `standard`, `all`, or a model, a shadow and a transparency such as \
     look+dom+dbk, of {}, of {}, and of {}",
    .suggestion.as_ref().map(|s| format!(" (did you mean {s}?)")).unwrap_or_default(),
    words(0), words(1), words(2)
)]
pub struct UnknownCombination {
    /// What was asked for.
    pub found: String,
    /// What was probably meant.
    pub suggestion: Option<String>,
}

/// The words that may stand in one place of a combination.
fn words(place: usize) -> String {
    let words: Vec<&str> = match place {
        0 => MODELS.iter().map(|(name, _)| *name).collect(),
        1 => SHADOWS.iter().map(ShadowTechnique::name).collect(),
        _ => TRANSPARENCY.iter().map(Transparency::name).collect(),
    };
    words.join(", ")
}

impl Combination {
    /// Everything with everything.
    pub fn all() -> Vec<Self> {
        let mut all = Vec::with_capacity(MODELS.len() * SHADOWS.len() * TRANSPARENCY.len());
        for (model, kind) in MODELS {
            for shadow in SHADOWS {
                all.extend(TRANSPARENCY.map(|transparency| Self { model, kind, shadow, transparency }));
            }
        }
        all
    }

    /// The looks themselves, deep opacity maps and the DBK-buffer; and what differs from that in one thing.
    pub fn standard() -> Vec<Self> {
        let is_default = |one: &Self| {
            [
                one.model == "look",
                one.shadow == ShadowTechnique::DOM,
                matches!(one.transparency, Transparency::Dbk { .. }),
            ]
        };
        let mut standard = Self::all();
        standard.retain(|one| is_default(one).into_iter().filter(|default| !default).count() <= 1);
        // The default itself leads.
        standard.sort_by_key(|one| is_default(one).into_iter().filter(|default| !default).count());
        standard
    }

    /// The combinations that words ask for, each once, in the order of the words.
    ///
    /// # Errors
    /// When a word is neither `standard` nor `all` nor a combination; the error knows the nearest one.
    pub fn named(names: &[String]) -> Result<Vec<Self>, UnknownCombination> {
        let mut wanted = Vec::new();
        for name in names {
            match name.as_str() {
                "all" => wanted.extend(Self::all()),
                "standard" => wanted.extend(Self::standard()),
                _ => match Self::all().into_iter().find(|one| one.name() == *name) {
                    Some(one) => wanted.push(one),
                    None => {
                        let suggestion = nearest(name, Self::all().iter().map(Self::name));
                        return Err(UnknownCombination { found: name.clone(), suggestion });
                    }
                },
            }
        }
        let mut unique: Vec<Self> = Vec::with_capacity(wanted.len());
        for one in wanted {
            if !unique.contains(&one) {
                unique.push(one);
            }
        }
        Ok(unique)
    }

    /// Model, shadow and transparency with a plus between: `look+dom+dbk`.
    pub fn name(&self) -> String {
        format!("{}+{}+{}", self.model, self.shadow.name(), self.transparency.name())
    }

    /// How it is drawn.
    pub fn settings(&self, transport: Transport) -> Settings {
        let default = Settings::default();
        let multiple = match transport {
            Transport::Direct => None,
            Transport::Full => Some(DualScattering::default()),
        };
        Settings {
            shading: Shading { model: self.kind, multiple, ..default.shading },
            shadow: Shadow { technique: self.shadow, ..default.shadow },
            transparency: self.transparency,
            ..default
        }
    }
}

/// Which light counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// That which scattered once.
    Direct,
    /// All.
    Full,
}

impl Transport {
    /// For tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Full => "full",
        }
    }
}

/// What a comparison may ask for.
pub struct Context<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// Threads of the path tracer; 0 is one per processor.
    pub threads: usize,
    /// Ends it early, with [`Error::Cancelled`].
    pub cancel: &'a Cancel,
    /// Is told how far it is.
    pub progress: &'a (dyn Fn(Progress<'_>) + Sync),
}

impl std::fmt::Debug for Context<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Context").field("gpu", self.gpu).field("threads", &self.threads).finish_non_exhaustive()
    }
}

impl Context<'_> {
    fn step(&self, step: &str, done: f64) -> Result<(), Error> {
        (self.progress)(Progress { step, done: done.clamp(0.0, 1.0) });
        if self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// A path-traced picture.
#[derive(Clone, Debug)]
struct Truth {
    image: Image,
    /// Which pixels hair covers by more than half.
    hair: Vec<bool>,
    summary: TruthSummary,
}

/// How good a reference is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthSummary {
    /// Which light it has.
    pub transport: Transport,
    /// Samples per pixel.
    pub samples: u32,
    /// Standard error of the luminance over the luminance, mean over covered pixels ([`Film::noise`]).
    pub noise: f64,
    /// What relMSE of luminance the reference's noise alone would show against a perfect picture.
    pub noise_relmse: f64,
    /// Pixels that hair covers by more than half.
    pub hair_pixels: usize,
}

/// How far a picture is from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scores {
    /// Mean FLIP error at the scene's exposure, `0..=1`; `None` in a build without it.
    pub flip: Option<f64>,
    /// Mean of squared error over (reference² + 10⁻⁴).
    pub relmse: f64,
    /// The same without the worst thousandth of the pixels.
    pub relmse_trimmed: f64,
    /// `|mean(test) - mean(reference)| / mean(reference)` of the luminance over the pixels that hair covers; NaN
    /// without any.
    pub radiance_error: f64,
    /// `mean(test) / mean(reference)` there.
    pub radiance_ratio: f64,
}

impl Scores {
    fn of(comparison: &Comparison, test: &Image, reference: &Image, hair: &[bool]) -> Self {
        let mean = |image: &Image| {
            let covered = image.pixels.iter().zip(hair).filter(|(_, hair)| **hair);
            let luminance: Vec<f64> = covered.map(|(light, _)| light.cast::<f64>().luminance()).collect();
            luminance.iter().sum::<f64>() / luminance.len() as f64
        };
        let radiance_ratio = mean(test) / mean(reference);
        Self {
            flip: comparison.flip.map(f64::from),
            relmse: comparison.relmse,
            relmse_trimmed: comparison.relmse_trimmed,
            radiance_error: (radiance_ratio - 1.0).abs(),
            radiance_ratio,
        }
    }
}

/// One combination against one truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Which light.
    pub transport: Transport,
    /// Which techniques.
    pub combination: Combination,
    /// How far.
    pub scores: Scores,
    /// Time of a frame, ms: of the device, or of the wall where it has no timers.
    pub ms: f64,
    /// Its strip of pictures, a file name.
    pub strip: String,
}

/// All rows and what they were held against.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// The references.
    pub truths: Vec<TruthSummary>,
    /// The rows, direct light first.
    pub rows: Vec<Row>,
    /// What is odd about the numbers.
    pub remarks: Vec<String>,
}

/// Renders both truths, draws every combination, and writes a strip of pictures for each into `folder`, which must be
/// there: the reference, the drawn picture, and the map of FLIP errors (or four times the difference, in a build
/// without FLIP).
///
/// # Errors
/// When it was cancelled, a renderer fails, or a file cannot be written.
pub fn compare(
    context: &Context<'_>,
    scene: &Scene,
    combinations: &[Combination],
    folder: &Path,
) -> Result<Outcome, Error> {
    let mut outcome = Outcome::default();
    let mut remarks = Remarks::default();
    let matched = matched(scene, &mut remarks);
    let drawn = Arc::new(matched.clone());
    let size = [scene.film.width, scene.film.height];
    let mut renderer: Option<Renderer> = None;
    for (place, transport) in [Transport::Direct, Transport::Full].into_iter().enumerate() {
        let begin = 0.5 * place as f64;
        let truth = trace(context, &matched, transport, begin)?;
        outcome.truths.push(truth.summary);
        for (i, combination) in combinations.iter().enumerate() {
            let name = combination.name();
            let what = format!("{}: {name}", transport.name());
            context.step(&what, begin + 0.4 + 0.1 * i as f64 / combinations.len() as f64)?;
            let settings = combination.settings(transport);
            let frame = draw(context.gpu, &mut renderer, &drawn, &settings, size);
            let Some((image, report)) = fitting(frame, &what, &mut remarks)? else { continue };
            for note in &report.notes {
                remarks.add(format!("The interactive renderer says: {note}."));
            }
            if report.fragments.dropped > 0 {
                remarks.add(format!("{what}: {} fragments were lost.", report.fragments.dropped));
            }
            if report.total_ms().is_none() {
                remarks.add("The adapter has no timers: times are those of the wall.");
            }
            let ev = scene.film.exposure_ev;
            let comparison = Comparison::at_exposure(&image, &truth.image, ev)?;
            let strip = format!("{}-{}.png", transport.name(), name.replace('+', "-"));
            film::write_bytes(folder.join(&strip), &pictures(scene, &truth.image, &image, &comparison, &name)?)?;
            outcome.rows.push(Row {
                transport,
                combination: *combination,
                scores: Scores::of(&comparison, &image, &truth.image, &truth.hair),
                ms: report.total_ms().unwrap_or(report.wall_ms),
                strip,
            });
        }
    }
    if outcome.truths.iter().any(|truth| truth.hair_pixels == 0) {
        remarks.add("Hair covers no pixel by more than half: there is no mean radiance to compare.");
    }
    outcome.remarks = remarks.into_lines();
    Ok(outcome)
}

/// The scene with what only one of the renderers knows taken away.
fn matched(scene: &Scene, remarks: &mut Remarks) -> Scene {
    let mut scene = scene.clone();
    if scene.camera.aperture_radius > 0.0 {
        scene.camera.aperture_radius = 0.0;
        remarks.add("The scene's lens was taken away: the interactive renderer has a pinhole.");
    }
    scene.film.filter = Filter::Box;
    scene.film.filter_width = 1.0;
    scene
}

fn trace(context: &Context<'_>, scene: &Scene, transport: Transport, begin: f64) -> Result<Truth, Error> {
    let mut scene = scene.clone();
    scene.render.integrator = match transport {
        Transport::Direct => Integrator::Direct,
        Transport::Full => Integrator::Path,
    };
    let step = format!("path tracing, {}", transport.name());
    context.step(&step, begin)?;
    let options = job::Options { threads: context.threads, ..job::Options::default() };
    let outcome = job::render(Arc::new(scene), &options, context.cancel, &mut |event| {
        let done = event.done as f64 / event.total.max(1) as f64;
        (context.progress)(Progress { step: &step, done: begin + 0.4 * done });
    })?;
    if outcome.cancelled {
        return Err(Error::Cancelled);
    }
    Ok(Truth::of(&outcome.film, transport, outcome.samples))
}

impl Truth {
    fn of(film: &Film, transport: Transport, samples: u32) -> Self {
        let pixels = film.pixels();
        let hair: Vec<bool> = pixels.iter().map(|p| p.strand() != NO_STRAND && p.alpha() > 0.5).collect();
        let relative: Vec<f64> = pixels
            .iter()
            .filter_map(|pixel| {
                let luminance = pixel.beauty().cast::<f64>().luminance();
                // As in `film::Comparison`, of luminance.
                pixel.variance().map(|variance| variance / (luminance * luminance + 1e-4))
            })
            .collect();
        let summary = TruthSummary {
            transport,
            samples,
            noise: film.noise(),
            noise_relmse: relative.iter().sum::<f64>() / relative.len() as f64,
            hair_pixels: hair.iter().filter(|hair| **hair).count(),
        };
        Self { image: film.image(), hair, summary }
    }
}

/// One frame; the renderer is made for the first.
fn draw(
    gpu: &Gpu,
    renderer: &mut Option<Renderer>,
    scene: &Arc<Scene>,
    settings: &Settings,
    size: [u32; 2],
) -> Result<(Image, Report), raster::RasterError> {
    let renderer = match renderer {
        Some(renderer) => {
            renderer.set(settings)?;
            renderer
        }
        None => renderer.insert(Renderer::new(gpu, Arc::clone(scene), settings)?),
    };
    // The first frame makes buffers and pipelines; the second one is timed.
    renderer.draw(&scene.camera, size)?;
    let report = renderer.draw(&scene.camera, size)?;
    Ok((renderer.image()?, report))
}

/// Reference, test, error.
fn pictures(scene: &Scene, truth: &Image, test: &Image, comparison: &Comparison, name: &str) -> Result<Vec<u8>, Error> {
    let (ev, view) = (scene.film.exposure_ev, view_of(scene));
    let difference;
    let (error, word) = match &comparison.flip_map {
        Some(map) => (map, "FLIP"),
        None => {
            difference = difference_image(test, truth, 4.0 * ev.exp2())?;
            (&difference, "difference, 4 times")
        }
    };
    let shots = [
        ("path traced".to_owned(), truth, ev, view),
        (name.to_owned(), test, ev, view),
        (word.to_owned(), error, 0.0, View::Srgb),
    ];
    developed_sheet(&shots, 3)
}

/// What the page says about how it came to be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// A name for the scene.
    pub scene: String,
    /// Pixels.
    pub size: [u32; 2],
    /// The adapter.
    pub adapter: AdapterDescription,
    /// The day, as it shall stand on the page; `None`: no day.
    pub date: Option<String>,
    /// The command that does it again.
    pub command: String,
}

/// The rows as a table.
pub fn table(outcome: &Outcome) -> Table {
    let mut table = Table::new(
        "All rows.",
        [
            "transport",
            "model",
            "shadow",
            "transparency",
            "FLIP",
            "relMSE",
            "relMSE trimmed",
            "mean radiance error",
            "mean radiance ratio",
            "ms",
        ],
    );
    for Row { transport, combination, scores, ms, .. } in &outcome.rows {
        table.row([
            transport.name().into(),
            combination.model.into(),
            combination.shadow.name().into(),
            combination.transparency.name().into(),
            scores.flip.into(),
            scores.relmse.into(),
            scores.relmse_trimmed.into(),
            scores.radiance_error.into(),
            scores.radiance_ratio.into(),
            (*ms).into(),
        ]);
    }
    table
}

/// Writes `results.csv` and then `README.md` into `folder`.
///
/// # Errors
/// When a file cannot be written; each is complete or not there.
pub fn write(folder: &Path, outcome: &Outcome, run: &Run) -> Result<(), film::WriteError> {
    film::write_bytes(folder.join("results.csv"), table(outcome).csv().as_bytes())?;
    film::write_bytes(folder.join("README.md"), text(outcome, run).as_bytes())
}

/// The page itself.
pub fn text(outcome: &Outcome, run: &Run) -> String {
    let [width, height] = run.size;
    let mut out = format!(
        "{PAGE_TITLE}\nThe interactive renderer against the path tracer: {}, {width} x {height} pixels, the same camera, \
         exposure and look. Both have a box filter of one pixel and no lens. *Direct* is light that scattered once, \
         against drawing without light from other fibers; *full* is all light, against drawing with dual scattering. \
         Mean radiance is that of the luminance over the pixels that hair covers by more than half. A combination is a \
         model, a shadow and a transparency; another model than the look's is held against the look all the same.\n\n\
         Adapter: {}.",
        escaped(&run.scene),
        run.adapter
    );
    if let Some(date) = &run.date {
        out += &format!(" {}.", date.replace('\n', " "));
    }
    out += "\n\n";
    if run.adapter.software {
        out += &format!("**{SOFTWARE}**\n\n");
    }
    for truth in &outcome.truths {
        let rows: Vec<&Row> = outcome.rows.iter().filter(|row| row.transport == truth.transport).collect();
        out +=
            &format!("## {}\n\n", if truth.transport == Transport::Direct { "Direct light" } else { "Full transport" });
        out += &format!(
            "Reference: {} samples a pixel, noise {} (standard error over value, mean over covered pixels); the noise \
             alone is a relMSE of {}. {} pixels of hair.\n\n",
            truth.samples,
            number(truth.noise),
            number(truth.noise_relmse),
            truth.hair_pixels
        );
        out += &best(&rows);
        out += "| combination | FLIP | relMSE | trimmed | mean radiance error | ratio | ms |\n|---|---|---|---|---|---|---|\n";
        for row in &rows {
            let scores = &row.scores;
            out += &format!(
                "| {} | {} | {} | {} | {} | {} | {} |\n",
                row.combination.name(),
                number(scores.flip.unwrap_or(f64::NAN)),
                number(scores.relmse),
                number(scores.relmse_trimmed),
                percent(scores.radiance_error),
                number(scores.radiance_ratio),
                number(row.ms)
            );
        }
        out.push('\n');
        for row in &rows {
            out += &format!("![{}]({})\n\n", row.combination.name(), row.strip);
        }
    }
    if !outcome.remarks.is_empty() {
        out += "## Remarks\n\n";
        for remark in &outcome.remarks {
            out += &format!("- {}\n", remark.replace('\n', " "));
        }
        out.push('\n');
    }
    out + &format!(
        "## How to do it again\n\n    {}\n\nAll digits: [results.csv](results.csv).\n",
        run.command.replace('\n', " ")
    )
}

fn percent(share: f64) -> String {
    if share.is_finite() { format!("{} %", number(100.0 * share)) } else { "-".into() }
}

/// Which rows come nearest.
fn best(rows: &[&Row]) -> String {
    let least = |of: fn(&Scores) -> f64| {
        let known = rows.iter().filter(|row| of(&row.scores).is_finite());
        known.min_by(|a, b| of(&a.scores).total_cmp(&of(&b.scores)))
    };
    let mut told = Vec::new();
    let flip: fn(&Scores) -> f64 = |scores| scores.flip.unwrap_or(f64::NAN);
    let error: fn(&Scores) -> f64 = |scores| scores.radiance_error;
    if let Some(row) = least(flip) {
        told.push(format!("Least FLIP: {} ({}).", row.combination.name(), number(flip(&row.scores))));
    }
    if let Some(row) = least(error) {
        let found = percent(row.scores.radiance_error);
        told.push(format!("Least error of the mean radiance: {} ({found}).", row.combination.name()));
    }
    if told.is_empty() { String::new() } else { format!("{}\n\n", told.join(" ")) }
}

#[cfg(test)]
mod tests {
    use film::Sample;
    use math::Rgb;

    use super::*;

    fn image(lights: &[f32]) -> Image {
        let pixels = lights.iter().map(|light| Rgb::splat(*light)).collect();
        Image::new(lights.len() as u32, 1, pixels, None).unwrap()
    }

    #[test]
    fn standard_varies_one_thing_at_a_time() {
        let standard = Combination::standard();
        assert_eq!(standard[0].name(), "look+dom+dbk");
        // The default; five other models, four other shadows, six other transparencies.
        assert_eq!(standard.len(), 1 + 5 + 4 + 6);
        let names: Vec<String> = standard.iter().map(Combination::name).collect();
        for name in ["kajiya-kay+dom+dbk", "look+none+dbk", "look+osm+dbk", "look+dom+opaque", "look+dom+a-buffer"] {
            assert!(names.iter().any(|known| known == name), "{name} in {names:?}");
        }
        for one in Combination::all() {
            one.settings(Transport::Direct).check().unwrap();
            one.settings(Transport::Full).check().unwrap();
        }
    }

    #[test]
    fn combinations_are_named_once_each() {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let found = Combination::named(&words("look+sm+blend look+dom+dbk look+sm+blend")).unwrap();
        assert_eq!(found.iter().map(Combination::name).collect::<Vec<_>>(), ["look+sm+blend", "look+dom+dbk"]);
        assert_eq!(Combination::named(&words("all standard")).unwrap().len(), 6 * 5 * 7);
        let error = Combination::named(&words("look+dmo+dbk")).unwrap_err();
        assert_eq!(error.suggestion.as_deref(), Some("look+dom+dbk"));
        let text = error.to_string();
        for word in ["kajiya-kay", "adsm", "a-buffer", "did you mean look+dom+dbk?"] {
            assert!(text.contains(word), "{word} in {text}");
        }
    }

    #[test]
    fn scores_are_those_of_the_hair() {
        let (test, reference) = (image(&[1.0, 0.75, 9.0]), image(&[2.0, 0.5, 1.0]));
        let comparison = Comparison::numbers(&test, &reference).unwrap();
        let scores = Scores::of(&comparison, &test, &reference, &[true, true, false]);
        // 1.75 over 2.5; luminance weights add up to one only to rounding.
        assert!((scores.radiance_ratio - 0.7).abs() < 1e-9 && (scores.radiance_error - 0.3).abs() < 1e-9);
        assert_eq!(scores.relmse, comparison.relmse, "of the whole picture");
        let bald = Scores::of(&comparison, &test, &reference, &[false; 3]);
        assert!(bald.radiance_error.is_nan() && percent(bald.radiance_error) == "-");
    }

    #[test]
    fn a_truth_knows_its_hair_and_its_noise() {
        let mut film = Film::new(3, 1).unwrap();
        let grey = |light, strand, alpha| Sample { beauty: Rgb::splat(light), alpha, strand, ..Sample::default() };
        for light in [1.0, 3.0] {
            film.pixels_mut()[0].add(&grey(light, 4, 1.0));
            // A mesh, and hair that covers less than half.
            film.pixels_mut()[1].add(&grey(0.0, NO_STRAND, 1.0));
            film.pixels_mut()[2].add(&grey(0.0, 4, if light > 2.0 { 0.8 } else { 0.0 }));
        }
        let truth = Truth::of(&film, Transport::Full, 2);
        assert_eq!((truth.hair.as_slice(), truth.summary.hair_pixels), ([true, false, false].as_slice(), 1));
        // Mean 2, variance of the mean 1; the other two pixels have no noise.
        assert!((truth.summary.noise_relmse - 1.0 / (4.0 + 1e-4) / 3.0).abs() < 1e-9);
    }

    #[test]
    fn the_page_reports_direct_and_full_apart() {
        let scores = Scores {
            flip: Some(0.05),
            relmse: 0.1,
            relmse_trimmed: 0.09,
            radiance_error: 0.024,
            radiance_ratio: 1.024,
        };
        let row = |transport, combination, flip| Row {
            transport,
            combination,
            scores: Scores { flip: Some(flip), ..scores },
            ms: 12.0,
            strip: "strip.png".into(),
        };
        let [first, second] = [Combination::standard()[0], Combination::standard()[1]];
        let truth =
            |transport| TruthSummary { transport, samples: 64, noise: 0.02, noise_relmse: 0.001, hair_pixels: 99 };
        let outcome = Outcome {
            truths: vec![truth(Transport::Direct), truth(Transport::Full)],
            rows: vec![
                row(Transport::Direct, first, 0.07),
                row(Transport::Direct, second, 0.06),
                row(Transport::Full, first, 0.3),
            ],
            remarks: vec!["odd".into()],
        };
        let run = Run {
            scene: "a | head".into(),
            size: [32, 48],
            adapter: AdapterDescription {
                name: "llvm".into(),
                backend: "Vulkan".into(),
                driver: String::new(),
                software: true,
            },
            date: Some("2026-01-31".into()),
            command: "cuticle compare-renderers -o FOLDER".into(),
        };
        let text = text(&outcome, &run);
        assert!(text.starts_with(PAGE_TITLE));
        let (direct, full) = text.split_once("## Full transport").unwrap();
        assert!(direct.contains(&format!("Least FLIP: {} (0.0600).", second.name())), "{direct}");
        assert!(full.contains("| look+dom+dbk | 0.300 | 0.100 | 0.0900 | 2.40 % | 1.02 | 12.0 |"), "{full}");
        for part in
            ["a \\| head", "32 x 48", "2026-01-31", "64 samples", SOFTWARE, "![look+dom+dbk](strip.png)", "- odd"]
        {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
        let csv = table(&outcome).csv();
        assert_eq!(csv.lines().count(), 4);
        assert!(csv.contains("direct,look,dom,dbk,0.07,0.1,0.09,0.024,1.024,12\n"), "{csv}");
    }

    #[test]
    fn what_one_renderer_lacks_is_taken_from_both() {
        let text = "[camera]\naperture_radius = 0.5\n[[light]]\ntype = \"distant\"\n\
                    [[groom]]\nprocedural = { preset = \"short\", strands = 20 }\n";
        let scene = Scene::load(text, &[], &scene::NoAssets).unwrap();
        let mut remarks = Remarks::default();
        let matched = matched(&scene, &mut remarks);
        assert_eq!((matched.camera.aperture_radius, matched.film.filter_width), (0.0, 1.0));
        assert_eq!(matched.film.filter, Filter::Box);
        assert!(remarks.into_lines()[0].contains("lens"));
    }
}
