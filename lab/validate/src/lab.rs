//! The lab scene against what other renderers made of it.

use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::lab_scene::{self, Choice, LabScene};
use crate::mask::Mask;
use crate::reference::{self, Blocks};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder with groom.hair and scene.json, as gen_groom.py writes it; the scene file goes there too
    #[arg(long, value_name = "DIR")]
    dir: PathBuf,
    /// L1: a constant environment. L2: a rectangle and a faint environment
    #[arg(long, value_parser = ["L1", "L2"])]
    light: String,
    /// Block means are known for brown, mean colours for brown and blonde
    #[arg(long, default_value = "brown")]
    material: String,
    /// Samples per pixel and seed
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    samples: u32,
    /// Independent renders, from which standard errors come
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(2..=1000))]
    seeds: u32,
    /// Threads; one per processor if left out
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Override a value of our scene, such as look.hair.tilt_deg=-2; may be repeated
    #[arg(long = "set", value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// Write the report (Markdown) here too
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// How far means over all hair may be off, per channel.
const MEAN_TOLERANCE: f64 = 0.01;
/// Share of the blocks with hair that must agree.
const SHARE_OF_BLOCKS: f64 = 0.95;
/// A channel of a block agrees within this many combined standard errors ...
const ERRORS: f64 = 4.0;
/// ... or within this share.
const BLOCK_TOLERANCE: f64 = 0.02;
/// How many of the worst blocks are listed.
const LISTED: usize = 20;

/// What is kept of one render.
struct Picture {
    /// Mean colour of every block, row by row.
    blocks: Vec<[f64; 3]>,
    /// Mean colour over the mask.
    hair: [f64; 3],
}

impl Picture {
    /// From the colours of all pixels, row by row.
    fn of(colours: impl Iterator<Item = [f32; 3]>, mask: &Mask, block: usize) -> Self {
        let columns = mask.width.div_ceil(block);
        let rows = (mask.inside.len() / mask.width).div_ceil(block);
        let mut blocks = vec![([0.0; 3], 0.0); columns * rows];
        let mut hair = ([0.0; 3], 0.0);
        for (index, colour) in colours.enumerate() {
            let add = |(sum, count): &mut ([f64; 3], f64)| {
                for (sum, channel) in sum.iter_mut().zip(colour) {
                    *sum += f64::from(channel);
                }
                *count += 1.0;
            };
            let (x, y) = (index % mask.width, index / mask.width);
            add(&mut blocks[y / block * columns + x / block]);
            if mask.inside[index] {
                add(&mut hair);
            }
        }
        let mean = |(sum, count): ([f64; 3], f64)| sum.map(|s| s / count);
        Self { blocks: blocks.into_iter().map(mean).collect(), hair: mean(hair) }
    }
}

/// A colour and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Estimate {
    mean: [f64; 3],
    /// Standard error of `mean`.
    error: [f64; 3],
}

impl Estimate {
    /// From independent results, at least two.
    fn of(runs: &[[f64; 3]]) -> Self {
        let n = runs.len() as f64;
        let mean = [0, 1, 2].map(|c: usize| runs.iter().map(|run| run[c]).sum::<f64>() / n);
        let error = [0, 1, 2].map(|c: usize| {
            let spread: f64 = runs.iter().map(|run| (run[c] - mean[c]).powi(2)).sum();
            (spread / ((n - 1.0) * n)).sqrt()
        });
        Self { mean, error }
    }
}

/// How one channel of a block compares.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Deviation {
    /// Of the reference.
    relative: f64,
    /// In combined standard errors; infinite when a difference is certain.
    z: f64,
}

impl Deviation {
    fn of(ours: &Estimate, theirs: &Estimate, channel: usize) -> Self {
        let difference = ours.mean[channel] - theirs.mean[channel];
        let error = ours.error[channel].hypot(theirs.error[channel]);
        let over = |by: f64| {
            if difference == 0.0 {
                0.0
            } else if by > 0.0 {
                difference / by
            } else {
                difference.signum() * f64::INFINITY
            }
        };
        Self { relative: over(theirs.mean[channel]), z: over(error) }
    }

    fn agrees(self) -> bool {
        self.z.abs() <= ERRORS || self.relative.abs() <= BLOCK_TOLERANCE
    }
}

/// A block of both pictures.
struct Block {
    column: usize,
    row: usize,
    /// Pixels of the mask in it.
    hair: usize,
    ours: Estimate,
    theirs: Estimate,
    deviations: [Deviation; 3],
}

impl Block {
    fn agrees(&self) -> bool {
        self.deviations.iter().all(|d| d.agrees())
    }

    fn worst_z(&self) -> f64 {
        self.deviations.iter().map(|d| d.z.abs()).fold(0.0, f64::max)
    }
}

/// The blocks with at least `least` pixels of the mask.
struct Group<'a> {
    name: &'static str,
    blocks: Vec<&'a Block>,
    ours: Estimate,
    theirs: Estimate,
    /// Ours over theirs, and its standard error.
    ratio: Estimate,
}

impl<'a> Group<'a> {
    /// Means are weighted by the pixels of the mask in every block.
    fn of(name: &'static str, least: usize, all: &'a [Block], pictures: &[Picture]) -> Self {
        let chosen: Vec<(usize, &Block)> = all.iter().enumerate().filter(|(_, b)| b.hair >= least).collect();
        let total: f64 = chosen.iter().map(|(_, b)| b.hair as f64).sum();
        let weighted = |value: &dyn Fn(usize, &Block) -> [f64; 3]| {
            let mut sum = [0.0; 3];
            for &(index, block) in &chosen {
                for (sum, x) in sum.iter_mut().zip(value(index, block)) {
                    *sum += block.hair as f64 * x;
                }
            }
            sum.map(|s| s / total)
        };
        // Over seeds first: whatever neighbouring blocks share is then in the error.
        let runs: Vec<[f64; 3]> = pictures.iter().map(|p| weighted(&|index, _| p.blocks[index])).collect();
        let ours = Estimate::of(&runs);
        // Blocks of the reference are independent: its pixels were sampled independently.
        let mut variance = [0.0; 3];
        for (_, block) in &chosen {
            for (sum, error) in variance.iter_mut().zip(block.theirs.error) {
                *sum += (block.hair as f64 / total * error).powi(2);
            }
        }
        let theirs = Estimate { mean: weighted(&|_, block| block.theirs.mean), error: variance.map(f64::sqrt) };
        let ratio = ratio(&ours, &theirs);
        Self { name, blocks: chosen.into_iter().map(|(_, block)| block).collect(), ours, theirs, ratio }
    }

    fn agreeing(&self) -> usize {
        self.blocks.iter().filter(|b| b.agrees()).count()
    }

    fn share(&self) -> f64 {
        self.agreeing() as f64 / self.blocks.len() as f64
    }

    fn mean_agrees(&self) -> bool {
        self.ratio.mean.iter().all(|r| (r - 1.0).abs() <= MEAN_TOLERANCE)
    }
}

fn ratio(ours: &Estimate, theirs: &Estimate) -> Estimate {
    let mean = [0, 1, 2].map(|c: usize| ours.mean[c] / theirs.mean[c]);
    let error =
        [0, 1, 2].map(|c: usize| (ours.error[c] / theirs.mean[c]).hypot(mean[c] * theirs.error[c] / theirs.mean[c]));
    Estimate { mean, error }
}

pub(crate) fn run(args: &Args) -> anyhow::Result<bool> {
    let case = format!("{}_{}", args.light, args.material);
    let reference = reference::blocks(&case)?;
    let peers = reference::hair_means()?;
    let Some(peer) = peers.cases.get(&case) else {
        let known: Vec<&str> = peers.cases.keys().map(String::as_str).collect();
        bail!("nobody rendered {case}; there are {}", known.join(", "));
    };

    let lab = LabScene::read(&args.dir)?;
    let material = lab.material(&args.material)?;
    let text = lab.toml(&Choice {
        light: &args.light,
        look: &material.look(),
        max_depth: material.max_scatter,
        roulette_start: None,
        samples: args.samples,
        with_head: true,
    })?;
    let scene = lab_scene::load(&args.dir, &format!("cuticle_{case}.toml"), &text, &args.set)?;
    let size = [scene.film.width as usize, scene.film.height as usize];
    if size != [lab.camera.width as usize, lab.camera.height as usize] {
        bail!("the hair mask is that of scene.json: the picture must keep its size");
    }
    if let Some(reference) = &reference
        && reference.size != size
    {
        bail!("the scene has {size:?} pixels and the reference {:?}; generate it with --size 512", reference.size);
    }
    let hair = scene.grooms.first().context("the scene has no hair")?;
    let mask = Mask::of(&lab.camera, &lab.head, hair.groom.strands(), 4);
    if mask.count() == 0 {
        bail!("no pixel shows hair");
    }

    let block = reference.as_ref().map_or(16, |r| r.block);
    let threads = args.threads.map_or(0, usize::from);
    let mut pictures = Vec::new();
    let (mut seconds, mut rejected, mut last) = (0.0, 0, None);
    for seed in 1..=args.seeds {
        let outcome = lab_scene::render(&scene, seed, threads)?;
        eprintln!(
            "seed {seed} of {}: {:.1} s, {:.3} million samples/s",
            args.seeds,
            outcome.elapsed.as_secs_f64(),
            lab_scene::rate(&outcome)
        );
        seconds += outcome.elapsed.as_secs_f64();
        rejected += outcome.film.rejected();
        let colours = outcome.film.pixels().iter().map(|pixel| pixel.beauty().0);
        pictures.push(Picture::of(colours, &mask, block));
        last = Some(outcome);
    }
    let last = last.context("there are no seeds")?;

    let mut verdicts: Vec<(String, bool)> = Vec::new();
    let mut text = format!("# Lab scene {}, {}\n\n    {}\n\n", args.light, args.material, crate::command_line());
    text += &format!(
        "{} strands, {} points; {} x {} pixels; {} seeds of {} samples per pixel; {seconds:.1} s on {} threads ({}), \
         last seed {:.3} million samples/s after {:.2} s of set-up. Samples that were not numbers: {rejected}.\n\n",
        hair.groom.strand_count(),
        hair.groom.point_count(),
        size[0],
        size[1],
        args.seeds,
        args.samples,
        last.threads,
        last.simd,
        lab_scene::rate(&last),
        last.startup.as_secs_f64(),
    );
    verdicts.push(("every sample is a number".into(), rejected == 0));

    let same_mask = mask.count() == peers.mask_pixels;
    verdicts.push((format!("the hair mask has {} pixels, the peers' {}", mask.count(), peers.mask_pixels), same_mask));

    text += "## Mean hair colour over the mask\n\n";
    text += &format!("Peers: {}; four digits as printed.\n\n", peers.source);
    text += "| renderer | mean RGB | standard error | ours / theirs |\n|---|---|---|---|\n";
    let runs: Vec<[f64; 3]> = pictures.iter().map(|p| p.hair).collect();
    let ours = Estimate::of(&runs);
    text += &format!("| Cuticle | {} | {} | |\n", list(ours.mean, 5), list(ours.error, 5));
    for (name, &mean) in peer {
        let ratio = [0, 1, 2].map(|c: usize| ours.mean[c] / mean[c]);
        text += &format!("| {name} | {} | | {} |\n", list(mean, 4), list(ratio, 4));
        if reference.is_none() {
            let agrees = ratio.iter().all(|r| (r - 1.0).abs() <= MEAN_TOLERANCE);
            verdicts.push((format!("mean hair colour within 1 % of {name}"), agrees));
        }
    }
    text += "\n";

    match &reference {
        Some(reference) => compare_blocks(&mut text, &mut verdicts, reference, &mask, &pictures),
        None => text += "There are no block means for this case: mean colours decide.\n\n",
    }

    text += "## Verdict\n\n";
    for (what, holds) in &verdicts {
        text += &format!("- {}: {what}\n", if *holds { "yes" } else { "NO" });
    }
    let agrees = verdicts.iter().all(|(_, holds)| *holds);
    text += &format!("\n{}\n", if agrees { "Agreement." } else { "DISAGREEMENT." });
    crate::publish(&text, args.report.as_deref())?;
    Ok(agrees)
}

/// Appends the comparison by blocks.
fn compare_blocks(
    text: &mut String,
    verdicts: &mut Vec<(String, bool)>,
    reference: &Blocks,
    mask: &Mask,
    pictures: &[Picture],
) {
    let side = reference.block;
    let columns = reference.size[0] / side;
    let mut hair = vec![0; columns * (reference.size[1] / side)];
    for (index, _) in mask.inside.iter().enumerate().filter(|(_, inside)| **inside) {
        let (x, y) = (index % mask.width, index / mask.width);
        hair[y / side * columns + x / side] += 1;
    }
    let blocks: Vec<Block> = hair
        .iter()
        .enumerate()
        .map(|(index, &hair)| {
            let (row, column) = (index / columns, index % columns);
            let runs: Vec<[f64; 3]> = pictures.iter().map(|p| p.blocks[index]).collect();
            let ours = Estimate::of(&runs);
            let theirs = Estimate { mean: reference.mean[row][column], error: reference.standard_error[row][column] };
            let deviations = [0, 1, 2].map(|c| Deviation::of(&ours, &theirs, c));
            Block { column, row, hair, ours, theirs, deviations }
        })
        .collect();

    let full = side * side;
    let groups = [
        Group::of("wholly hair", full, &blocks, pictures),
        Group::of("at least 90 % hair", (0.9 * full as f64).ceil() as usize, &blocks, pictures),
        Group::of("any hair", 1, &blocks, pictures),
    ];
    *text += &format!(
        "## Blocks of {side} x {side} pixels against {}, {} samples per pixel\n\n",
        reference.renderer, reference.spp
    );
    *text += "Means weighted by the mask's pixels in each block.\n\n";
    *text += "| blocks | number | ours | reference | ours / reference | standard error of that |\n";
    *text += "|---|---|---|---|---|---|\n";
    for g in &groups {
        *text += &format!(
            "| {} | {} | {} | {} | {} | {} |\n",
            g.name,
            g.blocks.len(),
            list(g.ours.mean, 5),
            list(g.theirs.mean, 5),
            list(g.ratio.mean, 4),
            list(g.ratio.error, 4)
        );
    }

    *text += "\nA block agrees when each channel is within 4 combined standard errors or within 2 %. ";
    *text += "z is the difference in standard errors: were there no bias, its mean would be 0 and its root mean \
              square a little above 1 (the errors come from few runs).\n\n";
    *text += "| blocks | agree | share | within 4 errors | within 2 % | median error | median difference | mean z | rms z |\n";
    *text += "|---|---|---|---|---|---|---|---|---|\n";
    for g in &groups {
        let all = |test: fn(&Deviation) -> bool| g.blocks.iter().filter(|b| b.deviations.iter().all(test)).count();
        let channels = || g.blocks.iter().flat_map(|b| (0..3_usize).map(move |c| (*b, c)));
        let error =
            median(channels().map(|(b, c)| b.ours.error[c].hypot(b.theirs.error[c]) / b.theirs.mean[c]).collect());
        let difference = median(channels().map(|(b, c)| b.deviations[c].relative.abs()).collect());
        let z: Vec<f64> = channels().map(|(b, c)| b.deviations[c].z).collect();
        let n = z.len() as f64;
        *text += &format!(
            "| {} | {} of {} | {:.2} % | {} | {} | {:.2} % | {:.2} % | {:+.2} | {:.2} |\n",
            g.name,
            g.agreeing(),
            g.blocks.len(),
            100.0 * g.share(),
            all(|d| d.z.abs() <= ERRORS),
            all(|d| d.relative.abs() <= BLOCK_TOLERANCE),
            100.0 * error,
            100.0 * difference,
            z.iter().sum::<f64>() / n,
            (z.iter().map(|z| z * z).sum::<f64>() / n).sqrt(),
        );
    }

    let mut worst: Vec<&Block> = blocks.iter().filter(|b| b.hair > 0).collect();
    worst.sort_by(|a, b| b.worst_z().total_cmp(&a.worst_z()));
    *text +=
        &format!("\nThe {} blocks with the largest z (position: left and top pixel):\n\n", worst.len().min(LISTED));
    *text +=
        "| position | hair | ours | reference | relative difference, % | z | agrees |\n|---|---|---|---|---|---|---|\n";
    for b in worst.iter().take(LISTED) {
        *text += &format!(
            "| {}, {} | {:.0} % | {} | {} | {} | {} | {} |\n",
            b.column * side,
            b.row * side,
            100.0 * b.hair as f64 / full as f64,
            list(b.ours.mean, 5),
            list(b.theirs.mean, 5),
            list(b.deviations.map(|d| 100.0 * d.relative), 2),
            list(b.deviations.map(|d| d.z), 1),
            if b.agrees() { "yes" } else { "no" }
        );
    }
    let bare: Vec<&Block> = blocks.iter().filter(|b| b.hair == 0).collect();
    let bare_wrong: Vec<&&Block> = bare.iter().filter(|b| !b.agrees()).collect();
    *text += &format!(
        "\nOf the {} blocks without hair {} disagree (no part of the verdict){}\n\n",
        bare.len(),
        bare_wrong.len(),
        if bare_wrong.is_empty() { "." } else { ":" }
    );
    for b in bare_wrong.iter().take(LISTED) {
        *text += &format!(
            "- {}, {}: ours {}, reference {}, {} %\n",
            b.column * side,
            b.row * side,
            list(b.ours.mean, 5),
            list(b.theirs.mean, 5),
            list(b.deviations.map(|d| 100.0 * d.relative), 2)
        );
    }
    if !bare_wrong.is_empty() {
        *text += "\n";
    }

    for g in &groups[1..] {
        verdicts.push((format!("mean colour of blocks with {} within 1 %", g.name), g.mean_agrees()));
        let what = format!("at least 95 % of the blocks with {} agree ({:.2} %)", g.name, 100.0 * g.share());
        verdicts.push((what, g.share() >= SHARE_OF_BLOCKS));
    }
}

/// Three numbers in a cell.
fn list(values: [f64; 3], digits: usize) -> String {
    values.map(|x| format!("{x:.digits$}")).join(" ")
}

/// The middle one; NaN of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_errors_are_those_of_the_mean() {
        // 1, 2, 3, 6: mean 3, sum of squares 14, so √(14 / (3·4)).
        let runs = [1.0, 2.0, 3.0, 6.0].map(|x| [x, 10.0 * x, 5.0]);
        let estimate = Estimate::of(&runs);
        assert_eq!(estimate.mean, [3.0, 30.0, 5.0]);
        assert!((estimate.error[0] - (14.0_f64 / 12.0).sqrt()).abs() < 1e-12);
        assert!((estimate.error[1] - 10.0 * estimate.error[0]).abs() < 1e-12);
        assert_eq!(estimate.error[2], 0.0);
    }

    #[test]
    fn a_channel_agrees_by_its_errors_or_by_two_percent_and_not_otherwise() {
        let at = |mean: f64, error: f64| Estimate { mean: [mean; 3], error: [error; 3] };
        let agrees = |ours: Estimate, theirs: Estimate| Deviation::of(&ours, &theirs, 1).agrees();
        // Combined error 5: four of them are 20.
        assert!(agrees(at(119.9, 3.0), at(100.0, 4.0)) && !agrees(at(120.1, 3.0), at(100.0, 4.0)));
        assert!(agrees(at(98.1, 0.0), at(100.0, 0.0)) && !agrees(at(97.9, 0.0), at(100.0, 0.0)));
        assert!(agrees(at(0.0, 0.0), at(0.0, 0.0)) && !agrees(at(1e-9, 0.0), at(0.0, 0.0)));
        assert_eq!(Deviation::of(&at(1.0, 0.0), &at(2.0, 0.0), 0), Deviation { relative: -0.5, z: f64::NEG_INFINITY });
    }

    #[test]
    fn ratios_carry_the_errors_of_both() {
        let both = ratio(
            &Estimate { mean: [2.0, 1.0, 3.0], error: [0.2, 0.0, 0.0] },
            &Estimate { mean: [1.0, 2.0, 3.0], error: [0.0, 0.2, 0.0] },
        );
        assert_eq!(both, Estimate { mean: [2.0, 0.5, 1.0], error: [0.2, 0.05, 0.0] });
    }

    /// Two pictures of 4 x 2 pixels in blocks of 2: left all hair, right one pixel of four.
    #[test]
    fn groups_weigh_blocks_by_their_hair() {
        let block = |column, hair, reference: f64| Block {
            column,
            row: 0,
            hair,
            ours: Estimate { mean: [0.0; 3], error: [0.0; 3] },
            theirs: Estimate { mean: [reference; 3], error: [0.1; 3] },
            deviations: [Deviation { relative: 0.0, z: 0.0 }; 3],
        };
        let blocks = [block(0, 4, 1.0), block(1, 1, 6.0)];
        let picture = |left: f64, right: f64| Picture { blocks: vec![[left; 3], [right; 3]], hair: [0.0; 3] };
        let pictures = [picture(1.0, 5.0), picture(1.2, 6.2)];
        let any = Group::of("any", 1, &blocks, &pictures);
        assert_eq!(any.theirs.mean, [2.0; 3]);
        // Runs 1.8 and 2.2.
        assert!((any.ours.mean[0] - 2.0).abs() < 1e-12 && (any.ours.error[0] - 0.2).abs() < 1e-12);
        assert!((any.theirs.error[0] - 0.1 * (0.64_f64 + 0.04).sqrt()).abs() < 1e-12);
        assert!(any.mean_agrees());
        let full = Group::of("full", 4, &blocks, &pictures);
        assert_eq!((full.blocks.len(), full.theirs.mean), (1, [1.0; 3]));
        assert!(!full.mean_agrees(), "1.1 against 1");
    }

    #[test]
    fn pictures_are_reduced_to_blocks_and_to_the_mask() {
        let mask = Mask { width: 4, inside: vec![true, false, false, false, true, false, false, true] };
        let picture = Picture::of((0..8_u8).map(|i| [f32::from(i); 3]), &mask, 2);
        // Rows 0 1 2 3 and 4 5 6 7.
        assert_eq!(picture.blocks, [[2.5; 3], [4.5; 3]]);
        assert!((picture.hair[0] - 11.0 / 3.0).abs() < 1e-12);
    }
}
