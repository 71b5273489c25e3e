//! What an experiment may ask for: the device, the plan, and how to take times.

use std::sync::Arc;

use film::Image;
use job::Cancel;
use raster::{
    AdapterDescription, Gpu, GpuError, GpuOptions, RasterError, Renderer, Report, Settings, Shadow, ShadowTechnique,
    Transparency,
};
use scene::Scene;

use crate::Error;
use crate::finding::median;
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
    /// Frames that are timed, after one that is not.
    pub repeats: u32,
    /// Whether the dearest settings are left out.
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

    /// The command that does an experiment again.
    pub fn command(&self, experiment: &str) -> String {
        let list = |words: Vec<String>| words.join(",");
        let [width, height] = self.size;
        let strands = list(self.strands.iter().map(u32::to_string).collect());
        let grooms = list(self.subjects.iter().map(Subject::argument).collect());
        let quick = if self.quick { " --quick" } else { "" };
        format!(
            "cuticle measure {experiment} -o FOLDER --size {width}x{height} --strands {strands} --grooms {grooms} \
             --repeats {}{quick}",
            self.repeats
        )
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

/// What frames with one setting cost.
#[derive(Clone, Debug)]
pub(crate) struct Cost {
    /// Time of a frame, ms: the median over the repeats.
    pub(crate) ms: f64,
    /// Shortest and longest of them.
    pub(crate) span: [f64; 2],
    /// Whether these are times of the device, and not of the wall.
    pub(crate) timed: bool,
    /// Report of the last frame.
    pub(crate) report: Report,
    /// Median per part of the renderer, ms; empty without timers.
    parts: Vec<(&'static str, f64)>,
}

impl Cost {
    /// From the reports of the frames that count.
    pub(crate) fn of(reports: Vec<Report>) -> Option<Self> {
        let timed = reports.iter().all(|report| report.total_ms().is_some());
        let totals: Vec<f64> =
            reports.iter().map(|report| report.total_ms().filter(|_| timed).unwrap_or(report.wall_ms)).collect();
        let mut owners: Vec<&'static str> = Vec::new();
        for span in reports.iter().filter(|_| timed).flat_map(|report| &report.spans) {
            if !owners.contains(&span.owner) {
                owners.push(span.owner);
            }
        }
        let of_owner = |owner: &str| median(reports.iter().filter_map(|report| report.ms(owner)).collect());
        let parts = owners.into_iter().map(|owner| (owner, of_owner(owner))).collect();
        let span = [totals.iter().copied().fold(f64::INFINITY, f64::min), totals.iter().copied().fold(0.0, f64::max)];
        let ms = median(totals);
        Some(Self { ms, span, timed, parts, report: reports.into_iter().next_back()? })
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

    pub(crate) fn of_cost(&mut self, cost: &Cost) {
        if !cost.timed {
            self.add(
                "The adapter has no timers: times are those of the wall, from the first command to the last result.",
            );
        }
        for note in &cost.report.notes {
            self.add(format!("The renderer says: {note}."));
        }
        if cost.report.fragments.dropped > 0 {
            self.add("In some frames fragments were lost.");
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

    /// A renderer for a scene.
    pub(crate) fn renderer(&self, scene: &Arc<Scene>, settings: &Settings) -> Result<Renderer, Error> {
        Ok(Renderer::new(&self.gpu, Arc::clone(scene), settings)?)
    }

    /// Takes the cost of frames with these settings; `None`, with a remark, where the device has no room for them.
    pub(crate) fn cost(
        &self,
        renderer: &mut Renderer,
        settings: &Settings,
        what: &str,
        remarks: &mut Remarks,
    ) -> Result<Option<Cost>, Error> {
        let frames = self.frames(renderer, settings);
        let Some(reports) = fitting(frames, what, remarks)? else { return Ok(None) };
        let cost = Cost::of(reports);
        if let Some(cost) = &cost {
            remarks.of_cost(cost);
        }
        Ok(cost)
    }

    fn frames(&self, renderer: &mut Renderer, settings: &Settings) -> Result<Vec<Report>, RasterError> {
        renderer.set(settings)?;
        let camera = renderer.scene().camera;
        // The first frame makes buffers and pipelines.
        renderer.draw(&camera, self.plan.size)?;
        (0..self.plan.repeats).map(|_| renderer.draw(&camera, self.plan.size)).collect()
    }

    /// Draws one picture; `None`, with a remark, where the device has no room for it.
    pub(crate) fn picture(
        &self,
        renderer: &mut Renderer,
        settings: &Settings,
        what: &str,
        remarks: &mut Remarks,
    ) -> Result<Option<(Image, Report)>, Error> {
        let size = self.plan.size;
        let mut drawn = || -> Result<(Image, Report), RasterError> {
            renderer.set(settings)?;
            let camera = renderer.scene().camera;
            // What is sized by what was counted in one frame is right in the next.
            renderer.draw(&camera, size)?;
            let report = renderer.draw(&camera, size)?;
            Ok((renderer.image()?, report))
        };
        let drawn = fitting(drawn(), what, remarks)?;
        if let Some((_, report)) = &drawn
            && report.fragments.dropped > 0
        {
            remarks.add(format!("{what}: {} fragments were lost.", report.fragments.dropped));
        }
        Ok(drawn)
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
            | RasterError::Gpu(GpuError::OutOfMemory(_))),
        ) => {
            remarks.add(format!("Not measured, {what}: {error}."));
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
        assert_eq!((cost.ms, cost.span), (5.0, [4.0, 10.0]));
        assert_eq!((cost.part("scene"), cost.part("dom-x"), cost.part("osm")), (2.0, 3.0, 0.0));
        assert!(Cost::of(Vec::new()).is_none());
    }

    #[test]
    fn without_timers_the_wall_counts() {
        let reports = vec![report([Some(1.0), Some(9.0)], 50.0), report([Some(2.0), None], 70.0)];
        let cost = Cost::of(reports).unwrap();
        // One frame without a timer makes all of them wall times: the two kinds do not mix.
        assert_eq!((cost.timed, cost.ms), (false, 60.0));
        assert!(cost.part("dom").is_nan());
        let mut remarks = Remarks::default();
        remarks.of_cost(&cost);
        remarks.of_cost(&cost);
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
    fn plans_are_checked_and_told_as_commands() {
        let plan = Plan::default();
        assert_eq!((plan.check(), plan.most()), (Ok(()), 50_000));
        plain().check().unwrap();
        let command = Plan { repeats: 3, strands: vec![10, 20], quick: true, ..plan.clone() }.command("shadows");
        let want = "cuticle measure shadows -o FOLDER --size 656x861 --strands 10,20 --grooms straight,wavy,curly \
                    --repeats 3 --quick";
        assert_eq!(command, want);
        for (wrong, word) in [
            (Plan { size: [0, 5], ..plan.clone() }, "a side of the picture is 0"),
            (Plan { strands: vec![5, 0], ..plan.clone() }, "the number of strands is 0"),
            (Plan { strands: vec![], ..plan.clone() }, "the list of numbers of strands is empty"),
            (Plan { subjects: vec![], ..plan.clone() }, "the list of grooms is empty"),
            (Plan { repeats: 0, ..plan.clone() }, "the number of repeats is 0"),
        ] {
            let error = wrong.check().unwrap_err().to_string();
            assert!(error.starts_with(word) && error.contains("must be"), "{error}");
        }
    }
}
