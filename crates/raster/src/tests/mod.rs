//! What needs a device. Without an adapter these tests fail, with the remedy in the message: a software one will do.

mod coverage;
mod lamps;
mod limits;
mod lists;
mod shadows;
mod tables;
mod truth;
mod twins;

use std::collections::BTreeMap;
use std::sync::Arc;

use groom::Groom;
use math::{Vec3, hash};
use scene::{AssetError, Assets, EnvironmentImage, Scene};

use crate::{Gpu, GpuOptions, Tier};

/// The device that tests draw on.
fn gpu() -> Gpu {
    gpu_of(Tier::Native)
}

fn gpu_of(tier: Tier) -> Gpu {
    Gpu::new(&GpuOptions { tier, ..GpuOptions::default() }).unwrap_or_else(|error| panic!("{error}"))
}

/// Grooms by name.
struct Memory(BTreeMap<String, Groom>);

impl Assets for Memory {
    fn groom(&self, path: &str) -> Result<Groom, AssetError> {
        self.0.get(path).cloned().ok_or_else(|| AssetError::new("there is no such groom"))
    }

    fn mesh(&self, _: &str) -> Result<groom::Mesh, AssetError> {
        Err(AssetError::new("there is no such mesh"))
    }

    fn environment(&self, _: &str) -> Result<EnvironmentImage, AssetError> {
        Err(AssetError::new("there is no such environment"))
    }
}

/// A scene around one groom, called `hair`.
fn scene(groom: Groom, text: &str) -> Arc<Scene> {
    let assets = Memory([("hair".to_owned(), groom)].into());
    Arc::new(Scene::load(text, &[], &assets).unwrap_or_else(|error| panic!("{error}")))
}

/// Straight strands from the plane y = 0 downwards to `-length`, rooted at random in a square of side `side`, each a
/// little aslant.
fn curtain(strands: u32, points: u32, side: f32, length: f32, radius: f32) -> Groom {
    let mut all = Vec::new();
    for strand in 0..strands {
        let at = |dim| hash::unit(strand, dim) - 0.5;
        let root = Vec3::new(at(1) * side, 0.0, at(2) * side);
        let lean = Vec3::new(at(3) * 0.3, -1.0, at(4) * 0.3);
        for i in 0..points {
            all.push(root + lean * (length * i as f32 / (points - 1) as f32));
        }
    }
    let mut groom = Groom::new(all, vec![points; strands as usize]).expect("counts fit");
    groom.set_radius(vec![radius; (strands * points) as usize]).expect("one each");
    groom
}
