//! Fig. 42: what transparency keeps in memory.

use raster::{Report, ShadowTechnique};

use crate::session::{Remarks, plain};
use crate::sheet;
use crate::subject::Pose;
use crate::transparency::{settings, techniques};
use crate::{Error, Finding, Page, Picture, Session, Table};

/// Megabytes that the thesis reports at 656 x 861 pixels.
const THESIS_MB: [(&str, f64); 4] = [("subsets", 34.47), ("k-plus", 36.63), ("dbk", 59.25), ("a-buffer", 150.46)];

/// Fragments that the thesis stores in the A-buffer and in the DBK-buffer.
const THESIS_FRAGMENTS: [f64; 2] = [12_959_208.0, 4_518_344.0];

/// What a technique kept.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    technique: &'static str,
    /// All its buffers and textures, bytes.
    bytes: f64,
    /// Of that the lists: heads, links and what they link, bytes.
    lists: f64,
    stored: f64,
    pixels: f64,
}

/// Bytes of a technique. A variant's buffers may belong to the plain name: `a-buffer-k` has those of `a-buffer`.
fn own(report: &Report, technique: &str, counts: impl Fn(&str) -> bool) -> f64 {
    let of = report.memory.iter().filter(|one| technique.starts_with(one.owner) && counts(&one.name));
    of.map(|one| one.bytes as f64).sum()
}

/// Whether a buffer is part of lists of fragments.
fn is_list(name: &str) -> bool {
    ["head", "link", "payload", "node"].iter().any(|word| name.to_lowercase().contains(word))
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let subject = plan.subject();
    session.step(&format!("growing {}", subject.name()), 0.0)?;
    let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
    let mut renderer = session.renderer(&prepared.scene, &prepared.settings(plain()))?;
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Memory on the device (1 MB is a million bytes), no shadow.",
        ["technique", "MB", "lists MB", "thesis MB", "fragments stored", "dropped", "whole renderer MB"],
    );
    let mut buffers = Table::new("Every buffer and texture of the techniques.", ["technique", "buffer", "bytes"]);
    let mut samples: Vec<Sample> = Vec::new();
    let techniques = techniques();
    let pixels = f64::from(plan.size[0]) * f64::from(plan.size[1]);
    for (i, (name, transparency, when)) in techniques.iter().enumerate() {
        session.step(name, i as f64 / techniques.len() as f64)?;
        let wanted = prepared.settings(settings(*transparency, *when, ShadowTechnique::None));
        let drawn = session.picture(&mut renderer, &wanted, name, &mut remarks)?;
        let Some((_, report)) = drawn else { continue };
        let technique = transparency.name();
        let sample = Sample {
            technique: *name,
            bytes: own(&report, technique, |_| true),
            lists: own(&report, technique, is_list),
            stored: report.fragments.stored as f64,
            pixels,
        };
        for one in report.memory.iter().filter(|one| technique.starts_with(one.owner)) {
            buffers.row([(*name).into(), one.name.clone().into(), one.bytes.into()]);
        }
        let thesis = THESIS_MB.iter().find(|(known, _)| known == name).map(|(_, mb)| *mb);
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
    let words: Vec<&str> = THESIS_MB.iter().map(|(name, _)| *name).collect();
    let ours = words.iter().map(|word| find(&samples, word).map_or(f64::NAN, |s| s.bytes * 1e-6)).collect();
    let series = [("here".to_owned(), ours), ("thesis".to_owned(), THESIS_MB.map(|(_, mb)| mb).to_vec())];
    let page = Page {
        text: vec![
            format!(
                "Groom {}, {} strands, seen from the side. Buffers that grow with the number of fragments have the size \
                 that the second frame needed, with the renderer's reserve.",
                subject.name(),
                prepared.strands
            ),
            "The thesis reports its sums in units of 1,000,000 or 1,048,576 bytes without saying which; ratios do not \
             depend on it. Its A-buffer keeps 12 bytes a fragment and 4 a pixel."
                .into(),
        ],
        findings: findings(&samples),
        tables: vec![table, buffers],
        pictures: vec![Picture {
            stem: "plot",
            caption: "Memory by technique, here and in the thesis. The groom and the camera are not the thesis's."
                .into(),
            png: sheet::bars("", "memory / MB", &words, &series)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

fn find<'s>(samples: &'s [Sample], technique: &str) -> Option<&'s Sample> {
    samples.iter().find(|sample| sample.technique == technique)
}

fn findings(samples: &[Sample]) -> Vec<Finding> {
    let of = |technique: &str, what: fn(&Sample) -> f64| {
        // A technique without lists has no ratio of lists.
        find(samples, technique).map(what).filter(|x| *x > 0.0).unwrap_or(f64::NAN)
    };
    let over = |what: fn(&Sample) -> f64| of("dbk", what) / of("a-buffer", what);
    vec![
        Finding::ratio("DBK-buffer over A-buffer, all memory", 59.25 / 150.46, over(|s| s.bytes), 0.25),
        Finding::below("DBK-buffer over A-buffer, lists of fragments (our own aim)", 0.45, over(|s| s.lists)),
        Finding::ratio(
            "DBK-buffer over A-buffer, fragments stored",
            THESIS_FRAGMENTS[1] / THESIS_FRAGMENTS[0],
            over(|s| s.stored),
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
                ("subsets", of("subsets", |s| s.bytes)),
                ("k-plus", of("k-plus", |s| s.bytes)),
                ("dbk", of("dbk", |s| s.bytes)),
                ("a-buffer", of("a-buffer", |s| s.bytes)),
            ],
        ),
    ]
}

#[cfg(test)]
mod tests {
    use raster::Allocation;

    use super::*;

    #[test]
    fn the_thesis_numbers_reproduce_the_thesis() {
        let mut samples: Vec<Sample> = THESIS_MB
            .iter()
            .map(|&(technique, mb)| {
                let stored = match technique {
                    "a-buffer" => THESIS_FRAGMENTS[0],
                    "dbk" => THESIS_FRAGMENTS[1],
                    _ => 0.0,
                };
                let lists = 12.0 * stored + 4.0 * 564_816.0;
                Sample { technique, bytes: mb * 1e6, lists, stored, pixels: 564_816.0 }
            })
            .collect();
        assert_eq!(Finding::tally(&findings(&samples)), "5 of 5");
        // Where nothing was stored, nothing is said of fragments.
        for sample in &mut samples {
            sample.stored = 0.0;
        }
        assert_eq!(Finding::tally(&findings(&samples)), "3 of 3");
    }

    #[test]
    fn buffers_belong_to_their_technique() {
        let one = |owner, name: &str, bytes| Allocation { owner, name: name.into(), bytes };
        let memory = vec![
            one("scene", "Nodes", 1),
            one("a-buffer", "heads", 2),
            one("a-buffer", "counter", 4),
            one("dbk", "links", 8),
        ];
        let report = Report { memory, ..Report::default() };
        assert_eq!((own(&report, "a-buffer-k", |_| true), own(&report, "a-buffer-k", is_list)), (6.0, 2.0));
        assert_eq!((own(&report, "dbk", is_list), own(&report, "blend", |_| true)), (8.0, 0.0));
    }
}
