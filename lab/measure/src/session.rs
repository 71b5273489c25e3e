//! What an experiment may ask for: the device, the plan, and how to take times.

use std::sync::Arc;

use film::{CompareError, Comparison, Image};
use job::Cancel;
use raster::{
    AdapterDescription, Gpu, GpuError, GpuOptions, RasterError, Renderer, Report, Settings, Shadow, ShadowTechnique,
    Transparency,
};
use scene::Scene;

use crate::Error;
use crate::finding::{Measured, median};
use crate::subject::Subject;

/// The size at which the thesis measures, pixels.
pub const THESIS_VIEWPORT: [u32; 2] = [656, 861];

/// What is measured with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Pixels.
    pub size: [u32; 2],
    /// Numbers of strands; experiments that do not compare them use the largest.
    pub strands: Vec<u32>,
    /// Grooms; experiments that do not compare them use the first.
    pub subjects: Vec<Subject>,
    /// Frames that are timed, after those that are not.
    pub repeats: u32,
    /// Whether the dearest settings are left out: a few minutes an experiment, on a software adapter and at half the
    /// size.
    pub quick: bool,
}

impl Default for Plan {
    /// As in the thesis.
    fn default() -> Self {
        Self {
            size: THESIS_VIEWPORT,
            strands: vec![10_000, 20_000, 30_000, 40_000, 50_000],
            subjects: Subject::GROWN.to_vec(),
            repeats: 5,
            quick: false,
        }
    }
}

/// A plan that cannot be carried out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} is {found}; it must be {range}")]
pub struct PlanError {
    /// Which part.
    pub name: &'static str,
    /// What it is.
    pub found: String,
    /// What it may be.
    pub range: &'static str,
}

impl Plan {
    /// Whether everything is in its range.
    ///
    /// # Errors
    /// The first part that is not.
    pub fn check(&self) -> Result<(), PlanError> {
        let refuse = |name, found: String, range| Err(PlanError { name, found, range });
        if let Some(side) = self.size.iter().find(|side| !(1..=16_384).contains(*side)) {
            return refuse("a side of the picture", side.to_string(), "1 to 16384 pixels");
        }
        if self.strands.is_empty() {
            return refuse("the list of numbers of strands", "empty".into(), "one number or more");
        }
        if let Some(count) = self.strands.iter().find(|count| !(1..=1_000_000).contains(*count)) {
            return refuse("the number of strands", count.to_string(), "1 to 1000000");
        }
        if self.subjects.is_empty() {
            return refuse("the list of grooms", "empty".into(), "one groom or more");
        }
        // Tables and findings go by name.
        let names: Vec<String> = self.subjects.iter().map(Subject::name).collect();
        if let Some(name) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(*name)).map(|(_, name)| name)
        {
            let range = "one of different names; that of a file is without folder and ending";
            return refuse("the list of grooms", format!("one with {name:?} twice"), range);
        }
        if !(1..=1000).contains(&self.repeats) {
            return refuse("the number of repeats", self.repeats.to_string(), "1 to 1000");
        }
        Ok(())
    }

    /// The largest number of strands.
    pub fn most(&self) -> u32 {
        self.strands.iter().copied().max().unwrap_or(1)
    }

    /// The groom of experiments with one groom.
    pub(crate) fn subject(&self) -> &Subject {
        self.subjects.first().unwrap_or(&Subject::Straight)
    }

    /// The command that does an experiment again; `adapter` is the part of a name that was asked for.
    pub fn command(&self, experiment: &str, adapter: Option<&str>) -> String {
        let list = |words: Vec<String>| shell_word(&words.join(","));
        let [width, height] = self.size;
        let strands = list(self.strands.iter().map(u32::to_string).collect());
        let grooms = list(self.subjects.iter().map(Subject::argument).collect());
        let quick = if self.quick { " --quick" } else { "" };
        let adapter = adapter.map(|name| format!(" --adapter {}", shell_word(name))).unwrap_or_default();
        format!(
            "cuticle measure {experiment} -o FOLDER --size {width}x{height} --strands {strands} --grooms {grooms} \
             --repeats {}{quick}{adapter}",
            self.repeats
        )
    }
}

/// A word as a shell takes it for one: in quotation marks where it needs them.
pub fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// How far an experiment is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress<'a> {
    /// What is being done.
    pub step: &'a str,
    /// How much of the experiment is done, 0 to 1.
    pub done: f64,
}

/// An open device and what is to be measured on it.
pub struct Session<'a> {
    plan: Plan,
    gpu: Gpu,
    cancel: Cancel,
    progress: &'a (dyn Fn(Progress<'_>) + Sync),
}

impl std::fmt::Debug for Session<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("plan", &self.plan).field("adapter", self.adapter()).finish_non_exhaustive()
    }
}

/// How well a time is known that was taken once, as a share of it: what repeats on an idle machine differ by.
const ALONE: f64 = 0.05;

/// What frames with one setting cost.
#[derive(Clone, Debug)]
pub(crate) struct Cost {
    /// Time of a frame, ms: of the device, or of the wall where it has no timers.
    pub(crate) ms: Measured,
    /// Time from the first command to the last result, ms.
    pub(crate) wall: Measured,
    /// Whether `ms` is the device's.
    pub(crate) timed: bool,
    /// Frames that count.
    frames: usize,
    /// How often one of them was drawn, at most.
    attempts: u32,
    /// Report of the last frame.
    pub(crate) report: Report,
    /// Median per part of the renderer, ms; empty without timers.
    parts: Vec<(&'static str, f64)>,
}

impl Cost {
    /// From the reports of the frames that count.
    pub(crate) fn of(reports: Vec<Report>) -> Option<Self> {
        let timed = reports.iter().all(|report| report.total_ms().is_some());
        let total = |report: &Report| report.total_ms().filter(|_| timed).unwrap_or(report.wall_ms);
        let ms = measured(reports.iter().map(total).collect());
        let wall = measured(reports.iter().map(|report| report.wall_ms).collect());
        let mut owners: Vec<&'static str> = Vec::new();
        for span in reports.iter().filter(|_| timed).flat_map(|report| &report.spans) {
            if !owners.contains(&span.owner) {
                owners.push(span.owner);
            }
        }
        let of_owner = |owner: &str| median(reports.iter().filter_map(|report| report.ms(owner)).collect());
        let parts = owners.into_iter().map(|owner| (owner, of_owner(owner))).collect();
        let (frames, attempts) = (reports.len(), reports.iter().map(|report| report.attempts).max().unwrap_or(0));
        Some(Self { ms, wall, timed, frames, attempts, parts, report: reports.into_iter().next_back()? })
    }

    /// Time of a frame for verdicts: what was taken once is not taken for exact.
    pub(crate) fn time(&self) -> Measured {
        let Measured { middle, .. } = self.ms;
        match self.frames {
            1 => Measured { middle, least: (1.0 - ALONE) * middle, most: (1.0 + ALONE) * middle },
            _ => self.ms,
        }
    }

    /// Time of one part, ms; NaN without timers, and 0 of a part that had nothing to do. A variant's passes may
    /// belong to the plain name: `a-buffer-k` has those of `a-buffer`.
    pub(crate) fn part(&self, name: &str) -> f64 {
        if !self.timed {
            return f64::NAN;
        }
        self.parts.iter().filter(|(owner, _)| name.starts_with(owner)).map(|(_, ms)| ms).sum()
    }
}

/// Median, least and most.
fn measured(values: Vec<f64>) -> Measured {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Measured { middle: median(values), least, most }
}

/// Middle, least and most of the times of frames, for tables; unknown where nothing was measured.
pub(crate) fn times(cost: Option<&Cost>) -> Measured {
    cost.map_or(Measured::UNKNOWN, |cost| cost.ms)
}

/// The same for verdicts.
pub(crate) fn judged(cost: Option<&Cost>) -> Measured {
    cost.map_or(Measured::UNKNOWN, Cost::time)
}

/// What is said on pages besides numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Remarks(Vec<String>);

impl Remarks {
    /// Says something, once.
    pub(crate) fn add(&mut self, remark: impl Into<String>) {
        let remark = remark.into();
        if !self.0.contains(&remark) {
            self.0.push(remark);
        }
    }

    /// What is odd about a cost.
    pub(crate) fn of_cost(&mut self, what: &str, cost: &Cost) {
        if !cost.timed {
            self.add(
                "The adapter has no timers: times are those of the wall, from the first command to the last result.",
            );
        }
        if cost.frames == 1 {
            self.add(format!("One frame was timed: in orders its time counts as known to {:.0} %.", 100.0 * ALONE));
        }
        if cost.attempts > 1 {
            self.add(format!(
                "{what}: a frame that counts was drawn {} times until its fragments found room, and its wall time is \
                 that of all of them.",
                cost.attempts
            ));
        }
        self.of_report(what, &cost.report);
    }

    /// What is odd about a frame.
    pub(crate) fn of_report(&mut self, what: &str, report: &Report) {
        for note in &report.notes {
            self.add(format!("The renderer says: {note}."));
        }
        if report.fragments.dropped > 0 {
            self.add(format!("{what}: {} fragments were lost.", report.fragments.dropped));
        }
    }

    pub(crate) fn into_lines(self) -> Vec<String> {
        self.0
    }
}

impl<'a> Session<'a> {
    /// Opens the device.
    ///
    /// # Errors
    /// When there is no such adapter, or it cannot do what is needed.
    pub fn open(
        plan: Plan,
        options: &GpuOptions,
        cancel: Cancel,
        progress: &'a (dyn Fn(Progress<'_>) + Sync),
    ) -> Result<Self, GpuError> {
        Ok(Self { plan, gpu: Gpu::new(options)?, cancel, progress })
    }

    /// Which adapter it is.
    pub fn adapter(&self) -> &AdapterDescription {
        self.gpu.description()
    }

    /// What is measured with.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Tells how far it is, and finds out whether to go on.
    pub(crate) fn step(&self, step: &str, done: f64) -> Result<(), Error> {
        (self.progress)(Progress { step, done: done.clamp(0.0, 1.0) });
        if self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// The adapter, for titles of plots.
    pub(crate) fn label(&self) -> String {
        let adapter = self.adapter();
        format!("{}{}", adapter.name, if adapter.software { " (software: only ratios count)" } else { "" })
    }

    /// Where a scene is drawn.
    pub(crate) fn bench(&self, scene: &Arc<Scene>) -> Bench {
        Bench::new(&self.gpu, scene)
    }

    /// Takes the cost of frames with these settings; `None`, with a remark, where the device has no room for them.
    pub(crate) fn cost(
        &self,
        bench: &mut Bench,
        settings: &Settings,
        what: &str,
        remarks: &mut Remarks,
    ) -> Result<Option<Cost>, Error> {
        self.cost_at(bench, settings, self.plan.size, what, remarks)
    }

    /// The same at another size.
    pub(crate) fn cost_at(
        &self,
        bench: &mut Bench,
        settings: &Settings,
        size: [u32; 2],
        what: &str,
        remarks: &mut Remarks,
    ) -> Result<Option<Cost>, Error> {
        let (repeats, quick) = (self.plan.repeats, self.plan.quick);
        let frames = bench.with(settings, |renderer| {
            let camera = renderer.scene().camera;
            // The first frame makes pipelines and counts fragments; the second one makes the room that fits them.
            let first = renderer.draw(&camera, size)?;
            if !quick || first.fragments.stored > 0 {
                renderer.draw(&camera, size)?;
            }
            (0..repeats).map(|_| renderer.draw(&camera, size)).collect::<Result<Vec<Report>, RasterError>>()
        });
        let Some(reports) = fitting(frames, what, remarks)? else { return Ok(None) };
        let cost = Cost::of(reports);
        if let Some(cost) = &cost {
            remarks.of_cost(what, cost);
        }
        Ok(cost)
    }

    /// Draws one picture; `None`, with a remark, where the device has no room for it.
    pub(crate) fn picture(
        &self,
        bench: &mut Bench,
        settings: &Settings,
        what: &str,
        remarks: &mut Remarks,
    ) -> Result<Option<(Image, Report)>, Error> {
        let size = self.plan.size;
        // A frame whose fragments found no room is drawn again by the renderer: one is enough to be seen.
        let drawn = bench.with(settings, |renderer| {
            let camera = renderer.scene().camera;
            let report = renderer.draw(&camera, size)?;
            Ok((renderer.image()?, report))
        });
        let drawn = fitting(drawn, what, remarks)?;
        if let Some((_, report)) = &drawn {
            remarks.of_report(what, report);
        }
        Ok(drawn)
    }

    /// What a frame keeps once everything has the size that it takes; `None`, with a remark, where the device has no
    /// room for it.
    pub(crate) fn settled(
        &self,
        bench: &mut Bench,
        settings: &Settings,
        what: &str,
        remarks: &mut Remarks,
    ) -> Result<Option<Report>, Error> {
        let size = self.plan.size;
        let drawn = bench.with(settings, |renderer| {
            let camera = renderer.scene().camera;
            // What is sized by what was counted in one frame is right in the next.
            renderer.draw(&camera, size)?;
            renderer.draw(&camera, size)
        });
        let report = fitting(drawn, what, remarks)?;
        if let Some(report) = &report {
            remarks.of_report(what, report);
        }
        Ok(report)
    }
}

/// A scene and the renderer that draws it, which is made when it is needed and made anew after an error: what an
/// error left of one is not to be measured.
#[derive(Debug)]
pub(crate) struct Bench {
    gpu: Gpu,
    scene: Arc<Scene>,
    renderer: Option<Renderer>,
}

impl Bench {
    pub(crate) fn new(gpu: &Gpu, scene: &Arc<Scene>) -> Self {
        Self { gpu: gpu.clone(), scene: Arc::clone(scene), renderer: None }
    }

    /// Does something with a renderer that has these settings.
    pub(crate) fn with<T>(
        &mut self,
        settings: &Settings,
        work: impl FnOnce(&mut Renderer) -> Result<T, RasterError>,
    ) -> Result<T, RasterError> {
        let done = self.ready(settings).and_then(work);
        if done.is_err() {
            self.renderer = None;
        }
        done
    }

    fn ready(&mut self, settings: &Settings) -> Result<&mut Renderer, RasterError> {
        match &mut self.renderer {
            Some(renderer) => {
                renderer.set(settings)?;
                Ok(renderer)
            }
            none => Ok(none.insert(Renderer::new(&self.gpu, Arc::clone(&self.scene), settings)?)),
        }
    }
}

/// Lack of room is a result like any other; everything else ends the experiment.
pub(crate) fn fitting<T>(
    result: Result<T, RasterError>,
    what: &str,
    remarks: &mut Remarks,
) -> Result<Option<T>, Error> {
    match result {
        Ok(found) => Ok(Some(found)),
        Err(
            error @ (RasterError::Overflow { .. }
            | RasterError::TooLarge { .. }
            | RasterError::TooManyModels { .. }
            | RasterError::Gpu(GpuError::OutOfMemory(_))),
        ) => {
            remarks.add(format!("Not measured, {what}: {error}."));
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

/// How far two pictures are apart; `None`, with a remark, where one holds what is no number.
pub(crate) fn compared(
    test: &Image,
    reference: &Image,
    exposure_ev: f32,
    what: &str,
    remarks: &mut Remarks,
) -> Result<Option<Comparison>, Error> {
    match Comparison::at_exposure(test, reference, exposure_ev) {
        Ok(comparison) => Ok(Some(comparison)),
        Err(error @ CompareError::NotFinite { .. }) => {
            remarks.add(format!(
                "Not compared, {what}: {error}. Drawn pictures have no radiance above 65504, the largest number of half \
                 precision."
            ));
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

/// What measurements begin with: opaque, no shadow, and no light from other fibers, which the thesis has none of.
pub(crate) fn plain() -> Settings {
    let default = Settings::default();
    Settings {
        shading: raster::Shading { multiple: None, ..default.shading },
        shadow: Shadow { technique: ShadowTechnique::None, ..default.shadow },
        transparency: Transparency::Opaque,
        ..default
    }
}

#[cfg(test)]
mod tests {
    use raster::Span;

    use super::*;

    fn report(ms: [Option<f64>; 2], wall_ms: f64) -> Report {
        let spans = [("scene", ms[0]), ("dom", ms[1])];
        let spans = spans.map(|(owner, ms)| Span { owner, pass: "pass".into(), ms });
        Report { spans: spans.to_vec(), wall_ms, ..Report::default() }
    }

    #[test]
    fn a_cost_is_the_median_of_device_times() {
        let reports = vec![
            report([Some(1.0), Some(9.0)], 50.0),
            report([Some(2.0), Some(3.0)], 50.0),
            report([Some(3.0), Some(1.0)], 50.0),
        ];
        let cost = Cost::of(reports).unwrap();
        assert!(cost.timed);
        assert_eq!(cost.ms, Measured { middle: 5.0, least: 4.0, most: 10.0 });
        assert_eq!((cost.time(), cost.wall), (cost.ms, Measured::exact(50.0)));
        assert_eq!((cost.part("scene"), cost.part("dom-x"), cost.part("osm")), (2.0, 3.0, 0.0));
        assert!(Cost::of(Vec::new()).is_none());
    }

    #[test]
    fn a_time_taken_once_is_not_exact() {
        let mut again = report([Some(1.0), Some(1.0)], 9.0);
        again.attempts = 2;
        let cost = Cost::of(vec![again]).unwrap();
        let time = cost.time();
        assert_eq!((cost.ms, time.middle), (Measured::exact(2.0), 2.0));
        assert!((time.least - 1.9).abs() < 1e-12 && (time.most - 2.1).abs() < 1e-12, "{time:?}");
        let mut remarks = Remarks::default();
        remarks.of_cost("dbk", &cost);
        let lines = remarks.into_lines();
        assert!(lines.iter().any(|line| line.contains("known to 5 %")), "{lines:?}");
        assert!(lines.iter().any(|line| line.starts_with("dbk: ") && line.contains("drawn 2 times")), "{lines:?}");
    }

    #[test]
    fn without_timers_the_wall_counts() {
        let reports = vec![report([Some(1.0), Some(9.0)], 50.0), report([Some(2.0), None], 70.0)];
        let cost = Cost::of(reports).unwrap();
        // One frame without a timer makes all of them wall times: the two kinds do not mix.
        assert_eq!((cost.timed, cost.ms.middle), (false, 60.0));
        assert!(cost.part("dom").is_nan());
        let mut remarks = Remarks::default();
        remarks.of_cost("a", &cost);
        remarks.of_cost("b", &cost);
        let lines = remarks.into_lines();
        assert_eq!(lines.len(), 1);
        assert!(lines[0].contains("wall"), "{lines:?}");
    }

    #[test]
    fn lack_of_room_is_a_result_and_other_errors_are_not() {
        let mut remarks = Remarks::default();
        let full: Result<(), RasterError> = Err(RasterError::Overflow { dropped: 7, attempts: 6 });
        assert!(fitting(full, "a-buffer", &mut remarks).unwrap().is_none());
        assert!(remarks.into_lines()[0].contains("a-buffer: 7 fragments"));
        let lost: Result<(), RasterError> = Err(GpuError::Lost("gone".into()).into());
        assert!(fitting(lost, "", &mut Remarks::default()).is_err());
    }

    #[test]
    fn a_pixel_that_is_no_number_is_a_result_and_other_errors_are_not() {
        let image =
            |width: u32, light: f32| Image::new(width, 1, vec![math::Rgb::splat(light); width as usize], None).unwrap();
        let mut remarks = Remarks::default();
        let good = compared(&image(2, 1.0), &image(2, 2.0), 0.0, "opaque", &mut remarks).unwrap();
        assert!(good.is_some_and(|good| (good.mse - 1.0).abs() < 1e-9));
        assert!(compared(&image(2, f32::INFINITY), &image(2, 2.0), 0.0, "dbk", &mut remarks).unwrap().is_none());
        let lines = remarks.into_lines();
        assert!(lines.len() == 1 && lines[0].contains("dbk: the test image is not finite"), "{lines:?}");
        assert!(compared(&image(1, 1.0), &image(2, 2.0), 0.0, "", &mut Remarks::default()).is_err());
    }

    #[test]
    fn plans_are_checked_and_told_as_commands() {
        let plan = Plan::default();
        assert_eq!((plan.check(), plan.most()), (Ok(()), 50_000));
        plain().check().unwrap();
        let quick = Plan { repeats: 3, strands: vec![10, 20], quick: true, ..plan.clone() };
        let want = "cuticle measure shadows -o FOLDER --size 656x861 --strands 10,20 --grooms straight,wavy,curly \
                    --repeats 3 --quick";
        assert_eq!(quick.command("shadows", None), want);
        assert_eq!(quick.command("shadows", Some("llvm pipe")), format!("{want} --adapter 'llvm pipe'"));
        let file = Plan { subjects: vec![Subject::File("my hair.hair".into())], ..plan.clone() };
        assert!(file.command("shadows", Some("llvm")).contains("--grooms 'my hair.hair' --repeats 5 --adapter llvm"));
        assert_eq!(shell_word("it's"), r"'it'\''s'");
        let twice = [Subject::Curly, Subject::File("a/fur.hair".into()), Subject::File("b/fur.toml".into())];
        for (wrong, word) in [
            (Plan { size: [0, 5], ..plan.clone() }, "a side of the picture is 0"),
            (Plan { strands: vec![5, 0], ..plan.clone() }, "the number of strands is 0"),
            (Plan { strands: vec![], ..plan.clone() }, "the list of numbers of strands is empty"),
            (Plan { subjects: vec![], ..plan.clone() }, "the list of grooms is empty"),
            (Plan { repeats: 0, ..plan.clone() }, "the number of repeats is 0"),
            (Plan { subjects: twice.to_vec(), ..plan.clone() }, "the list of grooms is one with \"fur\" twice"),
        ] {
            let error = wrong.check().unwrap_err().to_string();
            assert!(error.starts_with(word) && error.contains("must be"), "{error}");
        }
    }
}
