//! Scattering models by name, with their parameters as the model pages name them; radians.

use anyhow::{Context, ensure};
use fiber::{
    ArtistLobe, Attenuation, Caustic, Chiang, Deon, Fiber, Field, Fur, Glint, Hery, HeryLobe, HeryMode, Highlight,
    KajiyaKay, KajiyaKayMode, Lambertian, Marschner, MarschnerNorm, Medulla, Roots, Sadeghi, SadeghiMode,
};
use math::Rgb;
use serde::Deserialize;
use serde_json::Value;

/// The models.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum Kind {
    /// Params: sigma_a (number or rgb), eta, beta_M, beta_N, alpha, residual, attenuation (difference, known), field (near, far; far without h)
    Deon,
    /// Params: sigma_a, eta, beta_m, beta_n, alpha, field (near, far; far without h)
    Chiang,
    /// Params: kd
    Lambertian,
    /// Params: kd, ks, m, alpha, ks2, m2, alpha2, mode (normalised, thesis)
    KajiyaKay,
    /// Params: ks, beta, alpha, ks2, beta2, alpha2, mode (truncated, faithful, faithful_exact_pdf), cos_theta_d
    Hery,
    /// Params: sigma_a, eta, beta_R, alpha_R, a, kd, mode (normalised, as_printed), roots (exact, cubic), smoothing, k_G, w_c, delta_eta, delta_h_M
    Marschner,
    /// Params: C_R, I_R, alpha_R, beta_R, the same with TT and TRT, delta_TT, I_G, delta_G, G_angle, mode (normalised, legacy)
    Sadeghi,
    /// Params: sigma_a, eta, beta_M, beta_N, alpha, layers, kappa, sigma_ms, sigma_ma, g; needs h
    Fur,
}

/// A colour given as one number or three.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "expected a number or [red, green, blue]")]
enum Tone {
    Grey(f64),
    Colour([f64; 3]),
}

impl From<Tone> for Rgb<f64> {
    fn from(tone: Tone) -> Self {
        match tone {
            Tone::Grey(x) => Self::splat(x),
            Tone::Colour(rgb) => Self(rgb),
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct DeonParams {
    sigma_a: Option<Tone>,
    eta: Option<f64>,
    #[serde(alias = "beta_m", alias = "beta_R", alias = "beta")]
    #[serde(rename = "beta_M")]
    beta_m: Option<f64>,
    #[serde(alias = "beta_n")]
    #[serde(rename = "beta_N")]
    beta_n: Option<f64>,
    alpha: f64,
    residual: Option<bool>,
    attenuation: Option<AttenuationName>,
    field: Option<FieldName>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum AttenuationName {
    Difference,
    Known,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum FieldName {
    Near,
    Far,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct ChiangParams {
    sigma_a: Option<Tone>,
    eta: Option<f64>,
    #[serde(alias = "beta_M")]
    beta_m: Option<f64>,
    #[serde(alias = "beta_N")]
    beta_n: Option<f64>,
    alpha: f64,
    field: Option<FieldName>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct LambertianParams {
    #[serde(alias = "k_d", alias = "albedo")]
    kd: Option<Tone>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct KajiyaKayParams {
    #[serde(alias = "K_d")]
    kd: Option<Tone>,
    #[serde(alias = "K_s")]
    ks: Option<Tone>,
    m: Option<f64>,
    alpha: f64,
    ks2: Option<Tone>,
    m2: Option<f64>,
    alpha2: f64,
    mode: Option<KajiyaKayName>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum KajiyaKayName {
    Normalised,
    Thesis,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct HeryParams {
    #[serde(alias = "K_s")]
    ks: Option<Tone>,
    beta: Option<f64>,
    alpha: f64,
    ks2: Option<Tone>,
    beta2: Option<f64>,
    alpha2: f64,
    mode: Option<HeryName>,
    cos_theta_d: bool,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum HeryName {
    Truncated,
    Faithful,
    FaithfulExactPdf,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct MarschnerParams {
    sigma_a: Option<Tone>,
    eta: Option<f64>,
    #[serde(rename = "beta_R", alias = "beta_M", alias = "beta_m", alias = "beta")]
    beta: Option<f64>,
    #[serde(rename = "alpha_R", alias = "alpha")]
    alpha: Option<f64>,
    #[serde(alias = "eccentricity")]
    a: Option<f64>,
    #[serde(alias = "K_d", alias = "k_d")]
    kd: Option<Tone>,
    mode: Option<MarschnerName>,
    roots: Option<RootsName>,
    smoothing: Option<bool>,
    #[serde(rename = "k_G")]
    k_g: Option<f64>,
    w_c: Option<f64>,
    delta_eta: Option<f64>,
    #[serde(rename = "delta_h_M")]
    delta_h_m: Option<f64>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum MarschnerName {
    Normalised,
    AsPrinted,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum RootsName {
    Exact,
    Cubic,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct SadeghiParams {
    #[serde(rename = "C_R")]
    c_r: Option<Tone>,
    #[serde(rename = "I_R")]
    i_r: Option<f64>,
    #[serde(rename = "alpha_R")]
    alpha_r: Option<f64>,
    #[serde(rename = "beta_R")]
    beta_r: Option<f64>,
    #[serde(rename = "C_TT")]
    c_tt: Option<Tone>,
    #[serde(rename = "I_TT")]
    i_tt: Option<f64>,
    #[serde(rename = "alpha_TT")]
    alpha_tt: Option<f64>,
    #[serde(rename = "beta_TT")]
    beta_tt: Option<f64>,
    #[serde(rename = "C_TRT")]
    c_trt: Option<Tone>,
    #[serde(rename = "I_TRT")]
    i_trt: Option<f64>,
    #[serde(rename = "alpha_TRT")]
    alpha_trt: Option<f64>,
    #[serde(rename = "beta_TRT")]
    beta_trt: Option<f64>,
    #[serde(rename = "delta_TT")]
    delta_tt: Option<f64>,
    #[serde(rename = "I_G")]
    i_g: Option<f64>,
    #[serde(rename = "delta_G")]
    delta_g: Option<f64>,
    #[serde(rename = "G_angle")]
    g_angle: Option<f64>,
    mode: Option<SadeghiName>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum SadeghiName {
    Normalised,
    Legacy,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct FurParams {
    sigma_a: Option<Tone>,
    eta: Option<f64>,
    #[serde(rename = "beta_M", alias = "beta_m", alias = "beta")]
    beta_m: Option<f64>,
    #[serde(rename = "beta_N", alias = "beta_n")]
    beta_n: Option<f64>,
    alpha: f64,
    #[serde(alias = "l")]
    layers: Option<f64>,
    kappa: Option<f64>,
    sigma_ms: Option<f64>,
    sigma_ma: Option<Tone>,
    g: Option<f64>,
}

/// Reads the parameters, or the defaults where there are none.
fn params<T: Default + for<'a> Deserialize<'a>>(value: &Value) -> anyhow::Result<T> {
    if value.is_null() {
        return Ok(T::default());
    }
    ensure!(value.is_object(), "\"params\" is {value}; it must be an object such as {{\"eta\": 1.55}}");
    T::deserialize(value).context("in \"params\"")
}

fn positive(name: &str, x: f64) -> anyhow::Result<f64> {
    ensure!(x > 0.0 && x.is_finite(), "{name} is {x}; it must be greater than 0");
    Ok(x)
}

/// A width in radians: beyond a turn a lobe is flat.
fn width(name: &str, x: f64) -> anyhow::Result<f64> {
    ensure!(x > 0.0 && x <= std::f64::consts::TAU, "{name} is {x}; it must be greater than 0 and at most 2 pi");
    Ok(x)
}

fn at_least(name: &str, x: f64, least: f64) -> anyhow::Result<f64> {
    ensure!(x >= least && x.is_finite(), "{name} is {x}; it must be at least {least}");
    Ok(x)
}

fn within(name: &str, x: f64, least: f64, most: f64) -> anyhow::Result<f64> {
    ensure!((least..=most).contains(&x), "{name} is {x}; it must be between {least} and {most}");
    Ok(x)
}

fn colour(name: &str, tone: Option<Tone>, default: f64) -> anyhow::Result<Rgb<f64>> {
    let rgb: Rgb<f64> = tone.unwrap_or(Tone::Grey(default)).into();
    ensure!(rgb.0.iter().all(|x| *x >= 0.0 && x.is_finite()), "{name} is {:?}; it must not be negative", rgb.0);
    Ok(rgb)
}

/// Most that a highlight of Kajiya and Kay may be shifted.
const SHIFT: f64 = std::f64::consts::FRAC_PI_4;

/// Tilts beyond this are no hair; the longitudinal lobes fold there.
fn angle(name: &str, x: f64) -> anyhow::Result<f64> {
    within(name, x, -std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2)
}

/// Near or far, where a model has both: what is asked for, else by whether an offset is given.
fn field(asked: Option<FieldName>, has_h: bool) -> anyhow::Result<Field> {
    let field = match asked {
        Some(FieldName::Near) => Field::Near,
        Some(FieldName::Far) => Field::Far,
        None if has_h => Field::Near,
        None => Field::Far,
    };
    ensure!(field == Field::Far || has_h, "the near field needs \"h\"");
    Ok(field)
}

/// The model of this kind; `has_h` tells whether there is an offset across the fiber.
pub(crate) fn model(kind: Kind, value: &Value, has_h: bool) -> anyhow::Result<Fiber<f64>> {
    Ok(match kind {
        Kind::Deon => {
            let p: DeonParams = params(value)?;
            let beta_m = width("beta_M", p.beta_m.unwrap_or(7.5_f64.to_radians()))?;
            Fiber::Deon(Deon {
                eta: within("eta", p.eta.unwrap_or(1.55), 1.0, 3.0)?,
                beta_m,
                beta_n: width("beta_N", p.beta_n.unwrap_or(beta_m))?,
                alpha: angle("alpha", p.alpha)?,
                residual: p.residual.unwrap_or(true),
                attenuation: match p.attenuation {
                    Some(AttenuationName::Known) => Attenuation::Known,
                    _ => Attenuation::Difference,
                },
                field: field(p.field, has_h)?,
                ..Deon::with_absorption(colour("sigma_a", p.sigma_a, 0.0)?)
            })
        }
        Kind::Chiang => {
            let p: ChiangParams = params(value)?;
            ensure!(has_h || p.field.is_some(), "this model is near-field: it needs \"h\", or \"field\": \"far\"");
            Fiber::Chiang(Chiang {
                beta_m: width("beta_m", p.beta_m.unwrap_or(0.3))?,
                beta_n: width("beta_n", p.beta_n.unwrap_or(0.3))?,
                alpha: angle("alpha", p.alpha)?,
                eta: within("eta", p.eta.unwrap_or(1.55), 1.0, 3.0)?,
                sigma_a: colour("sigma_a", p.sigma_a, 0.0)?,
                field: field(p.field, has_h)?,
            })
        }
        Kind::Lambertian => {
            let p: LambertianParams = params(value)?;
            Fiber::Lambertian(Lambertian { albedo: colour("kd", p.kd, 1.0)? })
        }
        Kind::KajiyaKay => {
            let p: KajiyaKayParams = params(value)?;
            Fiber::KajiyaKay(KajiyaKay {
                diffuse: colour("kd", p.kd, 0.5)?,
                highlights: [
                    Highlight {
                        color: colour("ks", p.ks, 0.5)?,
                        exponent: at_least("m", p.m.unwrap_or(25.0), 0.0)?,
                        shift: within("alpha", p.alpha, -SHIFT, SHIFT)?,
                    },
                    Highlight {
                        color: colour("ks2", p.ks2, 0.0)?,
                        exponent: at_least("m2", p.m2.unwrap_or(25.0), 0.0)?,
                        shift: within("alpha2", p.alpha2, -SHIFT, SHIFT)?,
                    },
                ],
                mode: match p.mode {
                    Some(KajiyaKayName::Thesis) => KajiyaKayMode::Thesis,
                    _ => KajiyaKayMode::Normalised,
                },
            })
        }
        Kind::Hery => {
            let p: HeryParams = params(value)?;
            Fiber::Hery(Hery {
                lobes: [
                    HeryLobe {
                        tint: colour("ks", p.ks, 1.0)?,
                        beta: width("beta", p.beta.unwrap_or(5.0_f64.to_radians()))?,
                        alpha: angle("alpha", p.alpha)?,
                    },
                    HeryLobe {
                        tint: colour("ks2", p.ks2, 0.0)?,
                        beta: width("beta2", p.beta2.unwrap_or(10.0_f64.to_radians()))?,
                        alpha: angle("alpha2", p.alpha2)?,
                    },
                ],
                mode: match p.mode {
                    Some(HeryName::Faithful) => HeryMode::Faithful,
                    Some(HeryName::FaithfulExactPdf) => HeryMode::FaithfulExactPdf,
                    _ => HeryMode::Truncated,
                },
                cos_theta_d: p.cos_theta_d,
            })
        }
        Kind::Marschner => marschner(&params(value)?)?,
        Kind::Sadeghi => sadeghi(&params(value)?)?,
        Kind::Fur => {
            let p: FurParams = params(value)?;
            ensure!(has_h, "this model is near-field: it needs \"h\"");
            let beta_m = width("beta_M", p.beta_m.unwrap_or(7.5_f64.to_radians()))?;
            Fiber::Fur(Fur {
                eta: within("eta", p.eta.unwrap_or(1.55), 1.0, 3.0)?,
                sigma_a: colour("sigma_a", p.sigma_a, 0.0)?,
                beta_m,
                beta_n: width("beta_N", p.beta_n.unwrap_or(beta_m))?,
                alpha: angle("alpha", p.alpha)?,
                layers: within("layers", p.layers.unwrap_or(1.0), 1.0, 10.0)?,
                medulla: Medulla {
                    radius: within("kappa", p.kappa.unwrap_or(0.0), 0.0, 0.95)?,
                    scattering: within("sigma_ms", p.sigma_ms.unwrap_or(0.0), 0.0, 1e3)?,
                    absorption: colour("sigma_ma", p.sigma_ma, 0.0)?,
                    anisotropy: within("g", p.g.unwrap_or(0.0), -0.6, 0.9)?,
                },
            })
        }
    })
}

fn marschner(p: &MarschnerParams) -> anyhow::Result<Fiber<f64>> {
    let usual = Marschner::<f64>::with_absorption(colour("sigma_a", p.sigma_a, 0.0)?);
    let caustic = Caustic {
        strength: at_least("k_G", p.k_g.unwrap_or(1.0), 0.0)?,
        width: width("w_c", p.w_c.unwrap_or(15.0_f64.to_radians()))?,
        fade: positive("delta_eta", p.delta_eta.unwrap_or(0.3))?,
        limit: within("delta_h_M", p.delta_h_m.unwrap_or(0.5), 0.0, 1.0)?,
    };
    Ok(Fiber::Marschner(Marschner {
        eta: within("eta", p.eta.unwrap_or(usual.eta), 1.01, 3.0)?,
        beta_m: width("beta_R", p.beta.unwrap_or(usual.beta_m))?,
        alpha: angle("alpha_R", p.alpha.unwrap_or(0.0))?,
        eccentricity: within("a", p.a.unwrap_or(1.0), 0.5, 1.0)?,
        diffuse: colour("kd", p.kd, 0.0)?,
        roots: match p.roots {
            Some(RootsName::Cubic) => Roots::Cubic,
            _ => Roots::Exact,
        },
        norm: match p.mode {
            Some(MarschnerName::AsPrinted) => MarschnerNorm::AsPrinted,
            _ => MarschnerNorm::Normalised,
        },
        caustic: p.smoothing.unwrap_or(true).then_some(caustic),
        ..usual
    }))
}

fn sadeghi(p: &SadeghiParams) -> anyhow::Result<Fiber<f64>> {
    let usual = Sadeghi::<f64>::default();
    let [alpha, beta] = [p.alpha_r.unwrap_or(usual.lobes[0].shift), p.beta_r.unwrap_or(usual.lobes[0].width)];
    // What is not said of TT and TRT follows R, as in Marschner's table.
    let given = [
        ("R", p.c_r, p.i_r, Some(alpha), Some(beta), 1.0, 1.0),
        ("TT", p.c_tt, p.i_tt, p.alpha_tt, p.beta_tt, -0.5, 0.5),
        ("TRT", p.c_trt, p.i_trt, p.alpha_trt, p.beta_trt, -1.5, 2.0),
    ];
    let mut lobes = usual.lobes;
    for (lobe, (name, color, intensity, shift, width, by_alpha, by_beta)) in lobes.iter_mut().zip(given) {
        *lobe = ArtistLobe {
            color: colour(&format!("C_{name}"), color, 1.0)?,
            intensity: at_least(&format!("I_{name}"), intensity.unwrap_or(lobe.intensity), 0.0)?,
            shift: angle(&format!("alpha_{name}"), shift.unwrap_or(by_alpha * alpha))?,
            width: self::width(&format!("beta_{name}"), width.unwrap_or(by_beta * beta))?,
        };
    }
    Ok(Fiber::Sadeghi(Sadeghi {
        lobes,
        tt_azimuthal_width: width("delta_TT", p.delta_tt.unwrap_or(usual.tt_azimuthal_width))?,
        glint: Glint {
            intensity: at_least("I_G", p.i_g.unwrap_or(usual.glint.intensity), 0.0)?,
            width: width("delta_G", p.delta_g.unwrap_or(usual.glint.width))?,
            angle: within("G_angle", p.g_angle.unwrap_or(usual.glint.angle), 0.0, std::f64::consts::PI)?,
        },
        mode: match p.mode {
            Some(SadeghiName::Legacy) => SadeghiMode::Legacy,
            _ => SadeghiMode::Normalised,
        },
    }))
}
