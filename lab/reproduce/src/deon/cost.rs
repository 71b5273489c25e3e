//! What a sample costs beside an evaluation.

use std::hint::black_box;
use std::time::Instant;

use fiber::{DIMS, Deon, DeonSetup, Dir, Field, Hit, Model, Scatter, Weights};
use math::hash;

use super::point;
use crate::chart::{Chart, Curve};
use crate::sphere::{numbers, uniform};
use crate::{Context, Error, Measured, Report, Table, number, stats};

const WIDTHS_DEG: [f64; 6] = [2.0, 4.0, 7.5, 12.0, 20.0, 30.0];
/// Width at which the claim is tried, degrees.
const USUAL_DEG: f64 = 7.5;
const SIGMA_A: f64 = 0.3;
/// Calls per round.
const CALLS: usize = 1024;
/// Views, each set up once.
const VIEWS: usize = 128;

/// Nanoseconds of one call, median over rounds.
#[derive(Clone, Copy, Debug)]
struct Costs {
    beta_deg: f64,
    /// What the view alone determines.
    set_up: f64,
    /// Value alone.
    eval: f64,
    /// Direction and weight.
    draw: f64,
    /// Direction, weight and density.
    sample: f64,
    /// Direction, and value over density as weight.
    marginal: f64,
}

/// Nanoseconds of one of [`CALLS`] calls.
fn time(call: impl Fn(usize) -> f32) -> f64 {
    let begin = Instant::now();
    let mut sum = 0.0_f32;
    for i in 0..CALLS {
        sum += call(i);
    }
    black_box(sum);
    begin.elapsed().as_secs_f64() * 1e9 / CALLS as f64
}

/// All costs of a fiber; each round measures all of them, so that a machine that slows down slows all.
fn costs(beta_deg: f64, field: Field, rounds: u32, stream: u32) -> Costs {
    let fiber = |weights| Deon { field, ..point::deon::<f32>(beta_deg, SIGMA_A, -3.0, weights) };
    let (joint, marginal) = (fiber(Weights::Joint), fiber(Weights::Marginal));
    let hits: Vec<Hit> = (0..VIEWS as u32)
        .map(|i| Hit::new(uniform(numbers(i, hash::mix2(stream, 1))), hash::signed(i, hash::mix2(stream, 2))))
        .collect();
    let at: Vec<DeonSetup> = hits.iter().map(|hit| joint.prepare(hit)).collect();
    let at_marginal: Vec<DeonSetup> = hits.iter().map(|hit| marginal.prepare(hit)).collect();
    let inputs: Vec<[f32; DIMS]> = (0..CALLS as u32).map(|i| numbers(i, hash::mix2(stream, 3))).collect();
    // Directions as scattering meets them: drawn at the same places.
    let dirs: Vec<Dir> = (0..CALLS)
        .map(|i| at[i % VIEWS].sample(inputs[CALLS - 1 - i]).map_or(Dir::new(0.0, 0.0), |sample| sample.dir))
        .collect();
    let mut times: [Vec<f64>; 5] = Default::default();
    for _ in 0..rounds.max(3) {
        let round = [
            time(|i| {
                // The whole of it is made, whatever is looked at.
                black_box(joint.prepare(black_box(&hits[i % VIEWS])));
                0.0
            }),
            time(|i| at[i % VIEWS].eval(black_box(dirs[i])).sum().luminance()),
            time(|i| at[i % VIEWS].sample(black_box(inputs[i])).map_or(0.0, |sample| sample.weight.sum().luminance())),
            time(|i| {
                let at = &at[i % VIEWS];
                at.sample(black_box(inputs[i])).map_or(0.0, |sample| {
                    sample.weight.sum().luminance() + sample.pdf.unwrap_or_else(|| at.pdf(sample.dir))
                })
            }),
            time(|i| {
                at_marginal[i % VIEWS]
                    .sample(black_box(inputs[i]))
                    .map_or(0.0, |sample| sample.weight.sum().luminance())
            }),
        ];
        for (times, time) in times.iter_mut().zip(round) {
            times.push(time);
        }
    }
    let [set_up, eval, draw, sample, marginal] = times.map(|times| stats::quantile(&times, 0.5));
    Costs { beta_deg, set_up, eval, draw, sample, marginal }
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let rounds = context.count(61);
    let mut far = Vec::new();
    for (i, beta_deg) in WIDTHS_DEG.into_iter().enumerate() {
        context.step("far field", i as f64 / WIDTHS_DEG.len() as f64)?;
        far.push(costs(beta_deg, Field::Far, rounds, hash::mix2(context.seed, i as u32)));
    }
    context.step("near field", 0.0)?;
    let near = costs(USUAL_DEG, Field::Near, rounds, hash::mix2(context.seed, 77));
    let Some(usual) = far.iter().find(|c| c.beta_deg == USUAL_DEG).copied() else {
        return Err(Error::Measure("the usual width"));
    };
    let ratio = usual.sample / usual.eval;
    let most = far.iter().map(|c| c.sample / c.eval).fold(0.0, f64::max);
    let measured = vec![
        Measured::new("far field, β = 7.5°: a sample with weight and density", ratio, "evaluations")
            .between(0.5, 2.0)
            .decides(),
        Measured::new("the same, the most over widths from 2° to 30°", most, "evaluations").between(0.5, 2.0).decides(),
        Measured::new("far field: direction and weight without density", usual.draw / usual.eval, "evaluations")
            .between(0.0, 1.0)
            .decides(),
        Measured::new("far field: direction, value over density", usual.marginal / usual.eval, "evaluations")
            .between(0.5, 2.5),
        Measured::new(
            "far field, set-up included: a sample with density over an evaluation",
            (usual.set_up + usual.sample) / (usual.set_up + usual.eval),
            "",
        )
        .between(0.5, 2.0),
        Measured::new("near field: a sample with weight and density", near.sample / near.eval, "evaluations"),
        Measured::new("far field: one evaluation", usual.eval, "ns"),
        Measured::new("near field: one evaluation", near.eval, "ns"),
    ];
    let mut report = Report::new(
        "A call of the sampler takes about as long as an evaluation of the scattering function: the quadratures for \
         TRT and its density are what costs, drawing a direction is cheap.",
        format!(
            "in the far field a sample with its density costs {} evaluations, without it {}",
            number(ratio),
            number(usual.draw / usual.eval)
        ),
        measured,
    );
    report.text = vec![
        format!(
            "Single precision, one thread, σ = {SIGMA_A}, tilt -3 degrees. {VIEWS} views all around and {CALLS} calls \
             a round; times are medians over {} rounds in which everything is measured in turn. An evaluation gives \
             the value of all lobes in three channels; a sample gives a direction, its weight A / w and the density \
             that multiple importance sampling asks for. What only the view determines is set up before.",
            rounds.max(3)
        ),
        "These are times on a shared machine, so ratios differ by some percent from run to run; half to twice an \
         evaluation counts as \"about the same\". Our density is found by the same pass over the cross-section as the \
         value, for all lobes alike, where the paper solves for the root of R and TT; with roughness there is no \
         single root. The near field has no quadrature at all: there the random numbers' way to a direction weighs \
         about as much as the value."
            .into(),
    ];
    let mut table = Table::new(
        "Nanoseconds of a call, median.",
        ["field", "β", "set-up", "value", "direction, weight", "with density", "direction, value over density"],
    );
    for (field, costs) in far.iter().map(|c| ("far", c)).chain([("near", &near)]) {
        let &Costs { beta_deg, set_up, eval, draw, sample, marginal } = costs;
        table.row([
            field.to_owned(),
            format!("{beta_deg}°"),
            number(set_up),
            number(eval),
            number(draw),
            number(sample),
            number(marginal),
        ]);
    }
    report.tables.push(table);
    let curve = |name: &str, of: fn(&Costs) -> f64| {
        Curve::marked(name, far.iter().map(|costs| [costs.beta_deg, of(costs)]).collect())
    };
    report.pictures.push(
        Chart {
            title: "Price of a call, far field".into(),
            x: "β, degrees".into(),
            y: "nanoseconds".into(),
            y_log: true,
            curves: vec![
                curve("value", |c| c.eval),
                curve("direction, weight", |c| c.draw),
                curve("direction, weight, density", |c| c.sample),
                curve("direction, value over density", |c| c.marginal),
            ],
            ..Chart::default()
        }
        .picture("calls", "Time of a call against the roughness: narrower lobes need more nodes.")?,
    );
    Ok(report)
}
