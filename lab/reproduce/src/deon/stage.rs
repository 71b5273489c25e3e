//! What the pictures show: three curling locks under a sky, with and without area lights.

use std::f32::consts::TAU;
use std::sync::Arc;

use film::{Film, View};
use groom::Groom;
use math::{DVec3, Rgb, Vec3, hash};
use scene::EnvironmentImage;

use crate::raster::Raster;
use crate::render::{self, Memory};
use crate::{Context, Error, stats};

/// Radius of a fiber; a unit is a centimetre. Thicker than hair, so that fewer make a lock.
const RADIUS: f32 = 0.011;

/// What varies along the fibers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Varies {
    pub(super) absorption: bool,
    pub(super) roughness: bool,
    pub(super) tilt: bool,
    pub(super) ior: bool,
}

impl Varies {
    /// All of it.
    pub(super) const ALL: Self = Self { absorption: true, roughness: true, tilt: true, ior: true };

    /// The lines of a look: golden brown, or darker by the factor `pigment`.
    pub(super) fn look(self, pigment: f64) -> String {
        let mut out = String::from("model = \"deon\"\n");
        let absorption = if self.absorption {
            format!(
                "eumelanin = {{ ramp = [[0.0, {:?}], [0.5, {:?}], [1.0, {:?}]], noise = {{ amount = {:?}, \
                 frequency = 8.0 }} }}\n",
                1.3 * pigment,
                0.45 * pigment,
                0.1 * pigment,
                0.25 * pigment
            )
        } else {
            format!("eumelanin = {:?}\n", 0.5 * pigment)
        };
        out += &absorption;
        out += &format!("pheomelanin = {:?}\n", 0.35 * pigment);
        out += if self.roughness {
            // One seed: a rough place is rough in both directions.
            "longitudinal_roughness_deg = { value = 8.0, noise = { amount = 6.0, frequency = 14.0, seed = 5 } }\n\
             azimuthal_roughness_deg = { value = 8.0, noise = { amount = 6.0, frequency = 14.0, seed = 5 } }\n"
        } else {
            "longitudinal_roughness_deg = 8.0\nazimuthal_roughness_deg = 8.0\n"
        };
        out += if self.tilt {
            "tilt_deg = { value = -3.0, noise = { amount = 5.0, frequency = 14.0 } }\n"
        } else {
            "tilt_deg = -3.0\n"
        };
        out += if self.ior {
            "ior = { value = 1.55, noise = { amount = 0.25, frequency = 14.0 } }\n"
        } else {
            "ior = 1.55\n"
        };
        out
    }
}

/// A picture to take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot<'a> {
    /// Lines of the look.
    pub(super) look: &'a str,
    /// Whether the area lights shine beside the sky.
    pub(super) area_lights: bool,
    /// As in scene files.
    pub(super) integrator: &'a str,
    /// Per pixel.
    pub(super) samples: u32,
    /// A small part of the middle lock, of this many pixels a side, instead of the whole.
    pub(super) close: Option<u32>,
    /// Changes the noise.
    pub(super) seed: u32,
}

/// The locks and the sky.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    assets: Memory,
    size: (u32, u32),
}

impl Stage {
    pub(super) fn new(context: &Context<'_>) -> Result<Self, Error> {
        let mut assets = Memory::default();
        assets.grooms.insert("locks".into(), locks(context.count(1500).clamp(150, 3000))?);
        assets.environments.insert("sky".into(), sky(64));
        Ok(Self { assets, size: (context.pixels(150), context.pixels(200)) })
    }

    fn text(&self, shot: &Shot<'_>) -> String {
        let (target, fov_deg, (width, height)) = match shot.close {
            None => ([0.0, 0.0, 0.0], 28.0, self.size),
            Some(side) => ([0.4, 0.2, 0.0], 3.0, (side, side)),
        };
        let mut text = format!(
            "[scene]\nname = \"locks\"\n[camera]\nposition = [0.0, 0.0, 16.0]\ntarget = {target:?}\n\
             fov_deg = {fov_deg:?}\n[film]\nwidth = {width}\nheight = {height}\n\
             [render]\nsamples = {}\nmax_depth = 64\nintegrator = \"{}\"\nseed = {}\n\
             [[light]]\ntype = \"environment\"\nfile = \"sky\"\nvisible = false\n",
            shot.samples, shot.integrator, shot.seed
        );
        if shot.area_lights {
            text += "[[light]]\ntype = \"rectangle\"\ncenter = [-7.0, 8.0, 9.0]\naim = [0.0, 0.0, 0.0]\nwidth = 5.0\n\
                     height = 5.0\nradiance = [7.0, 6.3, 5.4]\n\
                     [[light]]\ntype = \"rectangle\"\ncenter = [8.0, 5.0, -8.0]\naim = [0.0, 0.0, 0.0]\nwidth = 5.0\n\
                     height = 6.0\nradiance = [5.0, 5.6, 6.6]\n";
        }
        text += "[[groom]]\nfile = \"locks\"\nlook = \"main\"\n[look.main]\n";
        text + shot.look
    }

    /// Takes a picture; `step` is what is told meanwhile.
    pub(super) fn film(&self, context: &Context<'_>, step: &str, shot: &Shot<'_>) -> Result<Film, Error> {
        let scene: Arc<scene::Scene> = render::load(&self.text(shot), &self.assets)?;
        render::film(context, step, scene)
    }
}

/// How pictures of the locks are shown.
pub(super) fn shown(film: &Film) -> Raster {
    Raster::of(&film.image(), View::Filmic, 0.8)
}

/// Three locks side by side, each a bundle that winds around a vertical axis.
fn locks(count: u32) -> Result<Groom, Error> {
    const POINTS: u32 = 56;
    let strands: Vec<Vec<Vec3>> = (0..count)
        .map(|strand| {
            let u = |stream: u32| hash::unit(strand, hash::mix2(0x10c5, stream));
            let stray = |y: f32, stream: u32| 0.07 * hash::noise_1d(1.3 * y, hash::mix3(strand, stream, 0x10c5));
            let lock = (strand % 3) as f32;
            // Even over the cross-section of the bundle.
            let (offset, turn) = (u(1).sqrt(), TAU * u(2));
            let length = 6.8 + 1.2 * u(3);
            (0..POINTS)
                .map(|i| {
                    let t = i as f32 / (POINTS - 1) as f32;
                    let wind = 2.1 * lock + 1.75 * TAU * t;
                    let swing = 0.55 * (t / 0.3).min(1.0);
                    let thick = 0.62 * (1.0 - 0.55 * t) * offset;
                    let y = 3.6 - length * t;
                    Vec3::new(
                        1.75 * (lock - 1.0) + swing * wind.cos() + thick * (turn + wind).cos() + stray(y, 4),
                        y,
                        swing * wind.sin() + thick * (turn + wind).sin() + stray(y, 5),
                    )
                })
                .collect()
        })
        .collect();
    Ok(render::strands(&strands, RADIUS)?)
}

/// A dim room with a warm window in front on the left and a cool one behind on the right.
fn sky(height: u32) -> EnvironmentImage {
    let width = 2 * height;
    let glow = |dir: DVec3, kappa: f64, towards: DVec3| (kappa * (dir.dot(towards) / towards.length() - 1.0)).exp();
    let pixels = (0..width * height)
        .map(|i| {
            let u = (f64::from(i % width) + 0.5) / f64::from(width);
            let v = (f64::from(i / width) + 0.5) / f64::from(height);
            let (sin, cos) = (std::f64::consts::PI * v).sin_cos();
            let (sin_u, cos_u) = (std::f64::consts::TAU * u).sin_cos();
            let dir = DVec3::new(sin * sin_u, cos, -sin * cos_u);
            let up = 0.5 * (1.0 + dir.y);
            let light = Rgb::<f64>::new(0.08, 0.07, 0.06) * (1.0 - up)
                + Rgb::new(0.22, 0.26, 0.33) * up
                + Rgb::new(2.6, 2.2, 1.7) * glow(dir, 12.0, DVec3::new(-0.6, 0.6, 0.7))
                + Rgb::new(1.6, 1.9, 2.4) * glow(dir, 25.0, DVec3::new(0.8, 0.35, -0.6));
            light.cast()
        })
        .collect();
    EnvironmentImage { width, height, pixels }
}

/// Root of the mean squared difference of luminance over the pixels that show hair in `reference`, relative to their
/// mean there.
pub(super) fn rmse(film: &Film, reference: &Film) -> f64 {
    let (test, want) = (render::luminance(film), render::luminance(reference));
    let pairs: Vec<(f64, f64)> = test
        .into_iter()
        .zip(want)
        .zip(reference.pixels())
        .filter(|(_, pixel)| pixel.alpha() > 0.5)
        .map(|(pair, _)| pair)
        .collect();
    let mean = pairs.iter().map(|(_, want)| want).sum::<f64>() / pairs.len() as f64;
    stats::rms(pairs.iter().map(|(test, want)| test - want)) / mean
}

/// The same picture with every pixel `times` as wide and high.
pub(super) fn enlarged(raster: &Raster, times: usize) -> Raster {
    let width = raster.width * times;
    let mut out = Raster::filled(width, raster.height * times, [0; 3]);
    for (i, pixel) in out.pixels.iter_mut().enumerate() {
        *pixel = raster.pixels[i / width / times * raster.width + i % width / times];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locks_hang_within_the_picture() {
        let groom = locks(300).unwrap();
        assert_eq!(groom.strand_count(), 300);
        let (low, high) = groom.bounds().unwrap();
        // Half of 16 tan(14°) = 4 upwards, three quarters of it sideways.
        assert!(low.x > -3.2 && high.x < 3.2 && low.y > -4.6 && high.y < 3.61, "{low} {high}");
    }

    #[test]
    fn looks_are_understood_and_vary_where_they_should() {
        let mut assets = Memory::default();
        assets.grooms.insert("locks".into(), locks(30).unwrap());
        assets.environments.insert("sky".into(), sky(8));
        let stage = Stage { assets, size: (16, 16) };
        for (varies, constant) in [(Varies::default(), true), (Varies::ALL, false)] {
            let look = varies.look(1.0);
            for close in [None, Some(16)] {
                let shot = Shot { look: &look, area_lights: true, integrator: "path", samples: 1, close, seed: 0 };
                let scene = render::load(&stage.text(&shot), &stage.assets).unwrap();
                assert_eq!(scene.looks[0].constant().is_some(), constant);
                assert_eq!(scene.lights.len(), 3);
            }
        }
    }

    #[test]
    fn enlarging_repeats_pixels() {
        let mut small = Raster::filled(2, 1, [0; 3]);
        small.pixels[1] = [9; 3];
        let large = enlarged(&small, 3);
        assert_eq!((large.width, large.height), (6, 3));
        assert_eq!(large.pixels[6..12], [[0; 3], [0; 3], [0; 3], [9; 3], [9; 3], [9; 3]]);
    }
}
