//! Every experiment at the least effort: a page with all its pictures comes out.

use std::sync::Mutex;

use job::Cancel;
use reproduce::page::{self, Run};
use reproduce::{Context, Error, Outcome, experiments};

/// So little that nothing can be concluded; what is tried is that it runs.
const SCALE: f64 = 0.004;

fn context(progress: &(dyn Fn(reproduce::Progress<'_>) + Sync), cancel: Cancel) -> Context<'_> {
    Context { scale: SCALE, seed: 1, threads: 0, cancel, folder: None, progress }
}

#[test]
fn every_experiment_leaves_a_page_with_its_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let steps = Mutex::new(0);
    let count = |progress: reproduce::Progress<'_>| {
        assert!((0.0..=1.0).contains(&progress.done) && !progress.step.is_empty(), "{progress:?}");
        *steps.lock().unwrap() += 1;
    };
    let run = Run { date: None, quality: SCALE, seed: 1 };
    for experiment in experiments() {
        let name = experiment.name;
        let outcome = Outcome::of(experiment, &context(&count, Cancel::default()))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let report = &outcome.report;
        assert!(!report.claim.is_empty() && !report.figure.is_empty() && !report.text.is_empty(), "{name}");
        assert!(report.measured.iter().any(|m| m.decides), "{name}: nothing decides");
        assert!(report.measured.iter().all(|m| !m.decides || m.meets().is_some()), "{name}: expects nothing");
        for table in &report.tables {
            assert!(table.rows.iter().all(|row| row.len() == table.columns.len()), "{name}: {}", table.caption);
        }
        assert!(!report.pictures.is_empty(), "{name} has no picture");
        page::write(folder.path(), &outcome, &run).unwrap();
        let text = std::fs::read_to_string(folder.path().join(format!("{name}.md"))).unwrap();
        assert!(!text.contains("not a number"), "{name}: {text}");
        for picture in &report.pictures {
            let file = format!("{name}-{}.png", picture.stem);
            assert!(text.contains(&format!("]({file})")), "{name} does not show {file}");
            let image = film::image::read(folder.path().join(&file)).unwrap();
            assert!(image.width >= 16 && image.height >= 16, "{file}: {} x {}", image.width, image.height);
            assert!(picture.png.len() <= reproduce::raster::LARGEST, "{file}: {} bytes", picture.png.len());
            // Something is to be seen.
            assert!(image.pixels.iter().any(|p| *p != image.pixels[0]), "{file} is empty");
        }
    }
    assert!(*steps.lock().unwrap() > 10);
    page::write_index(folder.path()).unwrap();
    let index = std::fs::read_to_string(folder.path().join("README.md")).unwrap();
    for experiment in experiments() {
        assert!(index.contains(&format!("]({}.md)", experiment.name)), "{} is not in the index", experiment.name);
    }
    assert!(!index.contains("not tried"));
}

#[test]
fn experiments_stop_when_asked_to() {
    let cancel = Cancel::default();
    cancel.cancel();
    let experiment = reproduce::find("hery-fig1").unwrap();
    let result = Outcome::of(experiment, &context(&|_| {}, cancel));
    assert!(matches!(result, Err(Error::Cancelled)), "{result:?}");
}
