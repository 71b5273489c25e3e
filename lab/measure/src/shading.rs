//! Fig. 33: what shading costs, for ever more strands of three grooms, opaque and without shadows.

use raster::{Geometry, Settings, Shading, ShadingTime, Shape};

use crate::session::{Remarks, plain};
use crate::sheet;
use crate::subject::Pose;
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
    ms: f64,
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let variants = if plan.quick { 2 } else { VARIANTS.len() };
    let mut counts = plan.strands.clone();
    counts.sort_unstable();
    counts.dedup();
    if plan.quick && counts.len() > 2 {
        counts = vec![counts[0], counts[counts.len() - 1]];
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
            let mut renderer = session.renderer(&prepared.scene, &settings(0))?;
            for (variant, (told, ..)) in VARIANTS.iter().enumerate().take(variants) {
                let what = format!("{name}, {last} strands, {told}");
                session.step(&what, table.rows.len() as f64 / all)?;
                let cost = session.cost(&mut renderer, &settings(variant), &what, &mut remarks)?;
                let (ms, [least, most]) = cost.map_or((f64::NAN, [f64::NAN; 2]), |cost| (cost.ms, cost.span));
                table.row([
                    name.clone().into(),
                    last.into(),
                    points.into(),
                    (*told).into(),
                    ms.into(),
                    least.into(),
                    most.into(),
                ]);
                samples.push(Sample { subject: name.clone(), strands: last, variant, ms });
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
            "Hair is opaque, lit by one light and casts no shadow; it is shaded by Marschner's model from tables. The \
             camera stands at the side and frames the hair."
                .into(),
        ],
        findings: findings(&samples, &names),
        tables: vec![table],
        pictures: vec![Picture {
            stem: "plot",
            caption: "Time of a frame for ever more strands.".into(),
            png: sheet::lines("", "strands / 1000", "time / ms", &panels)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

/// Thousands of strands, ms.
fn curve(samples: &[Sample], subject: &str, variant: usize) -> Vec<[f64; 2]> {
    let of = samples.iter().filter(|s| s.subject == subject && s.variant == variant);
    of.map(|s| [f64::from(s.strands) / 1000.0, s.ms]).collect()
}

fn findings(samples: &[Sample], subjects: &[String]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for subject in subjects {
        let forward = curve(samples, subject, 0);
        let [Some(first), Some(last)] = [forward.first(), forward.last()] else { continue };
        if forward.len() > 1 {
            findings.push(Finding::above(
                format!("{subject}: more strands take longer ({} thousand over {} thousand)", last[0], first[0]),
                1.0,
                last[1] / first[1],
            ));
        }
        let deferred = curve(samples, subject, 1).last().map_or(f64::NAN, |point| point[1]);
        findings.push(Finding::above(
            format!("{subject}: deferred shading of opaque hair without shadows is a little slower than forward"),
            1.0,
            deferred / last[1],
        ));
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_follow_from_the_samples() {
        let sample = |strands, variant, ms| Sample { subject: "curly".into(), strands, variant, ms };
        let samples = [sample(10_000, 0, 2.0), sample(10_000, 1, 2.5), sample(50_000, 0, 8.0), sample(50_000, 1, 6.0)];
        let found = findings(&samples, &["curly".into(), "absent".into()]);
        let told: Vec<(&str, Option<bool>)> = found.iter().map(|f| (f.found.as_str(), f.agrees)).collect();
        assert_eq!(told, [("4.00", Some(true)), ("0.750", Some(false))]);
        assert!(found[0].claim.contains("50 thousand over 10 thousand"), "{}", found[0].claim);
        assert_eq!(curve(&samples, "curly", 1), [[10.0, 2.5], [50.0, 6.0]]);
    }
}
