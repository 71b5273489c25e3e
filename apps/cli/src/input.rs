//! Where a scene comes from, as flags: what all commands that render have in common.

use std::path::PathBuf;

use anyhow::{Context, bail};
use job::{GroomView, LoadedScene, SceneView, Source, UpAxis, View};

/// A scene file, a groom alone or the built-in scene, and what is overridden.
#[derive(clap::Args)]
pub(crate) struct Input {
    /// Scene file (.toml); without one, the built-in scene
    scene: Option<PathBuf>,
    /// Render this groom alone, framed and lit automatically
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    groom: Option<PathBuf>,
    /// Up axis of --groom; guessed from the strands if left out
    #[arg(long, value_parser = ["x", "y", "z"], requires = "groom")]
    up: Option<String>,
    /// Where --groom is seen from: degrees around the vertical
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires = "groom")]
    azimuth: Option<f32>,
    /// Where --groom is seen from: degrees above the horizon
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires = "groom")]
    elevation: Option<f32>,
    /// Metres per unit of --groom and --head (0.01 for centimetres), to judge widths
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, requires = "groom")]
    unit_m: Option<f32>,
    /// A mesh under --groom (.obj, .ply), in the groom's units and axes
    #[arg(long, value_name = "FILE", requires = "groom")]
    head: Option<PathBuf>,
    /// Light --groom by this lat-long picture (.hdr, .exr)
    #[arg(long, value_name = "FILE", requires = "groom")]
    env: Option<PathBuf>,
    /// Picture size, such as 1280x720
    #[arg(long, allow_hyphen_values = true, value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Override a value of the scene, such as look.main.eumelanin=0.3; may be repeated
    #[arg(long = "set", value_name = "PATH=VALUE")]
    set: Vec<String>,
}

impl Input {
    /// Refuses angles and units that cannot be ones, before any file is read.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        // The parser does not ask for --groom beside a scene file, with which it could not stand.
        let of_grooms = [
            ("--up", self.up.is_some()),
            ("--azimuth", self.azimuth.is_some()),
            ("--elevation", self.elevation.is_some()),
            ("--unit-m", self.unit_m.is_some()),
            ("--head", self.head.is_some()),
            ("--env", self.env.is_some()),
        ];
        if let (None, Some((flag, _))) = (&self.groom, of_grooms.iter().find(|(_, given)| *given)) {
            bail!("{flag} goes with --groom, not with a scene file");
        }
        for (flag, angle, most) in [("--azimuth", self.azimuth, 1e6), ("--elevation", self.elevation, 89.0)] {
            if let Some(angle) = angle.filter(|a| !(a.abs() <= most)) {
                bail!("{flag} is {angle}; it must be a number of degrees between -{most} and {most}");
            }
        }
        super::check_unit(self.unit_m)
    }

    /// Loads the scene and passes its warnings on.
    ///
    /// Flags are overrides like any other: `overrides` are those of the command, `--size` follows, and what `--set`
    /// says comes last and wins.
    pub(crate) fn load(&self, mut overrides: Vec<String>) -> anyhow::Result<LoadedScene> {
        if let Some((width, height)) = self.size {
            overrides.push(format!("film.width={width}"));
            overrides.push(format!("film.height={height}"));
        }
        overrides.extend(self.set.iter().cloned());
        let scene = job::load(&self.source(), &overrides)?;
        for warning in &scene.warnings {
            super::say(&format!("warning: {warning}"));
        }
        Ok(scene)
    }

    fn source(&self) -> Source {
        match (&self.scene, &self.groom) {
            (Some(path), _) => Source::File(path.clone()),
            (None, Some(path)) => {
                let default = GroomView::default();
                let view = GroomView {
                    up: self.up.as_deref().map(|up| match up {
                        "x" => UpAxis::X,
                        "z" => UpAxis::Z,
                        _ => UpAxis::Y,
                    }),
                    azimuth_deg: self.azimuth.unwrap_or(default.azimuth_deg),
                    elevation_deg: self.elevation.unwrap_or(default.elevation_deg),
                    unit_m: self.unit_m.unwrap_or(default.unit_m),
                    head: self.head.clone(),
                    environment: self.env.clone(),
                };
                Source::Groom(path.clone(), view)
            }
            (None, None) => Source::Builtin,
        }
    }

    /// What is about to be rendered: `curls: 50,000 strands, 1280 x 720 pixels`.
    pub(crate) fn heading(&self, scene: &LoadedScene) -> String {
        let strands: usize = scene.grooms.iter().map(|g| g.groom.strand_count()).sum();
        let name = match (&self.scene, &self.groom, scene.name.as_str()) {
            (None, None, _) => "built-in scene",
            (_, _, "") => "scene",
            (_, _, name) => name,
        };
        format!("{name}: {} strands, {} x {} pixels", grouped(strands as u64), scene.film.width, scene.film.height)
    }
}

/// How a picture is developed: as asked for, else as the scene says.
pub(crate) fn view(asked: Option<View>, scene: &LoadedScene) -> View {
    asked.unwrap_or(match scene.film.view {
        SceneView::Srgb => View::Srgb,
        SceneView::Filmic => View::Filmic,
        SceneView::Agx => View::Agx,
    })
}

/// `1234567` as `1,234,567`.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

/// What scenes accept, too.
const LONGEST_SIDE: u32 = 16_384;

/// A size such as `1280x720`, each side within what scenes accept.
pub(crate) fn parse_size(text: &str) -> anyhow::Result<(u32, u32)> {
    let hint = || format!("{text:?} is no size; write it as 1280x720");
    let (width, height) = text.split_once(['x', 'X']).with_context(hint)?;
    let size: (u32, u32) = (width.parse().with_context(hint)?, height.parse().with_context(hint)?);
    let sides = 1..=LONGEST_SIDE;
    if !sides.contains(&size.0) || !sides.contains(&size.1) {
        bail!("{text:?} is out of range; each side lies between 1 and {LONGEST_SIDE} pixels");
    }
    Ok(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_people_write_them() {
        assert_eq!(parse_size("1280x720").unwrap(), (1280, 720));
        for wrong in ["1280", "x", "-1x5", "1280x720x3"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_are_grouped() {
        assert_eq!(grouped(50_000), "50,000");
        assert_eq!(grouped(999), "999");
    }
}
