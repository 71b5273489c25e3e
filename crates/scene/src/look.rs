//! Looks in memory: parameters that vary over strands, and the fiber they make at a point.

use fiber::absorption::{self, MelaninConstants};
use fiber::{Attenuation, Chiang, Deon, Fiber, Field, Hery, HeryMode, KajiyaKay, KajiyaKayMode, Lambertian, Weights};
use groom::Attributes;
use math::{Rgb, hash};

use crate::error::{SceneError, SceneErrorKind, closest, quoted_list};
use crate::file::{
    AttenuationKind, FieldKind, LookSection, MelaninConstantsKind, ModeKind, ModelKind, NoiseSection, Param,
    PresetKind, Tone, Variation, WeightsKind,
};
use crate::source::Source;

/// A point on a strand, as far as a look cares.
#[derive(Clone, Copy, Debug)]
pub struct StrandPoint<'g> {
    /// The strand within its groom, from 0.
    pub strand: u32,
    /// Parameter along the strand: 0 at the root, 1 at the tip.
    pub u: f32,
    /// The point before the place, counted through all points of the groom.
    pub point_index: usize,
    /// How far the place is from that point to the next one, in `[0, 1]`.
    pub frac: f32,
    /// The attributes of the groom.
    pub attributes: &'g Attributes,
    /// Sets the random numbers of one groom apart from those of another.
    pub seed: u32,
}

/// What fibers are made of: gives the fiber model with all its parameters at any point of a strand.
#[derive(Clone, Debug)]
pub struct Look {
    name: String,
    shader: Shader,
    constant: Option<Fiber>,
    attributes: Vec<String>,
}

impl Look {
    /// The name by which grooms call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The fiber at a point of a strand. Allocates nothing; every parameter is within its legal range.
    #[inline]
    pub fn fiber(&self, at: &StrandPoint<'_>) -> Fiber {
        match self.constant {
            Some(fiber) => fiber,
            None => self.shader.fiber(Some(at)),
        }
    }

    /// The fiber that this look gives everywhere; `None` when a parameter varies.
    #[inline]
    pub fn constant(&self) -> Option<Fiber> {
        self.constant
    }

    /// The fiber without any variation: ramps at the root, no random offsets, no attributes.
    pub fn base(&self) -> Fiber {
        self.shader.fiber(None)
    }

    /// The attributes of the groom that the look reads, where the groom has them.
    pub fn attributes(&self) -> &[String] {
        &self.attributes
    }
}

/// A look from its section of the file, and what is odd about it.
pub(crate) fn resolve(
    name: &str,
    section: &LookSection,
    source: &Source<'_>,
) -> Result<(Look, Vec<String>), SceneError> {
    let mut builder =
        Builder { source, look: format!("look.{name}"), attributes: Vec::new(), varies: false, warnings: Vec::new() };
    let shader = builder.shader(section)?;
    let constant = (!builder.varies).then(|| shader.fiber(None));
    let look = Look { name: name.to_owned(), shader, constant, attributes: builder.attributes };
    Ok((look, builder.warnings))
}

/// A model with parameters that may vary; angles in degrees.
#[derive(Clone, Debug)]
enum Shader {
    Deon {
        pigment: Pigment,
        longitudinal_deg: Varying<f32>,
        /// `None`: the longitudinal one.
        azimuthal_deg: Option<Varying<f32>>,
        tilt_deg: Varying<f32>,
        ior: Varying<f32>,
        residual: bool,
        attenuation: Attenuation,
        weights: Weights,
        field: Field,
    },
    Chiang {
        pigment: Pigment,
        longitudinal: Varying<f32>,
        azimuthal: Varying<f32>,
        tilt_deg: Varying<f32>,
        ior: Varying<f32>,
    },
    Lambertian {
        albedo: Varying<Rgb>,
    },
    KajiyaKay {
        diffuse: Varying<Rgb>,
        specular: Varying<Rgb>,
        exponent: Varying<f32>,
        mode: KajiyaKayMode,
    },
    Hery {
        tint: Varying<Rgb>,
        roughness_deg: Varying<f32>,
        tilt_deg: Varying<f32>,
        mode: HeryMode,
        cos_theta_d: bool,
    },
}

/// Where the absorption comes from.
#[derive(Clone, Debug)]
enum Pigment {
    Concentrations { eumelanin: Varying<f32>, pheomelanin: Varying<f32>, constants: MelaninConstants },
    Share { melanin: Varying<f32>, redness: Varying<f32>, constants: MelaninConstants },
    Color(Varying<Rgb>),
    Absorption(Varying<Rgb>),
}

impl Pigment {
    /// Absorption per radius; `roughness` is Chiang's azimuthal one, which the colour fit needs.
    #[inline]
    fn sigma_a(&self, at: Option<&StrandPoint<'_>>, roughness: f32) -> Rgb {
        match self {
            Self::Concentrations { eumelanin, pheomelanin, constants } => {
                absorption::from_melanin(eumelanin.at(at), pheomelanin.at(at), *constants)
            }
            Self::Share { melanin, redness, constants } => {
                absorption::from_cycles_melanin_with(melanin.at(at), redness.at(at), *constants)
            }
            Self::Color(color) => absorption::from_color(color.at(at), roughness),
            Self::Absorption(sigma_a) => sigma_a.at(at),
        }
    }
}

/// The roughness at which d'Eon's fibers, which have none of that kind, invert a colour.
const COLOUR_FIT_ROUGHNESS: f32 = 0.3;

impl Shader {
    fn fiber(&self, at: Option<&StrandPoint<'_>>) -> Fiber {
        match self {
            Self::Deon {
                pigment,
                longitudinal_deg,
                azimuthal_deg,
                tilt_deg,
                ior,
                residual,
                attenuation,
                weights,
                field,
            } => {
                let longitudinal = longitudinal_deg.at(at).to_radians();
                Fiber::Deon(Deon {
                    eta: ior.at(at),
                    sigma_a: pigment.sigma_a(at, COLOUR_FIT_ROUGHNESS),
                    beta_m: longitudinal,
                    beta_n: azimuthal_deg.as_ref().map_or(longitudinal, |deg| deg.at(at).to_radians()),
                    alpha: tilt_deg.at(at).to_radians(),
                    residual: *residual,
                    attenuation: *attenuation,
                    weights: *weights,
                    field: *field,
                })
            }
            Self::Chiang { pigment, longitudinal, azimuthal, tilt_deg, ior } => {
                let azimuthal = azimuthal.at(at);
                Fiber::Chiang(Chiang {
                    beta_m: longitudinal.at(at),
                    beta_n: azimuthal,
                    alpha: tilt_deg.at(at).to_radians(),
                    eta: ior.at(at),
                    sigma_a: pigment.sigma_a(at, azimuthal),
                })
            }
            Self::Lambertian { albedo } => Fiber::Lambertian(Lambertian { albedo: albedo.at(at) }),
            Self::KajiyaKay { diffuse, specular, exponent, mode } => Fiber::KajiyaKay(KajiyaKay {
                diffuse: diffuse.at(at),
                specular: specular.at(at),
                exponent: exponent.at(at),
                mode: *mode,
            }),
            Self::Hery { tint, roughness_deg, tilt_deg, mode, cos_theta_d } => Fiber::Hery(Hery {
                tint: tint.at(at),
                beta: roughness_deg.at(at).to_radians(),
                alpha: tilt_deg.at(at).to_radians(),
                mode: *mode,
                cos_theta_d: *cos_theta_d,
            }),
        }
    }
}

/// A parameter: its base value, the range it may take, and how it varies.
#[derive(Clone, Debug)]
struct Varying<T> {
    base: T,
    least: f32,
    most: f32,
    variation: Option<Box<InMemory<T>>>,
}

/// How a parameter varies, ready to be evaluated.
#[derive(Clone, Debug)]
struct InMemory<T> {
    /// Rising in its first component; may be empty.
    ramp: Vec<(f32, T)>,
    attribute: Option<String>,
    scale: f32,
    random: f32,
    random_stream: u32,
    noise: f32,
    frequency: f32,
    noise_stream: u32,
}

impl<T: Quantity> Varying<T> {
    /// The value at a point, or the base value.
    #[inline]
    fn at(&self, at: Option<&StrandPoint<'_>>) -> T {
        let (Some(variation), Some(at)) = (&self.variation, at) else { return self.base };
        let base = variation
            .attribute
            .as_deref()
            .and_then(|name| T::attribute(name, at))
            .or_else(|| ramp_at(&variation.ramp, at.u))
            .map_or(self.base, |base| base.scaled(variation.scale, 0.0));
        let mut offset = 0.0;
        if variation.random > 0.0 {
            let stream = hash::mix2(variation.random_stream, at.seed);
            offset += variation.random * hash::signed(at.strand, stream);
        }
        if variation.noise > 0.0 {
            let stream = hash::mix3(variation.noise_stream, at.seed, at.strand);
            offset += variation.noise * hash::noise_1d(at.u * variation.frequency, stream);
        }
        base.scaled(1.0, offset).limited(self.least, self.most).unwrap_or(self.base)
    }
}

/// The ramp at `u`, straight between its points and level outside; `None` for an empty one.
#[inline]
fn ramp_at<T: Quantity>(ramp: &[(f32, T)], u: f32) -> Option<T> {
    let after = ramp.partition_point(|&(x, _)| x <= u);
    let Some(&(x0, a)) = after.checked_sub(1).and_then(|i| ramp.get(i)) else {
        return ramp.first().map(|&(_, first)| first);
    };
    match ramp.get(after) {
        Some(&(x1, b)) if x1 > x0 => Some(T::mix(a, b, (u - x0) / (x1 - x0))),
        _ => Some(a),
    }
}

/// A number or a colour.
trait Quantity: Copy {
    /// `None` for a colour where a number is wanted.
    fn from_tone(tone: Tone) -> Option<Self>;
    fn mix(a: Self, b: Self, t: f32) -> Self;
    fn scaled(self, factor: f32, offset: f32) -> Self;
    /// Within `[least, most]`; `None` when it is not finite.
    fn limited(self, least: f32, most: f32) -> Option<Self>;
    fn attribute(name: &str, at: &StrandPoint<'_>) -> Option<Self>;
}

impl Quantity for f32 {
    fn from_tone(tone: Tone) -> Option<Self> {
        match tone {
            Tone::Grey(x) => Some(x as Self),
            Tone::Colour(_) => None,
        }
    }

    #[inline]
    fn mix(a: Self, b: Self, t: f32) -> Self {
        math::lerp(a, b, t)
    }

    #[inline]
    fn scaled(self, factor: f32, offset: f32) -> Self {
        self * factor + offset
    }

    #[inline]
    fn limited(self, least: f32, most: f32) -> Option<Self> {
        self.is_finite().then(|| self.clamp(least, most))
    }

    fn attribute(name: &str, at: &StrandPoint<'_>) -> Option<Self> {
        at.attributes.float(name, at.strand as usize, at.point_index, at.frac)
    }
}

impl Quantity for Rgb {
    fn from_tone(tone: Tone) -> Option<Self> {
        Some(Self(tone.rgb().map(|x| x as f32)))
    }

    #[inline]
    fn mix(a: Self, b: Self, t: f32) -> Self {
        a.zip(b, |a, b| math::lerp(a, b, t))
    }

    #[inline]
    fn scaled(self, factor: f32, offset: f32) -> Self {
        self.map(|x| x * factor + offset)
    }

    #[inline]
    fn limited(self, least: f32, most: f32) -> Option<Self> {
        self.is_finite().then(|| self.map(|x| x.clamp(least, most)))
    }

    fn attribute(name: &str, at: &StrandPoint<'_>) -> Option<Self> {
        let strand = at.strand as usize;
        at.attributes
            .vec3(name, strand, at.point_index, at.frac)
            .map(Self)
            .or_else(|| at.attributes.float(name, strand, at.point_index, at.frac).map(Self::splat))
    }
}

/// Which numbers a parameter may take.
type Range = (f64, f64);

const UNIT: Range = (0.0, 1.0);
const CONCENTRATION: Range = (0.0, 100.0);
const ABSORPTION: Range = (0.0, 1e4);
const ANGLE_DEG: Range = (0.02, 90.0);
const ROUGHNESS: Range = (0.01, 1.0);
const TILT_DEG: Range = (-20.0, 20.0);
const IOR: Range = (1.01, 3.0);
const EXPONENT: Range = (0.0, 1e4);

const PIGMENT_KEYS: [&str; 7] =
    ["eumelanin", "pheomelanin", "melanin", "redness", "color", "absorption", "melanin_constants"];

/// The keys that a model takes beside those of the pigment, and whether it takes those too.
fn keys_of(model: ModelKind) -> (&'static [&'static str], bool) {
    match model {
        ModelKind::Deon => (
            &[
                "longitudinal_roughness_deg",
                "azimuthal_roughness_deg",
                "tilt_deg",
                "ior",
                "residual",
                "attenuation",
                "weights",
                "field",
            ],
            true,
        ),
        ModelKind::Chiang => (&["longitudinal_roughness", "azimuthal_roughness", "tilt_deg", "ior"], true),
        ModelKind::Lambertian => (&["albedo"], false),
        ModelKind::KajiyaKay => (&["diffuse", "specular", "exponent", "mode"], false),
        ModelKind::Hery => (&["tint", "roughness_deg", "tilt_deg", "mode", "cos_theta_d"], false),
    }
}

fn model_name(model: ModelKind) -> &'static str {
    match model {
        ModelKind::Deon => "deon",
        ModelKind::Chiang => "chiang",
        ModelKind::Lambertian => "lambertian",
        ModelKind::KajiyaKay => "kajiya_kay",
        ModelKind::Hery => "hery",
    }
}

/// The keys that a section gives, except model and preset.
fn given(look: &LookSection) -> Vec<&'static str> {
    let all = [
        ("eumelanin", look.eumelanin.is_some()),
        ("pheomelanin", look.pheomelanin.is_some()),
        ("melanin", look.melanin.is_some()),
        ("redness", look.redness.is_some()),
        ("color", look.color.is_some()),
        ("absorption", look.absorption.is_some()),
        ("melanin_constants", look.melanin_constants.is_some()),
        ("longitudinal_roughness_deg", look.longitudinal_roughness_deg.is_some()),
        ("azimuthal_roughness_deg", look.azimuthal_roughness_deg.is_some()),
        ("longitudinal_roughness", look.longitudinal_roughness.is_some()),
        ("azimuthal_roughness", look.azimuthal_roughness.is_some()),
        ("tilt_deg", look.tilt_deg.is_some()),
        ("ior", look.ior.is_some()),
        ("residual", look.residual.is_some()),
        ("attenuation", look.attenuation.is_some()),
        ("weights", look.weights.is_some()),
        ("field", look.field.is_some()),
        ("albedo", look.albedo.is_some()),
        ("diffuse", look.diffuse.is_some()),
        ("specular", look.specular.is_some()),
        ("exponent", look.exponent.is_some()),
        ("tint", look.tint.is_some()),
        ("roughness_deg", look.roughness_deg.is_some()),
        ("cos_theta_d", look.cos_theta_d.is_some()),
        ("mode", look.mode.is_some()),
    ];
    all.into_iter().filter(|&(_, is_given)| is_given).map(|(key, _)| key).collect()
}

/// Eumelanin and pheomelanin of a named colour.
fn preset_pigment(preset: PresetKind) -> (Param, Param) {
    let (eumelanin, pheomelanin) = match preset {
        PresetKind::Black => (8.0, 0.0),
        PresetKind::DarkBrown => (3.0, 0.3),
        PresetKind::Brown => (1.3, 0.2),
        PresetKind::LightBrown => (0.7, 0.2),
        PresetKind::Auburn => (0.6, 1.0),
        PresetKind::Red => (0.1, 1.0),
        PresetKind::Blonde => (0.3, 0.1),
        PresetKind::Platinum => (0.06, 0.02),
        PresetKind::White => (0.0, 0.0),
        PresetKind::Grey => {
            let varied = Variation { value: Some(Tone::Grey(0.35)), random: Some(0.35), ..Variation::default() };
            return (Param::Varying(Box::new(varied)), Param::from(0.0));
        }
    };
    (Param::from(eumelanin), Param::from(pheomelanin))
}

/// The number that a parameter is or varies around, if it says so.
fn middle(param: &Param) -> Option<f64> {
    match param {
        Param::Constant(Tone::Grey(x)) => Some(*x),
        Param::Varying(variation) => match variation.value {
            Some(Tone::Grey(x)) => Some(x),
            _ => None,
        },
        Param::Constant(Tone::Colour(_)) => None,
    }
}

/// A random stream for the parameter `key`, or for the seed that the user gave.
fn stream(key: &str, seed: Option<u32>, salt: u32) -> u32 {
    let word = seed.unwrap_or_else(|| {
        key.bytes().fold(0x811c_9dc5, |word, byte| (word ^ u32::from(byte)).wrapping_mul(0x0100_0193))
    });
    hash::mix2(word, salt)
}

/// Turns the section of a look into its form in memory, checking everything on the way.
struct Builder<'s, 't> {
    source: &'s Source<'t>,
    look: String,
    attributes: Vec<String>,
    varies: bool,
    warnings: Vec<String>,
}

impl Builder<'_, '_> {
    fn shader(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        let model = look.model.unwrap_or_default();
        self.check_keys(look, model)?;
        match model {
            ModelKind::Deon => {
                let azimuthal_deg = match &look.azimuthal_roughness_deg {
                    Some(param) => {
                        let like = look.longitudinal_roughness_deg.as_ref().and_then(middle).unwrap_or(7.5);
                        Some(self.param("azimuthal_roughness_deg", Some(param), like, ANGLE_DEG)?)
                    }
                    None => None,
                };
                Ok(Shader::Deon {
                    pigment: self.pigment(look)?,
                    longitudinal_deg: self.param(
                        "longitudinal_roughness_deg",
                        look.longitudinal_roughness_deg.as_ref(),
                        7.5,
                        ANGLE_DEG,
                    )?,
                    azimuthal_deg,
                    tilt_deg: self.param("tilt_deg", look.tilt_deg.as_ref(), -3.0, TILT_DEG)?,
                    ior: self.param("ior", look.ior.as_ref(), 1.55, IOR)?,
                    residual: look.residual.unwrap_or(true),
                    attenuation: match look.attenuation {
                        None | Some(AttenuationKind::Difference) => Attenuation::Difference,
                        Some(AttenuationKind::Known) => Attenuation::Known,
                    },
                    weights: match look.weights {
                        None | Some(WeightsKind::Marginal) => Weights::Marginal,
                        Some(WeightsKind::Joint) => Weights::Joint,
                        Some(WeightsKind::Clamped) => Weights::Clamped,
                    },
                    field: match look.field {
                        None | Some(FieldKind::Near) => Field::Near,
                        Some(FieldKind::Far) => Field::Far,
                    },
                })
            }
            ModelKind::Chiang => Ok(Shader::Chiang {
                pigment: self.pigment(look)?,
                longitudinal: self.param(
                    "longitudinal_roughness",
                    look.longitudinal_roughness.as_ref(),
                    0.3,
                    ROUGHNESS,
                )?,
                azimuthal: self.param("azimuthal_roughness", look.azimuthal_roughness.as_ref(), 0.3, ROUGHNESS)?,
                tilt_deg: self.param("tilt_deg", look.tilt_deg.as_ref(), -2.0, TILT_DEG)?,
                ior: self.param("ior", look.ior.as_ref(), 1.55, IOR)?,
            }),
            ModelKind::Lambertian => {
                Ok(Shader::Lambertian { albedo: self.param("albedo", look.albedo.as_ref(), 0.5, UNIT)? })
            }
            ModelKind::KajiyaKay => self.kajiya_kay(look),
            ModelKind::Hery => Ok(Shader::Hery {
                tint: self.param("tint", look.tint.as_ref(), 1.0, UNIT)?,
                roughness_deg: self.param("roughness_deg", look.roughness_deg.as_ref(), 5.0, ANGLE_DEG)?,
                tilt_deg: self.param("tilt_deg", look.tilt_deg.as_ref(), -2.0, TILT_DEG)?,
                mode: match look.mode {
                    None | Some(ModeKind::Truncated) => HeryMode::Truncated,
                    Some(ModeKind::Faithful) => HeryMode::Faithful,
                    Some(ModeKind::FaithfulExactPdf) => HeryMode::FaithfulExactPdf,
                    Some(ModeKind::Normalised | ModeKind::Thesis) => {
                        return Err(self.wrong_mode("`truncated`, `faithful`, `faithful_exact_pdf`"));
                    }
                },
                cos_theta_d: look.cos_theta_d.unwrap_or(false),
            }),
        }
    }

    fn kajiya_kay(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        let mode = match look.mode {
            None | Some(ModeKind::Normalised) => KajiyaKayMode::Normalised,
            Some(ModeKind::Thesis) => KajiyaKayMode::Thesis,
            Some(ModeKind::Truncated | ModeKind::Faithful | ModeKind::FaithfulExactPdf) => {
                return Err(self.wrong_mode("`normalised`, `thesis`"));
            }
        };
        let brown = Param::Constant(Tone::Colour([0.4, 0.25, 0.15]));
        let diffuse = look.diffuse.as_ref().unwrap_or(&brown);
        let diffuse: Varying<Rgb> = self.param("diffuse", Some(diffuse), 0.25, UNIT)?;
        let specular: Varying<Rgb> = self.param("specular", look.specular.as_ref(), 0.2, UNIT)?;
        let exponent = self.param("exponent", look.exponent.as_ref(), 25.0, EXPONENT)?;
        let most = (diffuse.base + specular.base).max_channel();
        if mode == KajiyaKayMode::Normalised && most > 1.0 + 1e-6 {
            self.warnings.push(format!(
                "`{}`: diffuse and specular add up to {most}; above 1 the fiber reflects more than it receives",
                self.look
            ));
        }
        Ok(Shader::KajiyaKay { diffuse, specular, exponent, mode })
    }

    fn wrong_mode(&self, choice: &str) -> SceneError {
        let path = format!("{}.mode", self.look);
        let message = format!("`{path}` is of another model; this one has the modes {choice}");
        self.source.at_value(SceneErrorKind::Conflict, &path, message)
    }

    /// Refuses parameters of other models.
    fn check_keys(&self, look: &LookSection, model: ModelKind) -> Result<(), SceneError> {
        let (own, has_pigment) = keys_of(model);
        let pigment: &[&str] = if has_pigment { &PIGMENT_KEYS } else { &[] };
        let allowed: Vec<&str> = pigment.iter().chain(own).copied().collect();
        if let Some(key) = given(look).into_iter().find(|key| !allowed.contains(key)) {
            let name = model_name(model);
            let path = format!("{}.{key}", self.look);
            let list = quoted_list(allowed.iter().copied());
            let message = format!("`{path}`: the model `{name}` has no parameter `{key}`; it has {list}");
            return Err(self.source.at_key(SceneErrorKind::Conflict, &path, message).suggest(closest(key, allowed)));
        }
        if look.preset.is_some() && !has_pigment {
            let path = format!("{}.preset", self.look);
            let name = model_name(model);
            let message = format!("`{path}`: presets are pigments, for `deon` and `chiang`; this is `{name}`");
            return Err(self.source.at_key(SceneErrorKind::Conflict, &path, message));
        }
        Ok(())
    }

    fn pigment(&mut self, look: &LookSection) -> Result<Pigment, SceneError> {
        let concentrations = look.eumelanin.is_some() || look.pheomelanin.is_some();
        let share = look.melanin.is_some() || look.redness.is_some();
        // Each form with the key that stands for it in complaints.
        let forms = [
            (concentrations, if look.eumelanin.is_some() { "eumelanin" } else { "pheomelanin" }),
            (share, if look.melanin.is_some() { "melanin" } else { "redness" }),
            (look.color.is_some(), "color"),
            (look.absorption.is_some(), "absorption"),
        ];
        let mut used = forms.iter().filter(|(is_given, _)| *is_given).map(|&(_, key)| key);
        if let (Some(first), Some(second)) = (used.next(), used.next()) {
            let path = format!("{}.{second}", self.look);
            let message = format!(
                "`{path}`: the colour is already given by `{first}`; use one form only: eumelanin and \
                 pheomelanin, melanin and redness, color, or absorption"
            );
            return Err(self.source.at_key(SceneErrorKind::Conflict, &path, message));
        }
        let constants = |default| match look.melanin_constants {
            None => default,
            Some(MelaninConstantsKind::Pbrt) => MelaninConstants::Pbrt,
            Some(MelaninConstantsKind::Cycles) => MelaninConstants::Cycles,
        };
        if (look.color.is_some() || look.absorption.is_some()) && look.melanin_constants.is_some() {
            let path = format!("{}.melanin_constants", self.look);
            let message = format!("`{path}` means nothing where the colour is not given by melanin");
            return Err(self.source.at_key(SceneErrorKind::Conflict, &path, message));
        }
        if let Some(color) = &look.color {
            return Ok(Pigment::Color(self.param("color", Some(color), 0.5, UNIT)?));
        }
        if let Some(sigma_a) = &look.absorption {
            let sigma_a = self.param("absorption", Some(sigma_a), 0.2, ABSORPTION)?;
            return Ok(Pigment::Absorption(sigma_a));
        }
        if share {
            return Ok(Pigment::Share {
                melanin: self.param("melanin", look.melanin.as_ref(), 0.8, UNIT)?,
                redness: self.param("redness", look.redness.as_ref(), 0.0, UNIT)?,
                constants: constants(MelaninConstants::Cycles),
            });
        }
        // One of the pair alone means that there is none of the other; neither means brown.
        let (eumelanin, pheomelanin) = match look.preset {
            Some(preset) => preset_pigment(preset),
            None if concentrations => (Param::from(0.0), Param::from(0.0)),
            None => preset_pigment(PresetKind::Brown),
        };
        // What varies without saying around what varies around the preset, if there is one.
        let around =
            |preset: &Param, brown| if look.preset.is_some() { middle(preset).unwrap_or(brown) } else { brown };
        let (e, p) = (around(&eumelanin, 1.3), around(&pheomelanin, 0.2));
        let eumelanin = look.eumelanin.as_ref().unwrap_or(&eumelanin);
        let pheomelanin = look.pheomelanin.as_ref().unwrap_or(&pheomelanin);
        Ok(Pigment::Concentrations {
            eumelanin: self.param("eumelanin", Some(eumelanin), e, CONCENTRATION)?,
            pheomelanin: self.param("pheomelanin", Some(pheomelanin), p, CONCENTRATION)?,
            constants: constants(MelaninConstants::Pbrt),
        })
    }

    /// A parameter from what the file says about it.
    fn param<T: Quantity>(
        &mut self,
        key: &str,
        param: Option<&Param>,
        default: f64,
        range: Range,
    ) -> Result<Varying<T>, SceneError> {
        let path = format!("{}.{key}", self.look);
        let (least, most) = (range.0 as f32, range.1 as f32);
        let plain = |base| Varying { base, least, most, variation: None };
        let variation = match param {
            None => return self.tone(&path, Tone::Grey(default), range).map(plain),
            Some(Param::Constant(tone)) => return self.tone(&path, *tone, range).map(plain),
            Some(Param::Varying(variation)) => variation.as_ref(),
        };
        if variation.value.is_some() && variation.ramp.is_some() {
            let path = format!("{path}.ramp");
            let message = format!("`{path}` stands beside `value`; give one of the two");
            return Err(self.source.at_key(SceneErrorKind::Conflict, &path, message));
        }
        let scale = self.finite(&path, "scale", variation.scale.unwrap_or(1.0), (-1e6, 1e6))?;
        let width = f64::from(most) - f64::from(least);
        let random = self.finite(&path, "random", variation.random.unwrap_or(0.0), (0.0, width))?;
        let noise = variation.noise.clone().unwrap_or(NoiseSection { amount: 0.0, frequency: 1.0, seed: None });
        let noise_amount = self.finite(&path, "noise.amount", noise.amount, (0.0, width))?;
        let frequency = self.finite(&path, "noise.frequency", noise.frequency, (0.0, 1e4))?;
        let ramp = self.ramp::<T>(&path, variation.ramp.as_deref(), range)?;
        let value = variation.value.unwrap_or(Tone::Grey(default));
        let value: T = self.tone(&format!("{path}.value"), value, range)?;
        let base = ramp.first().map_or(value, |&(_, first)| first).scaled(scale, 0.0);
        let mut varying = plain(base.limited(least, most).unwrap_or(value));
        if let Some(name) = &variation.attribute
            && !self.attributes.contains(name)
        {
            self.attributes.push(name.clone());
        }
        if !ramp.is_empty() || variation.attribute.is_some() || random > 0.0 || noise_amount > 0.0 {
            self.varies = true;
            varying.variation = Some(Box::new(InMemory {
                ramp,
                attribute: variation.attribute.clone(),
                scale,
                random,
                random_stream: stream(key, variation.seed, 1),
                noise: noise_amount,
                frequency,
                noise_stream: stream(key, noise.seed, 2),
            }));
        }
        Ok(varying)
    }

    fn ramp<T: Quantity>(
        &self,
        path: &str,
        ramp: Option<&[(f64, Tone)]>,
        range: Range,
    ) -> Result<Vec<(f32, T)>, SceneError> {
        let Some(points) = ramp else { return Ok(Vec::new()) };
        let path = format!("{path}.ramp");
        if points.is_empty() {
            let message = format!("`{path}` is empty; it needs pairs such as [[0.0, 9.0], [1.0, 6.0]]");
            return Err(self.source.at_value(SceneErrorKind::Missing, &path, message));
        }
        let mut last = 0.0;
        let mut out = Vec::with_capacity(points.len());
        for (index, &(u, tone)) in points.iter().enumerate() {
            let path = format!("{path}.{index}");
            // Written so that a NaN is refused too.
            if !(last..=1.0).contains(&u) {
                let message = format!("`{path}` is at {u}; places rise from 0 at the root to 1 at the tip");
                return Err(self.source.at_value(SceneErrorKind::OutOfRange, &path, message));
            }
            last = u;
            out.push((u as f32, self.tone(&path, tone, range)?));
        }
        Ok(out)
    }

    /// A value within its range.
    fn tone<T: Quantity>(&self, path: &str, tone: Tone, range: Range) -> Result<T, SceneError> {
        let (least, most) = range;
        for x in tone.rgb() {
            if !(least..=most).contains(&x) {
                let message = format!("`{path}` is {x}; it must be between {least} and {most}");
                return Err(self.source.at_value(SceneErrorKind::OutOfRange, path, message));
            }
        }
        T::from_tone(tone).and_then(|value| value.limited(least as f32, most as f32)).ok_or_else(|| {
            let message = format!("`{path}` takes one number, not a colour");
            self.source.at_value(SceneErrorKind::WrongType, path, message)
        })
    }

    fn finite(&self, path: &str, key: &str, x: f64, range: Range) -> Result<f32, SceneError> {
        let (least, most) = range;
        if (least..=most).contains(&x) {
            return Ok(x as f32);
        }
        let path = format!("{path}.{key}");
        let message = format!("`{path}` is {x}; it must be between {least} and {most}");
        Err(self.source.at_value(SceneErrorKind::OutOfRange, &path, message))
    }
}
