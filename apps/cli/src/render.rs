use std::cell::Cell;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use job::{Cancel, Event, Metadata, Options, Outcome, Outputs, SimdLevel, View};

use super::input::{self, Input};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    input: Input,
    /// Samples per pixel
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    samples: Option<u32>,
    /// Stop after this much rendering, such as 60s, 5m or 1h
    #[arg(long, allow_negative_numbers = true, value_parser = parse_duration)]
    time: Option<Duration>,
    /// Changes the noise and nothing else
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u32>,
    /// Threads; one per processor if left out
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Instruction set: auto, sse2, sse4_2, avx2, avx512; the picture is the same
    #[arg(long, default_value = "auto")]
    simd: SimdLevel,
    /// How the PNG is developed: srgb, filmic or agx; the scene's choice if left out
    #[arg(long)]
    view: Option<View>,
    /// Where to write: NAME.exr gives all layers and NAME.png, NAME.png the picture alone
    #[arg(short, long, default_value = "cuticle.exr")]
    output: PathBuf,
    /// Say nothing but errors and warnings
    #[arg(short, long)]
    quiet: bool,
}

/// Stopped from outside, as shells count it: 128 + SIGINT.
const INTERRUPTED: u8 = 130;

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    args.input.check()?;
    let outputs = Outputs::from_name(&args.output)?;
    outputs.check()?;

    let scene = args.input.load(overrides(args))?;
    let say = |text: String| {
        if !args.quiet {
            super::say(&text);
        }
    };
    say(format!("{}, up to {} samples each", args.input.heading(&scene), scene.render.samples));

    let cancel = Cancel::default();
    {
        let cancel = cancel.clone();
        ctrlc::set_handler(move || {
            if cancel.is_cancelled() {
                std::process::exit(i32::from(INTERRUPTED));
            }
            cancel.cancel();
            super::say("\nstopping; what is there will be written (once more to stop at once)");
        })
        .context("cannot listen for Ctrl-C")?;
    }

    let view = input::view(args.view, &scene);
    let exposure = scene.film.exposure_ev;
    let command: Vec<String> = std::env::args_os().map(|arg| arg.to_string_lossy().into_owned()).collect();
    let command = command.join(" ");
    let mut metadata = Metadata::default()
        .with("software", concat!("Cuticle ", env!("CARGO_PKG_VERSION")))
        .with("scene", &scene.name)
        .with("seed", scene.render.seed.to_string())
        .with("integrator", format!("{:?}", scene.render.integrator))
        .with("command", &command);

    let bar = Bar::new(args.quiet);
    let options = Options { time: args.time, threads: args.threads.map_or(0, usize::from), simd: args.simd };
    let outcome = job::render(scene.into(), &options, &cancel, &mut |event| bar.show(event))?;
    bar.finish();

    if *outcome.film.sample_counts().end() == 0 {
        super::say("stopped before the first sample; nothing was written");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    metadata = metadata
        .with("samples", outcome.samples.to_string())
        .with("simd", &outcome.simd)
        .with("render_seconds", format!("{:.3}", outcome.elapsed.as_secs_f64()));
    outputs.save(&outcome.film, view, exposure, &metadata)?;
    say(summary(&outcome));
    let written: Vec<String> = outputs.paths().map(|p| p.display().to_string()).collect();
    say(format!("wrote {}", written.join(" and ")));
    Ok(if outcome.cancelled { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

/// What the flags of this command override in the scene.
fn overrides(args: &Args) -> Vec<String> {
    let mut all = Vec::new();
    match args.samples {
        Some(samples) => all.push(format!("render.samples={samples}")),
        // A time limit alone means: as many as fit.
        None if args.time.is_some() => all.push("render.samples=16777216".to_owned()),
        None => {}
    }
    if let Some(seed) = args.seed {
        all.push(format!("render.seed={seed}"));
    }
    all
}

fn summary(outcome: &Outcome) -> String {
    let elapsed = outcome.elapsed.as_secs_f64();
    let film = &outcome.film;
    let samples = *film.sample_counts().end();
    let done = f64::from(outcome.samples) * f64::from(film.width()) * f64::from(film.height());
    let mut text = format!(
        "{samples} samples a pixel in {elapsed:.1} s after {:.2} s of set-up: {:.0} thousand samples/s, {:.2} million \
         rays/s on {} threads ({})",
        outcome.startup.as_secs_f64(),
        done / elapsed.max(1e-9) / 1e3,
        outcome.rays as f64 / elapsed.max(1e-9) / 1e6,
        outcome.threads,
        outcome.simd,
    );
    let noise = film.noise();
    if noise.is_finite() {
        text += &format!("; noise {:.2} %", 100.0 * noise);
    }
    if outcome.cancelled {
        text += "; stopped early";
    }
    if film.rejected() > 0 {
        text += &format!("; {} samples were not numbers and were left out", film.rejected());
    }
    text
}

/// A progress bar on a terminal, a line now and then elsewhere.
enum Bar {
    Terminal(ProgressBar),
    Lines { last: Cell<Duration> },
    Quiet,
}

/// How often a line is printed where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

impl Bar {
    fn new(quiet: bool) -> Self {
        if quiet {
            return Self::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines { last: Cell::new(Duration::ZERO) };
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        // The template is a constant; were it wrong, the bar would merely be plain.
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}") {
            bar.set_style(style);
        }
        Self::Terminal(bar)
    }

    fn show(&self, event: &Event) {
        match self {
            Self::Quiet => {}
            Self::Terminal(bar) => {
                bar.set_length(event.total);
                bar.set_position(event.done);
                bar.set_message(progress(event));
            }
            Self::Lines { last } => {
                if event.elapsed >= last.get() + LINE_EVERY {
                    last.set(event.elapsed);
                    let percent = 100 * event.done / event.total.max(1);
                    super::say(&format!("{percent:>3} %  {}", progress(event)));
                }
            }
        }
    }

    fn finish(&self) {
        if let Self::Terminal(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// `12 spp, 250k samples/s, noise 20.1 %, 0:42 left`.
fn progress(event: &Event) -> String {
    let mut text = format!("{} spp, {:.0}k samples/s", event.passes, event.rate / 1e3);
    if let Some(noise) = event.noise {
        text += &format!(", noise {:.1} %", 100.0 * noise);
    }
    if let Some(left) = event.remaining {
        text += &format!(", {} left", clock(left));
    }
    text
}

fn clock(time: Duration) -> String {
    let s = time.as_secs();
    if s >= 3600 {
        format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
    } else {
        format!("{}:{:02}", s / 60, s % 60)
    }
}

fn parse_duration(text: &str) -> anyhow::Result<Duration> {
    let (number, factor) = match text.char_indices().last() {
        Some((at, 's')) => (&text[..at], 1.0),
        Some((at, 'm')) => (&text[..at], 60.0),
        Some((at, 'h')) => (&text[..at], 3600.0),
        _ => (text, 1.0),
    };
    let seconds: f64 = number.parse().with_context(|| format!("{text:?} is no duration; write 90s, 5m or 1h"))?;
    if !(seconds > 0.0 && seconds * factor < 1e7) {
        bail!("{text:?} is out of range; a duration lies between 0 and about 100 days");
    }
    Ok(Duration::from_secs_f64(seconds * factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_read_as_people_write_them() {
        assert_eq!(parse_duration("90s").unwrap(), Duration::from_secs(90));
        assert_eq!(parse_duration("1.5m").unwrap(), Duration::from_secs(90));
        assert_eq!(parse_duration("2").unwrap(), Duration::from_secs(2));
        for wrong in ["", "s", "-3s", "nan", "1e99h", "ten", "5µ"] {
            assert!(parse_duration(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_are_told_like_a_clock() {
        assert_eq!(clock(Duration::from_secs(3725)), "1:02:05");
    }
}
