//! Fig. 41: what transparency costs, without shadows and with three kinds of them.

use raster::{
    DepthShift, Filter, KPlusForm, Settings, Shading, ShadingTime, Shadow, ShadowTechnique, Sort, Transparency,
};

use crate::session::{Remarks, plain};
use crate::sheet;
use crate::subject::Pose;
use crate::{Error, Finding, Page, Picture, Session, Table};

/// Fragments that techniques with a fixed number keep; so many in the thesis.
pub(crate) const K: u32 = 8;

/// What is compared, and when each shades: techniques that keep fragments shade only those that matter, as in the
/// thesis.
pub(crate) fn techniques() -> Vec<(&'static str, Transparency, ShadingTime)> {
    use ShadingTime::{Deferred, Forward};
    vec![
        ("opaque", Transparency::Opaque, Forward),
        ("opaque, deferred", Transparency::Opaque, Deferred),
        ("weighted", Transparency::Weighted, Forward),
        ("blend", Transparency::Blend { sort: Sort::Strands }, Forward),
        ("subsets", Transparency::RandomSubsets { k: K }, Deferred),
        ("dbk", Transparency::Dbk { shift: DepthShift::default() }, Deferred),
        ("k-plus", Transparency::KPlus { k: K, form: KPlusForm::LockFree }, Deferred),
        ("a-buffer, 8", Transparency::ABuffer { foremost: Some(K) }, Deferred),
        ("a-buffer", Transparency::ABuffer { foremost: None }, Deferred),
    ]
}

const SHADOWS: [ShadowTechnique; 4] =
    [ShadowTechnique::None, ShadowTechnique::Map, ShadowTechnique::Adsm { spacing: None }, ShadowTechnique::DOM];

/// Settings of a technique with a shadow at the thesis's size and filter.
pub(crate) fn settings(transparency: Transparency, when: ShadingTime, technique: ShadowTechnique) -> Settings {
    let plain = plain();
    Settings {
        transparency,
        shading: Shading { when, ..plain.shading },
        shadow: Shadow { technique, resolution: 512, filter: Filter::Pcf3, ..plain.shadow },
        ..plain
    }
}

/// One measured combination.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    technique: &'static str,
    shadow: &'static str,
    ms: f64,
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let subject = plan.subject();
    session.step(&format!("growing {}", subject.name()), 0.0)?;
    let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
    let mut renderer = session.renderer(&prepared.scene, &prepared.settings(plain()))?;
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Time of a frame, all passes, and of that the technique's own; shadows at 512 texels with a 3x3 filter.",
        ["technique", "shadow", "ms", "own ms", "shadow ms", "least ms", "most ms", "fragments stored", "dropped"],
    );
    let mut samples = Vec::new();
    let techniques = techniques();
    let all = (techniques.len() * SHADOWS.len()) as f64;
    for (name, transparency, when) in &techniques {
        for shadow in SHADOWS {
            let what = format!("{name}, shadow {}", shadow.name());
            session.step(&what, samples.len() as f64 / all)?;
            let wanted = prepared.settings(settings(*transparency, *when, shadow));
            let cost = session.cost(&mut renderer, &wanted, &what, &mut remarks)?;
            let ms = cost.as_ref().map_or(f64::NAN, |cost| cost.ms);
            let [least, most] = cost.as_ref().map_or([f64::NAN; 2], |cost| cost.span);
            let [own, maps] =
                [transparency.name(), shadow.name()].map(|part| cost.as_ref().map_or(f64::NAN, |cost| cost.part(part)));
            let fragments = cost.map(|cost| cost.report.fragments).unwrap_or_default();
            table.row([
                (*name).into(),
                shadow.name().into(),
                ms.into(),
                own.into(),
                maps.into(),
                least.into(),
                most.into(),
                fragments.stored.into(),
                fragments.dropped.into(),
            ]);
            samples.push(Sample { technique: *name, shadow: shadow.name(), ms });
        }
    }
    let words: Vec<&str> = techniques.iter().map(|(name, ..)| *name).collect();
    let series: Vec<(String, Vec<f64>)> = SHADOWS
        .iter()
        .map(|shadow| {
            let values = words.iter().map(|word| time(&samples, word, shadow.name())).collect();
            (format!("shadow {}", shadow.name()), values)
        })
        .collect();
    let page = Page {
        text: vec![format!(
            "Groom {}, {} strands, seen from the side. Fibers are thinner than pixels, which is where transparency comes \
             from. Techniques that keep fragments shade when the picture is put together; the number of fragments is \
             {K} where there is one. The DBK-buffer finds its depth shift by itself; in the thesis it was set by hand \
             so that {K} fragments and more were stored. The K+-buffer is the one without locks.",
            subject.name(),
            prepared.strands
        )],
        findings: findings(&samples),
        tables: vec![table],
        pictures: vec![Picture {
            stem: "plot",
            caption: "Time of a frame by technique, for each kind of shadow.".into(),
            png: sheet::bars("", "time / ms", &words, &series)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

fn time(samples: &[Sample], technique: &str, shadow: &str) -> f64 {
    samples.iter().find(|s| s.technique == technique && s.shadow == shadow).map_or(f64::NAN, |s| s.ms)
}

fn findings(samples: &[Sample]) -> Vec<Finding> {
    let at = |technique: &str, shadow: &str| time(samples, technique, shadow);
    let order = |shadow: &str| {
        Finding::order(
            format!("shadow {shadow}: random subsets are fastest, then DBK, K+, and the A-buffer"),
            &[
                ("subsets", at("subsets", shadow)),
                ("dbk", at("dbk", shadow)),
                ("k-plus", at("k-plus", shadow)),
                ("a-buffer, 8", at("a-buffer, 8", shadow)),
            ],
        )
    };
    vec![
        order("none"),
        order("adsm"),
        order("dom"),
        // 91 and 50 frames a second.
        Finding::ratio("DOM: random subsets over DBK", 50.0 / 91.0, at("subsets", "dom") / at("dbk", "dom"), 0.25),
        // 125 and 58 frames a second.
        Finding::ratio("ADSM: random subsets over DBK", 58.0 / 125.0, at("subsets", "adsm") / at("dbk", "adsm"), 0.25),
        // 58 and 50 frames a second.
        Finding::ratio("DBK: DOM over ADSM", 58.0 / 50.0, at("dbk", "dom") / at("dbk", "adsm"), 0.15),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_settings_are_allowed_and_named_apart() {
        let techniques = techniques();
        for (_, transparency, when) in &techniques {
            for shadow in SHADOWS {
                settings(*transparency, *when, shadow).check().unwrap();
            }
        }
        let mut names: Vec<&str> = techniques.iter().map(|(name, ..)| *name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), techniques.len());
    }

    #[test]
    fn the_thesis_numbers_reproduce_the_thesis() {
        let times = [("subsets", [6.0, 8.0, 11.0]), ("dbk", [15.0, 17.2, 20.0]), ("k-plus", [40.0, 42.0, 45.0])];
        let mut samples: Vec<Sample> = Vec::new();
        for (technique, times) in times.into_iter().chain([("a-buffer, 8", [50.0, 52.0, 55.0])]) {
            let of = |(shadow, ms)| Sample { technique, shadow, ms };
            samples.extend(["none", "adsm", "dom"].into_iter().zip(times).map(of));
        }
        assert_eq!(Finding::tally(&findings(&samples)), "6 of 6");
        // Without the A-buffer no order is known; the ratios are.
        samples.retain(|sample| sample.technique != "a-buffer, 8");
        assert_eq!(Finding::tally(&findings(&samples)), "3 of 3");
    }
}
