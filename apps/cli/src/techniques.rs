//! The techniques of the interactive renderer as flags.
//!
//! A flag that the chosen technique would not hear is refused with what it goes with: whoever gives `--k` to blending
//! expects something else than what would be drawn.

use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use raster::{
    DepthShift, Filter, KPlusForm, Kind, Settings, ShadingSource, ShadingTime, ShadowTechnique, Shape, Sort,
    Transparency,
};
use serde::Serialize;

/// How the interactive renderer draws. What is left out is as in [`Settings::default`].
#[derive(clap::Args)]
pub(crate) struct Techniques {
    /// Scattering model of all hair; `look` is that of each look, others take its parameters over
    #[arg(long, value_enum, value_name = "MODEL", default_value_t = ShadingName::Look, help_heading = SHADING)]
    shading: ShadingName,
    /// Evaluate the model for every fragment; without it Marschner, d'Eon and Chiang are read from tables
    #[arg(long, help_heading = SHADING)]
    direct: bool,
    /// Shade fragments when they are drawn, not when the picture is put together
    #[arg(long, help_heading = SHADING)]
    forward: bool,
    /// Leave out light that other fibers scattered (dual scattering)
    #[arg(long, help_heading = SHADING)]
    no_multiple: bool,
    /// Most different fibers for a look that varies, 1 to 256 [default: 32]
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = SHADING)]
    palette: Option<u32>,
    /// Texels a side of the tables, 8 to 512 [default: 64]
    #[arg(long, value_name = "TEXELS", allow_negative_numbers = true, help_heading = SHADING)]
    table_size: Option<u32>,

    /// Directions that stand for an environment, 1 to 64 [default: 12]
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = LIGHTS)]
    environment_directions: Option<u32>,
    /// Points that stand for a rectangle, 1 to 16 [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = LIGHTS)]
    area_samples: Option<u32>,
    /// Take the smooth part of an environment as spherical harmonics, without shadows
    #[arg(long, help_heading = LIGHTS)]
    harmonics: bool,

    /// What keeps light from hair
    #[arg(long, value_enum, value_name = "TECHNIQUE", default_value_t = ShadowName::Dom, help_heading = SHADOWS)]
    shadow: ShadowName,
    /// Texels a side of each shadow map, 16 to 4096 [default: 512]
    #[arg(long, value_name = "TEXELS", allow_negative_numbers = true, help_heading = SHADOWS)]
    shadow_size: Option<u32>,
    /// Texels that are averaged; 3x3 if left out
    #[arg(long, value_enum, value_name = "TEXELS", help_heading = SHADOWS)]
    shadow_filter: Option<FilterName>,
    /// How much of the shadow is applied, 0 to 1 [default: 1]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, help_heading = SHADOWS)]
    shadow_strength: Option<f32>,
    /// Opacity of one fiber in adsm, osm and dom, 0 to 1; 0.18 if left out, which takes all light that meets a fiber
    #[arg(long, value_name = "ALPHA", allow_negative_numbers = true, help_heading = SHADOWS)]
    shadow_alpha: Option<f32>,
    /// Where the layers of dom end, 1 to 4 rising shares of the hair's depth [default: 0.05,0.2,1]
    #[arg(
        long,
        value_name = "SHARE,..",
        value_delimiter = ',',
        allow_hyphen_values = true,
        help_heading = SHADOWS
    )]
    shadow_layers: Option<Vec<f32>>,
    /// Distance between fibers that adsm assumes, scene units; that of the groom on average if left out
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, help_heading = SHADOWS)]
    shadow_spacing: Option<f32>,
    /// Share of the strands that casts shadows, made thicker by what is missing [default: 1]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, help_heading = SHADOWS)]
    shadow_strands: Option<f32>,

    /// How fragments become pixels
    #[arg(
        long,
        value_enum,
        value_name = "TECHNIQUE",
        default_value_t = TransparencyName::Dbk,
        help_heading = TRANSPARENCY
    )]
    transparency: TransparencyName,
    /// Fragments kept by k-plus, or subsets, 1 to 16; 8 if left out. With a-buffer: blend only so many of the nearest
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = TRANSPARENCY)]
    k: Option<u32>,
    /// How k-plus keeps fragments of a pixel apart; lock-free if left out
    #[arg(long, value_enum, value_name = "FORM", help_heading = TRANSPARENCY)]
    k_form: Option<FormName>,
    /// What is sorted before blend; strands if left out
    #[arg(long, value_enum, value_name = "WHAT", help_heading = TRANSPARENCY)]
    sort: Option<SortName>,
    /// Thickness of the layer of dbk: auto, or scene units [default: auto]
    #[arg(
        long,
        value_name = "auto|LENGTH",
        allow_negative_numbers = true,
        value_parser = parse_shift,
        help_heading = TRANSPARENCY
    )]
    shift: Option<Shift>,
    /// Opacity at which the layer of dbk ends with --shift auto, between 0 and 1 [default: 0.97]
    #[arg(long, value_name = "ALPHA", allow_negative_numbers = true, help_heading = TRANSPARENCY)]
    shift_opacity: Option<f32>,

    /// Draw lines one pixel wide, not ribbons
    #[arg(long, help_heading = GEOMETRY)]
    lines: bool,
    /// Straight pieces between two points of a strand, 1 to 16 [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = GEOMETRY)]
    subdivisions: Option<u32>,
    /// Share of the strands that is drawn, made thicker by what is missing [default: 1]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, help_heading = GEOMETRY)]
    strands: Option<f32>,
    /// Opacity of hair where it covers a pixel, 0 to 1 [default: 1]
    #[arg(long, value_name = "ALPHA", allow_negative_numbers = true, help_heading = GEOMETRY)]
    opacity: Option<f32>,
    /// Samples a side of a pixel, 1 to 4 [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = GEOMETRY)]
    supersample: Option<u32>,
}

const SHADING: &str = "Shading";
const LIGHTS: &str = "Lights";
const SHADOWS: &str = "Shadows";
const TRANSPARENCY: &str = "Transparency";
const GEOMETRY: &str = "Geometry";

/// Most layers of deep opacity maps.
const MOST_LAYERS: usize = 4;

/// What `--k` is where a technique needs one and none is given.
const K: u32 = 8;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ShadingName {
    /// The model of each look
    Look,
    /// Kajiya & Kay 1989, with Scheuermann's shifts
    #[value(alias = "kajiya_kay")]
    KajiyaKay,
    /// Marschner et al. 2003
    Marschner,
    /// Sadeghi et al. 2010
    Sadeghi,
    /// d'Eon et al. 2011
    Deon,
    /// Chiang et al. 2016
    Chiang,
    /// An opaque diffuse fiber
    Lambertian,
    /// Hery & Ramamoorthi 2012
    Hery,
    /// Fur with a medulla, after Yan et al. 2017
    Fur,
}

impl ShadingName {
    fn kind(self) -> Option<Kind> {
        match self {
            Self::Look => None,
            Self::KajiyaKay => Some(Kind::KajiyaKay),
            Self::Marschner => Some(Kind::Marschner),
            Self::Sadeghi => Some(Kind::Sadeghi),
            Self::Deon => Some(Kind::Deon),
            Self::Chiang => Some(Kind::Chiang),
            Self::Lambertian => Some(Kind::Lambertian),
            Self::Hery => Some(Kind::Hery),
            Self::Fur => Some(Kind::Fur),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ShadowName {
    /// No shadows
    None,
    /// Shadow map: lit or not
    Sm,
    /// Approximated deep shadow map: fibers guessed from the depth behind the first
    Adsm,
    /// Opacity shadow maps, 16 slices
    Osm,
    /// Deep opacity maps, layers that follow the first fiber
    Dom,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FilterName {
    /// One texel
    None,
    /// 3 by 3 texels
    #[value(name = "3x3")]
    Three,
    /// 5 by 5 texels
    #[value(name = "5x5")]
    Five,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TransparencyName {
    /// The nearest fragment, as if it were opaque
    Opaque,
    /// Sorted on the CPU, blended by the hardware
    Blend,
    /// Weighted blended, not sorted
    Weighted,
    /// Lists of all fragments, sorted per pixel: what the others are compared with
    #[value(name = "a-buffer")]
    ABuffer,
    /// The k nearest fragments
    #[value(name = "k-plus")]
    KPlus,
    /// Lists in a layer behind the nearest fragment, one fragment for all that is behind the layer
    Dbk,
    /// Random subsets of the strands, each opaque, blended in order
    Subsets,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FormName {
    /// Atomic minima in two passes
    LockFree,
    /// A semaphore per pixel around an array
    MaxArray,
    /// A semaphore per pixel around a heap
    MaxHeap,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SortName {
    /// Nothing
    None,
    /// Whole strands
    Strands,
    /// Every piece of a strand
    Pieces,
}

/// What `--shift` says.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shift {
    Automatic,
    /// Scene units.
    Fixed(f32),
}

fn parse_shift(text: &str) -> anyhow::Result<Shift> {
    if text == "auto" {
        return Ok(Shift::Automatic);
    }
    let length: f32 =
        text.parse().with_context(|| format!("{text:?} is no shift; write auto, or a length in scene units"))?;
    Ok(Shift::Fixed(length))
}

impl Techniques {
    /// What the flags say, checked.
    ///
    /// # Errors
    /// When a flag does not go with the technique that is chosen, or a number is out of its range.
    pub(crate) fn settings(&self) -> anyhow::Result<Settings> {
        self.check_company()?;
        let mut settings = Settings::default();

        let shading = &mut settings.shading;
        shading.model = self.shading.kind();
        shading.source = if self.direct { ShadingSource::Direct } else { ShadingSource::Tables };
        shading.when = if self.forward { ShadingTime::Forward } else { ShadingTime::Deferred };
        if self.no_multiple {
            shading.multiple = None;
        }
        replace(&mut shading.palette, self.palette);
        replace(&mut shading.table_size, self.table_size);

        let lights = &mut settings.lights;
        replace(&mut lights.environment_directions, self.environment_directions);
        replace(&mut lights.area_samples, self.area_samples);
        lights.harmonics = self.harmonics;

        let shadow = &mut settings.shadow;
        shadow.technique = self.shadow_technique()?;
        replace(&mut shadow.resolution, self.shadow_size);
        replace(&mut shadow.filter, self.shadow_filter.map(FilterName::filter));
        replace(&mut shadow.strength, self.shadow_strength);
        replace(&mut shadow.alpha, self.shadow_alpha);
        replace(&mut shadow.strands, self.shadow_strands);

        settings.transparency = self.transparency();

        let geometry = &mut settings.geometry;
        geometry.shape = if self.lines { Shape::Line } else { Shape::Ribbon };
        replace(&mut geometry.subdivisions, self.subdivisions);
        replace(&mut geometry.strands, self.strands);
        replace(&mut geometry.opacity, self.opacity);
        replace(&mut settings.supersample, self.supersample);

        settings.check()?;
        Ok(settings)
    }

    fn shadow_technique(&self) -> anyhow::Result<ShadowTechnique> {
        Ok(match self.shadow {
            ShadowName::None => ShadowTechnique::None,
            ShadowName::Sm => ShadowTechnique::Map,
            ShadowName::Adsm => ShadowTechnique::Adsm { spacing: self.shadow_spacing },
            ShadowName::Osm => ShadowTechnique::Osm,
            ShadowName::Dom => match &self.shadow_layers {
                None => ShadowTechnique::DOM,
                Some(given) => {
                    let layers = given.len();
                    ensure!(
                        (1..=MOST_LAYERS).contains(&layers),
                        "--shadow-layers has {layers} ends; deep opacity maps have 1 to {MOST_LAYERS} layers"
                    );
                    let mut ends = [1.0; MOST_LAYERS];
                    ends[..layers].copy_from_slice(given);
                    ShadowTechnique::Dom { layers: layers as u32, ends }
                }
            },
        })
    }

    fn transparency(&self) -> Transparency {
        match self.transparency {
            TransparencyName::Opaque => Transparency::Opaque,
            TransparencyName::Blend => Transparency::Blend {
                sort: match self.sort {
                    None => Sort::default(),
                    Some(SortName::None) => Sort::None,
                    Some(SortName::Strands) => Sort::Strands,
                    Some(SortName::Pieces) => Sort::Pieces,
                },
            },
            TransparencyName::Weighted => Transparency::Weighted,
            TransparencyName::ABuffer => Transparency::ABuffer { foremost: self.k },
            TransparencyName::KPlus => Transparency::KPlus {
                k: self.k.unwrap_or(K),
                form: match self.k_form {
                    None => KPlusForm::default(),
                    Some(FormName::LockFree) => KPlusForm::LockFree,
                    Some(FormName::MaxArray) => KPlusForm::MaxArray,
                    Some(FormName::MaxHeap) => KPlusForm::MaxHeap,
                },
            },
            TransparencyName::Dbk => Transparency::Dbk {
                shift: match (self.shift, self.shift_opacity) {
                    (Some(Shift::Fixed(length)), _) => DepthShift::Fixed(length),
                    (_, Some(opacity)) => DepthShift::Automatic { opacity },
                    (_, None) => DepthShift::default(),
                },
            },
            TransparencyName::Subsets => Transparency::RandomSubsets { k: self.k.unwrap_or(K) },
        }
    }

    /// Refuses flags that what is chosen would not hear.
    fn check_company(&self) -> anyhow::Result<()> {
        use ShadingName::{Chiang, Deon, Look, Marschner};
        use ShadowName::{Adsm, Dom, Osm, Sm};
        use TransparencyName::{ABuffer, Blend, Dbk, KPlus, Opaque, Subsets};

        if self.direct && self.table_size.is_some() {
            bail!("--table-size goes with tables; --direct does without them");
        }
        // The others have no tables, and are always evaluated. A look may have any model.
        let shading = |given, flag| fits(given, flag, "--shading", self.shading, &[Look, Marschner, Deon, Chiang]);
        shading(self.direct, "--direct")?;
        shading(self.table_size.is_some(), "--table-size")?;
        let shadow = |given, flag, with: &[ShadowName]| fits(given, flag, "--shadow", self.shadow, with);
        shadow(self.shadow_size.is_some(), "--shadow-size", &[Sm, Adsm, Osm, Dom])?;
        shadow(self.shadow_filter.is_some(), "--shadow-filter", &[Sm, Adsm, Osm, Dom])?;
        shadow(self.shadow_strength.is_some(), "--shadow-strength", &[Sm, Adsm, Osm, Dom])?;
        shadow(self.shadow_strands.is_some(), "--shadow-strands", &[Sm, Adsm, Osm, Dom])?;
        shadow(self.shadow_alpha.is_some(), "--shadow-alpha", &[Adsm, Osm, Dom])?;
        shadow(self.shadow_layers.is_some(), "--shadow-layers", &[Dom])?;
        shadow(self.shadow_spacing.is_some(), "--shadow-spacing", &[Adsm])?;

        let transparency =
            |given, flag, with: &[TransparencyName]| fits(given, flag, "--transparency", self.transparency, with);
        transparency(self.k.is_some(), "--k", &[ABuffer, KPlus, Subsets])?;
        transparency(self.k_form.is_some(), "--k-form", &[KPlus])?;
        transparency(self.sort.is_some(), "--sort", &[Blend])?;
        transparency(self.shift.is_some(), "--shift", &[Dbk])?;
        transparency(self.shift_opacity.is_some(), "--shift-opacity", &[Dbk])?;
        if self.shift_opacity.is_some() && matches!(self.shift, Some(Shift::Fixed(_))) {
            bail!("--shift-opacity goes with --shift auto; a fixed shift is as thick as it is");
        }
        // The other two blend every fragment as it comes, and always shade it then.
        transparency(self.forward, "--forward", &[Opaque, ABuffer, KPlus, Dbk, Subsets])
    }
}

impl FilterName {
    fn filter(self) -> Filter {
        match self {
            Self::None => Filter::None,
            Self::Three => Filter::Pcf3,
            Self::Five => Filter::Pcf5,
        }
    }
}

/// Puts a value that was given in the place of the default.
fn replace<T>(place: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *place = given;
    }
}

/// Refuses a flag that was given although `chosen` is none of those it goes with.
fn fits<T: ValueEnum + PartialEq>(given: bool, flag: &str, option: &str, chosen: T, with: &[T]) -> anyhow::Result<()> {
    ensure!(
        !given || with.contains(&chosen),
        "{flag} goes with {option} {}, not with {}",
        alternatives(with),
        word(&chosen)
    );
    Ok(())
}

/// A choice as it is written on the command line.
fn word<T: ValueEnum>(choice: &T) -> String {
    choice.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// `a, b or c`.
fn alternatives<T: ValueEnum>(choices: &[T]) -> String {
    let words: Vec<String> = choices.iter().map(word).collect();
    match words.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => words.concat(),
    }
}

/// Settings as a report names them: techniques by the renderer's names, which are the words of the flags but tell
/// variants apart (`a-buffer-k`, `k-plus-heap`); everything else as it is set, heard or not. What has no value with
/// another technique is left out there: layers, spacing, k, sort, shift.
#[derive(Serialize)]
pub(crate) struct Named {
    shading: String,
    source: &'static str,
    when: &'static str,
    multiple: bool,
    palette: u32,
    table_size: u32,
    environment_directions: u32,
    area_samples: u32,
    harmonics: bool,
    shadow: &'static str,
    shadow_size: u32,
    shadow_filter: &'static str,
    shadow_strength: f32,
    shadow_alpha: f32,
    shadow_strands: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    shadow_layers: Option<Vec<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shadow_spacing: Option<f32>,
    transparency: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    k: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sort: Option<&'static str>,
    /// Scene units; nothing where the shift is automatic.
    #[serde(skip_serializing_if = "Option::is_none")]
    shift: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shift_opacity: Option<f32>,
    shape: &'static str,
    subdivisions: u32,
    strands: f32,
    opacity: f32,
    supersample: u32,
}

impl From<&Settings> for Named {
    fn from(settings: &Settings) -> Self {
        let Settings { geometry, shading, lights, shadow, transparency, supersample } = settings;
        let model = ShadingName::value_variants().iter().find(|name| name.kind() == shading.model);
        let (shadow_layers, shadow_spacing) = match shadow.technique {
            ShadowTechnique::Dom { layers, ends } => (Some(ends.iter().take(layers as usize).copied().collect()), None),
            ShadowTechnique::Adsm { spacing } => (None, spacing),
            ShadowTechnique::None | ShadowTechnique::Map | ShadowTechnique::Osm => (None, None),
        };
        let (mut k, mut sort, mut shift, mut shift_opacity) = (None, None, None, None);
        match *transparency {
            Transparency::Opaque | Transparency::Weighted => {}
            Transparency::Blend { sort: what } => {
                sort = Some(match what {
                    Sort::None => "none",
                    Sort::Strands => "strands",
                    Sort::Pieces => "pieces",
                });
            }
            Transparency::ABuffer { foremost } => k = foremost,
            Transparency::KPlus { k: kept, .. } => k = Some(kept),
            Transparency::Dbk { shift: DepthShift::Automatic { opacity } } => shift_opacity = Some(opacity),
            Transparency::Dbk { shift: DepthShift::Fixed(length) } => shift = Some(length),
            Transparency::RandomSubsets { k: subsets } => k = Some(subsets),
        }
        Self {
            shading: model.map(word).unwrap_or_default(),
            source: match shading.source {
                ShadingSource::Tables => "tables",
                ShadingSource::Direct => "direct",
            },
            when: match shading.when {
                ShadingTime::Forward => "forward",
                ShadingTime::Deferred => "deferred",
            },
            multiple: shading.multiple.is_some(),
            palette: shading.palette,
            table_size: shading.table_size,
            environment_directions: lights.environment_directions,
            area_samples: lights.area_samples,
            harmonics: lights.harmonics,
            shadow: shadow.technique.name(),
            shadow_size: shadow.resolution,
            shadow_filter: shadow.filter.name(),
            shadow_strength: shadow.strength,
            shadow_alpha: shadow.alpha,
            shadow_strands: shadow.strands,
            shadow_layers,
            shadow_spacing,
            transparency: transparency.name(),
            k,
            sort,
            shift,
            shift_opacity,
            shape: match geometry.shape {
                Shape::Ribbon => "ribbon",
                Shape::Line => "line",
            },
            subdivisions: geometry.subdivisions,
            strands: geometry.strands,
            opacity: geometry.opacity,
            supersample: *supersample,
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        techniques: Techniques,
    }

    fn settings(line: &str) -> anyhow::Result<Settings> {
        let args = ["test"].into_iter().chain(line.split_whitespace());
        Line::try_parse_from(args)?.techniques.settings()
    }

    fn refusal(line: &str) -> String {
        settings(line).expect_err(line).to_string()
    }

    #[test]
    fn no_flags_are_the_defaults() {
        assert_eq!(settings("").unwrap(), Settings::default());
        // What the help calls defaults are those.
        let spelt = "--shading look --palette 32 --table-size 64 --environment-directions 12 --area-samples 1 \
                     --shadow dom --shadow-size 512 --shadow-filter 3x3 --shadow-strength 1 \
                     --shadow-layers 0.05,0.2,1 --shadow-strands 1 --transparency dbk --shift auto \
                     --shift-opacity 0.97 --subdivisions 1 --strands 1 --opacity 1 --supersample 1";
        assert_eq!(settings(spelt).unwrap(), Settings::default());
        assert!((Settings::default().shadow.alpha - 0.18).abs() < 0.005, "the help rounds to two digits");
    }

    #[test]
    fn every_flag_changes_its_setting_and_no_other() {
        type Change = fn(&mut Settings);
        let cases: &[(&str, Change)] = &[
            ("--shading kajiya-kay", |s| s.shading.model = Some(Kind::KajiyaKay)),
            ("--shading kajiya_kay", |s| s.shading.model = Some(Kind::KajiyaKay)),
            ("--direct", |s| s.shading.source = ShadingSource::Direct),
            ("--forward", |s| s.shading.when = ShadingTime::Forward),
            ("--no-multiple", |s| s.shading.multiple = None),
            ("--palette 7", |s| s.shading.palette = 7),
            ("--table-size 16", |s| s.shading.table_size = 16),
            ("--environment-directions 5", |s| s.lights.environment_directions = 5),
            ("--area-samples 4", |s| s.lights.area_samples = 4),
            ("--harmonics", |s| s.lights.harmonics = true),
            ("--shadow none", |s| s.shadow.technique = ShadowTechnique::None),
            ("--shadow sm", |s| s.shadow.technique = ShadowTechnique::Map),
            ("--shadow adsm", |s| s.shadow.technique = ShadowTechnique::Adsm { spacing: None }),
            ("--shadow adsm --shadow-spacing 0.5", |s| {
                s.shadow.technique = ShadowTechnique::Adsm { spacing: Some(0.5) };
            }),
            ("--shadow osm", |s| s.shadow.technique = ShadowTechnique::Osm),
            ("--shadow-layers 0.25,0.5", |s| {
                s.shadow.technique = ShadowTechnique::Dom { layers: 2, ends: [0.25, 0.5, 1.0, 1.0] };
            }),
            ("--shadow-size 128", |s| s.shadow.resolution = 128),
            ("--shadow-filter none", |s| s.shadow.filter = Filter::None),
            ("--shadow-filter 5x5", |s| s.shadow.filter = Filter::Pcf5),
            ("--shadow-strength 0.5", |s| s.shadow.strength = 0.5),
            ("--shadow-alpha 0.25", |s| s.shadow.alpha = 0.25),
            ("--shadow-strands 0.5", |s| s.shadow.strands = 0.5),
            ("--transparency opaque", |s| s.transparency = Transparency::Opaque),
            ("--transparency blend", |s| s.transparency = Transparency::Blend { sort: Sort::Strands }),
            ("--transparency blend --sort pieces", |s| s.transparency = Transparency::Blend { sort: Sort::Pieces }),
            ("--transparency blend --sort none", |s| s.transparency = Transparency::Blend { sort: Sort::None }),
            ("--transparency weighted", |s| s.transparency = Transparency::Weighted),
            ("--transparency a-buffer", |s| s.transparency = Transparency::ABuffer { foremost: None }),
            ("--transparency a-buffer --k 4", |s| s.transparency = Transparency::ABuffer { foremost: Some(4) }),
            ("--transparency k-plus", |s| {
                s.transparency = Transparency::KPlus { k: 8, form: KPlusForm::LockFree };
            }),
            ("--transparency k-plus --k 4 --k-form max-heap", |s| {
                s.transparency = Transparency::KPlus { k: 4, form: KPlusForm::MaxHeap };
            }),
            ("--transparency k-plus --k-form max-array", |s| {
                s.transparency = Transparency::KPlus { k: 8, form: KPlusForm::MaxArray };
            }),
            ("--shift 0.5", |s| s.transparency = Transparency::Dbk { shift: DepthShift::Fixed(0.5) }),
            ("--shift-opacity 0.5", |s| {
                s.transparency = Transparency::Dbk { shift: DepthShift::Automatic { opacity: 0.5 } };
            }),
            ("--transparency subsets", |s| s.transparency = Transparency::RandomSubsets { k: 8 }),
            ("--transparency subsets --k 3", |s| s.transparency = Transparency::RandomSubsets { k: 3 }),
            ("--lines", |s| s.geometry.shape = Shape::Line),
            ("--subdivisions 3", |s| s.geometry.subdivisions = 3),
            ("--strands 0.5", |s| s.geometry.strands = 0.5),
            ("--opacity 0.5", |s| s.geometry.opacity = 0.5),
            ("--supersample 2", |s| s.supersample = 2),
        ];
        for (line, change) in cases {
            let mut wanted = Settings::default();
            change(&mut wanted);
            assert_ne!(wanted, Settings::default(), "{line}");
            assert_eq!(settings(line).unwrap(), wanted, "{line}");
        }
    }

    #[test]
    fn every_model_is_a_shading() {
        for kind in Kind::ALL {
            // Scene files write underscores.
            let line = format!("--shading {}", kind.name().replace('_', "-"));
            assert_eq!(settings(&line).unwrap().shading.model, Some(kind), "{line}");
        }
    }

    #[test]
    fn flags_that_would_not_be_heard_are_refused() {
        for (line, says) in [
            ("--k 4", "--k goes with --transparency a-buffer, k-plus or subsets, not with dbk"),
            ("--transparency blend --k 4", "not with blend"),
            (
                "--transparency a-buffer --k-form max-array",
                "--k-form goes with --transparency k-plus, not with a-buffer",
            ),
            ("--sort strands", "--sort goes with --transparency blend, not with dbk"),
            ("--transparency opaque --shift 1", "--shift goes with --transparency dbk, not with opaque"),
            ("--transparency opaque --shift-opacity 0.9", "--shift-opacity goes with --transparency dbk"),
            ("--shift 1 --shift-opacity 0.9", "--shift-opacity goes with --shift auto"),
            ("--transparency weighted --forward", "--forward goes with --transparency opaque, a-buffer, k-plus, dbk"),
            ("--direct --table-size 64", "--table-size goes with tables"),
            ("--shading kajiya-kay --direct", "--direct goes with --shading look, marschner, deon or chiang, not with"),
            ("--shading sadeghi --table-size 32", "--table-size goes with --shading look, marschner, deon or chiang"),
            ("--shadow none --shadow-size 64", "--shadow-size goes with --shadow sm, adsm, osm or dom, not with none"),
            ("--shadow none --shadow-filter 3x3", "--shadow-filter goes with"),
            ("--shadow none --shadow-strength 1", "--shadow-strength goes with"),
            ("--shadow none --shadow-strands 1", "--shadow-strands goes with"),
            ("--shadow sm --shadow-alpha 0.1", "--shadow-alpha goes with --shadow adsm, osm or dom, not with sm"),
            ("--shadow osm --shadow-layers 1", "--shadow-layers goes with --shadow dom, not with osm"),
            ("--shadow-spacing 1", "--shadow-spacing goes with --shadow adsm, not with dom"),
        ] {
            let refusal = refusal(line);
            assert!(refusal.contains(says), "{line}: {refusal}");
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for (line, says) in [
            ("--shadow-layers 0.1,0.2,0.3,0.4,1", "5 ends"),
            ("--shadow-layers 0.5,0.1", "rising"),
            ("--shadow-layers -0.1,1", "-0.1"),
            ("--shift -1", "at least 0"),
            ("--shift nan", "NaN"),
            ("--shift thick", "\"thick\" is no shift; write auto"),
            ("--shift-opacity 1", "below 1"),
            ("--transparency k-plus --k 17", "k is 17"),
            ("--transparency a-buffer --k 0", "k is 0"),
            ("--supersample 5", "supersampling is 5"),
            ("--strands nan", "the share of strands is NaN"),
        ] {
            let refusal = refusal(line);
            assert!(refusal.contains(says), "{line}: {refusal}");
        }
    }

    #[test]
    fn reports_name_what_was_chosen() {
        let named = |line: &str| serde_json::to_value(Named::from(&settings(line).unwrap())).unwrap();
        let usual = named("");
        for (key, word) in [("shading", "look"), ("shadow", "dom"), ("transparency", "dbk"), ("shape", "ribbon")] {
            assert_eq!(usual[key], word, "{key}");
        }
        assert!(usual.get("k").is_none() && usual.get("shift").is_none(), "{usual}");
        let other =
            named("--shading kajiya-kay --transparency k-plus --k 4 --shadow adsm --shadow-spacing 0.5 --lines");
        assert_eq!(other["shading"], "kajiya-kay");
        assert_eq!((other["k"].as_u64(), other["shadow_spacing"].as_f64()), (Some(4), Some(0.5)));
        assert_eq!(other["shape"], "line");
        assert!(other.get("shadow_layers").is_none(), "{other}");
    }
}
