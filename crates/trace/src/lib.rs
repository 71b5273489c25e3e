//! The reference renderer: an unbiased path tracer for hair.
//!
//! A [`Tracer`] is built once from a checked scene and then answers one question: what does sample `i`
//! of pixel `(x, y)` see? The answer is a pure function of pixel, index and seed, so a picture does not
//! depend on threads, tiles or the order of work. [`Tracer::render`] asks it for all pixels in parallel.
//!
//! - Next event estimation and multiple importance sampling at every vertex (balance or power
//!   heuristic); Russian roulette on the path's throughput; both can be turned off by the integrator.
//! - Lights emit and do not block: a ray passes through the shapes of area lights and collects what they
//!   emit on its way. So shadow rays and scattered rays see the same world.
//! - A constant environment takes no light samples (the scattering models sample it almost perfectly)
//!   except where only light samples are wanted.
//! - The outgoing ray of a fiber carries `accel`'s leaving policy instead of an epsilon.

mod camera;
mod environment;
mod integrator;
mod light;
mod sampler;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

pub use accel::{SimdLevel, Stats as AccelStats};

use accel::{Accel, Basis, Options, Shape, Strands, Triangles};
use film::Film;
use math::Vec3;
use rayon::prelude::*;
use scene::{CurveBasis, CurveShape, Scene};

use camera::PreparedCamera;
use light::Lights;

/// A scene, ready to be asked for samples.
#[derive(Debug)]
pub struct Tracer {
    scene: Arc<Scene>,
    accel: Accel,
    camera: PreparedCamera,
    lights: Lights,
    /// Smooth normals of meshes that have them.
    normals: Vec<Option<Arc<Vec<Vec3>>>>,
    rays: AtomicU64,
    samples: AtomicU64,
}

impl Tracer {
    /// Builds the acceleration structure and the light distributions, on the current rayon pool.
    pub fn new(scene: Arc<Scene>, level: SimdLevel) -> Self {
        let options = Options {
            shape: match scene.render.curve_shape {
                CurveShape::Round => Shape::Round,
                CurveShape::Ribbon => Shape::Ribbon,
            },
            basis: match scene.render.curve_basis {
                CurveBasis::CatmullRom => Basis::CatmullRom,
                CurveBasis::Linear => Basis::Linear,
            },
            level,
        };
        let strands: Vec<Strands<'_>> = scene
            .grooms
            .iter()
            .map(|g| Strands {
                points: g.groom.points(),
                radii: g.groom.radius.as_deref().unwrap_or(&[]),
                offsets: g.groom.offsets(),
            })
            .collect();
        let triangles: Vec<Triangles<'_>> = scene
            .meshes
            .iter()
            .map(|m| Triangles { positions: &m.mesh.positions, indices: &m.mesh.triangles })
            .collect();
        let accel = Accel::build(&strands, &triangles, &options);
        let normals = scene.meshes.iter().map(|m| m.mesh.normals.as_ref().map(|n| Arc::new(n.clone()))).collect();
        let camera = PreparedCamera::new(&scene.camera, &scene.film);
        let bounds = accel.bounds().unwrap_or((Vec3::ZERO, Vec3::ONE));
        let lights = Lights::new(&scene.lights, scene.render.integrator, scene.render.light_selection, bounds);
        Self { scene, accel, camera, lights, normals, rays: AtomicU64::new(0), samples: AtomicU64::new(0) }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The intersection structure.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// The camera ray through the centre of pixel `(x, y)`, pinhole and unfiltered: for picking and for
    /// benches.
    pub fn primary_ray(&self, x: u32, y: u32) -> accel::Ray {
        self.camera.ray(x, y, [0.5; 4])
    }

    /// What sample `index` of pixel `(x, y)` sees.
    pub fn sample(&self, x: u32, y: u32, index: u32) -> film::Sample {
        integrator::trace(self, x, y, index).0
    }

    /// Adds samples `from..to` to every pixel of the film, whose size must be the scene's. Stops early,
    /// between rows, when `cancel` is set; pixels then differ in their number of samples.
    ///
    /// Runs on the current rayon pool; the result does not depend on how many threads it has.
    pub fn render(&self, film: &mut Film, from: u32, to: u32, cancel: &AtomicBool) {
        const ROWS: usize = 8;
        let width = film.width() as usize;
        film.pixels_mut().par_chunks_mut(width * ROWS).enumerate().for_each(|(band, pixels)| {
            let rows = pixels.len() / width;
            // Columns of the band in blocks, so that neighbouring rays share what they touch.
            for left in (0..width).step_by(ROWS) {
                if cancel.load(Ordering::Relaxed) {
                    return;
                }
                let mut rays = 0;
                for row in 0..rows {
                    for x in left..(left + ROWS).min(width) {
                        let y = band * ROWS + row;
                        for index in from..to {
                            let (sample, count) = integrator::trace(self, x as u32, y as u32, index);
                            rays += count;
                            pixels[row * width + x].add(&sample);
                        }
                    }
                }
                self.rays.fetch_add(rays, Ordering::Relaxed);
                let columns = (left + ROWS).min(width) - left;
                self.samples.fetch_add((rows * columns) as u64 * u64::from(to.saturating_sub(from)), Ordering::Relaxed);
            }
        });
    }

    /// Samples of pixels taken by [`render`](Self::render) so far.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Rays traced by [`render`](Self::render) so far, shadow rays included.
    pub fn rays(&self) -> u64 {
        self.rays.load(Ordering::Relaxed)
    }
}
