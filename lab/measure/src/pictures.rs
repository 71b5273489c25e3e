//! Figs. 34, 37, 38, 40 and 47: the same hair by every technique.

use film::{Image, View};
use raster::{DepthShift, Filter, KPlusForm, Settings, ShadingTime, Shadow, ShadowTechnique, Sort, Transparency};

use crate::session::{Remarks, compared};
use crate::sheet::{exposure, roughness, sheet};
use crate::subject::{Pose, seen};
use crate::transparency::{K, settings};
use crate::{Error, Finding, Page, Picture, Session, Table};

/// Blending that hides nothing of the shadows: lists, sorted.
const SORTED: Transparency = Transparency::ABuffer { foremost: None };

/// A row of pictures as it is asked for.
struct Series {
    stem: &'static str,
    caption: &'static str,
    columns: usize,
    shots: Vec<(String, Settings)>,
}

fn shadowed(technique: ShadowTechnique, resolution: u32, filter: Filter) -> Settings {
    let settings = settings(SORTED, ShadingTime::Forward, technique);
    Settings { shadow: Shadow { resolution, filter, ..settings.shadow }, ..settings }
}

/// A weaker shadow by the means that the technique has: a shadow map knows no opacity of a fiber.
fn weaker(technique: ShadowTechnique) -> (String, Settings) {
    let settings = shadowed(technique, 512, Filter::Pcf5);
    let (word, shadow) = match technique {
        ShadowTechnique::Map => ("strength 0.6", Shadow { strength: 0.6, ..settings.shadow }),
        _ => ("half the alpha", Shadow { alpha: 0.5 * Shadow::PHYSICAL_ALPHA, ..settings.shadow }),
    };
    (format!("{}, 5x5, {word}", technique.name()), Settings { shadow, ..settings })
}

fn transparent(transparency: Transparency, when: ShadingTime) -> Settings {
    settings(transparency, when, ShadowTechnique::DOM)
}

fn series() -> Vec<Series> {
    let fig34 = [128, 256, 512]
        .map(|size| (format!("DOM, {size}"), shadowed(ShadowTechnique::DOM, size, Filter::Pcf3)))
        .to_vec();
    let mut fig37 = Vec::new();
    for technique in [ShadowTechnique::Map, ShadowTechnique::Adsm { spacing: None }, ShadowTechnique::DOM] {
        let name = technique.name();
        fig37.push((format!("{name}, one texel"), shadowed(technique, 512, Filter::None)));
        fig37.push((format!("{name}, 5x5"), shadowed(technique, 512, Filter::Pcf5)));
        fig37.push(weaker(technique));
    }
    let opaque = transparent(Transparency::Opaque, ShadingTime::Forward);
    let sorted = transparent(SORTED, ShadingTime::Forward);
    let subsets = transparent(Transparency::RandomSubsets { k: K }, ShadingTime::Deferred);
    let fig40 = vec![
        ("blend".to_owned(), transparent(Transparency::Blend { sort: Sort::Strands }, ShadingTime::Forward)),
        ("a-buffer".to_owned(), sorted),
        (
            "k-plus, 16".to_owned(),
            transparent(Transparency::KPlus { k: 16, form: KPlusForm::LockFree }, ShadingTime::Forward),
        ),
        ("dbk".to_owned(), transparent(Transparency::Dbk { shift: DepthShift::default() }, ShadingTime::Forward)),
        ("subsets".to_owned(), subsets),
    ];
    vec![
        Series {
            stem: "fig34",
            caption: "Fig. 34: deep opacity maps of 128, 256 and 512 texels a side, 3x3 filter.",
            columns: 3,
            shots: fig34,
        },
        Series {
            stem: "fig37",
            caption: "Fig. 37: shadow map, approximated deep shadow map, deep opacity map; one texel, 5x5, and a weaker \
                      shadow: of the shadow map by its strength, of the others by the opacity of a fiber.",
            columns: 3,
            shots: fig37,
        },
        Series {
            stem: "fig38",
            caption: "Fig. 38: opaque and transparent hair.",
            columns: 2,
            shots: vec![("opaque".to_owned(), opaque), ("transparent".to_owned(), sorted)],
        },
        Series {
            stem: "fig40",
            caption: "Fig. 40: sorted strands blended, the techniques that keep fragments, and random subsets.",
            columns: 3,
            shots: fig40,
        },
        Series {
            stem: "fig47",
            caption: "Fig. 47: what eight random subsets come to, and one, two and four.",
            columns: 4,
            shots: [1, 2, 4, K]
                .map(|k| {
                    (format!("{k} subsets"), transparent(Transparency::RandomSubsets { k }, ShadingTime::Deferred))
                })
                .to_vec(),
        },
    ]
}

/// Pictures under their names.
type Shots = Vec<(String, Image)>;

pub(crate) fn run(session: &Session<'_>) -> Result<Page, Error> {
    let plan = session.plan();
    let subject = plan.subject();
    session.step(&format!("growing {}", subject.name()), 0.0)?;
    let prepared = subject.prepared(plan.most(), Pose::SIDE, plan.size)?;
    let mut bench = session.bench(&prepared.scene);
    let mut remarks = Remarks::default();
    let all = series();
    let count: usize = all.iter().map(|series| series.shots.len()).sum();
    // One exposure for all pictures: that of hair without shadows.
    let bright = prepared.settings(settings(SORTED, ShadingTime::Forward, ShadowTechnique::None));
    let ev = match session.picture(&mut bench, &bright, "exposure", &mut remarks)? {
        Some((image, _)) => exposure(&image),
        None => 0.0,
    };
    let mut pictures = Vec::new();
    let mut drawn: Vec<Shots> = Vec::new();
    let mut done = 0;
    for Series { stem, caption, columns, shots } in &all {
        let mut images = Shots::new();
        for (name, settings) in shots {
            session.step(&format!("{stem}: {name}"), f64::from(done) / count as f64)?;
            done += 1;
            let what = format!("{stem}, {name}");
            let settings = prepared.settings(*settings);
            if let Some((image, _)) = session.picture(&mut bench, &settings, &what, &mut remarks)? {
                images.push((name.clone(), image));
            }
        }
        if !images.is_empty() {
            let png = sheet(&images, *columns, ev, View::Srgb)?;
            pictures.push(Picture { stem, caption: (*caption).to_owned(), png });
        }
        drawn.push(images);
    }
    session.step("comparing", 1.0)?;
    let mut table = Table::new(
        "How far pictures of a row are from its last one (fig. 40: from the A-buffer's): FLIP; and the mean difference \
         of neighbouring pixels as they are shown.",
        ["figure", "picture", "FLIP", "roughness"],
    );
    for (Series { stem, .. }, images) in all.iter().zip(&drawn) {
        let reference = find(images, "a-buffer").or(images.last().map(|(_, image)| image));
        for (name, image) in images {
            let flip = match reference {
                Some(reference) => flip(image, reference, ev, &format!("{stem}, {name}"), &mut remarks)?,
                None => f64::NAN,
            };
            table.row([(*stem).into(), name.clone().into(), flip.into(), roughness(image, ev).into()]);
        }
    }
    let model = if subject.is_scene() { "" } else { " The model is Marschner's." };
    let page = Page {
        text: vec![
            format!(
                "Groom {}, {} strands. {}{model} Light from other fibers is left out. All pictures are developed alike.",
                subject.name(),
                prepared.strands,
                seen(std::slice::from_ref(subject))
            ),
            "Two things that the thesis shows are not here: the layers and the map of fig. 35, because maps cannot be \
             read back as pictures, and the single subsets of fig. 47, because no setting draws one alone."
                .into(),
        ],
        findings: findings(&drawn, ev, &mut remarks)?,
        tables: vec![table],
        pictures,
        ..Page::default()
    };
    Ok(page.remarked(remarks))
}

fn find<'i>(images: &'i [(String, Image)], name: &str) -> Option<&'i Image> {
    images.iter().find(|(known, _)| known == name).map(|(_, image)| image)
}

/// FLIP of two pictures as they are shown; NaN in a build without it, or of what is no picture.
fn flip(test: &Image, reference: &Image, ev: f32, what: &str, remarks: &mut Remarks) -> Result<f64, Error> {
    let comparison = compared(test, reference, ev, what, remarks)?;
    Ok(comparison.and_then(|comparison| comparison.flip).map_or(f64::NAN, f64::from))
}

/// The thesis judges pictures by eye. Where its sentences become numbers here, numbers and orders are ours.
fn findings(drawn: &[Shots], ev: f32, remarks: &mut Remarks) -> Result<Vec<Finding>, Error> {
    let image = |name: &str| drawn.iter().find_map(|images| find(images, name));
    let mut apart = |a: &str, b: &str| match (image(a), image(b)) {
        (Some(test), Some(reference)) => flip(test, reference, ev, &format!("{a} and {b}"), remarks),
        _ => Ok(f64::NAN),
    };
    let rough = |name: &str| image(name).map_or(f64::NAN, |image| roughness(image, ev));
    let findings = vec![
        Finding::order(
            "256 texels suffice for DOM: the picture is nearer to that of 512 than the one of 128 is (FLIP)",
            &[("256", apart("DOM, 256", "DOM, 512")?), ("128", apart("DOM, 128", "DOM, 512")?)],
        ),
        Finding::order(
            "a filter smooths the shadow map's noise (roughness)",
            &[("5x5", rough("sm, 5x5")), ("one texel", rough("sm, one texel"))],
        ),
        Finding::order(
            "filtered, ADSM is nearer to DOM than the shadow map is (FLIP)",
            &[("adsm", apart("adsm, 5x5", "dom, 5x5")?), ("sm", apart("sm, 5x5", "dom, 5x5")?)],
        ),
        Finding::above(
            "opaque hair is more aliased: its roughness over that of transparent hair",
            1.0,
            rough("opaque") / rough("transparent"),
        ),
        Finding::below(
            "the techniques that keep fragments look alike: DBK against the A-buffer (FLIP)",
            0.02,
            apart("dbk", "a-buffer")?,
        ),
        Finding::below("the same of K+ with 16 fragments (FLIP)", 0.02, apart("k-plus, 16", "a-buffer")?),
        Finding::order(
            "DBK is nearer to the A-buffer than blending sorted strands is (FLIP)",
            &[("dbk", apart("dbk", "a-buffer")?), ("blend", apart("blend", "a-buffer")?)],
        ),
    ];
    Ok(findings.into_iter().map(Finding::ours).collect())
}

#[cfg(test)]
mod tests {
    use math::Rgb;

    use super::*;

    #[test]
    fn every_picture_has_a_name_and_allowed_settings() {
        let mut names = Vec::new();
        for series in series() {
            assert!(!series.shots.is_empty());
            for (name, settings) in series.shots {
                settings.check().unwrap();
                names.push(name);
            }
        }
        // Findings go by name; those that they use are there, once.
        for name in [
            "DOM, 128",
            "sm, 5x5",
            "sm, one texel",
            "adsm, 5x5",
            "dom, 5x5",
            "opaque",
            "a-buffer",
            "dbk",
            "k-plus, 16",
            "blend",
        ] {
            assert_eq!(names.iter().filter(|known| *known == name).count(), 1, "{name} in {names:?}");
        }
    }

    #[test]
    fn weaker_shadows_are_weaker_by_their_own_means() {
        let usual = |technique| shadowed(technique, 512, Filter::Pcf5).shadow;
        let (name, map) = weaker(ShadowTechnique::Map);
        assert_eq!(name, "sm, 5x5, strength 0.6");
        assert_eq!(map.shadow, Shadow { strength: 0.6, ..usual(ShadowTechnique::Map) });
        let (_, dom) = weaker(ShadowTechnique::DOM);
        assert_eq!(dom.shadow, Shadow { alpha: 0.5 * Shadow::PHYSICAL_ALPHA, ..usual(ShadowTechnique::DOM) });
    }

    #[test]
    fn aliasing_is_found_in_pictures() {
        let image = |light: fn(u32) -> f32| {
            let pixels = (0..64).map(|i| Rgb::splat(light(i % 8))).collect();
            Image::new(8, 8, pixels, None).unwrap()
        };
        let drawn = [vec![
            ("opaque".to_owned(), image(|x| (x % 2) as f32)),
            ("transparent".to_owned(), image(|x| 0.1 * x as f32)),
        ]];
        let found = findings(&drawn, 0.0, &mut Remarks::default()).unwrap();
        let opaque = found.iter().find(|finding| finding.claim.starts_with("opaque")).unwrap();
        assert_eq!(opaque.told(), "met");
        assert_eq!(found.iter().filter(|finding| finding.told() == "not measured").count(), found.len() - 1);
        assert!(found.iter().all(|finding| finding.ours));
    }
}
