use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

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
    #[arg(long, value_name = "MOST")]
    max_relmse: Option<f64>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if !args.scale.is_finite() || !args.exposure.is_finite() {
        anyhow::bail!("--scale and --exposure must be finite numbers");
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
    super::emit(&text);
    let plain = PngOptions { view: View::Srgb, ..PngOptions::default() };
    if let Some(path) = &args.output {
        film::write_png(path, &film::difference_image(&test, &reference, args.scale)?, &plain)?;
    }
    if let Some(path) = &args.flip_map {
        let Some(map) = &c.flip_map else {
            anyhow::bail!("this build has no FLIP; build it with the feature `flip`");
        };
        film::write_png(path, map, &plain)?;
    }
    let failed = args.max_relmse.is_some_and(|most| c.relmse > most);
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
