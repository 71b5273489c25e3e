//! The interactive renderer against the path tracer: same scene, same camera, same size.
//!
//! There are two truths. *Direct*: light that scatters once, against drawing without light from other fibers. *Full*:
//! all paths, against drawing with dual scattering. Each [`Combination`] of techniques is held against both.
//!
//! So that only the renderers differ, the path tracer gets the raster's pixel, a box as wide as a pixel, no lens and
//! no clamp; and the raster draws twice as large and averages, because meshes have hard edges otherwise. A combination
//! with another model than the look's is still held against the look: its error is that of the technique and of the
//! other model together.
//!
//! Mean radiance is that of *hair pixels*: hair alone, traced without meshes, covers more than half of them, and it is
//! the first thing that a ray of the reference finds there at least once. So hair behind a head does not count, while
//! a pixel in which a few hairs stand before a head does where the hair behind that head would cover it.

use std::path::Path;
use std::sync::Arc;

use film::{Comparison, Film, Image, NO_STRAND, View, WriteError, difference_image};
use job::Cancel;
use raster::{
    AdapterDescription, DepthShift, DualScattering, Gpu, KPlusForm, Kind, RasterError, Report, Settings, Shading,
    Shadow, ShadowTechnique, Sort, Transparency,
};
use scene::{Camera, Filter, Integrator, Light, Scene};

use crate::page::SOFTWARE;
use crate::session::{Bench, Progress, Remarks, compared, fitting};
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
fn transparency() -> [Transparency; 7] {
    [
        Transparency::Opaque,
        Transparency::Weighted,
        Transparency::Blend { sort: Sort::Strands },
        Transparency::RandomSubsets { k: K },
        Transparency::KPlus { k: K, form: KPlusForm::LockFree },
        Transparency::Dbk { shift: DepthShift::default() },
        Transparency::ABuffer { foremost: None },
    ]
}

/// Samples a side of a pixel of drawn pictures: the hair's edges are smooth by themselves, those of meshes are not.
const SUPERSAMPLE: u32 = 2;

/// Samples a pixel of the trace that finds hair alone.
const MASK_SAMPLES: u32 = 16;

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
        _ => transparency().iter().map(Transparency::name).collect(),
    };
    words.join(", ")
}

impl Combination {
    /// Everything with everything.
    pub fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for (model, kind) in MODELS {
            for shadow in SHADOWS {
                all.extend(transparency().map(|transparency| Self { model, kind, shadow, transparency }));
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
            supersample: SUPERSAMPLE,
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
        self.tracing().step(step, done)
    }

    /// What the path tracer needs of it.
    fn tracing(&self) -> Tracing<'_> {
        Tracing { threads: self.threads, cancel: self.cancel, progress: self.progress }
    }
}

/// How the path tracer runs.
#[derive(Clone, Copy)]
struct Tracing<'a> {
    threads: usize,
    cancel: &'a Cancel,
    progress: &'a (dyn Fn(Progress<'_>) + Sync),
}

impl Tracing<'_> {
    fn step(self, step: &str, done: f64) -> Result<(), Error> {
        (self.progress)(Progress { step, done: done.clamp(0.0, 1.0) });
        if self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// A whole picture; `share` of the progress is its own.
    fn picture(self, scene: Scene, step: &str, begin: f64, share: f64) -> Result<job::Outcome, Error> {
        self.step(step, begin)?;
        let options = job::Options { threads: self.threads, ..job::Options::default() };
        let outcome = job::render(Arc::new(scene), &options, self.cancel, &mut |event| {
            let done = event.done as f64 / event.total.max(1) as f64;
            (self.progress)(Progress { step, done: begin + share * done });
        })?;
        if outcome.cancelled { Err(Error::Cancelled) } else { Ok(outcome) }
    }
}

/// A path-traced picture.
#[derive(Clone, Debug)]
struct Truth {
    image: Image,
    /// Which pixels are those of hair.
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
    /// Longest path, in scattering events.
    pub max_depth: u32,
    /// Standard error of the luminance over the luminance, mean over covered pixels ([`Film::noise`]).
    pub noise: f64,
    /// What relMSE of luminance the reference's noise alone would show against a perfect picture.
    pub noise_relmse: f64,
    /// Standard error of the mean luminance of hair pixels over that mean; NaN without such pixels, or with a single
    /// sample in each.
    pub mean_error: f64,
    /// Pixels that hair covers by more than half, and that it is the first thing in.
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
    /// `|mean(test) - mean(reference)| / mean(reference)` of the luminance over hair pixels; NaN without
    /// any.
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
    /// Time of the frame that was compared, at two samples a side of a pixel, ms: of the device, or of the wall where
    /// it has no timers.
    pub ms: f64,
    /// Its strip of pictures, a file name.
    pub strip: String,
}

/// All rows and what they were held against.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Samples a side of a pixel of drawn pictures.
    pub supersample: u32,
    /// The references.
    pub truths: Vec<TruthSummary>,
    /// The rows, direct light first.
    pub rows: Vec<Row>,
    /// What is odd about the numbers.
    pub remarks: Vec<String>,
}

/// Pictures of rows, until their page is written: a folder within the page's, which goes unless [`write()`] takes what
/// is in it.
#[derive(Debug)]
pub struct Strips(tempfile::TempDir);

impl Strips {
    /// In `folder`, which must be there. It is found out here whether anything can be written into it, before hours are
    /// spent.
    ///
    /// # Errors
    /// When nothing can.
    pub fn new(folder: &Path) -> Result<Self, WriteError> {
        let made = tempfile::Builder::new().prefix(".cuticle-").suffix(".part").tempdir_in(folder);
        made.map(Self).map_err(|cause| {
            // The system's error names the temporary folder, which means nothing to anyone.
            let cause = cause.raw_os_error().map_or_else(|| cause.kind().into(), std::io::Error::from_raw_os_error);
            WriteError::Create { path: folder.to_owned(), cause }
        })
    }

    /// Moves what a row shows to where its page looks for it.
    fn publish(&self, strip: &str, folder: &Path) -> Result<(), WriteError> {
        let path = folder.join(strip);
        std::fs::rename(self.0.path().join(strip), &path).map_err(|cause| WriteError::Finish { path, cause })
    }
}

/// Renders both truths, draws every combination, and makes a strip of pictures for each: the reference, the drawn
/// picture, and the map of FLIP errors (or four times the difference, in a build without FLIP).
///
/// # Errors
/// When it was cancelled, a renderer fails, or a file cannot be written.
pub fn compare(
    context: &Context<'_>,
    scene: &Scene,
    combinations: &[Combination],
    strips: &Strips,
) -> Result<Outcome, Error> {
    let mut outcome = Outcome::default();
    let mut remarks = Remarks::default();
    let matched = matched(scene, &mut remarks);
    let size = [scene.film.width, scene.film.height];
    let supersample = supersample(context.gpu, size, &mut remarks);
    outcome.supersample = supersample;
    let cover = hair_alone(context.tracing(), &matched)?;
    let mut bench = Bench::new(context.gpu, &Arc::new(matched.clone()));
    for (place, transport) in [Transport::Direct, Transport::Full].into_iter().enumerate() {
        let begin = 0.5 * place as f64;
        let truth = trace(context.tracing(), &matched, &cover, transport, begin)?;
        outcome.truths.push(truth.summary);
        for (i, combination) in combinations.iter().enumerate() {
            let name = combination.name();
            let what = format!("{}: {name}", transport.name());
            context.step(&what, begin + 0.4 + 0.1 * i as f64 / combinations.len() as f64)?;
            let settings = Settings { supersample, ..combination.settings(transport) };
            let frame = draw(&mut bench, &matched.camera, &settings, size);
            let Some((image, report)) = fitting(frame, &what, &mut remarks)? else { continue };
            remarks.of_report(&what, &report);
            if report.total_ms().is_none() {
                remarks.add("The adapter has no timers: times are those of the wall.");
            }
            let ev = scene.film.exposure_ev;
            let Some(comparison) = compared(&image, &truth.image, ev, &what, &mut remarks)? else { continue };
            let strip = format!("{}-{}.png", transport.name(), name.replace('+', "-"));
            let png = pictures(scene, &truth.image, &image, &comparison, &name)?;
            film::write_bytes(strips.0.path().join(&strip), &png)?;
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
    if let Some(most) = scene.render.clamp.take() {
        remarks.add(format!(
            "The scene's clamp of paths to a radiance of {most} was taken away: it makes references too dark."
        ));
    }
    scene.film.filter = Filter::Box;
    scene.film.filter_width = 1.0;
    scene
}

/// How many samples a side a pixel has in drawn pictures: fewer where the device has no texture for more.
fn supersample(gpu: &Gpu, size: [u32; 2], remarks: &mut Remarks) -> u32 {
    if size.iter().all(|side| side.saturating_mul(SUPERSAMPLE) <= gpu.largest_side()) {
        return SUPERSAMPLE;
    }
    remarks.add(
        "The device has no texture for a picture twice as large: pictures were drawn with one sample a pixel, in which \
         the edges of meshes are hard.",
    );
    1
}

/// How much of each pixel hair would cover if there were nothing else.
fn hair_alone(tracing: Tracing<'_>, scene: &Scene) -> Result<Vec<f32>, Error> {
    let pixels = scene.film.width as usize * scene.film.height as usize;
    if scene.grooms.iter().all(|groom| groom.groom.strand_count() == 0) {
        return Ok(vec![0.0; pixels]);
    }
    let mut scene = scene.clone();
    scene.meshes.clear();
    for light in &mut scene.lights {
        match light {
            Light::Environment { visible, .. } | Light::Rectangle { visible, .. } | Light::Sphere { visible, .. } => {
                *visible = false;
            }
            Light::Point { .. } | Light::Spot { .. } | Light::Distant { .. } => {}
        }
    }
    scene.render.samples = MASK_SAMPLES;
    scene.render.max_depth = 1;
    scene.render.integrator = Integrator::Direct;
    let film = tracing.picture(scene, "finding the hair", 0.0, 0.0)?.film;
    Ok(film.pixels().iter().map(|pixel| pixel.alpha()).collect())
}

fn trace(tracing: Tracing<'_>, scene: &Scene, cover: &[f32], transport: Transport, begin: f64) -> Result<Truth, Error> {
    let mut scene = scene.clone();
    scene.render.integrator = match transport {
        Transport::Direct => Integrator::Direct,
        Transport::Full => Integrator::Path,
    };
    let max_depth = match transport {
        Transport::Direct => 1,
        Transport::Full => scene.render.max_depth,
    };
    let outcome = tracing.picture(scene, &format!("path tracing, {}", transport.name()), begin, 0.4)?;
    Ok(Truth::of(&outcome.film, cover, transport, [outcome.samples, max_depth]))
}

impl Truth {
    /// `cover` is how much hair alone covers of each pixel.
    fn of(film: &Film, cover: &[f32], transport: Transport, [samples, max_depth]: [u32; 2]) -> Self {
        let pixels = film.pixels();
        let hair: Vec<bool> =
            pixels.iter().zip(cover).map(|(pixel, cover)| pixel.strand() != NO_STRAND && *cover > 0.5).collect();
        let covered = || pixels.iter().zip(&hair).filter(|(_, hair)| **hair).map(|(pixel, _)| pixel);
        let luminance: f64 = covered().map(|pixel| pixel.beauty().cast::<f64>().luminance()).sum();
        // Pixels have a box filter and so no sample in common: variances add up.
        let variance: Option<f64> = covered().map(|pixel| pixel.variance()).sum();
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
            max_depth,
            noise: film.noise(),
            noise_relmse: relative.iter().sum::<f64>() / relative.len() as f64,
            mean_error: variance.map_or(f64::NAN, f64::sqrt) / luminance,
            hair_pixels: hair.iter().filter(|hair| **hair).count(),
        };
        Self { image: film.image(), hair, summary }
    }
}

/// One frame after one that does not count: the first makes buffers and pipelines.
fn draw(
    bench: &mut Bench,
    camera: &Camera,
    settings: &Settings,
    size: [u32; 2],
) -> Result<(Image, Report), RasterError> {
    bench.with(settings, |renderer| {
        renderer.draw(camera, size)?;
        let report = renderer.draw(camera, size)?;
        Ok((renderer.image()?, report))
    })
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

/// Writes a page into `folder`: the strips, then `results.csv`, and `README.md` last, so that it never points at what
/// is missing.
///
/// # Errors
/// When a file cannot be written; each is complete or not there.
pub fn write(folder: &Path, strips: &Strips, outcome: &Outcome, run: &Run) -> Result<(), WriteError> {
    for row in &outcome.rows {
        strips.publish(&row.strip, folder)?;
    }
    film::write_bytes(folder.join("results.csv"), table(outcome).csv(&run.adapter).as_bytes())?;
    film::write_bytes(folder.join("README.md"), text(outcome, run).as_bytes())
}

/// The page itself.
pub fn text(outcome: &Outcome, run: &Run) -> String {
    let [width, height] = run.size;
    let n = outcome.supersample;
    let mut out = format!(
        "{PAGE_TITLE}\nThe interactive renderer against the path tracer: {}, {width} x {height} pixels, the same camera, \
         exposure and look. Both have a box filter of one pixel, no lens and no clamp. *Direct* is light that scattered \
         once, against drawing without light from other fibers; *full* is all light, against drawing with dual \
         scattering. A combination is a model, a shadow and a transparency; another model than the look's is held \
         against the look all the same.\n\n\
         Mean radiance is that of the luminance over hair pixels: those of which hair alone, traced without meshes, \
         covers more than half, and in which it is the first thing that some ray of the reference finds. Hair behind a \
         head does not count, but a few hairs before a head do where hair behind it would cover the pixel.\n\n\
         Pictures are drawn with {n} by {n} samples a pixel, because meshes have hard edges with one, and times are of \
         these pictures: one frame after one that does not count.\n\n\
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
            "Reference: {} samples a pixel, paths of at most {} scattering event{}, noise {} (standard error over \
             value, mean over covered pixels); the noise alone is a relMSE of {}. {} pixels of hair, whose mean radiance \
             has a standard error of {}.\n\n",
            truth.samples,
            truth.max_depth,
            if truth.max_depth == 1 { "" } else { "s" },
            number(truth.noise),
            number(truth.noise_relmse),
            truth.hair_pixels,
            percent(truth.mean_error)
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
            // A mesh before hair, and hair that covers less than half of a pixel with a mesh behind.
            film.pixels_mut()[1].add(&grey(0.0, NO_STRAND, 1.0));
            film.pixels_mut()[2].add(&grey(0.0, if light > 2.0 { 4 } else { NO_STRAND }, 1.0));
        }
        let truth = Truth::of(&film, &[1.0, 1.0, 0.4], Transport::Full, [2, 9]);
        assert_eq!((truth.hair.as_slice(), truth.summary.hair_pixels), ([true, false, false].as_slice(), 1));
        assert_eq!((truth.summary.samples, truth.summary.max_depth), (2, 9));
        // Mean 2, variance of the mean 1; the other two pixels have no noise.
        assert!((truth.summary.noise_relmse - 1.0 / (4.0 + 1e-4) / 3.0).abs() < 1e-9);
        assert!((truth.summary.mean_error - 0.5).abs() < 1e-6, "{}", truth.summary.mean_error);
        let bald = Truth::of(&film, &[0.0; 3], Transport::Full, [2, 9]);
        assert!(bald.summary.hair_pixels == 0 && bald.summary.mean_error.is_nan());
    }

    #[test]
    fn neither_head_nor_sky_is_hair() {
        let text = "[film]\nwidth = 24\nheight = 24\n[render]\nsamples = 1\n[[light]]\ntype = \"environment\"\n\
                    [[mesh]]\nbuiltin = \"head\"\n\
                    [[groom]]\nprocedural = { preset = \"short\", strands = 400 }\nwidth = { scale = 60.0 }\n";
        let scene = Scene::load(text, &[], &scene::NoAssets).unwrap();
        let cancel = Cancel::default();
        let tracing = Tracing { threads: 1, cancel: &cancel, progress: &|_| {} };
        let cover = hair_alone(tracing, &scene).unwrap();
        assert_eq!(cover.len(), 24 * 24);
        assert!(cover.iter().all(|share| (0.0..=1.0).contains(share)));
        assert!(cover[0] == 0.0 && cover.iter().any(|share| *share > 0.5), "{cover:?}");
        let mut whole = scene.clone();
        whole.render.samples = MASK_SAMPLES;
        let whole = tracing.picture(whole, "", 0.0, 0.0).unwrap().film;
        let bare = whole.pixels().iter().zip(&cover).filter(|(pixel, hair)| pixel.alpha() > 0.9 && **hair < 0.1);
        assert!(bare.count() > 0, "the head covers pixels that hair does not");
    }

    #[test]
    fn strips_appear_with_their_page() {
        let folder = tempfile::tempdir().unwrap();
        let names = || {
            let entries = std::fs::read_dir(folder.path()).unwrap();
            let mut names: Vec<String> =
                entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
            names.sort();
            names
        };
        let strips = Strips::new(folder.path()).unwrap();
        std::fs::write(strips.0.path().join("strip.png"), b"png").unwrap();
        assert!(names().iter().all(|name| name.starts_with(".cuticle-")), "{:?}", names());
        let (outcome, run) = (outcome(), run());
        let one = Outcome { rows: outcome.rows[..1].to_vec(), ..outcome };
        write(folder.path(), &strips, &one, &run).unwrap();
        drop(strips);
        assert_eq!(names(), ["README.md", "results.csv", "strip.png"]);
        let csv = std::fs::read(folder.path().join("results.csv")).unwrap();
        assert!(crate::page::is_table(&csv));
        // What is not finished leaves nothing, and a folder that is not there is named.
        drop(Strips::new(folder.path()).unwrap());
        assert_eq!(names().len(), 3);
        let error = Strips::new(&folder.path().join("absent")).unwrap_err().to_string();
        assert!(error.contains("absent"), "{error}");
    }

    /// Two rows of direct light and one of all.
    fn outcome() -> Outcome {
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
        let truth = |transport, max_depth| TruthSummary {
            transport,
            samples: 64,
            max_depth,
            noise: 0.02,
            noise_relmse: 0.001,
            mean_error: 0.0015,
            hair_pixels: 99,
        };
        Outcome {
            supersample: 2,
            truths: vec![truth(Transport::Direct, 1), truth(Transport::Full, 64)],
            rows: vec![
                row(Transport::Direct, first, 0.07),
                row(Transport::Direct, second, 0.06),
                row(Transport::Full, first, 0.3),
            ],
            remarks: vec!["odd".into()],
        }
    }

    fn run() -> Run {
        Run {
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
        }
    }

    #[test]
    fn the_page_reports_direct_and_full_apart() {
        let (outcome, run) = (outcome(), run());
        let second = outcome.rows[1].combination;
        let text = text(&outcome, &run);
        assert!(text.starts_with(PAGE_TITLE));
        let (direct, full) = text.split_once("## Full transport").unwrap();
        assert!(direct.contains(&format!("Least FLIP: {} (0.0600).", second.name())), "{direct}");
        assert!(direct.contains("at most 1 scattering event,"), "{direct}");
        assert!(full.contains("at most 64 scattering events,"), "{full}");
        assert!(full.contains("| look+dom+dbk | 0.300 | 0.100 | 0.0900 | 2.40 % | 1.02 | 12.0 |"), "{full}");
        for part in [
            "a \\| head",
            "32 x 48",
            "2026-01-31",
            "64 samples",
            "standard error of 0.150 %",
            "2 by 2 samples a pixel",
            SOFTWARE,
            "![look+dom+dbk](strip.png)",
            "- odd",
        ] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
        let csv = table(&outcome).csv(&run.adapter);
        assert_eq!(csv.lines().count(), 4);
        assert!(csv.contains("direct,look,dom,dbk,0.07,0.1,0.09,0.024,1.024,12,llvm,true\n"), "{csv}");
    }

    #[test]
    fn what_one_renderer_lacks_is_taken_from_both() {
        let text = "[camera]\naperture_radius = 0.5\n[render]\nclamp = 4.0\n[[light]]\ntype = \"distant\"\n\
                    direction = [0.0, -1.0, 0.0]\n[[groom]]\nprocedural = { preset = \"short\", strands = 20 }\n";
        let scene = Scene::load(text, &[], &scene::NoAssets).unwrap();
        let mut remarks = Remarks::default();
        let matched = matched(&scene, &mut remarks);
        assert_eq!((matched.camera.aperture_radius, matched.film.filter_width), (0.0, 1.0));
        assert_eq!(matched.film.filter, Filter::Box);
        assert_eq!(matched.render.clamp, None);
        let lines = remarks.into_lines();
        assert!(lines[0].contains("lens") && lines[1].contains("clamp") && lines[1].contains('4'), "{lines:?}");
    }
}
