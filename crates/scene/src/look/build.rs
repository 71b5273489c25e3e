//! From the section of a scene file to a shader, checking everything on the way.

use std::sync::Arc;

use fiber::absorption::MelaninConstants;
use fiber::multiple::albedo::{AlbedoCurve, AlbedoGrid};
use fiber::{Attenuation, Field, HeryMode, KajiyaKayMode, MarschnerNorm, Roots, SadeghiMode, Weights};
use math::{Rgb, hash};

use super::shader::{
    Inverse, Pigment, Shader, VaryingArtistLobe, VaryingCaustic, VaryingHery, VaryingHighlight, VaryingMedulla,
};
use super::varying::{InMemory, Quantity, Varying};
use crate::error::{SceneError, SceneErrorKind, closest, quoted_list};
use crate::file::{
    AttenuationKind, ColorMethodKind, FieldKind, LookSection, MelaninConstantsKind, ModeKind, ModelKind, NoiseSection,
    Param, PresetKind, RootsKind, Tone, Variation, WeightsKind,
};
use crate::source::Source;

/// Which numbers a parameter may take.
pub(super) type Range = (f64, f64);

const UNIT: Range = (0.0, 1.0);
const CONCENTRATION: Range = (0.0, 100.0);
const ABSORPTION: Range = (0.0, 1e4);
const ANGLE_DEG: Range = (0.02, 90.0);
const ROUGHNESS: Range = (0.01, 1.0);
const TILT_DEG: Range = (-20.0, 20.0);
const IOR: Range = (1.01, 3.0);
const EXPONENT: Range = (0.0, 1e4);
const INTENSITY: Range = (0.0, 100.0);
const SHIFT_DEG: Range = (-45.0, 45.0);
const ECCENTRICITY: Range = (0.85, 1.0);
const GLINT_WIDTH_DEG: Range = (0.1, 90.0);
const GLINT_ANGLE_DEG: Range = (0.0, 180.0);
const MEDULLA: Range = (0.0, 0.95);
const MEDULLA_SCATTERING: Range = (0.0, 1e3);
const ANISOTROPY: Range = (-0.6, 0.9);
const LAYERS: Range = (1.0, 10.0);

/// Paths by which a colour is inverted: its error is below 0.01.
const INVERSION_PATHS: u32 = 8192;

const PIGMENT_KEYS: [&str; 8] =
    ["eumelanin", "pheomelanin", "melanin", "redness", "color", "color_method", "absorption", "melanin_constants"];

/// The keys that a model takes beside those of the pigment, and whether it takes those too.
pub(super) fn keys_of(model: ModelKind) -> (&'static [&'static str], bool) {
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
        ModelKind::Chiang => (&["longitudinal_roughness", "azimuthal_roughness", "tilt_deg", "ior", "field"], true),
        ModelKind::Lambertian => (&["albedo"], false),
        ModelKind::KajiyaKay => {
            (&["diffuse", "specular", "exponent", "shift_deg", "specular2", "exponent2", "shift2_deg", "mode"], false)
        }
        ModelKind::Hery => (
            &["tint", "roughness_deg", "tilt_deg", "tint2", "roughness2_deg", "tilt2_deg", "mode", "cos_theta_d"],
            false,
        ),
        ModelKind::Marschner => (
            &[
                "longitudinal_roughness_deg",
                "tilt_deg",
                "ior",
                "eccentricity",
                "diffuse",
                "roots",
                "glints",
                "glint_strength",
                "glint_width_deg",
                "glint_fade",
                "glint_limit",
                "mode",
            ],
            true,
        ),
        ModelKind::Sadeghi => (
            &[
                "r_color",
                "r_intensity",
                "r_shift_deg",
                "r_width_deg",
                "tt_color",
                "tt_intensity",
                "tt_shift_deg",
                "tt_width_deg",
                "tt_azimuthal_width_deg",
                "trt_color",
                "trt_intensity",
                "trt_shift_deg",
                "trt_width_deg",
                "glint_intensity",
                "glint_width_deg",
                "glint_angle_deg",
                "mode",
            ],
            false,
        ),
        ModelKind::Fur => (
            &[
                "longitudinal_roughness_deg",
                "azimuthal_roughness_deg",
                "tilt_deg",
                "ior",
                "cuticle_layers",
                "medulla",
                "medulla_scattering",
                "medulla_absorption",
                "medulla_anisotropy",
            ],
            true,
        ),
    }
}

pub(super) fn model_name(model: ModelKind) -> &'static str {
    match model {
        ModelKind::Deon => "deon",
        ModelKind::Chiang => "chiang",
        ModelKind::Lambertian => "lambertian",
        ModelKind::KajiyaKay => "kajiya_kay",
        ModelKind::Hery => "hery",
        ModelKind::Marschner => "marschner",
        ModelKind::Sadeghi => "sadeghi",
        ModelKind::Fur => "fur",
    }
}

pub(super) fn field(look: &LookSection) -> Field {
    match look.field {
        None | Some(FieldKind::Near) => Field::Near,
        Some(FieldKind::Far) => Field::Far,
        Some(FieldKind::Auto) => Field::Auto,
    }
}

/// The keys that a section gives, except model and preset.
pub(super) fn given(look: &LookSection) -> Vec<&'static str> {
    let all = [
        ("eumelanin", look.eumelanin.is_some()),
        ("pheomelanin", look.pheomelanin.is_some()),
        ("melanin", look.melanin.is_some()),
        ("redness", look.redness.is_some()),
        ("color", look.color.is_some()),
        ("color_method", look.color_method.is_some()),
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
        ("shift_deg", look.shift_deg.is_some()),
        ("specular2", look.specular2.is_some()),
        ("exponent2", look.exponent2.is_some()),
        ("shift2_deg", look.shift2_deg.is_some()),
        ("tint", look.tint.is_some()),
        ("roughness_deg", look.roughness_deg.is_some()),
        ("tint2", look.tint2.is_some()),
        ("roughness2_deg", look.roughness2_deg.is_some()),
        ("tilt2_deg", look.tilt2_deg.is_some()),
        ("eccentricity", look.eccentricity.is_some()),
        ("roots", look.roots.is_some()),
        ("glints", look.glints.is_some()),
        ("glint_strength", look.glint_strength.is_some()),
        ("glint_width_deg", look.glint_width_deg.is_some()),
        ("glint_fade", look.glint_fade.is_some()),
        ("glint_limit", look.glint_limit.is_some()),
        ("glint_intensity", look.glint_intensity.is_some()),
        ("glint_angle_deg", look.glint_angle_deg.is_some()),
        ("r_color", look.r_color.is_some()),
        ("r_intensity", look.r_intensity.is_some()),
        ("r_shift_deg", look.r_shift_deg.is_some()),
        ("r_width_deg", look.r_width_deg.is_some()),
        ("tt_color", look.tt_color.is_some()),
        ("tt_intensity", look.tt_intensity.is_some()),
        ("tt_shift_deg", look.tt_shift_deg.is_some()),
        ("tt_width_deg", look.tt_width_deg.is_some()),
        ("tt_azimuthal_width_deg", look.tt_azimuthal_width_deg.is_some()),
        ("trt_color", look.trt_color.is_some()),
        ("trt_intensity", look.trt_intensity.is_some()),
        ("trt_shift_deg", look.trt_shift_deg.is_some()),
        ("trt_width_deg", look.trt_width_deg.is_some()),
        ("medulla", look.medulla.is_some()),
        ("medulla_scattering", look.medulla_scattering.is_some()),
        ("medulla_absorption", look.medulla_absorption.is_some()),
        ("medulla_anisotropy", look.medulla_anisotropy.is_some()),
        ("cuticle_layers", look.cuticle_layers.is_some()),
        ("cos_theta_d", look.cos_theta_d.is_some()),
        ("mode", look.mode.is_some()),
    ];
    all.into_iter().filter(|&(_, is_given)| is_given).map(|(key, _)| key).collect()
}

/// Eumelanin and pheomelanin of a named colour.
pub(super) fn preset_pigment(preset: PresetKind) -> (Param, Param) {
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
pub(super) fn middle(param: &Param) -> Option<f64> {
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
pub(super) fn stream(key: &str, seed: Option<u32>, salt: u32) -> u32 {
    let word = seed.unwrap_or_else(|| {
        key.bytes().fold(0x811c_9dc5, |word, byte| (word ^ u32::from(byte)).wrapping_mul(0x0100_0193))
    });
    hash::mix2(word, salt)
}

/// Turns the section of a look into its form in memory, checking everything on the way.
pub(super) struct Builder<'s, 't> {
    pub(super) source: &'s Source<'t>,
    pub(super) look: String,
    pub(super) attributes: Vec<String>,
    pub(super) varies: bool,
    pub(super) warnings: Vec<String>,
}

impl Builder<'_, '_> {
    pub(super) fn shader(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        let model = look.model.unwrap_or_default();
        self.check_keys(look, model)?;
        match model {
            ModelKind::Deon => {
                let azimuthal_deg = self.azimuthal(look)?;
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
                    field: field(look),
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
                field: field(look),
            }),
            ModelKind::Lambertian => {
                Ok(Shader::Lambertian { albedo: self.param("albedo", look.albedo.as_ref(), 0.5, UNIT)? })
            }
            ModelKind::KajiyaKay => self.kajiya_kay(look),
            ModelKind::Hery => self.hery(look),
            ModelKind::Marschner => self.marschner(look),
            ModelKind::Sadeghi => self.sadeghi(look),
            ModelKind::Fur => self.fur(look),
        }
    }

    pub(super) fn hery(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        let mode = match look.mode {
            None | Some(ModeKind::Truncated) => HeryMode::Truncated,
            Some(ModeKind::Faithful) => HeryMode::Faithful,
            Some(ModeKind::FaithfulExactPdf) => HeryMode::FaithfulExactPdf,
            Some(_) => return Err(self.wrong_mode("`truncated`, `faithful`, `faithful_exact_pdf`")),
        };
        let lobes = [
            VaryingHery {
                tint: self.param("tint", look.tint.as_ref(), 1.0, UNIT)?,
                roughness_deg: self.param("roughness_deg", look.roughness_deg.as_ref(), 5.0, ANGLE_DEG)?,
                tilt_deg: self.param("tilt_deg", look.tilt_deg.as_ref(), -2.0, TILT_DEG)?,
            },
            VaryingHery {
                tint: self.param("tint2", look.tint2.as_ref(), 0.0, UNIT)?,
                roughness_deg: self.param("roughness2_deg", look.roughness2_deg.as_ref(), 10.0, ANGLE_DEG)?,
                tilt_deg: self.param("tilt2_deg", look.tilt2_deg.as_ref(), 5.0, TILT_DEG)?,
            },
        ];
        let most = (lobes[0].tint.base + lobes[1].tint.base).max_channel();
        self.warn_if_gaining("tint and tint2 add up to", most);
        Ok(Shader::Hery { lobes, mode, cos_theta_d: look.cos_theta_d.unwrap_or(false) })
    }

    pub(super) fn marschner(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        let norm = match look.mode {
            None | Some(ModeKind::Normalised) => MarschnerNorm::Normalised,
            Some(ModeKind::AsPrinted) => MarschnerNorm::AsPrinted,
            Some(_) => return Err(self.wrong_mode("`normalised`, `as_printed`")),
        };
        let caustic = VaryingCaustic {
            strength: self.param("glint_strength", look.glint_strength.as_ref(), 1.0, (0.0, 5.0))?,
            width_deg: self.param("glint_width_deg", look.glint_width_deg.as_ref(), 15.0, GLINT_WIDTH_DEG)?,
            fade: self.param("glint_fade", look.glint_fade.as_ref(), 0.3, (0.001, 1.0))?,
            limit: self.param("glint_limit", look.glint_limit.as_ref(), 0.5, UNIT)?,
        };
        Ok(Shader::Marschner {
            pigment: self.pigment(look)?,
            longitudinal_deg: self.param(
                "longitudinal_roughness_deg",
                look.longitudinal_roughness_deg.as_ref(),
                7.5,
                ANGLE_DEG,
            )?,
            tilt_deg: self.param("tilt_deg", look.tilt_deg.as_ref(), -5.0, TILT_DEG)?,
            ior: self.param("ior", look.ior.as_ref(), 1.55, IOR)?,
            eccentricity: self.param("eccentricity", look.eccentricity.as_ref(), 1.0, ECCENTRICITY)?,
            diffuse: self.param("diffuse", look.diffuse.as_ref(), 0.0, UNIT)?,
            roots: match look.roots {
                None | Some(RootsKind::Exact) => Roots::Exact,
                Some(RootsKind::Cubic) => Roots::Cubic,
            },
            norm,
            caustic: look.glints.unwrap_or(true).then_some(caustic),
        })
    }

    pub(super) fn sadeghi(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        let mode = match look.mode {
            None | Some(ModeKind::Normalised) => SadeghiMode::Normalised,
            Some(ModeKind::Legacy) => SadeghiMode::Legacy,
            Some(_) => return Err(self.wrong_mode("`normalised`, `legacy`")),
        };
        let tt = Param::Constant(Tone::Colour([0.5, 0.3, 0.15]));
        let trt = Param::Constant(Tone::Colour([0.4, 0.2, 0.08]));
        let lobes = [
            VaryingArtistLobe {
                color: self.param("r_color", look.r_color.as_ref(), 1.0, UNIT)?,
                intensity: self.param("r_intensity", look.r_intensity.as_ref(), 0.45, INTENSITY)?,
                shift_deg: self.param("r_shift_deg", look.r_shift_deg.as_ref(), -5.0, SHIFT_DEG)?,
                width_deg: self.param("r_width_deg", look.r_width_deg.as_ref(), 7.5, ANGLE_DEG)?,
            },
            VaryingArtistLobe {
                color: self.param("tt_color", Some(look.tt_color.as_ref().unwrap_or(&tt)), 0.3, UNIT)?,
                intensity: self.param("tt_intensity", look.tt_intensity.as_ref(), 0.25, INTENSITY)?,
                shift_deg: self.param("tt_shift_deg", look.tt_shift_deg.as_ref(), 2.5, SHIFT_DEG)?,
                width_deg: self.param("tt_width_deg", look.tt_width_deg.as_ref(), 3.75, ANGLE_DEG)?,
            },
            VaryingArtistLobe {
                color: self.param("trt_color", Some(look.trt_color.as_ref().unwrap_or(&trt)), 0.2, UNIT)?,
                intensity: self.param("trt_intensity", look.trt_intensity.as_ref(), 0.3, INTENSITY)?,
                shift_deg: self.param("trt_shift_deg", look.trt_shift_deg.as_ref(), 7.5, SHIFT_DEG)?,
                width_deg: self.param("trt_width_deg", look.trt_width_deg.as_ref(), 15.0, ANGLE_DEG)?,
            },
        ];
        if mode == SadeghiMode::Normalised {
            let gain = |lobe: &VaryingArtistLobe| lobe.color.base * lobe.intensity.base;
            let most = (gain(&lobes[0]) + gain(&lobes[1]) + gain(&lobes[2])).max_channel();
            self.warn_if_gaining("the lobes' colours times their intensities add up to", most);
        }
        // Where nothing is said every strand has glints of its own, between 30 and 45 degrees.
        let spread = Variation { value: Some(Tone::Grey(37.5)), random: Some(7.5), ..Variation::default() };
        let angle = look.glint_angle_deg.clone().unwrap_or_else(|| Param::Varying(Box::new(spread)));
        Ok(Shader::Sadeghi {
            lobes,
            tt_azimuthal_deg: self.param(
                "tt_azimuthal_width_deg",
                look.tt_azimuthal_width_deg.as_ref(),
                10.0,
                ANGLE_DEG,
            )?,
            glint_intensity: self.param("glint_intensity", look.glint_intensity.as_ref(), 1.0, INTENSITY)?,
            glint_width_deg: self.param("glint_width_deg", look.glint_width_deg.as_ref(), 5.0, GLINT_WIDTH_DEG)?,
            glint_angle_deg: self.param("glint_angle_deg", Some(&angle), 37.5, GLINT_ANGLE_DEG)?,
            mode,
        })
    }

    pub(super) fn fur(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        Ok(Shader::Fur {
            pigment: self.pigment(look)?,
            longitudinal_deg: self.param(
                "longitudinal_roughness_deg",
                look.longitudinal_roughness_deg.as_ref(),
                7.5,
                ANGLE_DEG,
            )?,
            azimuthal_deg: self.azimuthal(look)?,
            tilt_deg: self.param("tilt_deg", look.tilt_deg.as_ref(), -3.0, TILT_DEG)?,
            ior: self.param("ior", look.ior.as_ref(), 1.55, IOR)?,
            layers: self.param("cuticle_layers", look.cuticle_layers.as_ref(), 1.0, LAYERS)?,
            medulla: VaryingMedulla {
                radius: self.param("medulla", look.medulla.as_ref(), 0.6, MEDULLA)?,
                scattering: self.param(
                    "medulla_scattering",
                    look.medulla_scattering.as_ref(),
                    2.0,
                    MEDULLA_SCATTERING,
                )?,
                absorption: self.param("medulla_absorption", look.medulla_absorption.as_ref(), 0.0, ABSORPTION)?,
                anisotropy: self.param("medulla_anisotropy", look.medulla_anisotropy.as_ref(), 0.4, ANISOTROPY)?,
            },
        })
    }

    /// The azimuthal width, if it is given.
    pub(super) fn azimuthal(&mut self, look: &LookSection) -> Result<Option<Varying<f32>>, SceneError> {
        let Some(param) = &look.azimuthal_roughness_deg else { return Ok(None) };
        let like = look.longitudinal_roughness_deg.as_ref().and_then(middle).unwrap_or(7.5);
        self.param("azimuthal_roughness_deg", Some(param), like, ANGLE_DEG).map(Some)
    }

    /// Says so where a fiber gives back more than it gets.
    pub(super) fn warn_if_gaining(&mut self, what: &str, most: f32) {
        if most > 1.0 + 1e-6 {
            self.warnings
                .push(format!("`{}`: {what} {most}; above 1 the fiber reflects more than it receives", self.look));
        }
    }

    pub(super) fn kajiya_kay(&mut self, look: &LookSection) -> Result<Shader, SceneError> {
        let mode = match look.mode {
            None | Some(ModeKind::Normalised) => KajiyaKayMode::Normalised,
            Some(ModeKind::Thesis) => KajiyaKayMode::Thesis,
            Some(_) => return Err(self.wrong_mode("`normalised`, `thesis`")),
        };
        let brown = Param::Constant(Tone::Colour([0.4, 0.25, 0.15]));
        let diffuse = look.diffuse.as_ref().unwrap_or(&brown);
        let diffuse: Varying<Rgb> = self.param("diffuse", Some(diffuse), 0.25, UNIT)?;
        let highlights = [
            VaryingHighlight {
                color: self.param("specular", look.specular.as_ref(), 0.2, UNIT)?,
                exponent: self.param("exponent", look.exponent.as_ref(), 25.0, EXPONENT)?,
                shift_deg: self.param("shift_deg", look.shift_deg.as_ref(), 0.0, TILT_DEG)?,
            },
            VaryingHighlight {
                color: self.param("specular2", look.specular2.as_ref(), 0.0, UNIT)?,
                exponent: self.param("exponent2", look.exponent2.as_ref(), 25.0, EXPONENT)?,
                shift_deg: self.param("shift2_deg", look.shift2_deg.as_ref(), 0.0, TILT_DEG)?,
            },
        ];
        if mode == KajiyaKayMode::Normalised {
            let most = (diffuse.base + highlights[0].color.base + highlights[1].color.base).max_channel();
            self.warn_if_gaining("diffuse and specular add up to", most);
        }
        Ok(Shader::KajiyaKay { diffuse, highlights, mode })
    }

    pub(super) fn wrong_mode(&self, choice: &str) -> SceneError {
        let path = format!("{}.mode", self.look);
        let message = format!("`{path}` is of another model; this one has the modes {choice}");
        self.source.at_value(SceneErrorKind::Conflict, &path, message)
    }

    /// Refuses parameters of other models.
    pub(super) fn check_keys(&self, look: &LookSection, model: ModelKind) -> Result<(), SceneError> {
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
            let message = format!(
                "`{path}`: presets are pigments, for `deon`, `chiang`, `marschner` and `fur`; this is `{name}`"
            );
            return Err(self.source.at_key(SceneErrorKind::Conflict, &path, message));
        }
        Ok(())
    }

    /// Puts the numeric inversion of the colour where the look asks for it.
    pub(super) fn invert_colour(&mut self, shader: &mut Shader, look: &LookSection) -> Result<(), SceneError> {
        let path = format!("{}.color_method", self.look);
        if look.color_method.is_some() && look.color.is_none() {
            let message = format!("`{path}` means nothing without `color`");
            return Err(self.source.at_key(SceneErrorKind::Conflict, &path, message));
        }
        let default =
            if matches!(shader, Shader::Deon { .. }) { ColorMethodKind::Numeric } else { ColorMethodKind::Fit };
        if look.color_method.unwrap_or(default) == ColorMethodKind::Fit {
            return Ok(());
        }
        // Widths as the model has them, and the nodes that serve where they vary.
        let base = shader.fiber(None);
        let (pigment, varies, nodes) = match shader {
            Shader::Deon { pigment, longitudinal_deg, azimuthal_deg, .. } => {
                let varies = longitudinal_deg.varies() || azimuthal_deg.as_ref().is_some_and(Varying::varies);
                (pigment, varies, [2.0, 5.0, 10.0, 20.0, 40.0, 90.0].map(f64::to_radians))
            }
            Shader::Chiang { pigment, longitudinal, azimuthal, .. } => {
                (pigment, longitudinal.varies() || azimuthal.varies(), [0.05, 0.2, 0.4, 0.6, 0.8, 1.0])
            }
            _ => {
                let message = format!(
                    "`{path}`: only `deon` and `chiang` can be inverted numerically; leave it out, or say \"fit\""
                );
                return Err(self.source.at_value(SceneErrorKind::Conflict, &path, message));
            }
        };
        let Pigment::Fit(color) = pigment else { return Ok(()) };
        let model = base.cast::<f64>();
        let curve = AlbedoCurve::new(&model, INVERSION_PATHS, 0);
        if let Some(curve) = &curve {
            let lightest = curve.range()[1];
            let asked = f64::from(color.base.max_channel());
            if asked > lightest + 0.02 {
                self.warnings.push(format!(
                    "`{}.color`: {asked} is lighter than dense hair of this fiber gets without pigment, {lightest:.2}; \
                     `attenuation = \"known\"` loses nothing",
                    self.look
                ));
            }
        }
        let inverse = if varies {
            AlbedoGrid::new(&model, &nodes, &nodes, INVERSION_PATHS / 16, 0).map(Inverse::Grid)
        } else {
            curve.map(Inverse::Curve)
        };
        if let Some(inverse) = inverse {
            *pigment = Pigment::Numeric(color.clone(), Arc::new(inverse));
        }
        Ok(())
    }

    pub(super) fn pigment(&mut self, look: &LookSection) -> Result<Pigment, SceneError> {
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
            return Ok(Pigment::Fit(self.param("color", Some(color), 0.5, UNIT)?));
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
    pub(super) fn param<T: Quantity>(
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

    pub(super) fn ramp<T: Quantity>(
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
    pub(super) fn tone<T: Quantity>(&self, path: &str, tone: Tone, range: Range) -> Result<T, SceneError> {
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

    pub(super) fn finite(&self, path: &str, key: &str, x: f64, range: Range) -> Result<f32, SceneError> {
        let (least, most) = range;
        if (least..=most).contains(&x) {
            return Ok(x as f32);
        }
        let path = format!("{path}.{key}");
        let message = format!("`{path}` is {x}; it must be between {least} and {most}");
        Err(self.source.at_value(SceneErrorKind::OutOfRange, &path, message))
    }
}
