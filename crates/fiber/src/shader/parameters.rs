//! Parameters of the models as the shaders read them: twins of the structures in `shaders/model/`.
//!
//! Names and order are those of the WGSL; numbers called `_pad` fill what its layout leaves between them. A
//! test compares size and offsets.

use bytemuck::{Pod, Zeroable};

use crate::{Attenuation, Fiber, Field, HeryMode, KajiyaKayMode, MarschnerNorm, Roots, SadeghiMode};

/// Parameters of `deon_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Deon {
    /// Absorption per fiber radius.
    pub sigma_a: [f32; 3],
    /// Relative index of refraction.
    pub eta: f32,
    /// Longitudinal standard deviation of lobe R, radians.
    pub beta_m: f32,
    /// Azimuthal standard deviation of lobe R, radians. In the far field at least 7.5 degrees: the shader has one
    /// quadrature rule.
    pub beta_n: f32,
    /// Tilt of the scales, radians.
    pub alpha: f32,
    /// 1 if higher orders are kept, else 0.
    pub residual: u32,
    /// 0 at half the difference of the inclinations, 1 at the known one.
    pub attenuation: u32,
    /// 0 near, 1 far, 2 by width.
    pub field: u32,
    _pad: [u32; 2],
}

/// Parameters of `chiang_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Chiang {
    /// Absorption per fiber radius.
    pub sigma_a: [f32; 3],
    /// Relative index of refraction.
    pub eta: f32,
    /// Longitudinal roughness, `(0, 1]`.
    pub beta_m: f32,
    /// Azimuthal roughness, `(0, 1]`. In the far field at least 0.2: the shader has one quadrature rule.
    pub beta_n: f32,
    /// Tilt of the scales, radians.
    pub alpha: f32,
    /// 0 near, 1 far, 2 by width.
    pub field: u32,
}

/// Parameters of `lambertian_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Lambertian {
    /// Share of the light that leaves again.
    pub albedo: [f32; 3],
    _pad: f32,
}

/// One highlight of [`KajiyaKay`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Highlight {
    /// Specular colour; black is no highlight.
    pub color: [f32; 3],
    /// Exponent.
    pub exponent: f32,
    /// Shift of the tangent, radians.
    pub shift: f32,
    _pad: [f32; 3],
}

/// Parameters of `kajiya_kay_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct KajiyaKay {
    /// Diffuse colour.
    pub diffuse: [f32; 3],
    /// 0 normalised, 1 as in the thesis.
    pub mode: u32,
    /// The first and the second highlight.
    pub highlights: [Highlight; 2],
}

/// One lobe of [`Hery`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct HeryLobe {
    /// Colour; black is no lobe.
    pub tint: [f32; 3],
    /// Standard deviation of the half angle, radians.
    pub beta: f32,
    /// Shift of the half angle, radians.
    pub alpha: f32,
    _pad: [f32; 3],
}

/// Parameters of `hery_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Hery {
    /// The first and the second lobe.
    pub lobes: [HeryLobe; 2],
    /// 0 truncated, 1 faithful, 2 faithful and cut where its sampler cannot go.
    pub mode: u32,
    /// 1 if the value has the squared ratio of cosines, else 0.
    pub cos_theta_d: u32,
    _pad: [u32; 2],
}

/// One lobe of [`Sadeghi`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ArtistLobe {
    /// Colour.
    pub color: [f32; 3],
    /// Intensity.
    pub intensity: f32,
    /// Shift of the half angle, radians.
    pub shift: f32,
    /// Standard deviation of the half angle, radians.
    pub width: f32,
    _pad: [f32; 2],
}

/// The glints of [`Sadeghi`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Glint {
    /// Height relative to the rest of the lobe.
    pub intensity: f32,
    /// Azimuthal standard deviation, radians.
    pub width: f32,
    /// Angle to either side, radians. Differs from strand to strand: a shader overwrites it.
    pub angle: f32,
}

/// Parameters of `sadeghi_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Sadeghi {
    /// R, TT, TRT.
    pub lobes: [ArtistLobe; 3],
    /// Azimuthal standard deviation of TT, radians.
    pub tt_azimuthal_width: f32,
    /// The glints of TRT.
    pub glint: Glint,
    /// 0 normalised, 1 legacy.
    pub mode: u32,
    _pad: [u32; 3],
}

/// How [`Marschner`] blurs its caustic.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Caustic {
    /// Strength of the glints.
    pub strength: f32,
    /// Width, radians.
    pub width: f32,
    /// Range of Bravais' index in which they fade.
    pub fade: f32,
    /// Largest extent in the offset.
    pub limit: f32,
}

/// Parameters of `marschner_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Marschner {
    /// Absorption per fiber radius.
    pub sigma_a: [f32; 3],
    /// Relative index of refraction.
    pub eta: f32,
    /// Lambertian fill.
    pub diffuse: [f32; 3],
    /// Standard deviation of the half angle of lobe R, radians.
    pub beta_m: f32,
    /// Shift of the half angle of lobe R, radians.
    pub alpha: f32,
    /// Minor over major axis.
    pub eccentricity: f32,
    /// 0 exact, 1 cubic.
    pub roots: u32,
    /// 0 normalised, 1 as printed.
    pub norm: u32,
    /// Ignored where `has_caustic` is 0.
    pub caustic: Caustic,
    /// 1 if the caustic is blurred, else 0.
    pub has_caustic: u32,
    _pad: [u32; 3],
}

/// The core of [`Fur`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Medulla {
    /// Absorption per fiber radius.
    pub absorption: [f32; 3],
    /// Radius in fiber radii.
    pub radius: f32,
    /// Scattering per fiber radius.
    pub scattering: f32,
    /// The radius that the cells are for.
    pub tabulated_radius: f32,
    _pad: [f32; 2],
}

/// Parameters of `fur_eval`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Fur {
    /// Absorption of the cortex per fiber radius.
    pub sigma_a: [f32; 3],
    /// Relative index of refraction.
    pub eta: f32,
    /// Longitudinal standard deviation of lobe R, radians.
    pub beta_m: f32,
    /// Azimuthal standard deviation of lobe R, radians.
    pub beta_n: f32,
    /// Tilt of the scales, radians.
    pub alpha: f32,
    /// Layers of cuticle that reflect.
    pub layers: f32,
    /// The scattering core.
    pub medulla: Medulla,
    /// How this core scatters, at five offsets and four inclinations each.
    pub cells: [[[f32; 4]; 5]; 20],
}

/// Parameters of any model.
#[derive(Clone, Debug, PartialEq)]
pub enum Parameters {
    /// Of part `deon`.
    Deon(Deon),
    /// Of part `chiang`.
    Chiang(Chiang),
    /// Of part `lambertian`.
    Lambertian(Lambertian),
    /// Of part `kajiya_kay`.
    KajiyaKay(KajiyaKay),
    /// Of part `hery`.
    Hery(Hery),
    /// Of part `marschner`.
    Marschner(Marschner),
    /// Of part `sadeghi`.
    Sadeghi(Sadeghi),
    /// Of part `fur`.
    Fur(Box<Fur>),
}

impl Parameters {
    /// What to upload: the structure that the model's `_eval` takes, byte by byte.
    pub fn bytes(&self) -> &[u8] {
        match self {
            Self::Deon(m) => bytemuck::bytes_of(m),
            Self::Chiang(m) => bytemuck::bytes_of(m),
            Self::Lambertian(m) => bytemuck::bytes_of(m),
            Self::KajiyaKay(m) => bytemuck::bytes_of(m),
            Self::Hery(m) => bytemuck::bytes_of(m),
            Self::Marschner(m) => bytemuck::bytes_of(m),
            Self::Sadeghi(m) => bytemuck::bytes_of(m),
            Self::Fur(m) => bytemuck::bytes_of(m.as_ref()),
        }
    }
}

impl From<Fiber<f32>> for Parameters {
    fn from(fiber: Fiber<f32>) -> Self {
        match fiber {
            Fiber::Deon(m) => Self::Deon(m.into()),
            Fiber::Chiang(m) => Self::Chiang(m.into()),
            Fiber::Lambertian(m) => Self::Lambertian(m.into()),
            Fiber::KajiyaKay(m) => Self::KajiyaKay(m.into()),
            Fiber::Hery(m) => Self::Hery(m.into()),
            Fiber::Marschner(m) => Self::Marschner(m.into()),
            Fiber::Sadeghi(m) => Self::Sadeghi(m.into()),
            Fiber::Fur(m) => Self::Fur(Box::new(m.into())),
        }
    }
}

/// The constants `FIELD_*` of `field.wgsl`.
fn field(field: Field) -> u32 {
    match field {
        Field::Near => 0,
        Field::Far => 1,
        Field::Auto => 2,
    }
}

impl From<crate::Deon<f32>> for Deon {
    fn from(m: crate::Deon<f32>) -> Self {
        Self {
            sigma_a: m.sigma_a.0,
            eta: m.eta,
            beta_m: m.beta_m,
            beta_n: m.beta_n,
            alpha: m.alpha,
            residual: u32::from(m.residual),
            attenuation: match m.attenuation {
                Attenuation::Difference => 0,
                Attenuation::Known => 1,
            },
            field: field(m.field),
            _pad: [0; 2],
        }
    }
}

impl From<crate::Chiang<f32>> for Chiang {
    fn from(m: crate::Chiang<f32>) -> Self {
        Self {
            sigma_a: m.sigma_a.0,
            eta: m.eta,
            beta_m: m.beta_m,
            beta_n: m.beta_n,
            alpha: m.alpha,
            field: field(m.field),
        }
    }
}

impl From<crate::Lambertian<f32>> for Lambertian {
    fn from(m: crate::Lambertian<f32>) -> Self {
        Self { albedo: m.albedo.0, _pad: 0.0 }
    }
}

impl From<crate::KajiyaKay<f32>> for KajiyaKay {
    fn from(m: crate::KajiyaKay<f32>) -> Self {
        Self {
            diffuse: m.diffuse.0,
            mode: match m.mode {
                KajiyaKayMode::Normalised => 0,
                KajiyaKayMode::Thesis => 1,
            },
            highlights: m.highlights.map(|highlight| Highlight {
                color: highlight.color.0,
                exponent: highlight.exponent,
                shift: highlight.shift,
                _pad: [0.0; 3],
            }),
        }
    }
}

impl From<crate::Hery<f32>> for Hery {
    fn from(m: crate::Hery<f32>) -> Self {
        Self {
            lobes: m.lobes.map(|lobe| HeryLobe {
                tint: lobe.tint.0,
                beta: lobe.beta,
                alpha: lobe.alpha,
                _pad: [0.0; 3],
            }),
            mode: match m.mode {
                HeryMode::Truncated => 0,
                HeryMode::Faithful => 1,
                HeryMode::FaithfulExactPdf => 2,
            },
            cos_theta_d: u32::from(m.cos_theta_d),
            _pad: [0; 2],
        }
    }
}

impl From<crate::Sadeghi<f32>> for Sadeghi {
    fn from(m: crate::Sadeghi<f32>) -> Self {
        Self {
            lobes: m.lobes.map(|lobe| ArtistLobe {
                color: lobe.color.0,
                intensity: lobe.intensity,
                shift: lobe.shift,
                width: lobe.width,
                _pad: [0.0; 2],
            }),
            tt_azimuthal_width: m.tt_azimuthal_width,
            glint: Glint { intensity: m.glint.intensity, width: m.glint.width, angle: m.glint.angle },
            mode: match m.mode {
                SadeghiMode::Normalised => 0,
                SadeghiMode::Legacy => 1,
            },
            _pad: [0; 3],
        }
    }
}

impl From<crate::Marschner<f32>> for Marschner {
    fn from(m: crate::Marschner<f32>) -> Self {
        let caustic = m.caustic.map(|caustic| Caustic {
            strength: caustic.strength,
            width: caustic.width,
            fade: caustic.fade,
            limit: caustic.limit,
        });
        Self {
            sigma_a: m.sigma_a.0,
            eta: m.eta,
            diffuse: m.diffuse.0,
            beta_m: m.beta_m,
            alpha: m.alpha,
            eccentricity: m.eccentricity,
            roots: match m.roots {
                Roots::Exact => 0,
                Roots::Cubic => 1,
            },
            norm: match m.norm {
                MarschnerNorm::Normalised => 0,
                MarschnerNorm::AsPrinted => 1,
            },
            caustic: caustic.unwrap_or_default(),
            has_caustic: u32::from(caustic.is_some()),
            _pad: [0; 3],
        }
    }
}

impl From<crate::Fur<f32>> for Fur {
    fn from(m: crate::Fur<f32>) -> Self {
        let (tabulated_radius, cells) = m.scattering_cells();
        Self {
            sigma_a: m.sigma_a.0,
            eta: m.eta,
            beta_m: m.beta_m,
            beta_n: m.beta_n,
            alpha: m.alpha,
            layers: m.layers,
            medulla: Medulla {
                absorption: m.medulla.absorption.0,
                radius: m.medulla.radius,
                scattering: m.medulla.scattering,
                tabulated_radius,
                _pad: [0.0; 2],
            },
            cells: bytemuck::cast(cells),
        }
    }
}
