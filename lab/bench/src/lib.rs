//! Inputs that the benches share: seeded, and the same at every run.
//!
//! A bench's name is a question and its unit something a peer's number can stand beside: `fiber/eval/chiang`
//! in evaluations a second, `accel/closest/primary` in rays a second. Raw results lie in `results/`, dated;
//! nothing else is claimed anywhere.

use std::sync::Arc;

use accel::{Hit, Ray, Strands};
use fiber::{
    Attenuation, Chiang, Deon, Dir, Fiber, Field, Fur, Hery, KajiyaKay, KajiyaKayMode, Lambertian, Marschner, Sadeghi,
    Weights,
};
use math::{Rgb, hash, warp};
use trace::Tracer;

/// One of every model, and the variants of d'Eon and Chiang that differ in cost.
pub fn standard_fibers() -> Vec<(&'static str, Fiber)> {
    let brown = fiber::absorption::from_melanin(1.3, 0.2, Default::default());
    let deon = Deon::<f32>::with_absorption(brown);
    let chiang = Chiang::with_absorption(brown);
    vec![
        ("deon_near", deon.into()),
        ("deon_far_marginal", Deon { field: Field::Far, ..deon }.into()),
        ("deon_far_joint", Deon { field: Field::Far, weights: Weights::Joint, ..deon }.into()),
        ("deon_near_known", Deon { attenuation: Attenuation::Known, ..deon }.into()),
        ("chiang", chiang.into()),
        ("chiang_far", Chiang { field: Field::Far, ..chiang }.into()),
        ("lambertian", Lambertian { albedo: Rgb::new(0.6, 0.4, 0.3) }.into()),
        ("kajiya_kay", KajiyaKay::single(Rgb::splat(0.4), Rgb::splat(0.3), 25.0, KajiyaKayMode::Normalised).into()),
        ("hery", Hery::single(Rgb::splat(1.0), 0.1, -0.03).into()),
        ("marschner", Marschner::with_absorption(brown).into()),
        ("sadeghi", Sadeghi::default().into()),
        ("fur", Fur::with_absorption(brown).into()),
    ]
}

/// Known directions with offsets, and sampled directions.
pub fn direction_pairs(n: u32, seed: u32) -> Vec<(fiber::Hit, Dir)> {
    let dir = |i: u32, stream: u32| {
        let v = warp::uniform_sphere([hash::unit(i, seed + stream), hash::unit(i, seed + stream + 1)]);
        Dir::from_local(v.to_array())
    };
    (0..n).map(|i| (fiber::Hit::new(dir(i, 0), hash::signed(i, seed + 2)), dir(i, 3))).collect()
}

/// The built-in scene, ready for rays.
pub fn builtin() -> Tracer {
    let scene = job::load(&job::Source::Builtin, &[]).expect("the built-in scene is right");
    Tracer::new(Arc::new(scene), Default::default())
}

/// The strands of the built-in scene as numbers.
pub fn strands(tracer: &Tracer) -> Strands<'_> {
    let groom = &tracer.scene().grooms[0].groom;
    Strands { points: groom.points(), radii: groom.radius.as_deref().unwrap_or(&[]), offsets: groom.offsets() }
}

/// Camera rays, a pseudo-random selection of pixels.
pub fn primary_rays(tracer: &Tracer, n: u32) -> Vec<Ray> {
    let film = &tracer.scene().film;
    (0..n)
        .map(|i| {
            let at = |stream: u32, size: u32| ((hash::unit(i, stream) * size as f32) as u32).min(size - 1);
            tracer.primary_ray(at(1, film.width), at(2, film.height))
        })
        .collect()
}

/// Rays that leave the strands that camera rays hit, in all directions.
pub fn secondary_rays(tracer: &Tracer, n: u32) -> Vec<Ray> {
    let mut rays = Vec::with_capacity(n as usize);
    let mut batch = 0;
    while rays.len() < n as usize {
        for (i, ray) in primary_rays(tracer, n).into_iter().enumerate() {
            let i = i as u32;
            if let Some(Hit::Strand(hit)) = tracer.accel().closest(&ray) {
                let dir = warp::uniform_sphere([hash::unit(i, 11 + 2 * batch), hash::unit(i, 12 + 2 * batch)]);
                rays.push(Ray { leaving: Some(hit.leave(dir)), ..Ray::new(hit.position, dir) });
            }
        }
        batch += 1;
        assert!(batch < 100, "the built-in scene shows no hair");
    }
    rays.truncate(n as usize);
    rays
}
