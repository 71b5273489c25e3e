//! How far each transparency technique is from the full sort.

use film::{Image, View};
use raster::{DepthShift, KPlusForm, ShadingTime, ShadowTechnique, Sort, Transparency};

use crate::session::{Remarks, compared};
use crate::sheet::{exposure, sheet};
use crate::subject::{Pose, seen};
use crate::transparency::{K, settings};
use crate::{Error, Finding, Page, Picture, Session, Table};

/// Everything that is held against the A-buffer with its lists sorted in full. All shade when they draw: at the same
/// place in all of them, so that only transparency differs.
fn techniques(quick: bool) -> Vec<(&'static str, Transparency)> {
    let k_plus = |k, form| Transparency::KPlus { k, form };
    let mut techniques = vec![
        ("dbk", Transparency::Dbk { shift: DepthShift::default() }),
        ("k-plus", k_plus(K, KPlusForm::LockFree)),
        ("k-plus, array", k_plus(K, KPlusForm::MaxArray)),
        ("k-plus, heap", k_plus(K, KPlusForm::MaxHeap)),
        ("a-buffer, 8", Transparency::ABuffer { foremost: Some(K) }),
        ("subsets", Transparency::RandomSubsets { k: K }),
        ("blend", Transparency::Blend { sort: Sort::Strands }),
        ("weighted", Transparency::Weighted),
        ("opaque", Transparency::Opaque),
    ];
    if !quick {
        techniques.extend([
            ("k-plus, 16", k_plus(16, KPlusForm::LockFree)),
            ("blend, pieces", Transparency::Blend { sort: Sort::Pieces }),
            ("blend, unsorted", Transparency::Blend { sort: Sort::None }),
        ]);
    }
    techniques
}

/// A level that is off by more than this, of 255, counts as wrong.
const LEVELS: f32 = 2.0;

/// One technique on one groom.
#[derive(Clone, Debug, PartialEq)]
struct Sample {
    subject: String,
    technique: &'static str,
    flip: f64,
    /// Fragments stored, over those of the A-buffer; NaN where none are.
    stored: f64,
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let techniques = techniques(plan.quick);
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Against the A-buffer sorted in full. The error is over the mean radiance of the reference; a pixel differs \
         when any channel is off by more than 2 of 255 levels as it is shown.",
        [
            "groom",
            "technique",
            "FLIP",
            "mean absolute error",
            "pixels that differ",
            "fragments stored",
            "reference stored",
        ],
    );
    let mut samples = Vec::new();
    let mut pictures = Vec::new();
    let all = (plan.subjects.len() * (techniques.len() + 1)) as f64;
    let mut done = 0.0;
    for (place, subject) in plan.subjects.iter().enumerate() {
        let name = subject.name();
        session.step(&format!("growing {name}"), done / all)?;
        let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
        let wanted =
            |transparency| prepared.settings(settings(transparency, ShadingTime::Forward, ShadowTechnique::DOM));
        let full = wanted(Transparency::ABuffer { foremost: None });
        let mut bench = session.bench(&prepared.scene);
        session.step(&format!("{name}: a-buffer"), done / all)?;
        done += 1.0;
        let drawn = session.picture(&mut bench, &full, &format!("{name}, a-buffer"), &mut remarks)?;
        let Some((reference, kept)) = drawn else {
            done += techniques.len() as f64;
            continue;
        };
        let ev = exposure(&reference);
        let mut shots = vec![("a-buffer".to_owned(), reference.clone())];
        for (technique, transparency) in &techniques {
            session.step(&format!("{name}: {technique}"), done / all)?;
            done += 1.0;
            let what = format!("{name}, {technique}");
            let drawn = session.picture(&mut bench, &wanted(*transparency), &what, &mut remarks)?;
            let Some((image, report)) = drawn else { continue };
            let comparison = compared(&image, &reference, ev, &what, &mut remarks)?;
            let flip = comparison.and_then(|comparison| comparison.flip).map_or(f64::NAN, f64::from);
            table.row([
                name.clone().into(),
                (*technique).into(),
                flip.into(),
                relative_error(&image, &reference).into(),
                differing(&image, &reference, ev).into(),
                report.fragments.stored.into(),
                kept.fragments.stored.into(),
            ]);
            let [stored, whole] = [&report, &kept].map(|report| report.fragments.stored as f64);
            let stored = if stored > 0.0 && whole > 0.0 { stored / whole } else { f64::NAN };
            samples.push(Sample { subject: name.clone(), technique, flip, stored });
            shots.push(((*technique).to_owned(), image));
        }
        if let Some(stem) = ["first", "second", "third", "fourth"].get(place).copied() {
            let caption = format!("Groom {name}.");
            pictures.push(Picture { stem, caption, png: sheet(&shots, 4, ev, View::Srgb)? });
        }
    }
    let page = Page {
        text: vec![format!(
            "Up to {} strands. {} Shadows by deep opacity maps of 512 texels. Two forms of the K+-buffer, `array` and \
             `heap`, have a semaphore for each pixel, and may lose fragments: those are counted and remarked.",
            plan.most(),
            seen(&plan.subjects)
        )],
        findings: findings(&samples),
        tables: vec![table],
        pictures,
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

/// Mean absolute error of all channels over the mean of the reference; NaN where that is black.
fn relative_error(test: &Image, reference: &Image) -> f64 {
    let sum = |image: &Image| image.pixels.iter().flat_map(|c| c.0).map(f64::from).sum::<f64>();
    let channels = |image: &Image| image.pixels.iter().flat_map(|c| c.0).map(f64::from).collect::<Vec<_>>();
    let error: f64 = channels(test).iter().zip(channels(reference)).map(|(a, b)| (a - b).abs()).sum();
    let whole = sum(reference);
    if whole > 0.0 { error / whole } else { f64::NAN }
}

/// Share of the pixels that differ by more than [`LEVELS`] as they are shown.
fn differing(test: &Image, reference: &Image, ev: f32) -> f64 {
    let differ = test.pixels.iter().zip(&reference.pixels).filter(|(a, b)| {
        let (a, b) = (View::Srgb.to_display(**a, ev), View::Srgb.to_display(**b, ev));
        a.iter().zip(b).any(|(a, b)| (a - b).abs() * 255.0 > LEVELS)
    });
    differ.count() as f64 / test.pixels.len().max(1) as f64
}

/// The thesis says that techniques look alike where they keep enough, and has no numbers: all of these are ours.
fn findings(samples: &[Sample]) -> Vec<Finding> {
    let mut subjects: Vec<&str> = samples.iter().map(|s| s.subject.as_str()).collect();
    subjects.dedup();
    let mut findings = Vec::new();
    for subject in subjects {
        let found = |technique: &str| samples.iter().find(|s| s.subject == subject && s.technique == technique);
        let of = |technique: &str| found(technique).map_or(f64::NAN, |s| s.flip);
        findings.push(Finding::below(format!("{subject}: DBK looks like the A-buffer (FLIP)"), 0.02, of("dbk")));
        findings.push(Finding::below(
            format!("{subject}: DBK over A-buffer, fragments stored"),
            0.45,
            found("dbk").map_or(f64::NAN, |s| s.stored),
        ));
        findings.push(Finding::order(
            format!("{subject}: DBK is nearer than random subsets, and those than opaque hair (FLIP)"),
            &[("dbk", of("dbk")), ("subsets", of("subsets")), ("opaque", of("opaque"))],
        ));
        findings.push(Finding::order(
            format!("{subject}: blending sorted strands is wrong: DBK is nearer (FLIP)"),
            &[("dbk", of("dbk")), ("blend", of("blend"))],
        ));
    }
    findings.into_iter().map(Finding::ours).collect()
}

#[cfg(test)]
mod tests {
    use math::Rgb;

    use super::*;

    fn plain(lights: [f32; 4]) -> Image {
        Image::new(2, 2, lights.map(Rgb::splat).to_vec(), None).unwrap()
    }

    #[test]
    fn errors_are_those_of_the_numbers() {
        let reference = plain([0.5, 0.5, 1.0, 0.0]);
        assert_eq!((relative_error(&reference, &reference), differing(&reference, &reference, 0.0)), (0.0, 0.0));
        let test = plain([0.5, 0.5, 0.5, 0.0]);
        // 0.5 of 2; one pixel of four.
        assert_eq!((relative_error(&test, &reference), differing(&test, &reference, 0.0)), (0.25, 0.25));
        // A quarter of a level is not seen; eight stops up both are white.
        let near = plain([0.501, 0.5, 1.0, 0.0]);
        assert_eq!(differing(&near, &reference, 0.0), 0.0);
        assert_eq!(differing(&test, &reference, 8.0), 0.0);
        assert!(relative_error(&test, &plain([0.0; 4])).is_nan());
    }

    #[test]
    fn findings_are_made_for_each_groom() {
        let sample = |subject: &str, technique, flip| {
            let stored = if technique == "dbk" { 10.0 * flip } else { f64::NAN };
            Sample { subject: subject.into(), technique, flip, stored }
        };
        let samples = [
            sample("straight", "dbk", 0.01),
            sample("straight", "subsets", 0.05),
            sample("straight", "blend", 0.04),
            sample("straight", "opaque", 0.1),
            sample("curly", "dbk", 0.05),
            sample("curly", "blend", 0.02),
        ];
        let found = findings(&samples);
        let told: Vec<&str> = found.iter().map(Finding::told).collect();
        assert_eq!(told, ["met", "met", "met", "met", "not met", "not met", "not measured", "not met"]);
    }

    #[test]
    fn all_techniques_are_allowed() {
        for (_, transparency) in techniques(false) {
            settings(transparency, ShadingTime::Forward, ShadowTechnique::DOM).check().unwrap();
        }
        // Findings go by name, and what is quick has them too.
        for name in ["dbk", "subsets", "opaque", "blend"] {
            assert_eq!(techniques(true).iter().filter(|(known, _)| *known == name).count(), 1, "{name}");
        }
    }
}
