//! `cuticle preview`: one frame by the interactive renderer, and what it cost.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context, bail};
use film::PngOptions;
use job::{Outputs, View};
use raster::{AdapterDescription, Gpu, GpuError, GpuOptions, Renderer, Report, Settings, Tier};
use serde::Serialize;

use super::input::{self, Input};
use super::techniques::{Named, Techniques};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    techniques: Techniques,
    /// Draw with the adapter of this name, or part of it; the most capable one if left out
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Ask the adapter for no more than the default limits of WebGPU, which every browser has
    #[arg(long)]
    web: bool,
    /// List the adapters of this machine and do nothing else
    #[arg(long, exclusive = true)]
    list_adapters: bool,
    /// Write what each pass and each buffer cost: NAME.json or NAME.csv
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// How the PNG is developed: srgb, filmic or agx; the scene's choice if left out
    #[arg(long)]
    view: Option<View>,
    /// Where to write: NAME.exr gives the radiance and NAME.png, NAME.png the picture alone
    #[arg(short, long, default_value = "preview.png")]
    output: PathBuf,
    /// Say nothing but errors and warnings
    #[arg(short, long)]
    quiet: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if args.list_adapters {
        let adapters = Gpu::adapters();
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter.into());
        }
        super::emit(&adapters.iter().map(|adapter| format!("{adapter}\n")).collect::<String>())?;
        return Ok(ExitCode::SUCCESS);
    }
    // Whatever can be refused is refused before the scene is read and the device opened: that takes seconds.
    args.input.check()?;
    let settings = args.techniques.settings()?;
    let outputs = Outputs::from_name(&args.output)?;
    outputs.check()?;
    let report_file = args.report.as_deref().map(ReportFile::new).transpose()?;

    let scene = Arc::new(args.input.load(Vec::new())?);
    let say = |text: &str| {
        if !args.quiet {
            super::say(text);
        }
    };
    say(&args.input.heading(&scene));
    let tier = if args.web { Tier::Web } else { Tier::Native };
    let gpu = Gpu::new(&GpuOptions { adapter: args.adapter.clone(), tier })?;
    say(&format!("on {}", gpu.description()));

    let size = [scene.film.width, scene.film.height];
    let mut renderer = Renderer::new(&gpu, Arc::clone(&scene), &settings)?;
    let report = renderer.draw(&scene.camera, size)?;
    let image = renderer.image()?;
    for note in &report.notes {
        say(&format!("note: {note}"));
    }

    if let Some(path) = &outputs.exr {
        film::write_image_exr(path, &image)?;
    }
    if let Some(path) = &outputs.png {
        let view = input::view(args.view, &scene);
        let options = PngOptions { view, exposure_ev: scene.film.exposure_ev, ..PngOptions::default() };
        film::write_png(path, &image, &options)?;
    }
    if let Some(file) = &report_file {
        file.write(gpu.description(), &settings, size, &report)?;
    }
    if !args.quiet {
        super::emit(&(report.table() + &told(gpu.description(), size, &report)))?;
    }
    let report_path = report_file.as_ref().map(|file| file.path);
    let written: Vec<String> = outputs.paths().chain(report_path).map(|path| path.display().to_string()).collect();
    say(&format!("wrote {}", written.join(" and ")));
    Ok(ExitCode::SUCCESS)
}

/// What the table does not say: without it nobody knows what its times are times of.
fn told(adapter: &AdapterDescription, [width, height]: [u32; 2], report: &Report) -> String {
    format!("{width} x {height} pixels, wall {:.3} ms, on {adapter}\n", report.wall_ms)
}

/// The table of the report, and what it does not say.
fn csv(adapter: &AdapterDescription, [width, height]: [u32; 2], report: &Report) -> String {
    // Names are text of the driver's.
    let name = format!("\"{}\"", adapter.name.replace('"', "\"\"").replace(['\n', '\r'], " "));
    let mut text = report.csv();
    for (name, value) in [
        ("adapter", name),
        ("software", adapter.software.to_string()),
        ("width", width.to_string()),
        ("height", height.to_string()),
        ("wall_ms", format!("{:.6}", report.wall_ms)),
        ("attempts", report.attempts.to_string()),
    ] {
        text += &format!("frame,preview,{name},{value}\n");
    }
    text
}

/// Where the report goes.
struct ReportFile<'a> {
    path: &'a Path,
    format: ReportFormat,
}

#[derive(Clone, Copy)]
enum ReportFormat {
    Json,
    Csv,
}

impl<'a> ReportFile<'a> {
    /// # Errors
    /// When no report could be written there.
    fn new(path: &'a Path) -> anyhow::Result<Self> {
        let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
        let format = match extension.as_deref() {
            Some("json") => ReportFormat::Json,
            Some("csv") => ReportFormat::Csv,
            _ => bail!("cannot write {}: reports are written as .json or .csv", path.display()),
        };
        // The folder is looked at as that of a picture is.
        Outputs { exr: None, png: Some(path.to_owned()) }.check()?;
        Ok(Self { path, format })
    }

    fn write(
        &self,
        adapter: &AdapterDescription,
        settings: &Settings,
        size: [u32; 2],
        report: &Report,
    ) -> anyhow::Result<()> {
        let text = match self.format {
            ReportFormat::Csv => csv(adapter, size, report),
            ReportFormat::Json => json(adapter, settings, size, report).context("the report is no JSON")?,
        };
        film::write_bytes(self.path, text.as_bytes())?;
        Ok(())
    }
}

// The report on disk is not the one in memory, so either may change alone.

#[derive(Serialize)]
struct JsonReport<'a> {
    adapter: JsonAdapter<'a>,
    settings: Named,
    /// Pixels.
    size: [u32; 2],
    spans: Vec<JsonSpan<'a>>,
    memory: Vec<JsonAllocation<'a>>,
    fragments: JsonFragments,
    attempts: u32,
    wall_ms: f64,
    notes: &'a [String],
}

#[derive(Serialize)]
struct JsonAdapter<'a> {
    name: &'a str,
    backend: &'a str,
    driver: &'a str,
    software: bool,
}

#[derive(Serialize)]
struct JsonSpan<'a> {
    part: &'a str,
    pass: &'a str,
    /// Nothing where the device has no timers.
    ms: Option<f64>,
}

#[derive(Serialize)]
struct JsonAllocation<'a> {
    part: &'a str,
    name: &'a str,
    bytes: u64,
}

#[derive(Serialize)]
struct JsonFragments {
    stored: u64,
    dropped: u64,
}

fn json(
    adapter: &AdapterDescription,
    settings: &Settings,
    size: [u32; 2],
    report: &Report,
) -> serde_json::Result<String> {
    let file = JsonReport {
        adapter: JsonAdapter {
            name: &adapter.name,
            backend: &adapter.backend,
            driver: &adapter.driver,
            software: adapter.software,
        },
        settings: Named::from(settings),
        size,
        spans: report.spans.iter().map(|s| JsonSpan { part: s.owner, pass: &s.pass, ms: s.ms }).collect(),
        memory: report.memory.iter().map(|m| JsonAllocation { part: m.owner, name: &m.name, bytes: m.bytes }).collect(),
        fragments: JsonFragments { stored: report.fragments.stored, dropped: report.fragments.dropped },
        attempts: report.attempts,
        wall_ms: report.wall_ms,
        notes: &report.notes,
    };
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

#[cfg(test)]
mod tests {
    use raster::{Allocation, Fragments, Span};
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn a_report_keeps_every_number() {
        let adapter = AdapterDescription {
            name: "a \"quoted\" name".to_owned(),
            backend: "Vulkan".to_owned(),
            driver: String::new(),
            software: true,
        };
        let span = |pass: &str, ms| Span { owner: "dom", pass: pass.to_owned(), ms };
        let report = Report {
            spans: vec![span("depth", Some(0.25)), span("opacity", None)],
            memory: vec![Allocation { owner: "dom", name: "maps".to_owned(), bytes: 1 << 40 }],
            fragments: Fragments { stored: 7, dropped: 1 },
            wall_ms: 1.5,
            attempts: 2,
            notes: vec!["light 0: is dark".to_owned()],
        };
        let text = super::json(&adapter, &Settings::default(), [16, 9], &report).unwrap();
        assert!(text.ends_with("}\n"), "{text}");
        let mut found: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(found["settings"]["transparency"], "dbk");
        found["settings"].take();
        let wanted = json!({
            "adapter": { "name": "a \"quoted\" name", "backend": "Vulkan", "driver": "", "software": true },
            "settings": null,
            "size": [16, 9],
            "spans": [
                { "part": "dom", "pass": "depth", "ms": 0.25 },
                { "part": "dom", "pass": "opacity", "ms": null },
            ],
            "memory": [{ "part": "dom", "name": "maps", "bytes": 1_099_511_627_776_u64 }],
            "fragments": { "stored": 7, "dropped": 1 },
            "attempts": 2,
            "wall_ms": 1.5,
            "notes": ["light 0: is dark"],
        });
        assert_eq!(found, wanted);
        // As CSV and in words, the same.
        let csv = super::csv(&adapter, [16, 9], &report);
        for line in [
            "ms,dom,depth,0.250000",
            "bytes,dom,maps,1099511627776",
            "fragments,transparency,dropped,1",
            "frame,preview,adapter,\"a \"\"quoted\"\" name\"",
            "frame,preview,software,true",
            "frame,preview,width,16",
            "frame,preview,height,9",
            "frame,preview,wall_ms,1.500000",
            "frame,preview,attempts,2",
        ] {
            assert!(csv.lines().any(|found| found == line), "{line} in\n{csv}");
        }
        let told = told(&adapter, [16, 9], &report);
        assert!(told.starts_with("16 x 9 pixels, wall 1.500 ms, on a \"quoted\" name (Vulkan, software"), "{told}");
    }

    #[test]
    fn reports_are_json_or_csv() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name| folder.path().join(name);
        assert!(matches!(ReportFile::new(&path("a.JSON")).unwrap().format, ReportFormat::Json));
        assert!(matches!(ReportFile::new(&path("a.csv")).unwrap().format, ReportFormat::Csv));
        for (name, says) in [("a.txt", ".json or .csv"), ("a", ".json or .csv"), ("no/such/a.json", "no/such")] {
            let path = path(name);
            let Err(error) = ReportFile::new(&path) else { panic!("{name} was taken") };
            assert!(error.to_string().contains(says), "{error}");
        }
    }
}
