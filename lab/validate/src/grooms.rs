//! Every groom of a folder, for looking at and for times.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use job::{GroomView, Metadata, Outputs, SceneView, Source, View};

use crate::lab_scene;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder with .hair files
    dir: PathBuf,
    /// Folder for the pictures; made if it is not there
    out: PathBuf,
    /// Picture size, such as 800x600 or 512
    #[arg(long, default_value = "512x512", value_parser = parse_size)]
    size: (u32, u32),
    /// Samples per pixel
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    samples: u32,
    /// Light by these lat-long pictures (.hdr, .exr), one after the other; a key, a rim and a sky if left out
    #[arg(long, value_name = "FILE", num_args = 1..)]
    env: Vec<PathBuf>,
    /// How pictures are developed: srgb, filmic or agx; agx if left out
    #[arg(long)]
    view: Option<View>,
    /// Threads; one per processor if left out
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Override a value of every scene, such as look.main.preset=blonde; may be repeated
    #[arg(long = "set", value_name = "PATH=VALUE")]
    set: Vec<String>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<bool> {
    let grooms = hair_files(&args.dir)?;
    if grooms.is_empty() {
        bail!("{} holds no .hair files", args.dir.display());
    }
    let mut stems: Vec<String> = args.env.iter().map(|env| stem(env)).collect();
    stems.sort();
    if let Some(twice) = stems.windows(2).find(|pair| pair[0] == pair[1]) {
        bail!("two environments are called {:?}: their pictures would have the same names", twice[0]);
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    // One render without an environment, or one for each.
    let lights: Vec<Option<&PathBuf>> =
        if args.env.is_empty() { vec![None] } else { args.env.iter().map(Some).collect() };
    let mut all_done = true;
    for groom in &grooms {
        for &environment in &lights {
            let name = match environment {
                Some(environment) => format!("{}_{}", stem(groom), stem(environment)),
                None => stem(groom),
            };
            match one(args, groom, environment, &name) {
                Ok(line) => println!("{name}: {line}"),
                Err(error) => {
                    println!("{name}: FAILED: {error:#}");
                    all_done = false;
                }
            }
        }
    }
    Ok(all_done)
}

/// Renders one groom and says in a line how it went.
fn one(args: &Args, groom: &Path, environment: Option<&PathBuf>, name: &str) -> anyhow::Result<String> {
    let view = GroomView { environment: environment.cloned(), ..GroomView::default() };
    let (width, height) = args.size;
    let mut overrides = vec![
        format!("film.width={width}"),
        format!("film.height={height}"),
        format!("render.samples={}", args.samples),
    ];
    overrides.extend(args.set.iter().cloned());
    let scene = job::load(&Source::Groom(groom.to_owned(), view), &overrides)?;
    let developed = args.view.unwrap_or(match scene.film.view {
        SceneView::Srgb => View::Srgb,
        SceneView::Filmic => View::Filmic,
        SceneView::Agx => View::Agx,
    });
    let strands: usize = scene.grooms.iter().map(|g| g.groom.strand_count()).sum();
    let points: usize = scene.grooms.iter().map(|g| g.groom.point_count()).sum();
    let outcome = lab_scene::render(&scene, scene.render.seed, args.threads.map_or(0, usize::from))?;
    let outputs = Outputs { exr: None, png: Some(args.out.join(format!("{name}.png"))) };
    outputs.save(&outcome.film, developed, scene.film.exposure_ev, &Metadata::default())?;

    let elapsed = outcome.elapsed.as_secs_f64();
    let mut line = format!(
        "{strands} strands, {points} points, set-up {:.2} s, {elapsed:.2} s, {:.3} million samples/s, {:.2} million rays/s",
        outcome.startup.as_secs_f64(),
        lab_scene::rate(&outcome),
        outcome.rays as f64 / elapsed.max(1e-9) / 1e6,
    );
    let noise = outcome.film.noise();
    if noise.is_finite() {
        line += &format!(", noise {:.1} %", 100.0 * noise);
    }
    if outcome.film.rejected() > 0 {
        line += &format!(", {} samples were NOT NUMBERS", outcome.film.rejected());
    }
    for warning in &scene.warnings {
        line += &format!("; warning: {warning}");
    }
    Ok(line)
}

/// The .hair files of a folder, by name.
fn hair_files(dir: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let context = || format!("cannot list {}", dir.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).with_context(context)? {
        let path = entry.with_context(context)?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("hair")) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn parse_size(text: &str) -> anyhow::Result<(u32, u32)> {
    let hint = || format!("{text:?} is no size; write it as 800x600, or 512 for a square");
    let (width, height) = text.split_once(['x', 'X']).unwrap_or((text, text));
    Ok((width.parse().with_context(hint)?, height.parse().with_context(hint)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_people_write_them() {
        assert_eq!(parse_size("800x600").unwrap(), (800, 600));
        assert_eq!(parse_size("512").unwrap(), (512, 512));
        for wrong in ["", "x", "-1x5", "8x8x8", "a"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn hair_files_are_found_by_their_ending_alone() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.hair", "A.HAIR", "c.txt", "hair"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let found: Vec<String> = hair_files(folder.path()).unwrap().iter().map(|p| stem(p)).collect();
        assert_eq!(found, ["A", "b"]);
        let error = hair_files(&folder.path().join("absent")).unwrap_err();
        assert!(format!("{error:#}").contains("absent"));
    }
}
