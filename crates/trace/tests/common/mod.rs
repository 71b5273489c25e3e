//! What the tests of the tracer share: assets from memory, strands and quads by hand, and the statistics of
//! pictures.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use film::{Film, Sample};
use groom::{Groom, Mesh};
use math::{Rgb, Vec3, hash, warp};
use rayon::prelude::*;
use scene::{AssetError, Assets, EnvironmentImage, Scene};
use trace::{SimdLevel, Tracer};

/// Assets by name.
#[derive(Default)]
pub(crate) struct Memory {
    pub(crate) grooms: BTreeMap<&'static str, Groom>,
    pub(crate) meshes: BTreeMap<&'static str, Mesh>,
    pub(crate) environments: BTreeMap<&'static str, EnvironmentImage>,
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

/// A tracer for a scene file with overrides.
pub(crate) fn tracer(assets: &Memory, text: &str, set: &[&str]) -> Tracer {
    Tracer::new(load(assets, text, set), SimdLevel::Auto)
}

/// A scene from a file with overrides.
pub(crate) fn load(assets: &Memory, text: &str, set: &[&str]) -> Arc<Scene> {
    let overrides: Vec<String> = set.iter().map(|&s| s.to_owned()).collect();
    Arc::new(Scene::load(text, &overrides, assets).unwrap_or_else(|error| panic!("{error}\n{text}")))
}

/// Strands of one radius.
pub(crate) fn strands(strands: &[Vec<Vec3>], radius: f32) -> Groom {
    let counts: Vec<u32> = strands.iter().map(|s| s.len() as u32).collect();
    let mut groom = Groom::new(strands.concat(), counts).unwrap();
    groom.set_radius_profile(|_| radius).unwrap();
    groom
}

/// Bent strands of half a unit that begin all over a ball of radius 1.
pub(crate) fn ball(count: u32, radius: f32, seed: u32) -> Groom {
    let all: Vec<Vec<Vec3>> = (0..count)
        .map(|strand| {
            let u = |stream: u32| hash::unit(strand, hash::mix2(seed, stream));
            let mut at = warp::uniform_sphere([u(1), u(2)]) * u(3).cbrt();
            let mut dir = warp::uniform_sphere([u(4), u(5)]);
            let mut points = Vec::new();
            for i in 0..6 {
                points.push(at);
                dir = (dir + warp::uniform_sphere([u(10 + 2 * i), u(11 + 2 * i)]) * 0.3).normalize();
                at += dir * 0.1;
            }
            points
        })
        .collect();
    strands(&all, radius)
}

/// A parallelogram with the corners `center ± u ± v`.
pub(crate) fn quad(center: Vec3, u: Vec3, v: Vec3) -> Mesh {
    let corners = vec![center - u - v, center + u - v, center + u + v, center - u + v];
    Mesh::new(corners, vec![[0, 1, 2], [0, 2, 3]], None).unwrap()
}

/// Every sample of every pixel, in order.
pub(crate) fn samples(tracer: &Tracer, per_pixel: u32) -> Vec<Sample> {
    let (width, height) = (tracer.scene().film.width, tracer.scene().film.height);
    (0..width * height)
        .into_par_iter()
        .flat_map_iter(|pixel| (0..per_pixel).map(move |i| tracer.sample(pixel % width, pixel / width, i)))
        .collect()
}

/// A film filled in passes that end at these sample indices.
pub(crate) fn render(tracer: &Tracer, passes: &[u32]) -> Film {
    let settings = tracer.scene().film;
    let mut film = Film::new(settings.width, settings.height).unwrap();
    let mut from = 0;
    for &to in passes {
        tracer.render(&mut film, from, to, &AtomicBool::new(false));
        from = to;
    }
    film
}

/// A mean with its standard error, per channel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mean {
    pub(crate) mean: Rgb<f64>,
    pub(crate) error: Rgb<f64>,
}

impl Mean {
    /// A number that is known.
    pub(crate) fn exact(mean: Rgb<f64>) -> Self {
        Self { mean, error: Rgb::black() }
    }

    /// Of single samples, as if they were independent: they are stratified, so the error is rather smaller.
    pub(crate) fn of(values: impl IntoIterator<Item = Rgb>) -> Self {
        let (mut n, mut sum, mut squares) = (0.0, Rgb::<f64>::black(), Rgb::<f64>::black());
        for value in values {
            let value = value.cast::<f64>();
            n += 1.0;
            sum += value;
            squares += value * value;
        }
        let mean = sum / n;
        Self { mean, error: (squares / n - mean * mean).map(|v: f64| (v.max(0.0) / (n - 1.0)).sqrt()) }
    }

    /// Of a whole picture, from two renders with different seeds: pixels are independent, so the differences
    /// between the two tell the error whatever the strata within a pixel.
    pub(crate) fn of_picture(assets: &Memory, text: &str, set: &[&str], samples: u32) -> Self {
        let picture = |seed: &str| {
            let mut set = set.to_vec();
            set.push(seed);
            let film = render(&tracer(assets, text, &set), &[samples]);
            assert_eq!(film.rejected(), 0, "{set:?}");
            film
        };
        let (a, b) = (picture("render.seed=11"), picture("render.seed=12"));
        let n = a.pixels().len() as f64;
        let (mut sum, mut squares) = (Rgb::<f64>::black(), Rgb::<f64>::black());
        for (a, b) in a.pixels().iter().zip(b.pixels()) {
            let (a, b) = (a.beauty().cast::<f64>(), b.beauty().cast::<f64>());
            sum += (a + b) * 0.5_f64;
            squares += (a - b) * (a - b);
        }
        Self { mean: sum / n, error: squares.map(|s: f64| 0.5 * s.sqrt() / n) }
    }

    /// Panics unless the two are within four combined standard errors plus `slack`, in every channel. A
    /// correct tracer fails one such comparison of three channels with a probability of 2e-4; seeds are
    /// fixed, so it either always does or never.
    pub(crate) fn expect(&self, what: &str, want: &Self, slack: f64) {
        let off = (self.mean - want.mean).map(|x: f64| x.abs());
        let allowed = self.error.zip(want.error, |a: f64, b: f64| 4.0 * a.hypot(b) + slack);
        println!(
            "{what}: {:.5?} +- {:.5?}, wanted {:.5?} +- {:.5?}",
            self.mean.0, self.error.0, want.mean.0, want.error.0
        );
        // Written so that a NaN fails too.
        assert!(
            off.0.iter().zip(allowed.0).all(|(off, allowed)| *off <= allowed),
            "{what}: {self:?} differs from {want:?} by {off:?}, more than {allowed:?}"
        );
    }
}
