use std::io::{BufRead, Write};
use std::process::ExitCode;

use anyhow::{Context, bail, ensure};
use fiber::{
    Attenuation, Chiang, Deon, Dir, Fiber, Field, Hery, HeryMode, Hit, KajiyaKay, KajiyaKayMode, Lambertian, Model,
    Scatter,
};
use math::Rgb;
use serde::{Deserialize, Serialize};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// deon, chiang, lambertian, kajiya_kay or hery
    #[arg(long, value_enum)]
    model: Kind,
}

#[derive(Clone, Copy, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum Kind {
    /// Params: sigma_a (number or rgb), eta, beta_M, beta_N, alpha, residual, attenuation (difference, known), field (near, far; far without h)
    Deon,
    /// Params: sigma_a, eta, beta_m, beta_n, alpha; needs h
    Chiang,
    /// Params: kd
    Lambertian,
    /// Params: kd, ks, m, mode (normalised, thesis)
    KajiyaKay,
    /// Params: ks, beta, alpha, mode (truncated, faithful, faithful_exact_pdf), cos_theta_d
    Hery,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Query {
    #[serde(default)]
    params: serde_json::Value,
    theta_k: f64,
    theta_s: f64,
    phi: f64,
    h: Option<f64>,
}

#[derive(Serialize)]
struct Answer {
    fcos: [f64; 3],
    pdf: f64,
    lobes: [[f64; 3]; 4],
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

/// Reads the parameters, or the defaults where there are none.
fn params<T: Default + for<'a> Deserialize<'a>>(value: &serde_json::Value) -> anyhow::Result<T> {
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

fn colour(name: &str, tone: Option<Tone>, default: f64) -> anyhow::Result<Rgb<f64>> {
    let rgb: Rgb<f64> = tone.unwrap_or(Tone::Grey(default)).into();
    ensure!(rgb.0.iter().all(|x| *x >= 0.0 && x.is_finite()), "{name} is {:?}; it must not be negative", rgb.0);
    Ok(rgb)
}

fn model(kind: Kind, query: &Query) -> anyhow::Result<Fiber<f64>> {
    Ok(match kind {
        Kind::Deon => {
            let p: DeonParams = params(&query.params)?;
            let beta_m = positive("beta_M", p.beta_m.unwrap_or(7.5_f64.to_radians()))?;
            let field = match p.field {
                Some(FieldName::Near) => Field::Near,
                Some(FieldName::Far) => Field::Far,
                None if query.h.is_some() => Field::Near,
                None => Field::Far,
            };
            ensure!(field == Field::Far || query.h.is_some(), "the near field needs \"h\"");
            Fiber::Deon(Deon {
                eta: positive("eta", p.eta.unwrap_or(1.55))?,
                beta_m,
                beta_n: positive("beta_N", p.beta_n.unwrap_or(beta_m))?,
                alpha: p.alpha,
                residual: p.residual.unwrap_or(true),
                attenuation: match p.attenuation {
                    Some(AttenuationName::Known) => Attenuation::Known,
                    _ => Attenuation::Difference,
                },
                field,
                ..Deon::with_absorption(colour("sigma_a", p.sigma_a, 0.0)?)
            })
        }
        Kind::Chiang => {
            let p: ChiangParams = params(&query.params)?;
            ensure!(query.h.is_some(), "this model is near-field: it needs \"h\"");
            Fiber::Chiang(Chiang {
                beta_m: positive("beta_m", p.beta_m.unwrap_or(0.3))?,
                beta_n: positive("beta_n", p.beta_n.unwrap_or(0.3))?,
                alpha: p.alpha,
                eta: positive("eta", p.eta.unwrap_or(1.55))?,
                sigma_a: colour("sigma_a", p.sigma_a, 0.0)?,
            })
        }
        Kind::Lambertian => {
            let p: LambertianParams = params(&query.params)?;
            Fiber::Lambertian(Lambertian { albedo: colour("kd", p.kd, 1.0)? })
        }
        Kind::KajiyaKay => {
            let p: KajiyaKayParams = params(&query.params)?;
            let m = p.m.unwrap_or(25.0);
            ensure!(m >= 0.0 && m.is_finite(), "m is {m}; it must not be negative");
            Fiber::KajiyaKay(KajiyaKay {
                diffuse: colour("kd", p.kd, 0.5)?,
                specular: colour("ks", p.ks, 0.5)?,
                exponent: m,
                mode: match p.mode {
                    Some(KajiyaKayName::Thesis) => KajiyaKayMode::Thesis,
                    _ => KajiyaKayMode::Normalised,
                },
            })
        }
        Kind::Hery => {
            let p: HeryParams = params(&query.params)?;
            Fiber::Hery(Hery {
                tint: colour("ks", p.ks, 1.0)?,
                beta: positive("beta", p.beta.unwrap_or(5.0_f64.to_radians()))?,
                alpha: p.alpha,
                mode: match p.mode {
                    Some(HeryName::Faithful) => HeryMode::Faithful,
                    Some(HeryName::FaithfulExactPdf) => HeryMode::FaithfulExactPdf,
                    _ => HeryMode::Truncated,
                },
                cos_theta_d: p.cos_theta_d,
            })
        }
    })
}

fn answer(kind: Kind, line: &str) -> anyhow::Result<Answer> {
    let query: Query = serde_json::from_str(line)?;
    for (name, x) in [("theta_k", query.theta_k), ("theta_s", query.theta_s)] {
        let most = std::f64::consts::FRAC_PI_2 + 1e-9;
        ensure!(x.abs() <= most, "{name} is {x}; inclinations lie between -pi/2 and pi/2, in radians");
    }
    let h = query.h.unwrap_or(0.0);
    ensure!((-1.0..=1.0).contains(&h), "h is {h}; offsets lie between -1 and 1");
    let setup = model(kind, &query)?.prepare(&Hit::new(Dir::new(query.theta_k, 0.0), h));
    let (lobes, pdf) = setup.eval_pdf(Dir::new(query.theta_s, query.phi));
    let answer = Answer { fcos: lobes.sum().0, pdf, lobes: lobes.0.map(|lobe| lobe.0) };
    if !answer.fcos.iter().all(|x| x.is_finite()) || !answer.pdf.is_finite() {
        bail!("the model has no finite value here");
    }
    Ok(answer)
}

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for (index, line) in std::io::stdin().lock().lines().enumerate() {
        let number = index + 1;
        let line = line.with_context(|| format!("reading line {number} of standard input"))?;
        if line.trim().is_empty() {
            continue;
        }
        let answer = match answer(args.model, &line) {
            Ok(answer) => answer,
            Err(error) => {
                // What was answered before stands.
                out.flush()?;
                bail!("line {number} of standard input: {error:#}");
            }
        };
        let mut text = serde_json::to_string(&answer)?;
        text.push('\n');
        if let Err(error) = out.write_all(text.as_bytes()) {
            return gone(&error);
        }
    }
    match out.flush() {
        Err(error) => gone(&error),
        Ok(()) => Ok(ExitCode::SUCCESS),
    }
}

/// A reader that has gone away has seen enough.
fn gone(error: &std::io::Error) -> anyhow::Result<ExitCode> {
    if error.kind() == std::io::ErrorKind::BrokenPipe {
        return Ok(ExitCode::SUCCESS);
    }
    bail!("cannot write to standard output: {error}")
}
