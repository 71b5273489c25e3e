//! Fig. 42: what transparency keeps in memory.

use raster::{Report, ShadowTechnique};

use crate::session::Remarks;
use crate::sheet;
use crate::subject::{Pose, seen};
use crate::transparency::{settings, techniques};
use crate::{Cell, Error, Finding, Page, Picture, Session, Table};

/// What the thesis reports at 656 x 861 pixels and 50,000 strands, in units of 2^20 bytes: the sizes that it gives of
/// single entries add up to these numbers in no other unit.
const THESIS_MIB: [(&str, f64); 4] = [("subsets", 34.47), ("k-plus", 36.63), ("dbk", 59.25), ("a-buffer", 150.46)];

/// Bytes of the thesis's unit.
const MIB: f64 = 1_048_576.0;

/// Fragments that the thesis stores in the A-buffer and in the DBK-buffer.
const THESIS_FRAGMENTS: [f64; 2] = [12_959_208.0, 4_518_344.0];

/// What a technique kept.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    technique: &'static str,
    /// All its buffers and textures, bytes.
    bytes: f64,
    /// Of that the lists: heads, links and what they link, bytes; NaN of techniques without lists.
    lists: f64,
    stored: f64,
    pixels: f64,
    /// Whether the picture was drawn in bands, which one set of buffers serves one after the other.
    banded: bool,
}

/// Bytes of a technique. A variant's buffers may belong to the plain name: `a-buffer-k` has those of `a-buffer`.
fn own(report: &Report, technique: &str, counts: impl Fn(&str) -> bool) -> f64 {
    let of = report.memory.iter().filter(|one| technique.starts_with(one.owner) && counts(&one.name));
    of.map(|one| one.bytes as f64).sum()
}

/// Whether a technique keeps lists of fragments.
fn has_lists(technique: &str) -> bool {
    technique == "dbk" || technique.starts_with("a-buffer")
}

/// Whether a buffer of such a technique is part of the lists.
fn is_list(name: &str) -> bool {
    ["heads", "links", "payloads"].contains(&name)
}

/// Whether the passes of a technique were repeated for bands of the picture.
fn is_banded(report: &Report, technique: &str) -> bool {
    report.spans.iter().any(|span| technique.starts_with(span.owner) && span.pass.contains(" band "))
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let subject = plan.subject();
    session.step(&format!("growing {}", subject.name()), 0.0)?;
    let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
    let mut bench = session.bench(&prepared.scene);
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Memory on the device (1 MB is a million bytes), no shadow. The thesis's sums are at 656 x 861 pixels and 50,000 \
         strands, whatever was drawn here.",
        ["technique", "MB", "lists MB", "thesis MB", "fragments stored", "dropped", "whole renderer MB"],
    );
    let mut buffers = Table::new("Every buffer and texture of the techniques.", ["technique", "buffer", "bytes"]);
    let mut samples: Vec<Sample> = Vec::new();
    let techniques = techniques();
    let pixels = f64::from(plan.size[0]) * f64::from(plan.size[1]);
    for (i, (name, transparency, when)) in techniques.iter().enumerate() {
        session.step(name, i as f64 / techniques.len() as f64)?;
        let wanted = prepared.settings(settings(*transparency, *when, ShadowTechnique::None));
        let drawn = session.settled(&mut bench, &wanted, name, &mut remarks)?;
        let thesis = THESIS_MIB.iter().find(|(known, _)| known == name).map(|(_, mib)| mib * MIB * 1e-6);
        let Some(report) = drawn else {
            let none = || Cell::Number(f64::NAN);
            table.row([(*name).into(), none(), none(), thesis.into(), none(), none(), none()]);
            continue;
        };
        let technique = transparency.name();
        let sample = Sample {
            technique: name,
            bytes: own(&report, technique, |_| true),
            lists: if has_lists(technique) { own(&report, technique, is_list) } else { f64::NAN },
            stored: report.fragments.stored as f64,
            pixels,
            banded: is_banded(&report, technique),
        };
        if sample.banded {
            remarks.add(format!(
                "{name}: the picture was drawn in bands, whose buffers are those of one band; its memory is in no ratio."
            ));
        }
        for one in report.memory.iter().filter(|one| technique.starts_with(one.owner)) {
            buffers.row([(*name).into(), one.name.clone().into(), one.bytes.into()]);
        }
        table.row([
            (*name).into(),
            (sample.bytes * 1e-6).into(),
            (sample.lists * 1e-6).into(),
            thesis.into(),
            report.fragments.stored.into(),
            report.fragments.dropped.into(),
            (report.total_bytes() as f64 * 1e-6).into(),
        ]);
        samples.push(sample);
    }
    let words: Vec<&str> = THESIS_MIB.iter().map(|(name, _)| *name).collect();
    let ours = words.iter().map(|word| find(&samples, word).map_or(f64::NAN, |s| s.bytes * 1e-6)).collect();
    let thesis = THESIS_MIB.map(|(_, mib)| mib * MIB * 1e-6).to_vec();
    let series = [("here".to_owned(), ours), ("thesis".to_owned(), thesis)];
    let page = Page {
        text: vec![
            format!(
                "Groom {}, {} strands. {} Buffers that grow with the number of fragments have the size that the second \
                 frame needed, with the renderer's reserve.",
                subject.name(),
                prepared.strands,
                seen(std::slice::from_ref(subject))
            ),
            "The thesis's sums are in units of 2^20 bytes: its A-buffer keeps 12 bytes a fragment and 4 a pixel, which \
             is 150.46 of these for 12,959,208 fragments and 564,816 pixels. Here they are in millions of bytes. They \
             are of 656 x 861 pixels and 50,000 strands."
                .into(),
        ],
        findings: findings(&samples),
        tables: vec![table, buffers],
        pictures: vec![Picture {
            stem: "plot",
            caption:
                "Memory by technique, here and in the thesis, whose groom, camera, size (656 x 861) and number of \
                      strands (50,000) may be others."
                    .into(),
            png: sheet::bars(&session.label(), "memory / MB", &words, &series)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

fn find<'s>(samples: &'s [Sample], technique: &str) -> Option<&'s Sample> {
    samples.iter().find(|sample| sample.technique == technique)
}

fn findings(samples: &[Sample]) -> Vec<Finding> {
    // 0 is what was not measured: no technique here keeps nothing.
    let positive = |x: Option<f64>| x.filter(|x| *x > 0.0).unwrap_or(f64::NAN);
    let of = |technique: &str, what: fn(&Sample) -> f64| positive(find(samples, technique).map(what));
    // Bytes of one band stand for no picture; the fragments are those of all bands.
    let kept = |technique: &str, what: fn(&Sample) -> f64| {
        positive(find(samples, technique).filter(|sample| !sample.banded).map(what))
    };
    let stored: fn(&Sample) -> f64 = |s| s.stored;
    let bytes: fn(&Sample) -> f64 = |s| s.bytes;
    let lists: fn(&Sample) -> f64 = |s| s.lists;
    vec![
        Finding::ratio(
            "DBK-buffer over A-buffer, all memory",
            59.25 / 150.46,
            kept("dbk", bytes) / kept("a-buffer", bytes),
            0.25,
        ),
        Finding::below(
            "DBK-buffer over A-buffer, lists of fragments",
            0.45,
            kept("dbk", lists) / kept("a-buffer", lists),
        )
        .ours(),
        Finding::ratio(
            "DBK-buffer over A-buffer, fragments stored",
            THESIS_FRAGMENTS[1] / THESIS_FRAGMENTS[0],
            of("dbk", stored) / of("a-buffer", stored),
            0.25,
        ),
        Finding::ratio(
            "A-buffer, fragments stored a pixel of the picture (another groom and camera)",
            THESIS_FRAGMENTS[0] / 564_816.0,
            of("a-buffer", |s| s.stored / s.pixels),
            0.5,
        ),
        Finding::order(
            "random subsets and K+ need least, the A-buffer most",
            &[
                ("subsets", kept("subsets", bytes)),
                ("k-plus", kept("k-plus", bytes)),
                ("dbk", kept("dbk", bytes)),
                ("a-buffer", kept("a-buffer", bytes)),
            ],
        ),
    ]
}

#[cfg(test)]
mod tests {
    use raster::{Allocation, Span};

    use super::*;

    #[test]
    fn the_thesis_numbers_reproduce_the_thesis() {
        let mut samples: Vec<Sample> = THESIS_MIB
            .iter()
            .map(|&(technique, mib)| {
                let stored = match technique {
                    "a-buffer" => THESIS_FRAGMENTS[0],
                    "dbk" => THESIS_FRAGMENTS[1],
                    _ => 0.0,
                };
                let lists = if has_lists(technique) { 12.0 * stored + 4.0 * 564_816.0 } else { f64::NAN };
                Sample { technique, bytes: mib * MIB, lists, stored, pixels: 564_816.0, banded: false }
            })
            .collect();
        // The A-buffer is nothing but its lists, which shows the unit: to all digits that the thesis gives.
        let a_buffer = find(&samples, "a-buffer").unwrap();
        assert!((a_buffer.lists - a_buffer.bytes).abs() < 0.005 * MIB, "{a_buffer:?}");
        assert_eq!((Finding::tally(&findings(&samples)), Finding::aims(&findings(&samples))), told("4 of 4", "1 of 1"));
        // Where nothing was stored, nothing is said of fragments.
        for sample in &mut samples {
            sample.stored = 0.0;
        }
        assert_eq!((Finding::tally(&findings(&samples)), Finding::aims(&findings(&samples))), told("2 of 2", "1 of 1"));
        // Nor of the memory of bands.
        samples[3].banded = true;
        assert_eq!((Finding::tally(&findings(&samples)), Finding::aims(&findings(&samples))), told("-", "-"));
    }

    fn told(tally: &str, aims: &str) -> (String, String) {
        (tally.to_owned(), aims.to_owned())
    }

    #[test]
    fn buffers_belong_to_their_technique() {
        let one = |owner, name: &str, bytes| Allocation { owner, name: name.into(), bytes };
        let memory = vec![
            one("scene", "heads", 1),
            one("a-buffer", "heads", 2),
            one("a-buffer", "counter", 4),
            one("dbk", "links", 8),
            one("dbk", "nearest payloads", 16),
        ];
        let report = Report { memory, ..Report::default() };
        assert_eq!((own(&report, "a-buffer-k", |_| true), own(&report, "a-buffer-k", is_list)), (6.0, 2.0));
        assert_eq!((own(&report, "dbk", is_list), own(&report, "blend", |_| true)), (8.0, 0.0));
        assert!(has_lists("a-buffer-k") && has_lists("dbk") && !has_lists("k-plus") && !has_lists("subsets"));
    }

    #[test]
    fn bands_are_seen_in_the_names_of_passes() {
        let span = |owner, pass: &str| Span { owner, pass: pass.into(), ms: None };
        let report = Report { spans: vec![span("dbk", "fill, band 1"), span("k-plus", "bands")], ..Report::default() };
        assert!(is_banded(&report, "dbk") && !is_banded(&report, "k-plus") && !is_banded(&report, "a-buffer"));
    }
}
