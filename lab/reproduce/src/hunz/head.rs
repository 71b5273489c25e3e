//! Curly hair on a head, lit once by point lights, as the renderer of the thesis does it.

use fiber::Fiber;
use film::{Film, Image, NO_STRAND, View};
use math::{Rgb, Vec3};

use crate::raster::Raster;
use crate::render::{self, Memory};
use crate::{Context, Error, stats};

/// Where the light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lighting {
    /// One light above the camera.
    Front,
    /// A dim light above the camera and a strong one behind the head.
    Back,
    /// One light from the side, and another view: for looks that were made for other lights.
    Side,
}

impl Lighting {
    /// The view, degrees around the head.
    fn azimuth_deg(self) -> f64 {
        match self {
            Self::Front | Self::Back => 20.0,
            Self::Side => 60.0,
        }
    }

    /// Positions in centimetres and irradiances at the middle of the head.
    fn lights(self) -> Vec<([f64; 3], f64)> {
        let front = [10.0, 75.0, 110.0];
        match self {
            Self::Front => vec![(front, 10.0)],
            Self::Back => vec![(front, 3.0), ([-45.0, 45.0, -110.0], 20.0)],
            Self::Side => vec![([-90.0, 40.0, 60.0], 10.0)],
        }
    }
}

/// A picture; `look` is the lines of a look.
///
/// Geometry and samples are the same for every look, so that pictures can be compared pixel by pixel.
pub(super) fn film(context: &Context<'_>, step: &str, lighting: Lighting, look: &str) -> Result<Film, Error> {
    render::film(context, step, render::load(&text(context, lighting, look), &Memory::default())?)
}

fn text(context: &Context<'_>, lighting: Lighting, look: &str) -> String {
    let lights: String = lighting
        .lights()
        .into_iter()
        .map(|(position, irradiance)| {
            let distance2: f64 = position.iter().map(|x| x * x).sum();
            let intensity = irradiance * distance2;
            format!("[[light]]\ntype = \"point\"\nposition = {position:?}\nintensity = {intensity:?}\n")
        })
        .collect();
    format!(
        "[scene]\nname = \"curls\"\n\
         [camera]\norbit = {{ target = [0.0, -4.0, 0.0], distance = 105.0, azimuth_deg = {:?}, elevation_deg = 5.0 }}\n\
         fov_deg = 25.0\n\
         [film]\nwidth = {}\nheight = {}\n\
         [render]\nsamples = {}\nintegrator = \"direct\"\nseed = {}\n\
         {lights}\
         [[mesh]]\nname = \"head\"\nbuiltin = \"head\"\nalbedo = 0.02\n\
         [[groom]]\nname = \"hair\"\nlook = \"main\"\nwidth = {{ scale = 2.2 }}\n\
         procedural = {{ preset = \"curly\", strands = {}, seed = 2 }}\n\
         [look.main]\n{look}",
        lighting.azimuth_deg(),
        context.pixels(240),
        context.pixels(288),
        context.count(32),
        context.seed,
        context.count(12_000).clamp(600, 20_000)
    )
}

/// The fiber of a look.
///
/// # Errors
/// What is wrong with the look.
pub(super) fn fiber(look: &str) -> Result<Fiber, Error> {
    let text = format!(
        "[camera]\nposition = [0.0, 0.0, 9.0]\ntarget = [0.0, 0.0, 0.0]\n[[light]]\ntype = \"environment\"\n\
         [[groom]]\nfile = \"one\"\nlook = \"main\"\n[look.main]\n{look}"
    );
    let mut assets = Memory::default();
    assets.grooms.insert("one".into(), render::strands(&[vec![Vec3::NEG_X, Vec3::X]], 0.01)?);
    let scene = render::load(&text, &assets)?;
    let look = scene.looks.first().ok_or(Error::Measure("the scene has no look"))?;
    Ok(look.base())
}

/// The pixels that show hair.
///
/// # Errors
/// When none does.
pub(super) fn hair(film: &Film) -> Result<Vec<usize>, Error> {
    let pixels = film.pixels().iter().enumerate();
    let hair: Vec<usize> = pixels.filter(|(_, pixel)| pixel.strand() != NO_STRAND).map(|(i, _)| i).collect();
    if hair.is_empty() { Err(Error::Measure("the hair is not in the picture")) } else { Ok(hair) }
}

/// The light that left the hair by one lobe, as a picture of its own.
pub(super) fn lobe_image(film: &Film, lobe: usize) -> Image {
    let pixels = film.pixels().iter().map(|pixel| pixel.lobes()[lobe]).collect();
    Image { width: film.width(), height: film.height(), pixels, alpha: None }
}

/// The exposure, in stops, at which nearly all of an image is below white.
pub(super) fn exposure(image: &Image) -> f32 {
    let lit: Vec<f64> = image.pixels.iter().map(|c| f64::from(c.max_channel())).filter(|x| *x > 0.0).collect();
    let bright = stats::quantile(&lit, 0.985);
    if bright > 0.0 { (0.9 / bright).log2().clamp(-20.0, 20.0) as f32 } else { 0.0 }
}

/// An image as all pages of the thesis show it.
pub(super) fn shown(image: &Image, exposure_ev: f32) -> Raster {
    Raster::of(image, View::Srgb, exposure_ev)
}

/// Mean colour of an image over some of its pixels.
pub(super) fn mean(image: &Image, over: &[usize]) -> Rgb<f64> {
    over.iter().map(|&i| image.pixels[i].cast::<f64>()).sum::<Rgb<f64>>() / over.len() as f64
}

#[cfg(test)]
mod tests {
    use job::Cancel;

    use super::*;

    #[test]
    fn the_scene_is_a_scene_and_shows_hair_in_every_light() {
        let context =
            Context { scale: 0.004, seed: 1, threads: 1, cancel: Cancel::default(), folder: None, progress: &|_| {} };
        for lighting in [Lighting::Front, Lighting::Back, Lighting::Side] {
            let look = "model = \"lambertian\"\n";
            let film = film(&context, "trial", lighting, look).unwrap();
            let hair = hair(&film).unwrap();
            assert!(hair.len() > 20, "{lighting:?}: {}", hair.len());
            assert!(mean(&film.image(), &hair).luminance() > 0.0, "{lighting:?}");
        }
    }
}
