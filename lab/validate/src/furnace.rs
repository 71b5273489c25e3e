//! The white furnace: fibers that absorb nothing under light of 1 from everywhere cannot be seen.

use std::path::PathBuf;

use anyhow::Context;

use crate::lab_scene::{self, Choice, LabScene};
use crate::mask::Mask;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder with groom.hair and scene.json, as gen_groom.py writes it; scene files go there too
    #[arg(long, value_name = "DIR")]
    dir: PathBuf,
    /// Samples per pixel
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    samples: u32,
    /// Changes the noise and nothing else
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Threads; one per processor if left out
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Override a value of our scenes, such as render.curve_shape=ribbon; may be repeated
    #[arg(long = "set", value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// Write the report (Markdown) here too
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// A model that should vanish.
struct Candidate {
    name: &'static str,
    file: &'static str,
    look: String,
    /// Whether it conserves energy by construction; else its loss is reported and not judged.
    exact: bool,
}

/// Places of strands that make a pixel hair: pixels that are hair all over, or nearly.
const MIN_HITS: u32 = 12;
/// Side of the blocks, pixels.
const BLOCK: usize = 32;
/// A mean agrees within this many standard errors and the rounding of some hundred factors in single precision.
const ERRORS: f64 = 4.0;
const ROUNDING: f64 = 1e-4;

pub(crate) fn run(args: &Args) -> anyhow::Result<bool> {
    let mut lab = LabScene::read(&args.dir)?;
    // Without the head, hair behind it is seen too.
    lab.head.radius = 1e-6;
    let white = lab.material("white")?;
    let deon = |attenuation: &str| format!("model = \"deon\"\nabsorption = 0.0\nattenuation = \"{attenuation}\"\n");
    let candidates = [
        Candidate { name: "Chiang", file: "chiang", look: white.look(), exact: true },
        Candidate {
            name: "Lambertian, albedo 1",
            file: "lambertian",
            look: "model = \"lambertian\"\nalbedo = 1.0\n".into(),
            exact: true,
        },
        Candidate {
            name: "d'Eon, attenuation at the difference angle",
            file: "deon_difference",
            look: deon("difference"),
            exact: false,
        },
        Candidate {
            name: "d'Eon, attenuation at the known direction",
            file: "deon_known",
            look: deon("known"),
            exact: true,
        },
    ];

    let mut text = format!("# White furnace\n\n    {}\n\n", crate::command_line());
    text += &format!(
        "The lab's groom without the head, environment 1, no absorption, at most {} scattering events, no roulette, \
         {} samples per pixel. Chiang has the lab's roughnesses and tilt, d'Eon the defaults of its model. Mean over \
         the pixels with at least {MIN_HITS} places of strands in them; its standard error is that of pixels whose \
         expectation is all the same. Blocks: means over blocks of {BLOCK} x {BLOCK} pixels, more than 90 % hair.\n\n",
        white.max_scatter, args.samples
    );
    text += "| model | mean | standard error | off by (errors) | blocks, least and most | pixels, least and most | \
             background | not numbers | million samples/s | conserves energy |\n";
    text += "|---|---|---|---|---|---|---|---|---|---|\n";
    let mut all_agree = true;
    let mut mask: Option<Mask> = None;
    for candidate in &candidates {
        let scene = lab.toml(&Choice {
            light: "L1",
            look: &candidate.look,
            max_depth: white.max_scatter,
            roulette_start: Some(white.max_scatter),
            samples: args.samples,
            with_head: false,
        })?;
        let scene = lab_scene::load(&args.dir, &format!("cuticle_furnace_{}.toml", candidate.file), &scene, &args.set)?;
        if [scene.film.width, scene.film.height] != [lab.camera.width, lab.camera.height] {
            anyhow::bail!("the hair mask is that of scene.json: the picture must keep its size");
        }
        let hair = scene.grooms.first().context("the scene has no hair")?;
        let mask = mask.get_or_insert_with(|| Mask::of(&lab.camera, &lab.head, hair.groom.strands(), MIN_HITS));
        let outcome = lab_scene::render(&scene, args.seed, args.threads.map_or(0, usize::from))?;
        eprintln!("{}: {:.1} s", candidate.name, outcome.elapsed.as_secs_f64());
        let grey: Vec<f64> = outcome
            .film
            .pixels()
            .iter()
            .map(|pixel| pixel.beauty().0.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0)
            .collect();
        let seen = Summary::of(&grey, mask).context("no pixel shows hair")?;
        let off = (seen.mean - 1.0).abs();
        let rejected = outcome.film.rejected();
        let agrees = off <= ERRORS * seen.error + ROUNDING && rejected == 0;
        all_agree &= agrees || !candidate.exact;
        text += &format!(
            "| {} | {:.5} | {:.5} | {} | {} | {:.4} {:.4} | {:.5} | {rejected} | {:.3} | {} |\n",
            candidate.name,
            seen.mean,
            seen.error,
            if seen.error > 0.0 { format!("{:+.1}", (seen.mean - 1.0) / seen.error) } else { "-".into() },
            match seen.blocks {
                Some((least, most)) => format!("{least:.4} {most:.4}"),
                None => "-".into(),
            },
            seen.least,
            seen.most,
            seen.background,
            lab_scene::rate(&outcome),
            match (agrees, candidate.exact) {
                (true, _) => "yes",
                (false, true) => "NO",
                (false, false) => "no, as published",
            }
        );
    }
    let pixels = mask.map_or(0, |mask| mask.count());
    text += &format!(
        "\nPixels of hair: {pixels}. A model conserves energy here when the mean is 1 within {ERRORS} standard errors \
         and {ROUNDING} for rounding, and every sample is a number.\n\n{}\n",
        if all_agree { "Agreement." } else { "DISAGREEMENT." }
    );
    crate::publish(&text, args.report.as_deref())?;
    Ok(all_agree)
}

/// What the furnace looks like where there is hair.
#[derive(Debug, PartialEq)]
struct Summary {
    mean: f64,
    error: f64,
    least: f64,
    most: f64,
    /// Least and greatest mean of the blocks that are nearly all hair, where there are any.
    blocks: Option<(f64, f64)>,
    /// Mean over the upper left corner, eight pixels wide and high.
    background: f64,
}

impl Summary {
    /// `None` without any hair.
    fn of(grey: &[f64], mask: &Mask) -> Option<Self> {
        let width = mask.width;
        let columns = width.div_ceil(BLOCK);
        let rows = (grey.len() / width).div_ceil(BLOCK);
        let mut blocks = vec![(0.0, 0_usize); columns * rows];
        let (mut sum, mut count) = (0.0, 0_usize);
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut corner, mut corners) = (0.0, 0.0);
        for (index, &value) in grey.iter().enumerate() {
            let (x, y) = (index % width, index / width);
            if x < 8 && y < 8 {
                corner += value;
                corners += 1.0;
            }
            if !mask.inside[index] {
                continue;
            }
            sum += value;
            count += 1;
            least = least.min(value);
            most = most.max(value);
            let block = &mut blocks[y / BLOCK * columns + x / BLOCK];
            block.0 += value;
            block.1 += 1;
        }
        if count == 0 {
            return None;
        }
        let mean = sum / count as f64;
        let hair = grey.iter().zip(&mask.inside).filter(|(_, inside)| **inside);
        let spread = hair.map(|(value, _)| (value - mean).powi(2)).sum::<f64>() / count as f64;
        let full = blocks.iter().filter(|(_, n)| *n as f64 > 0.9 * (BLOCK * BLOCK) as f64);
        let means = full.map(|(sum, n)| sum / *n as f64);
        let blocks = means.fold(None, |range: Option<(f64, f64)>, x| {
            let (least, most) = range.unwrap_or((x, x));
            Some((least.min(x), most.max(x)))
        });
        Some(Self { mean, error: (spread / count as f64).sqrt(), least, most, blocks, background: corner / corners })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_counts_hair_alone() {
        // 64 x 32: the left block all hair, of the right one a single row.
        let inside: Vec<bool> = (0..64 * 32).map(|i| i % 64 < 32 || i < 64).collect();
        let mask = Mask { width: 64, inside };
        let grey: Vec<f64> = (0..64 * 32)
            .map(|i| match (i % 64 < 32, i < 64) {
                // 0.75 and 1.25 by columns.
                (true, _) => {
                    if i % 2 == 0 {
                        0.75
                    } else {
                        1.25
                    }
                }
                (false, true) => 2.0,
                (false, false) => 1e9,
            })
            .collect();
        let seen = Summary::of(&grey, &mask).unwrap();
        let mean = (1024.0 + 64.0) / 1056.0;
        assert!((seen.mean - mean).abs() < 1e-12);
        // Spread: mean of squares less the square of the mean.
        let squares = (512.0 * (0.5625 + 1.5625) + 32.0 * 4.0) / 1056.0;
        assert!((seen.error - ((squares - mean * mean) / 1056.0).sqrt()).abs() < 1e-12);
        assert_eq!((seen.least, seen.most, seen.background), (0.75, 2.0, 1.0));
        assert_eq!(seen.blocks, Some((1.0, 1.0)));
        assert_eq!(Summary::of(&[1.0; 4], &Mask { width: 2, inside: vec![false; 4] }), None);
    }
}
