//! A model whose parameters vary.

use std::sync::Arc;

use fiber::absorption::{self, MelaninConstants};
use fiber::multiple::albedo::{AlbedoCurve, AlbedoGrid};
use fiber::{
    ArtistLobe, Attenuation, Caustic, Chiang, Deon, Fiber, Field, Fur, Glint, Hery, HeryLobe, HeryMode, Highlight,
    KajiyaKay, KajiyaKayMode, Lambertian, Marschner, MarschnerNorm, Medulla, Roots, Sadeghi, SadeghiMode, Weights,
};
use math::Rgb;

use super::StrandPoint;
use super::varying::Varying;

/// A model with parameters that may vary; angles in degrees.
#[derive(Clone, Debug)]
pub(super) enum Shader {
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
        field: Field,
    },
    Lambertian {
        albedo: Varying<Rgb>,
    },
    KajiyaKay {
        diffuse: Varying<Rgb>,
        highlights: [VaryingHighlight; 2],
        mode: KajiyaKayMode,
    },
    Hery {
        lobes: [VaryingHery; 2],
        mode: HeryMode,
        cos_theta_d: bool,
    },
    Marschner {
        pigment: Pigment,
        longitudinal_deg: Varying<f32>,
        tilt_deg: Varying<f32>,
        ior: Varying<f32>,
        eccentricity: Varying<f32>,
        diffuse: Varying<Rgb>,
        roots: Roots,
        norm: MarschnerNorm,
        caustic: Option<VaryingCaustic>,
    },
    Sadeghi {
        lobes: [VaryingArtistLobe; 3],
        tt_azimuthal_deg: Varying<f32>,
        glint_intensity: Varying<f32>,
        glint_width_deg: Varying<f32>,
        glint_angle_deg: Varying<f32>,
        mode: SadeghiMode,
    },
    Fur {
        pigment: Pigment,
        longitudinal_deg: Varying<f32>,
        azimuthal_deg: Option<Varying<f32>>,
        tilt_deg: Varying<f32>,
        ior: Varying<f32>,
        layers: Varying<f32>,
        medulla: VaryingMedulla,
    },
}

#[derive(Clone, Debug)]
pub(super) struct VaryingHighlight {
    pub(super) color: Varying<Rgb>,
    pub(super) exponent: Varying<f32>,
    pub(super) shift_deg: Varying<f32>,
}

#[derive(Clone, Debug)]
pub(super) struct VaryingHery {
    pub(super) tint: Varying<Rgb>,
    pub(super) roughness_deg: Varying<f32>,
    pub(super) tilt_deg: Varying<f32>,
}

#[derive(Clone, Debug)]
pub(super) struct VaryingCaustic {
    pub(super) strength: Varying<f32>,
    pub(super) width_deg: Varying<f32>,
    pub(super) fade: Varying<f32>,
    pub(super) limit: Varying<f32>,
}

#[derive(Clone, Debug)]
pub(super) struct VaryingArtistLobe {
    pub(super) color: Varying<Rgb>,
    pub(super) intensity: Varying<f32>,
    pub(super) shift_deg: Varying<f32>,
    pub(super) width_deg: Varying<f32>,
}

#[derive(Clone, Debug)]
pub(super) struct VaryingMedulla {
    pub(super) radius: Varying<f32>,
    pub(super) scattering: Varying<f32>,
    pub(super) absorption: Varying<Rgb>,
    pub(super) anisotropy: Varying<f32>,
}

/// Where the absorption comes from.
#[derive(Clone, Debug)]
pub(super) enum Pigment {
    Concentrations {
        eumelanin: Varying<f32>,
        pheomelanin: Varying<f32>,
        constants: MelaninConstants,
    },
    Share {
        melanin: Varying<f32>,
        redness: Varying<f32>,
        constants: MelaninConstants,
    },
    /// By the published fit.
    Fit(Varying<Rgb>),
    /// By a simulation of dense hair of this fiber.
    Numeric(Varying<Rgb>, Arc<Inverse>),
    Absorption(Varying<Rgb>),
}

/// From the colour of dense hair to absorption.
#[derive(Debug)]
pub(super) enum Inverse {
    /// For one roughness.
    Curve(AlbedoCurve),
    /// For roughness that varies.
    Grid(AlbedoGrid),
}

impl Pigment {
    /// Absorption per radius; `roughness` is longitudinal and azimuthal, in the units of the model, and `fit` is
    /// Chiang's azimuthal one, which the published colour fit needs.
    #[inline]
    pub(super) fn sigma_a(&self, at: Option<&StrandPoint<'_>>, roughness: [f32; 2], fit: f32) -> Rgb {
        match self {
            Self::Concentrations { eumelanin, pheomelanin, constants } => {
                absorption::from_melanin(eumelanin.at(at), pheomelanin.at(at), *constants)
            }
            Self::Share { melanin, redness, constants } => {
                absorption::from_cycles_melanin_with(melanin.at(at), redness.at(at), *constants)
            }
            Self::Fit(color) => absorption::from_color(color.at(at), fit),
            Self::Numeric(color, inverse) => match inverse.as_ref() {
                Inverse::Curve(curve) => curve.sigma_a(color.at(at)),
                Inverse::Grid(grid) => grid.sigma_a(color.at(at), roughness[0], roughness[1]),
            },
            Self::Absorption(sigma_a) => sigma_a.at(at),
        }
    }
}

/// The roughness at which d'Eon's fibers, which have none of that kind, invert a colour.
pub(super) const COLOUR_FIT_ROUGHNESS: f32 = 0.3;

impl Shader {
    pub(super) fn fiber(&self, at: Option<&StrandPoint<'_>>) -> Fiber {
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
                let azimuthal = azimuthal_deg.as_ref().map_or(longitudinal, |deg| deg.at(at).to_radians());
                Fiber::Deon(Deon {
                    eta: ior.at(at),
                    sigma_a: pigment.sigma_a(at, [longitudinal, azimuthal], COLOUR_FIT_ROUGHNESS),
                    beta_m: longitudinal,
                    beta_n: azimuthal,
                    alpha: tilt_deg.at(at).to_radians(),
                    residual: *residual,
                    attenuation: *attenuation,
                    weights: *weights,
                    field: *field,
                })
            }
            Self::Chiang { pigment, longitudinal, azimuthal, tilt_deg, ior, field } => {
                let (longitudinal, azimuthal) = (longitudinal.at(at), azimuthal.at(at));
                Fiber::Chiang(Chiang {
                    beta_m: longitudinal,
                    beta_n: azimuthal,
                    alpha: tilt_deg.at(at).to_radians(),
                    eta: ior.at(at),
                    sigma_a: pigment.sigma_a(at, [longitudinal, azimuthal], azimuthal),
                    field: *field,
                })
            }
            Self::Lambertian { albedo } => Fiber::Lambertian(Lambertian { albedo: albedo.at(at) }),
            Self::KajiyaKay { diffuse, highlights, mode } => Fiber::KajiyaKay(KajiyaKay {
                diffuse: diffuse.at(at),
                highlights: [0, 1].map(|i| Highlight {
                    color: highlights[i].color.at(at),
                    exponent: highlights[i].exponent.at(at),
                    shift: highlights[i].shift_deg.at(at).to_radians(),
                }),
                mode: *mode,
            }),
            Self::Hery { lobes, mode, cos_theta_d } => Fiber::Hery(Hery {
                lobes: [0, 1].map(|i| HeryLobe {
                    tint: lobes[i].tint.at(at),
                    beta: lobes[i].roughness_deg.at(at).to_radians(),
                    alpha: lobes[i].tilt_deg.at(at).to_radians(),
                }),
                mode: *mode,
                cos_theta_d: *cos_theta_d,
            }),
            Self::Marschner {
                pigment,
                longitudinal_deg,
                tilt_deg,
                ior,
                eccentricity,
                diffuse,
                roots,
                norm,
                caustic,
            } => Fiber::Marschner(Marschner {
                eta: ior.at(at),
                sigma_a: pigment.sigma_a(at, [longitudinal_deg.at(at).to_radians(); 2], COLOUR_FIT_ROUGHNESS),
                beta_m: longitudinal_deg.at(at).to_radians(),
                alpha: tilt_deg.at(at).to_radians(),
                eccentricity: eccentricity.at(at),
                roots: *roots,
                norm: *norm,
                caustic: caustic.as_ref().map(|caustic| Caustic {
                    strength: caustic.strength.at(at),
                    width: caustic.width_deg.at(at).to_radians(),
                    fade: caustic.fade.at(at),
                    limit: caustic.limit.at(at),
                }),
                diffuse: diffuse.at(at),
            }),
            Self::Sadeghi { lobes, tt_azimuthal_deg, glint_intensity, glint_width_deg, glint_angle_deg, mode } => {
                Fiber::Sadeghi(Sadeghi {
                    lobes: [0, 1, 2].map(|p| ArtistLobe {
                        color: lobes[p].color.at(at),
                        intensity: lobes[p].intensity.at(at),
                        shift: lobes[p].shift_deg.at(at).to_radians(),
                        width: lobes[p].width_deg.at(at).to_radians(),
                    }),
                    tt_azimuthal_width: tt_azimuthal_deg.at(at).to_radians(),
                    glint: Glint {
                        intensity: glint_intensity.at(at),
                        width: glint_width_deg.at(at).to_radians(),
                        angle: glint_angle_deg.at(at).to_radians(),
                    },
                    mode: *mode,
                })
            }
            Self::Fur { pigment, longitudinal_deg, azimuthal_deg, tilt_deg, ior, layers, medulla } => {
                let longitudinal = longitudinal_deg.at(at).to_radians();
                let azimuthal = azimuthal_deg.as_ref().map_or(longitudinal, |deg| deg.at(at).to_radians());
                Fiber::Fur(Fur {
                    eta: ior.at(at),
                    sigma_a: pigment.sigma_a(at, [longitudinal, azimuthal], COLOUR_FIT_ROUGHNESS),
                    beta_m: longitudinal,
                    beta_n: azimuthal,
                    alpha: tilt_deg.at(at).to_radians(),
                    layers: layers.at(at),
                    medulla: Medulla {
                        radius: medulla.radius.at(at),
                        scattering: medulla.scattering.at(at),
                        absorption: medulla.absorption.at(at),
                        anisotropy: medulla.anisotropy.at(at),
                    },
                })
            }
        }
    }
}
