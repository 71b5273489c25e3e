//! Fig. 41: what transparency costs, without shadows and with three kinds of them.

use raster::{
    DepthShift, Filter, KPlusForm, Settings, Shading, ShadingTime, Shadow, ShadowTechnique, Sort, Transparency,
};

use crate::finding::Measured;
use crate::session::{Cost, Remarks, judged, plain, times};
use crate::sheet;
use crate::subject::{Pose, seen};
use crate::table::grouped;
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
        ("k-plus, array", Transparency::KPlus { k: K, form: KPlusForm::MaxArray }, Deferred),
        ("k-plus, heap", Transparency::KPlus { k: K, form: KPlusForm::MaxHeap }, Deferred),
        ("a-buffer, 8", Transparency::ABuffer { foremost: Some(K) }, Deferred),
        ("a-buffer", Transparency::ABuffer { foremost: None }, Deferred),
    ]
}

const SHADOWS: [ShadowTechnique; 4] =
    [ShadowTechnique::None, ShadowTechnique::Map, ShadowTechnique::Adsm { spacing: None }, ShadowTechnique::DOM];

/// The shadows that a technique is measured with: in a hurry those of findings, and only for what they name.
fn shadows(technique: &str, quick: bool) -> Vec<ShadowTechnique> {
    let findings = ["subsets", "dbk", "k-plus", "a-buffer, 8"].contains(&technique);
    let mut shadows = SHADOWS.to_vec();
    shadows
        .retain(|shadow| !quick || *shadow == ShadowTechnique::None || (findings && *shadow != ShadowTechnique::Map));
    shadows
}

/// Our own aim on a graphics card: this many strands at this size, and more frames a second than that.
const AIM: (u32, [u32; 2], f64) = (50_000, [1920, 1080], 240.0);

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
    time: Measured,
}

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let subject = plan.subject();
    session.step(&format!("growing {}", subject.name()), 0.0)?;
    let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
    let mut bench = session.bench(&prepared.scene);
    let mut remarks = Remarks::default();
    let mut table = Table::new(
        "Time of a frame, all passes, and of that the technique's own; shadows at 512 texels with a 3x3 filter. Wall is \
         from the first command to the last result, with what the CPU does, sorting for one; frames a second are those \
         of the wall.",
        [
            "technique",
            "shadow",
            "ms",
            "own ms",
            "shadow ms",
            "least ms",
            "most ms",
            "wall ms",
            "frames/s",
            "fragments stored",
            "dropped",
        ],
    );
    let mut samples = Vec::new();
    let techniques = techniques();
    let all: usize = techniques.iter().map(|(name, ..)| shadows(name, plan.quick).len()).sum();
    for (name, transparency, when) in &techniques {
        for shadow in shadows(name, plan.quick) {
            let what = format!("{name}, shadow {}", shadow.name());
            session.step(&what, samples.len() as f64 / (all + 1) as f64)?;
            let wanted = prepared.settings(settings(*transparency, *when, shadow));
            let cost = session.cost(&mut bench, &wanted, &what, &mut remarks)?;
            let Measured { middle: ms, least, most } = times(cost.as_ref());
            let [own, maps] =
                [transparency.name(), shadow.name()].map(|part| cost.as_ref().map_or(f64::NAN, |cost| cost.part(part)));
            let fragments = cost.as_ref().map(|cost| cost.report.fragments);
            let wall = wall_ms(cost.as_ref());
            table.row([
                (*name).into(),
                shadow.name().into(),
                ms.into(),
                own.into(),
                maps.into(),
                least.into(),
                most.into(),
                wall.into(),
                (1000.0 / wall).into(),
                fragments.map(|fragments| fragments.stored).into(),
                fragments.map(|fragments| fragments.dropped).into(),
            ]);
            samples.push(Sample { technique: name, shadow: shadow.name(), time: judged(cost.as_ref()) });
        }
    }
    drop(bench);
    let (aim, frames) = aim(session, &mut remarks)?;
    let words: Vec<&str> = techniques.iter().map(|(name, ..)| *name).collect();
    let series: Vec<(String, Vec<f64>)> = SHADOWS
        .iter()
        .map(|shadow| {
            let values = words.iter().map(|word| time(&samples, word, shadow.name()).middle).collect();
            (format!("shadow {}", shadow.name()), values)
        })
        .collect();
    let page = Page {
        text: vec![format!(
            "Groom {}, {} strands. {} Fibers are thinner than pixels, which is where transparency comes \
             from. Techniques that keep fragments shade when the picture is put together; the number of fragments is \
             {K} where there is one. The DBK-buffer finds its depth shift by itself; in the thesis it was set by hand \
             so that {K} fragments and more were stored. `k-plus` is the form without locks; `array` and `heap` have a \
             semaphore for each pixel, and may lose fragments.",
            subject.name(),
            prepared.strands,
            seen(std::slice::from_ref(subject))
        )],
        findings: findings(&samples, frames),
        tables: std::iter::once(table).chain(aim).collect(),
        pictures: vec![Picture {
            stem: "plot",
            caption: "Time of a frame by technique, for each kind of shadow.".into(),
            png: sheet::bars(&session.label(), "time / ms", &words, &series)?,
        }],
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

/// Wall time of a frame; NaN where nothing was measured.
fn wall_ms(cost: Option<&Cost>) -> f64 {
    cost.map_or(f64::NAN, |cost| cost.wall.middle)
}

/// Our own aim, measured on graphics cards alone: its table, and frames a second of the wall, NaN where there are none.
fn aim(session: &Session<'_>, remarks: &mut Remarks) -> Result<(Option<Table>, f64), Error> {
    let (strands, size, _) = AIM;
    if session.adapter().software {
        return Ok((None, f64::NAN));
    }
    let [width, height] = size;
    let what = format!("dbk, shadow dom, {width} x {height}");
    session.step(&what, 1.0)?;
    let prepared = session.plan().subject().prepared(strands, Pose::SIDE, size)?;
    let dbk = Transparency::Dbk { shift: DepthShift::default() };
    let wanted = prepared.settings(settings(dbk, ShadingTime::Deferred, ShadowTechnique::DOM));
    let cost = session.cost_at(&mut session.bench(&prepared.scene), &wanted, size, &what, remarks)?;
    let ms = times(cost.as_ref()).middle;
    let wall = wall_ms(cost.as_ref());
    let mut table = Table::new(
        "Our aim: DBK-buffer, deep opacity maps of 512 texels, 3x3 filter.",
        ["strands", "width", "height", "ms", "wall ms", "frames/s of the device", "frames/s of the wall"],
    );
    table.row([
        prepared.strands.into(),
        width.into(),
        height.into(),
        ms.into(),
        wall.into(),
        (1000.0 / ms).into(),
        (1000.0 / wall).into(),
    ]);
    // A file with fewer strands is easier.
    Ok((Some(table), if prepared.strands == strands { 1000.0 / wall } else { f64::NAN }))
}

fn time(samples: &[Sample], technique: &str, shadow: &str) -> Measured {
    samples.iter().find(|s| s.technique == technique && s.shadow == shadow).map_or(Measured::UNKNOWN, |s| s.time)
}

fn findings(samples: &[Sample], frames: f64) -> Vec<Finding> {
    let at = |technique: &str, shadow: &str| time(samples, technique, shadow);
    let over = |a: Measured, b: Measured| a.over(b).middle;
    let order = |shadow: &str| {
        Finding::order_of(
            format!("shadow {shadow}: random subsets are fastest, then DBK, K+, and the A-buffer"),
            &[
                ("subsets", at("subsets", shadow)),
                ("dbk", at("dbk", shadow)),
                ("k-plus", at("k-plus", shadow)),
                ("a-buffer, 8", at("a-buffer, 8", shadow)),
            ],
        )
    };
    let (strands, [width, height], least) = AIM;
    vec![
        order("none"),
        order("adsm"),
        order("dom"),
        // 91 and 50 frames a second.
        Finding::ratio("DOM: random subsets over DBK", 50.0 / 91.0, over(at("subsets", "dom"), at("dbk", "dom")), 0.25),
        // 125 and 58 frames a second.
        Finding::ratio(
            "ADSM: random subsets over DBK",
            58.0 / 125.0,
            over(at("subsets", "adsm"), at("dbk", "adsm")),
            0.25,
        ),
        // 58 and 50 frames a second.
        Finding::ratio("DBK: DOM over ADSM", 58.0 / 50.0, over(at("dbk", "dom"), at("dbk", "adsm")), 0.15),
        Finding::above(
            format!(
                "on a graphics card, {} strands, DOM 512 with 3x3, DBK, {width} x {height} pixels: frames a second",
                grouped(strands.into())
            ),
            least,
            frames,
        )
        .ours(),
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
        // All that findings need is measured in a hurry, too.
        for name in ["subsets", "dbk", "k-plus", "a-buffer, 8"] {
            assert!(names.contains(&name), "{name}");
            let quick: Vec<&str> = shadows(name, true).iter().map(ShadowTechnique::name).collect();
            assert_eq!((quick, shadows(name, false).len()), (vec!["none", "adsm", "dom"], SHADOWS.len()));
        }
        assert_eq!(shadows("k-plus, heap", true), [ShadowTechnique::None]);
    }

    #[test]
    fn the_thesis_numbers_reproduce_the_thesis() {
        let times = [("subsets", [6.0, 8.0, 11.0]), ("dbk", [15.0, 17.2, 20.0]), ("k-plus", [40.0, 42.0, 45.0])];
        let mut samples: Vec<Sample> = Vec::new();
        for (technique, times) in times.into_iter().chain([("a-buffer, 8", [50.0, 52.0, 55.0])]) {
            let of = |(shadow, ms)| Sample { technique, shadow, time: Measured::exact(ms) };
            samples.extend(["none", "adsm", "dom"].into_iter().zip(times).map(of));
        }
        assert_eq!(Finding::tally(&findings(&samples, f64::NAN)), "6 of 6");
        // Without the A-buffer no order is known; the ratios are.
        samples.retain(|sample| sample.technique != "a-buffer, 8");
        assert_eq!(Finding::tally(&findings(&samples, f64::NAN)), "3 of 3");
        // Our aim is none of the thesis's findings.
        for (frames, told) in [(f64::NAN, "-"), (239.0, "0 of 1"), (241.0, "1 of 1")] {
            assert_eq!(Finding::aims(&findings(&samples, frames)), told, "{frames}");
        }
    }
}
