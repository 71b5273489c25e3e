//! Fig. 36: what shadows cost, by technique, size of the map and filter.

use raster::{Filter, Settings, Shading, ShadingTime, Shadow, ShadowTechnique};

use crate::finding::Measured;
use crate::session::{Remarks, judged, plain, times};
use crate::sheet;
use crate::subject::{Pose, seen};
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
    time: Measured,
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let resolutions: &[u32] = if plan.quick { &[256, 512] } else { &[128, 256, 512, 1024, 2048] };
    // Deferred shading at the setting that the thesis names.
    let mut wanted: Vec<(ShadowTechnique, u32, Filter, ShadingTime)> =
        vec![(ShadowTechnique::None, 256, Filter::None, ShadingTime::Forward)];
    for technique in TECHNIQUES {
        // What the thesis does not have need not be had in all forms in a hurry.
        let few = plan.quick && technique == ShadowTechnique::Osm;
        for &resolution in resolutions {
            let filters = FILTERS.iter().filter(|filter| !few || **filter == Filter::Pcf3);
            wanted.extend(filters.map(|filter| (technique, resolution, *filter, ShadingTime::Forward)));
        }
        wanted.push((technique, 256, Filter::Pcf3, ShadingTime::Deferred));
    }
    let subject = plan.subject();
    session.step(&format!("growing {}", subject.name()), 0.0)?;
    let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
    let mut bench = session.bench(&prepared.scene);
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
        let cost = session.cost(&mut bench, &settings, &what, &mut remarks)?;
        let Measured { middle: ms, least, most } = times(cost.as_ref());
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
        samples.push(Sample { technique: name, resolution, filter, when, time: judged(cost.as_ref()) });
    }
    let panels: Vec<(String, Vec<sheet::Curve>)> = FILTERS
        .iter()
        .map(|&filter| {
            let curve = |technique: &ShadowTechnique| {
                let name = technique.name();
                let of = |resolution: &u32| [f64::from(*resolution), time(&samples, name, *resolution, filter).middle];
                (name.to_owned(), resolutions.iter().map(of).collect())
            };
            (format!("filter {}", filter.name()), TECHNIQUES.iter().map(curve).collect())
        })
        .collect();
    let page = Page {
        text: vec![format!(
            "Groom {}, {} strands, opaque. {} The thesis has no opacity shadow maps (osm), and no maps of more than 512 \
             texels.",
            subject.name(),
            prepared.strands,
            seen(std::slice::from_ref(subject))
        )],
        findings: findings(&samples, resolutions[0]),
        tables: vec![table],
        pictures: vec![Picture {
            stem: "plot",
            caption: "Time of a frame by technique and size of the map, for each filter.".into(),
            png: sheet::lines(&session.label(), "texels a side", "time / ms", &panels)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

fn time(samples: &[Sample], technique: &str, resolution: u32, filter: Filter) -> Measured {
    time_when(samples, technique, resolution, filter, ShadingTime::Forward)
}

fn time_when(samples: &[Sample], technique: &str, resolution: u32, filter: Filter, when: ShadingTime) -> Measured {
    let is_meant =
        |s: &&Sample| s.technique == technique && s.resolution == resolution && s.filter == filter && s.when == when;
    samples.iter().find(is_meant).map_or(Measured::UNKNOWN, |s| s.time)
}

/// `least` is the smallest map that was drawn.
fn findings(samples: &[Sample], least: u32) -> Vec<Finding> {
    let at = |technique: &str, resolution, filter| time(samples, technique, resolution, filter);
    let over = |a: Measured, b: Measured| a.over(b).middle;
    let speedup = |technique: &str| {
        let deferred = time_when(samples, technique, 256, Filter::Pcf3, ShadingTime::Deferred);
        over(at(technique, 256, Filter::Pcf3), deferred)
    };
    let size = at("dom", 512, Filter::None).over(at("dom", least, Filter::None));
    let filter = at("dom", 256, Filter::Pcf5).over(at("dom", 256, Filter::None));
    let no_help = |name: &str, technique: &str| {
        Finding::below(
            format!(
                "{name}, 256 texels, 3x3: deferred shading is no great help (less than 15 %): forward over deferred"
            ),
            1.15,
            speedup(technique),
        )
    };
    vec![
        Finding::ratio(
            "256 texels, 3x3: ADSM costs hardly more than SM: ADSM over SM",
            1.0,
            over(at("adsm", 256, Filter::Pcf3), at("sm", 256, Filter::Pcf3)),
            0.15,
        ),
        Finding::order_of(
            "256 texels, 3x3: DOM costs more than SM",
            &[("sm", at("sm", 256, Filter::Pcf3)), ("dom", at("dom", 256, Filter::Pcf3))],
        ),
        Finding::order_of(
            "256 texels, 3x3: DOM costs more than ADSM",
            &[("adsm", at("adsm", 256, Filter::Pcf3)), ("dom", at("dom", 256, Filter::Pcf3))],
        ),
        Finding::ratio(
            "512 texels, 5x5: ADSM over SM",
            1.05,
            over(at("adsm", 512, Filter::Pcf5), at("sm", 512, Filter::Pcf5)),
            0.15,
        ),
        // 6.3 ms and 3.3 ms.
        Finding::ratio(
            "256 texels, 3x3: DOM over ADSM",
            6.3 / 3.3,
            over(at("dom", 256, Filter::Pcf3), at("adsm", 256, Filter::Pcf3)),
            0.25,
        ),
        // 6.3 ms and 5.0 ms.
        Finding::ratio("DOM, 256 texels, 3x3: forward over deferred", 6.3 / 5.0, speedup("dom"), 0.2),
        no_help("SM", "sm"),
        no_help("ADSM", "adsm"),
        Finding::order_of(
            format!(
                "DOM: the size of the map counts most: 512 over {least} texels is more than 5x5 over one texel at 256"
            ),
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
            time: Measured::exact(ms),
        };
        let deferred =
            |technique, ms| Sample { when: ShadingTime::Deferred, ..sample(technique, 256, Filter::Pcf3, ms) };
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
            deferred("sm", 3.3),
            deferred("adsm", 3.3),
            deferred("dom", 5.0),
        ];
        assert_eq!(Finding::tally(&findings(&samples, 128)), "9 of 9");
        // A map that costs more than the opacity map and is shaded twice as fast when deferred: three sentences less.
        samples[0].time = Measured::exact(7.0);
        assert_eq!(Finding::tally(&findings(&samples, 128)), "6 of 9");
        // And one that was not measured.
        samples.truncate(11);
        assert_eq!(Finding::tally(&findings(&samples, 128)), "5 of 8");
        // Times that differ from repeat to repeat by more than from technique to technique have no order.
        samples[1].time = Measured { middle: 3.3, least: 2.0, most: 6.5 };
        let told: Vec<&str> = findings(&samples, 128).iter().map(Finding::told).collect();
        assert_eq!(told[2], "within the spread");
    }
}
