use std::io::{BufRead, Write};
use std::process::ExitCode;

use anyhow::{Context, bail, ensure};
use fiber::{Dir, Hit, Model, Scatter};
use serde::{Deserialize, Serialize};

use crate::model::{Kind, model};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// The scattering model
    #[arg(long, value_enum)]
    model: Kind,
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
    /// Absolute azimuth of the known direction, for fibers that are not round.
    #[serde(default)]
    phi_k: f64,
}

#[derive(Serialize)]
struct Answer {
    fcos: [f64; 3],
    pdf: f64,
    lobes: [[f64; 3]; 4],
}

fn answer(kind: Kind, line: &str) -> anyhow::Result<Answer> {
    let query: Query = serde_json::from_str(line)?;
    for (name, x) in [("theta_k", query.theta_k), ("theta_s", query.theta_s)] {
        let most = std::f64::consts::FRAC_PI_2 + 1e-9;
        ensure!(x.abs() <= most, "{name} is {x}; inclinations lie between -pi/2 and pi/2, in radians");
    }
    let h = query.h.unwrap_or(0.0);
    ensure!((-1.0..=1.0).contains(&h), "h is {h}; offsets lie between -1 and 1");
    let setup =
        model(kind, &query.params, query.h.is_some())?.prepare(&Hit::new(Dir::new(query.theta_k, query.phi_k), h));
    let (lobes, pdf) = setup.eval_pdf(Dir::new(query.theta_s, query.phi_k + query.phi));
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
