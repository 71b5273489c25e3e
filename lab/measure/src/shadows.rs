//! Fig. 36: what shadows cost, by technique, size of the map and filter.

use raster::{Filter, Settings, Shading, ShadingTime, Shadow, ShadowTechnique};

use crate::session::{Remarks, plain};
use crate::sheet;
use crate::subject::Pose;
use crate::{Error, Finding, Page, Picture, Session, Table};

/// The thesis has no opacity shadow maps.
pub(crate) const TECHNIQUES: [ShadowTechnique; 4] =
    [ShadowTechnique::Map, ShadowTechnique::Adsm { spacing: None }, ShadowTechnique::Osm, ShadowTechnique::DOM];

pub(crate) const FILTERS: [Filter; 3] = [Filter::None, Filter::Pcf3, Filter::Pcf5];

/// One measured combination.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    technique: &'static str,
    resolution: u32,
    filter: Filter,
    when: ShadingTime,
    ms: f64,
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let resolutions: &[u32] = if plan.quick { &[128, 256, 512] } else { &[128, 256, 512, 1024] };
    // Deferred shading at the setting that the thesis names.
    let mut wanted: Vec<(ShadowTechnique, u32, Filter, ShadingTime)> =
        vec![(ShadowTechnique::None, 256, Filter::None, ShadingTime::Forward)];
    for technique in TECHNIQUES {
        for &resolution in resolutions {
            wanted.extend(FILTERS.map(|filter| (technique, resolution, filter, ShadingTime::Forward)));
        }
        wanted.push((technique, 256, Filter::Pcf3, ShadingTime::Deferred));
    }
    let subject = plan.subject();
    session.step(&format!("growing {}", subject.name()), 0.0)?;
    let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
    let mut renderer = session.renderer(&prepared.scene, &prepared.settings(plain()))?;
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Opaque: time of a frame, all passes, and of that the making of shadow maps.",
        ["technique", "size", "filter", "shading", "ms", "maps ms", "least ms", "most ms"],
    );
    let mut samples = Vec::with_capacity(wanted.len());
    for (i, &(technique, resolution, filter, when)) in wanted.iter().enumerate() {
        let name = technique.name();
        let shading = if when == ShadingTime::Forward { "forward" } else { "deferred" };
        let what = format!("{name} {resolution}, filter {}, {shading}", filter.name());
        session.step(&what, i as f64 / wanted.len() as f64)?;
        let plain = plain();
        let settings = prepared.settings(Settings {
            shading: Shading { when, ..plain.shading },
            shadow: Shadow { technique, resolution, filter, ..plain.shadow },
            ..plain
        });
        let cost = session.cost(&mut renderer, &settings, &what, &mut remarks)?;
        let (ms, [least, most]) = cost.as_ref().map_or((f64::NAN, [f64::NAN; 2]), |cost| (cost.ms, cost.span));
        let maps = cost.as_ref().map_or(f64::NAN, |cost| cost.part(name));
        table.row([
            name.into(),
            resolution.into(),
            filter.name().into(),
            shading.into(),
            ms.into(),
            maps.into(),
            least.into(),
            most.into(),
        ]);
        samples.push(Sample { technique: name, resolution, filter, when, ms });
    }
    let panels: Vec<(String, Vec<sheet::Curve>)> = FILTERS
        .iter()
        .map(|&filter| {
            let curve = |technique: &ShadowTechnique| {
                let name = technique.name();
                let of = |resolution: &u32| [f64::from(*resolution), time(&samples, name, *resolution, filter)];
                (name.to_owned(), resolutions.iter().map(of).collect())
            };
            (format!("filter {}", filter.name()), TECHNIQUES.iter().map(curve).collect())
        })
        .collect();
    let page = Page {
        text: vec![format!(
            "Groom {}, {} strands, opaque, seen from the side; one light. The thesis has no opacity shadow maps (osm).",
            subject.name(),
            prepared.strands
        )],
        findings: findings(&samples),
        tables: vec![table],
        pictures: vec![Picture {
            stem: "plot",
            caption: "Time of a frame by technique and size of the map, for each filter.".into(),
            png: sheet::lines("", "texels a side", "time / ms", &panels)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

fn time(samples: &[Sample], technique: &str, resolution: u32, filter: Filter) -> f64 {
    time_when(samples, technique, resolution, filter, ShadingTime::Forward)
}

fn time_when(samples: &[Sample], technique: &str, resolution: u32, filter: Filter, when: ShadingTime) -> f64 {
    let is_meant =
        |s: &&Sample| s.technique == technique && s.resolution == resolution && s.filter == filter && s.when == when;
    samples.iter().find(is_meant).map_or(f64::NAN, |s| s.ms)
}

fn findings(samples: &[Sample]) -> Vec<Finding> {
    let at = |technique: &str, resolution, filter| time(samples, technique, resolution, filter);
    let deferred = time_when(samples, "dom", 256, Filter::Pcf3, ShadingTime::Deferred);
    let size = at("dom", 512, Filter::None) / at("dom", 128, Filter::None);
    let filter = at("dom", 256, Filter::Pcf5) / at("dom", 256, Filter::None);
    vec![
        Finding::order(
            "256 texels, 3x3: ADSM costs hardly more than SM, DOM the most",
            &[
                ("sm", at("sm", 256, Filter::Pcf3)),
                ("adsm", at("adsm", 256, Filter::Pcf3)),
                ("dom", at("dom", 256, Filter::Pcf3)),
            ],
        ),
        Finding::ratio(
            "512 texels, 5x5: ADSM over SM",
            1.05,
            at("adsm", 512, Filter::Pcf5) / at("sm", 512, Filter::Pcf5),
            0.15,
        ),
        // 6.3 ms and 3.3 ms.
        Finding::ratio(
            "256 texels, 3x3: DOM over ADSM",
            6.3 / 3.3,
            at("dom", 256, Filter::Pcf3) / at("adsm", 256, Filter::Pcf3),
            0.25,
        ),
        // 6.3 ms and 5.0 ms.
        Finding::ratio(
            "DOM, 256 texels, 3x3: forward over deferred",
            6.3 / 5.0,
            at("dom", 256, Filter::Pcf3) / deferred,
            0.2,
        ),
        Finding::order(
            "DOM: four times the side of the map costs more than a 5x5 filter",
            &[("filter", filter), ("size", size)],
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_numbers_reproduce_the_thesis() {
        let sample = |technique, resolution, filter, ms| Sample {
            technique,
            resolution,
            filter,
            when: ShadingTime::Forward,
            ms,
        };
        let mut samples = vec![
            sample("sm", 256, Filter::Pcf3, 3.2),
            sample("adsm", 256, Filter::Pcf3, 3.3),
            sample("dom", 256, Filter::Pcf3, 6.3),
            sample("sm", 512, Filter::Pcf5, 4.0),
            sample("adsm", 512, Filter::Pcf5, 4.2),
            sample("dom", 512, Filter::None, 9.0),
            sample("dom", 128, Filter::None, 4.0),
            sample("dom", 256, Filter::Pcf5, 7.0),
            sample("dom", 256, Filter::None, 5.5),
            Sample { when: ShadingTime::Deferred, ..sample("dom", 256, Filter::Pcf3, 5.0) },
        ];
        assert_eq!(Finding::tally(&findings(&samples)), "5 of 5");
        // A map that costs more than the opacity map, and one that was not measured.
        samples[0].ms = 7.0;
        samples.remove(9);
        assert_eq!(Finding::tally(&findings(&samples)), "3 of 4");
    }
}
