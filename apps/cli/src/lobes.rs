use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail, ensure};
use fiber::Fiber;
use plot::chart::Figure;
use plot::lobes::{Kind, Offset, Options, Slice, Subject, Viewing};

use super::model::{self, Kind as ModelKind};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Draw the lobes of a look or a model
    Plot(PlotArgs),
    /// Draw a page about a look or a model: parameters, lobes, sampler, albedo
    Sheet(SheetArgs),
}

#[derive(clap::Args)]
pub(crate) struct PlotArgs {
    #[command(flatten)]
    subject: SubjectArgs,
    /// What to draw, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "azimuth")]
    kind: Vec<KindName>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(clap::Args)]
pub(crate) struct SheetArgs {
    #[command(flatten)]
    subject: SubjectArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Whose lobes, and where they are looked at from.
#[derive(clap::Args)]
struct SubjectArgs {
    /// A look of a scene file; the name may be left out where there is one look
    #[arg(long, value_name = "FILE[:NAME]", required_unless_present = "model", conflicts_with = "model")]
    look: Option<String>,
    /// A model with the parameters of `cuticle fiber eval`
    #[arg(long, value_enum)]
    model: Option<ModelKind>,
    /// A parameter of --model, such as beta_m=0.2 or sigma_a=[0.1,0.3,0.8]; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", requires = "model", conflicts_with = "look")]
    set: Vec<String>,
    /// Inclination of the known direction, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    theta_i: f64,
    /// Offset across the fiber, -1 to 1; without it the mean over all offsets is shown
    #[arg(long, allow_negative_numbers = true)]
    h: Option<f64>,
    /// Show the azimuth on the specular cone instead of integrated over the inclination
    #[arg(long)]
    cone: bool,
    /// Directions drawn for the histogram
    #[arg(long, default_value_t = 1_000_000, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    samples: u32,
    /// Changes the directions drawn and nothing else
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    seed: u32,
}

#[derive(clap::Args)]
struct OutputArgs {
    /// Where to write: NAME.svg or NAME.png
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Width of a PNG, pixels; twice the figure's own if left out
    #[arg(long, value_name = "PX", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(100..=16_384))]
    width: Option<u32>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum KindName {
    /// Lobes around the fiber, polar
    Azimuth,
    /// Lobes along the fiber
    Longitudinal,
    /// All directions as a map
    Sphere,
    /// What the sampler draws against its density
    Histogram,
    /// What comes back against the known inclination
    Albedo,
    /// Everything
    All,
}

impl KindName {
    fn kinds(self) -> Vec<Kind> {
        match self {
            Self::Azimuth => vec![Kind::Azimuth],
            Self::Longitudinal => vec![Kind::Longitudinal],
            Self::Sphere => vec![Kind::Sphere],
            Self::Histogram => vec![Kind::Histogram],
            Self::Albedo => vec![Kind::Albedo],
            Self::All => Kind::ALL.to_vec(),
        }
    }
}

/// What a figure is written as.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Svg,
    Png,
}

pub(crate) fn run(command: &Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::Plot(args) => {
            // Before anything is computed: a name that cannot be written costs no time.
            let format = args.output.format()?;
            let mut kinds: Vec<Kind> = Vec::new();
            for kind in args.kind.iter().flat_map(|name| name.kinds()) {
                if !kinds.contains(&kind) {
                    kinds.push(kind);
                }
            }
            let (subject, options) = args.subject.read()?;
            args.output.write(format, &plot::lobes::figure(&subject, &kinds, &options))?;
        }
        Command::Sheet(args) => {
            let format = args.output.format()?;
            let (subject, options) = args.subject.read()?;
            args.output.write(format, &plot::lobes::sheet(&subject, &options))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

impl SubjectArgs {
    fn read(&self) -> anyhow::Result<(Subject, Options)> {
        let theta_i = self.theta_i;
        ensure!(theta_i.abs() < 90.0, "--theta-i is {theta_i}; it must lie between -90 and 90 degrees");
        if let Some(h) = self.h {
            ensure!((-1.0..=1.0).contains(&h), "--h is {h}; offsets lie between -1 and 1");
        }
        let (name, fiber) = match (&self.look, self.model) {
            (Some(look), _) => look_named(look)?,
            (None, Some(kind)) => {
                // As with an offset, so that near-field forms are the default: the figures take the mean.
                let fiber = model::model(kind, &parameters(&self.set)?, true)?;
                (fiber.name().to_owned(), fiber)
            }
            (None, None) => bail!("say what to draw: --look FILE[:NAME] or --model MODEL"),
        };
        let offset = self.h.map_or(Offset::Mean, Offset::At);
        let subject = Subject { name, fiber, viewing: Viewing { theta_k: theta_i.to_radians(), offset } };
        let slice = if self.cone { Slice::Cone } else { Slice::Integrated };
        Ok((subject, Options { slice, draws: self.samples, seed: self.seed }))
    }
}

/// A look of a scene file, with its name for the title.
fn look_named(text: &str) -> anyhow::Result<(String, Fiber<f64>)> {
    let (path, wanted) = look_parts(text, |path| path.is_file());
    let looks = job::looks(path)?;
    let names = || looks.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    let found = match wanted {
        Some(wanted) => looks
            .iter()
            .find(|(name, _)| name == wanted)
            .with_context(|| format!("{} has no look {wanted:?}; it has: {}", path.display(), names()))?,
        None => match looks.as_slice() {
            [one] => one,
            [] => bail!("{} has no looks", path.display()),
            _ => bail!("{} has several looks: {}; add the name, as in FILE:NAME", path.display(), names()),
        },
    };
    let (name, fiber) = found;
    Ok((name.clone(), fiber.cast::<f64>()))
}

/// `FILE` or `FILE:NAME`; a file whose own name has a colon is a file.
fn look_parts(text: &str, is_file: impl Fn(&Path) -> bool) -> (&Path, Option<&str>) {
    match text.rsplit_once(':') {
        Some((path, name)) if !path.is_empty() && !name.is_empty() && !is_file(Path::new(text)) => {
            (Path::new(path), Some(name))
        }
        _ => (Path::new(text), None),
    }
}

/// `NAME=VALUE` several times as the JSON object that `fiber eval` takes. A value that is no JSON is a word.
fn parameters(set: &[String]) -> anyhow::Result<serde_json::Value> {
    let mut object = serde_json::Map::new();
    for text in set {
        let Some((name, value)) = text.split_once('=').map(|(name, value)| (name.trim(), value.trim())) else {
            bail!("--set {text:?} has no \"=\"; write NAME=VALUE, such as beta_m=0.2");
        };
        ensure!(!name.is_empty() && !value.is_empty(), "--set {text:?}: write NAME=VALUE, such as beta_m=0.2");
        let value = serde_json::from_str(value).unwrap_or_else(|_| serde_json::Value::String(value.to_owned()));
        if object.insert(name.to_owned(), value).is_some() {
            bail!("--set gives {name} twice");
        }
    }
    Ok(serde_json::Value::Object(object))
}

impl OutputArgs {
    fn format(&self) -> anyhow::Result<Format> {
        let path = &self.output;
        let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
        let format = match extension.as_deref() {
            Some("svg") => Format::Svg,
            Some("png") => Format::Png,
            _ => bail!("cannot write {}: figures are written as .svg or .png", path.display()),
        };
        ensure!(!path.is_dir(), "cannot write {}: it is a folder", path.display());
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            ensure!(folder.is_dir(), "cannot write {}: there is no folder {}", path.display(), folder.display());
        }
        ensure!(self.width.is_none() || format == Format::Png, "--width is for .png files; an SVG has no pixels");
        Ok(format)
    }

    fn write(&self, format: Format, figure: &Figure) -> anyhow::Result<()> {
        let bytes = match format {
            Format::Svg => figure.svg().into_bytes(),
            Format::Png => {
                let columns = self.width.unwrap_or((2.0 * figure.size()[0]) as u32);
                figure.png(columns).with_context(|| format!("drawing {}", self.output.display()))?
            }
        };
        film::write_bytes(&self.output, &bytes)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_look_follows_the_last_colon() {
        let none = |_: &Path| false;
        assert_eq!(look_parts("a.toml:main", none), (Path::new("a.toml"), Some("main")));
        assert_eq!(look_parts("a.toml", none), (Path::new("a.toml"), None));
        assert_eq!(look_parts("a.toml:", none), (Path::new("a.toml:"), None));
        assert_eq!(look_parts("odd:name.toml", |_: &Path| true), (Path::new("odd:name.toml"), None));
    }

    #[test]
    fn parameters_are_json_or_words() {
        let set = ["beta_m=0.2", "sigma_a=[0.1, 0.3, 0.8]", "mode=thesis", "residual = false"].map(str::to_owned);
        let wanted = serde_json::json!({
            "beta_m": 0.2, "sigma_a": [0.1, 0.3, 0.8], "mode": "thesis", "residual": false,
        });
        assert_eq!(parameters(&set).unwrap(), wanted);
        for bad in [&["beta_m"][..], &["=1"], &["a="], &["a=1", "a=2"]] {
            let set: Vec<String> = bad.iter().map(|text| (*text).to_owned()).collect();
            assert!(parameters(&set).unwrap_err().to_string().contains("--set"), "{bad:?}");
        }
    }
}
