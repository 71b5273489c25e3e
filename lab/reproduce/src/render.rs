//! Scenes from memory, rendered as a job.

use std::collections::BTreeMap;
use std::sync::Arc;

use accel::{Hit, StrandHit};
use groom::{Groom, GroomError, Mesh};
use job::{Film, Options};
use math::{Frame, Rgb, Vec3, hash, warp};
use scene::{AssetError, Assets, EnvironmentImage, Scene};
use trace::Tracer;

use crate::{Context, Error};

/// Grooms, meshes and skies by the names under which scene files call them.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// Grooms, in the unit of the scene.
    pub grooms: BTreeMap<String, Groom>,
    /// Meshes, in the unit of the scene.
    pub meshes: BTreeMap<String, Mesh>,
    /// Lat-long pictures.
    pub environments: BTreeMap<String, EnvironmentImage>,
}

impl Assets for Memory {
    fn groom(&self, path: &str) -> Result<Groom, AssetError> {
        self.grooms.get(path).cloned().ok_or_else(|| AssetError::new("there is no such groom"))
    }

    fn mesh(&self, path: &str) -> Result<Mesh, AssetError> {
        self.meshes.get(path).cloned().ok_or_else(|| AssetError::new("there is no such mesh"))
    }

    fn environment(&self, path: &str) -> Result<EnvironmentImage, AssetError> {
        self.environments.get(path).cloned().ok_or_else(|| AssetError::new("there is no such environment"))
    }
}

/// A scene from its text.
///
/// # Errors
/// What is wrong with it.
pub fn load(text: &str, assets: &Memory) -> Result<Arc<Scene>, Error> {
    Ok(Arc::new(Scene::load(text, &[], assets)?))
}

/// Renders a scene to its end; `step` is what is told meanwhile.
///
/// # Errors
/// When it was cancelled, or the renderer cannot run.
pub fn film(context: &Context<'_>, step: &str, scene: Arc<Scene>) -> Result<Film, Error> {
    let options = Options { threads: context.threads, ..Options::default() };
    let outcome = job::render(scene, &options, &context.cancel, &mut |event| {
        (context.progress)(crate::Progress { step, done: event.done as f64 / event.total.max(1) as f64 });
    })?;
    if outcome.cancelled { Err(Error::Cancelled) } else { Ok(outcome.film) }
}

/// Luminance of every pixel.
pub fn luminance(film: &Film) -> Vec<f64> {
    film.pixels().iter().map(|pixel| pixel.beauty().cast::<f64>().luminance()).collect()
}

/// Mean colour of the pixels for which `keep`, given by index, says yes; NaN without any.
pub fn mean_colour(film: &Film, keep: impl Fn(usize) -> bool) -> Rgb<f64> {
    let kept = film.pixels().iter().enumerate().filter(|(i, _)| keep(*i));
    let (mut sum, mut n) = (Rgb::<f64>::black(), 0.0_f64);
    for (_, pixel) in kept {
        sum += pixel.beauty().cast::<f64>();
        n += 1.0;
    }
    sum / n
}

/// A strand as the camera sees it in the middle of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// What the ray met.
    pub hit: StrandHit,
    /// Unit vector from there towards the camera.
    pub back: Vec3,
    /// A frame around the tangent.
    pub frame: Frame,
}

impl Seen {
    /// The direction towards the camera in the fiber's frame.
    pub fn known(&self) -> fiber::Dir<f64> {
        fiber::Dir::<f32>::from_local(self.frame.to_local(self.back).to_array()).cast()
    }

    /// Direction and offset, as the models want them.
    pub fn fiber_hit(&self) -> fiber::Hit<f64> {
        fiber::Hit::new(self.known(), f64::from(self.hit.h))
    }
}

/// What the camera sees in the middle of each pixel, row by row: strands, or nothing. Meshes hide strands.
pub fn visible(scene: Arc<Scene>) -> Vec<Option<Seen>> {
    let (width, height) = (scene.film.width, scene.film.height);
    let tracer = Tracer::new(scene, Default::default());
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let ray = tracer.primary_ray(x, y);
            match tracer.accel().closest(&ray) {
                Some(Hit::Strand(hit)) => Some(Seen { hit, back: -ray.dir, frame: Frame::around(hit.tangent) }),
                _ => None,
            }
        })
        .collect()
}

/// Strands of one radius.
///
/// # Errors
/// When a strand is no strand.
pub fn strands(strands: &[Vec<Vec3>], radius: f32) -> Result<Groom, GroomError> {
    let counts: Vec<u32> = strands.iter().map(|s| s.len() as u32).collect();
    let mut groom = Groom::new(strands.concat(), counts)?;
    groom.set_radius_profile(|_| radius)?;
    Ok(groom)
}

/// Slightly bent strands, half a unit long, that begin all over a ball of radius 0.8 and run in all directions.
///
/// # Errors
/// Never, in practice: directions of a hash are finite.
pub fn ball(count: u32, radius: f32, seed: u32) -> Result<Groom, GroomError> {
    let all: Vec<Vec<Vec3>> = (0..count)
        .map(|strand| {
            let u = |stream: u32| hash::unit(strand, hash::mix2(seed, stream));
            let mut at = warp::uniform_sphere([u(1), u(2)]) * (0.8 * u(3).cbrt());
            let mut dir = warp::uniform_sphere([u(4), u(5)]);
            let mut points = vec![at];
            for i in 0..5 {
                let bend = warp::uniform_sphere([u(10 + 2 * i), u(11 + 2 * i)]);
                dir = (dir + bend * 0.25).normalize_or(dir);
                at += dir * 0.1;
                points.push(at);
            }
            points
        })
        .collect();
    strands(&all, radius)
}

/// A parallelogram with the corners `centre ± u ± v`.
pub fn quad(centre: Vec3, u: Vec3, v: Vec3) -> Mesh {
    let positions = vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v];
    Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], normals: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ball_is_where_it_is_said_to_be() {
        let groom = ball(500, 0.01, 3).unwrap();
        assert_eq!((groom.strand_count(), groom.point_count()), (500, 3000));
        // Steps of 0.1: no point is farther from its root than half a unit.
        assert!(groom.points().iter().all(|p| p.length() < 1.3001));
        let (lo, hi) = groom.bounds().unwrap();
        assert!(lo.max_element() < -0.8 && hi.min_element() > 0.8, "{lo} {hi}");
    }

    #[test]
    fn the_camera_sees_strands_from_their_outside() {
        let mut assets = Memory::default();
        assets.grooms.insert("one".into(), strands(&[vec![Vec3::NEG_X, Vec3::X]], 0.3).unwrap());
        let text = "[camera]\nposition = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\n[film]\nwidth = 16\nheight = 16\n\
                    [[light]]\ntype = \"environment\"\n[[groom]]\nfile = \"one\"\n";
        let seen = visible(load(text, &assets).unwrap());
        assert_eq!(seen.len(), 256);
        let hits: Vec<Seen> = seen.into_iter().flatten().collect();
        assert!(!hits.is_empty() && hits.len() < 256);
        for seen in hits {
            // The strand runs along x and the camera is far: it is seen nearly across.
            assert!(seen.known().theta().abs() < 0.3 && seen.hit.normal.dot(seen.back) > -1e-3);
        }
    }
}
