use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::bail;
use film::{Comparison, PngOptions, View};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// The picture in question (.exr, .hdr, .png)
    test: PathBuf,
    /// The picture it is held against
    reference: PathBuf,
    /// Write the absolute difference as a picture (.png)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// What the difference is multiplied by
    #[arg(long, default_value_t = 4.0)]
    scale: f32,
    /// Write the map of FLIP errors (.png)
    #[arg(long, value_name = "FILE")]
    flip_map: Option<PathBuf>,
    /// Exposure at which FLIP looks at the pictures, stops
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Fail (exit code 1) if relMSE is above this
    #[arg(long, value_name = "MOST", allow_negative_numbers = true)]
    max_relmse: Option<f64>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if !args.scale.is_finite() {
        bail!("--scale is {}; it must be a finite number", args.scale);
    }
    if !(args.exposure.abs() <= 32.0) {
        bail!("--exposure is {}; it must lie between -32 and 32 stops", args.exposure);
    }
    if let Some(most) = args.max_relmse.filter(|most| !(*most >= 0.0 && most.is_finite())) {
        bail!("--max-relmse is {most}; it must be 0 or greater");
    }
    for path in [&args.output, &args.flip_map].into_iter().flatten() {
        check_output(path, [&args.test, &args.reference])?;
    }
    let (test, reference) = (film::image::read(&args.test)?, film::image::read(&args.reference)?);
    let c = Comparison::at_exposure(&test, &reference, args.exposure)?;
    let mut text = String::new();
    let rgb = |c: math::Rgb<f64>| format!("{:.5} {:.5} {:.5}", c[0], c[1], c[2]);
    // Writing to a string cannot fail.
    let _ = writeln!(text, "relMSE          {:.6}   (without the worst 0.1 %: {:.6})", c.relmse, c.relmse_trimmed);
    let _ = writeln!(text, "MSE             {:.6e}   PSNR {:.2} dB", c.mse, c.psnr);
    let _ = writeln!(text, "largest         {:.6}", c.max_abs);
    let _ = writeln!(text, "mean, test      {}", rgb(c.mean_test));
    let _ = writeln!(text, "mean, reference {}", rgb(c.mean_reference));
    let _ = writeln!(text, "ratio           {}", rgb(c.mean_ratio));
    match c.flip {
        Some(flip) => {
            let _ = writeln!(text, "FLIP            {flip:.5}");
        }
        None => {
            let _ = writeln!(text, "FLIP            not in this build (feature `flip`)");
        }
    }
    super::emit(&text)?;
    let plain = PngOptions { view: View::Srgb, ..PngOptions::default() };
    if let Some(path) = &args.output {
        film::write_png(path, &film::difference_image(&test, &reference, args.scale)?, &plain)?;
    }
    if let Some(path) = &args.flip_map {
        let Some(map) = &c.flip_map else {
            bail!("this build has no FLIP; build it with the feature `flip`");
        };
        film::write_png(path, map, &plain)?;
    }
    let failed = args.max_relmse.is_some_and(|most| c.relmse > most);
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Differences are PNGs, and never go over what is compared.
fn check_output(path: &Path, inputs: [&PathBuf; 2]) -> anyhow::Result<()> {
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        bail!("cannot write {}: differences are written as .png", path.display());
    }
    let same = |input: &PathBuf| match (path.canonicalize(), input.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => path == input.as_path(),
    };
    if inputs.into_iter().any(same) {
        bail!("{} is one of the pictures compared; it would be lost", path.display());
    }
    job::Outputs { exr: None, png: Some(path.to_owned()) }.check()?;
    Ok(())
}
