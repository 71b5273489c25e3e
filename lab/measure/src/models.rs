//! Figs. 29 to 32 and 46: shading models, and what they cost.

use film::{Image, View};
use raster::{DepthShift, Kind, Settings, Shading, ShadingSource, ShadingTime, ShadowTechnique, Transparency};

use crate::finding::Measured;
use crate::session::{Remarks, compared, plain, times};
use crate::sheet::{exposure, sheet};
use crate::subject::Pose;
use crate::transparency::settings;
use crate::{Error, Finding, Page, Picture, Session, Table};

/// Those that the thesis has come first.
const KINDS: [Kind; 5] = [Kind::KajiyaKay, Kind::Marschner, Kind::Sadeghi, Kind::Deon, Kind::Chiang];

/// One model, one way to evaluate it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    model: &'static str,
    tables: bool,
    /// Time of an opaque frame without shadow, ms.
    ms: f64,
}

fn of(kind: Kind, source: ShadingSource, base: Settings) -> Settings {
    Settings { shading: Shading { model: Some(kind), source, ..base.shading }, ..base }
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let subject = plan.subject();
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Opaque, no shadow: time of a frame. FLIP: tables against the model itself, in the picture below.",
        ["model", "source", "ms", "least ms", "most ms", "FLIP to direct"],
    );
    let mut samples = Vec::new();
    let mut pictures = Vec::new();
    let mut strands = 0;
    // A scene file has its own camera and lights: there is nothing to turn.
    let own_lights = subject.is_scene();
    let transparent =
        settings(Transparency::Dbk { shift: DepthShift::default() }, ShadingTime::Deferred, ShadowTechnique::DOM);
    let mut poses = vec![if own_lights {
        (Pose::FRONT, "front", "Transparent, with deep opacity maps.")
    } else {
        (Pose::FRONT, "front", "Lit from the front: transparent, with deep opacity maps.")
    }];
    if !own_lights {
        poses.push((Pose::BACKLIT, "back", "Lit from behind, and weakly from the front."));
    }
    let share = 1.0 / poses.len() as f64;
    for (place, (pose, stem, caption)) in poses.into_iter().enumerate() {
        session.step(&format!("growing {}", subject.name()), share * place as f64)?;
        let prepared = subject.prepared(plan.most(), pose, plan.size)?;
        strands = prepared.strands;
        let mut bench = session.bench(&prepared.scene);
        let mut shots: Vec<(String, Image)> = Vec::new();
        for (i, kind) in KINDS.into_iter().enumerate() {
            let name = kind.name();
            session.step(&format!("{stem}: {name}"), share * (place as f64 + i as f64 / KINDS.len() as f64))?;
            let mut shot = |source| {
                let wanted = prepared.settings(of(kind, source, transparent));
                let drawn = session.picture(&mut bench, &wanted, &format!("{stem}, {name}"), &mut remarks)?;
                Ok::<_, Error>(drawn.map(|(image, _)| image))
            };
            let by_tables = shot(ShadingSource::Tables)?;
            // Costs and the tables' error are taken once, in the first light.
            if place == 0 {
                let direct = shot(ShadingSource::Direct)?;
                let comparison = match (&by_tables, &direct) {
                    (Some(test), Some(reference)) => {
                        compared(test, reference, exposure(reference), &format!("{name}, tables"), &mut remarks)?
                    }
                    _ => None,
                };
                let flip = comparison.and_then(|comparison| comparison.flip).map(f64::from);
                for (source, word) in [(ShadingSource::Tables, "tables"), (ShadingSource::Direct, "direct")] {
                    let wanted = prepared.settings(of(kind, source, plain()));
                    let cost = session.cost(&mut bench, &wanted, &format!("{name}, {word}"), &mut remarks)?;
                    let Measured { middle: ms, least, most } = times(cost.as_ref());
                    let tables = source == ShadingSource::Tables;
                    let flip = flip.filter(|_| tables);
                    table.row([name.into(), word.into(), ms.into(), least.into(), most.into(), flip.into()]);
                    samples.push(Sample { model: name, tables, ms });
                }
            }
            if let Some(image) = by_tables {
                shots.push((name.to_owned(), image));
            }
        }
        if let Some((_, first)) = shots.first() {
            let png = sheet(&shots, 3, exposure(first), View::Srgb)?;
            pictures.push(Picture { stem, caption: caption.into(), png });
        }
    }
    let page = Page {
        text: vec![format!(
            "Groom {}, {strands} strands. {}; other models have the parameters that come nearest to that. Models without tables \
             are evaluated directly in both rows.",
            subject.name(),
            if own_lights {
                "Camera, lights and looks are those of the scene file, which is seen in one way only"
            } else {
                "The look is Marschner's"
            }
        )],
        findings: findings(&samples),
        tables: vec![table],
        pictures,
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

fn findings(samples: &[Sample]) -> Vec<Finding> {
    let thesis = ["kajiya_kay", "marschner", "sadeghi"];
    let times: Vec<f64> = samples.iter().filter(|s| s.tables && thesis.contains(&s.model)).map(|s| s.ms).collect();
    let known = times.len() == thesis.len() && times.iter().all(|ms| ms.is_finite());
    let (least, most) = times.iter().fold((f64::INFINITY, 0.0_f64), |(least, most), &ms| (least.min(ms), most.max(ms)));
    let ratio = if known { most / least } else { f64::NAN };
    // The thesis has no number for it.
    vec![Finding::below("the three models of the thesis cost nearly the same: slowest over fastest", 1.2, ratio).ours()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_compared_by_their_tables() {
        let sample = |model, tables, ms| Sample { model, tables, ms };
        let mut samples = vec![
            sample("kajiya_kay", true, 4.0),
            sample("marschner", true, 4.4),
            sample("marschner", false, 40.0),
            sample("sadeghi", true, 4.2),
            sample("deon", true, 9.0),
        ];
        let found = findings(&samples);
        assert_eq!((found[0].found.as_str(), found[0].told()), ("1.10", "met"));
        samples.remove(3);
        assert_eq!(findings(&samples)[0].told(), "not measured");
        for kind in KINDS {
            of(kind, ShadingSource::Direct, plain()).check().unwrap();
        }
    }
}
