//! Fig. 33: what shading costs, for ever more strands of three grooms, opaque and without shadows.

use raster::{Geometry, Settings, Shading, ShadingTime, Shape};

use crate::finding::Measured;
use crate::session::{Remarks, judged, plain, times};
use crate::sheet;
use crate::subject::{Pose, seen};
use crate::table::grouped;
use crate::{Error, Finding, Page, Picture, Session, Table};

/// What is compared: the thesis draws lines, forward and deferred.
const VARIANTS: [(&str, Shape, ShadingTime); 3] = [
    ("lines, forward", Shape::Line, ShadingTime::Forward),
    ("lines, deferred", Shape::Line, ShadingTime::Deferred),
    ("ribbons, forward", Shape::Ribbon, ShadingTime::Forward),
];

/// One measured point.
#[derive(Clone, Debug, PartialEq)]
struct Sample {
    subject: String,
    strands: u32,
    variant: usize,
    time: Measured,
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let variants = if plan.quick { 2 } else { VARIANTS.len() };
    let mut counts = plan.strands.clone();
    counts.sort_unstable();
    counts.dedup();
    if plan.quick && counts.len() > 3 {
        counts = vec![counts[0], counts[counts.len() / 2], counts[counts.len() - 1]];
    }
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Opaque, one light, no shadow: time of a frame, all passes.",
        ["groom", "strands", "points", "variant", "ms", "least ms", "most ms"],
    );
    let mut samples: Vec<Sample> = Vec::new();
    let all = (plan.subjects.len() * counts.len() * variants) as f64;
    for subject in &plan.subjects {
        let mut last = 0;
        for &count in &counts {
            let name = subject.name();
            session.step(&format!("growing {name}"), table.rows.len() as f64 / all)?;
            let prepared = subject.prepared(count, Pose::SIDE, plan.size)?;
            // A file may have fewer strands than asked for, and those are drawn once.
            if prepared.strands == last {
                continue;
            }
            last = prepared.strands;
            let there: usize = prepared.scene.grooms.iter().map(|groom| groom.groom.point_count()).sum();
            let settings = |variant: usize| {
                let (_, shape, when) = VARIANTS[variant];
                let plain = plain();
                prepared.settings(Settings {
                    geometry: Geometry { shape, ..plain.geometry },
                    shading: Shading { when, ..plain.shading },
                    ..plain
                })
            };
            let points = (there as f64 * f64::from(settings(0).geometry.strands)).round() as u64;
            let mut bench = session.bench(&prepared.scene);
            for (variant, (told, ..)) in VARIANTS.iter().enumerate().take(variants) {
                let what = format!("{name}, {last} strands, {told}");
                session.step(&what, table.rows.len() as f64 / all)?;
                let cost = session.cost(&mut bench, &settings(variant), &what, &mut remarks)?;
                let Measured { middle: ms, least, most } = times(cost.as_ref());
                table.row([
                    name.clone().into(),
                    last.into(),
                    points.into(),
                    (*told).into(),
                    ms.into(),
                    least.into(),
                    most.into(),
                ]);
                let time = judged(cost.as_ref());
                samples.push(Sample { subject: name.clone(), strands: last, variant, time });
            }
        }
    }
    let names: Vec<String> = plan.subjects.iter().map(|subject| subject.name()).collect();
    let panels: Vec<(String, Vec<sheet::Curve>)> = (0..variants)
        .map(|variant| {
            let curves = names.iter().map(|name| (name.clone(), curve(&samples, name, variant)));
            (VARIANTS[variant].0.to_owned(), curves.collect())
        })
        .collect();
    let page = Page {
        text: vec![
            format!("{} It is opaque and casts no shadow.", seen(&plan.subjects)),
            "Looks that are no scene file's are Marschner's model, read from tables.".into(),
        ],
        findings: findings(&samples, &names),
        tables: vec![table],
        pictures: vec![Picture {
            stem: "plot",
            caption: "Time of a frame for ever more strands.".into(),
            png: sheet::lines(&session.label(), "strands / 1000", "time / ms", &panels)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

/// Thousands of strands, ms.
fn curve(samples: &[Sample], subject: &str, variant: usize) -> Vec<[f64; 2]> {
    let of = samples.iter().filter(|s| s.subject == subject && s.variant == variant);
    of.map(|s| [f64::from(s.strands) / 1000.0, s.time.middle]).collect()
}

fn findings(samples: &[Sample], subjects: &[String]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for subject in subjects {
        let of = |variant: usize| samples.iter().filter(move |s| s.subject == *subject && s.variant == variant);
        let (Some(first), Some(last)) = (of(0).next(), of(0).next_back()) else { continue };
        if first.strands < last.strands {
            let [few, many] = [first, last].map(|s| format!("{} strands", grouped(s.strands.into())));
            findings.push(Finding::order_of(
                format!("{subject}, forward: more strands take longer"),
                &[(few.as_str(), first.time), (many.as_str(), last.time)],
            ));
        }
        let deferred = of(1).next_back().map_or(f64::NAN, |s| s.time.middle);
        findings.push(Finding::between(
            format!(
                "{subject}: deferred shading of opaque hair without shadows is a little slower (up to a quarter) than \
                 forward: deferred over forward"
            ),
            [1.0, 1.25],
            deferred / last.time.middle,
        ));
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_follow_from_the_samples() {
        let sample = |strands, variant, ms| {
            let time = Measured { middle: ms, least: 0.9 * ms, most: 1.1 * ms };
            Sample { subject: "curly".into(), strands, variant, time }
        };
        let mut samples =
            [sample(10_000, 0, 2.0), sample(10_000, 1, 2.5), sample(50_000, 0, 8.0), sample(50_000, 1, 6.0)];
        let subjects = ["curly".to_owned(), "absent".to_owned()];
        let told = |samples: &[Sample]| {
            let found = findings(samples, &subjects);
            found.iter().map(|f| (f.found.clone(), f.told())).collect::<Vec<_>>()
        };
        let order = |text: &str, verdict| (text.to_owned(), verdict);
        let rises = order("10,000 strands 2.00 < 50,000 strands 8.00", "reproduced");
        assert_eq!(told(&samples), [rises.clone(), order("0.750", "not reproduced")]);
        samples[3].time.middle = 10.0;
        assert_eq!(told(&samples), [rises, order("1.25", "reproduced")]);
        samples[3].time.middle = 6.0;
        // Repeats that overlap have no order.
        samples[2].time = Measured { middle: 2.2, least: 1.9, most: 2.5 };
        assert_eq!(told(&samples)[0].1, "within the spread");
        assert_eq!(curve(&samples, "curly", 1), [[10.0, 2.5], [50.0, 6.0]]);
    }
}
