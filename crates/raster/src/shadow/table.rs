//! Lamps as shaders see them: twins of the structures in `shaders/lamps.wgsl`, which says what the numbers are.

use bytemuck::{Pod, Zeroable};

use crate::lights::{Lamp, LampKind};
use crate::settings::{KAPPA, Shadow, ShadowTechnique};
use crate::view::View;

/// Most lamps that shaders know.
pub(super) const MOST_LAMPS: usize = 32;

/// A lamp without a map.
pub(super) const NO_MAP: u32 = u32::MAX;

/// Twin of `Lamp`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct LampWords {
    pub(super) map_from_world: [[f32; 4]; 4],
    pub(super) position: [f32; 3],
    pub(super) kind: u32,
    pub(super) direction: [f32; 3],
    pub(super) emission: u32,
    pub(super) color: [f32; 3],
    pub(super) layer: u32,
    pub(super) eye: [f32; 3],
    pub(super) near: f32,
    pub(super) forward: [f32; 3],
    pub(super) far: f32,
    pub(super) cone: [f32; 2],
    pub(super) hair: [f32; 2],
    pub(super) texel: f32,
    pub(super) perspective: u32,
    pub(super) _end: [u32; 2],
}

/// Twin of `LampTable`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct LampTable {
    pub(super) count: u32,
    pub(super) side: u32,
    pub(super) strength: f32,
    pub(super) optical: f32,
    pub(super) ends: [f32; 4],
    pub(super) spacing: f32,
    pub(super) width: f32,
    pub(super) _pad: [u32; 2],
    pub(super) ambient: [[f32; 4]; 9],
    pub(super) list: [LampWords; MOST_LAMPS],
}

impl LampWords {
    /// A lamp, and where it has a map: its layer, its view, and the depths of the hair in it.
    pub(super) fn new(lamp: &Lamp, map: Option<(u32, &View, [f32; 2])>) -> Self {
        let mut words = Self {
            position: lamp.position.to_array(),
            kind: match lamp.kind {
                LampKind::Directional => 0,
                LampKind::Point => 1,
                LampKind::Spot => 2,
            },
            direction: lamp.direction.to_array(),
            emission: u32::from(lamp.cosine) + 2 * u32::from(lamp.cosine && lamp.two_sided),
            color: lamp.color.0,
            layer: NO_MAP,
            ..Self::zeroed()
        };
        if let Some([inner, outer]) = lamp.cone {
            // `smoothstep` needs some way between the two.
            words.cone = [inner.max(outer + 1e-6), outer];
        }
        if let Some((layer, view, hair)) = map {
            words.map_from_world = view.clip_from_world;
            words.layer = layer;
            words.eye = view.eye;
            words.near = view.near;
            words.forward = view.forward;
            words.far = view.far;
            words.hair = hair;
            words.texel = view.pixel;
            words.perspective = view.perspective;
        }
        words
    }
}

impl LampTable {
    /// No lamps, and what the settings say of shadows. `spacing` is the distance between fibers along a ray, `width`
    /// that of the widest fiber as it is drawn into maps, both in scene units.
    pub(super) fn new(settings: &Shadow, side: u32, spacing: f32, width: f32) -> Self {
        let (spacing, ends) = match settings.technique {
            ShadowTechnique::Adsm { spacing: Some(own) } => (own, [1.0; 4]),
            ShadowTechnique::Dom { layers, ends } => (spacing, layer_ends(layers, ends)),
            _ => (spacing, [1.0; 4]),
        };
        Self {
            side,
            strength: settings.strength,
            optical: KAPPA * settings.alpha,
            ends,
            // Of no hair nobody knows the density: fibers are as far apart as can be.
            spacing: if spacing > 0.0 { spacing.min(f32::MAX) } else { f32::MAX },
            width,
            ..Self::zeroed()
        }
    }
}

/// Where layers end, shares of the hair's depth; those that are not in use end with the last one that is.
pub(super) fn layer_ends(layers: u32, ends: [f32; 4]) -> [f32; 4] {
    let last = layers.clamp(1, 4) as usize - 1;
    std::array::from_fn(|k| ends[k.min(last)])
}

/// The same for fragments that are drawn into the layers: in scene units behind the nearest fiber, and without an end
/// for the last layer in use, which holds the rest.
pub(super) fn fill_ends(layers: u32, ends: [f32; 4], depth: f32) -> [f32; 4] {
    let last = layers.clamp(1, 4) as usize - 1;
    std::array::from_fn(|k| if k < last { ends[k] * depth } else { f32::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_layer_in_use_holds_the_rest() {
        let ends = [0.05, 0.2, 1.0, 0.5];
        assert_eq!(layer_ends(3, ends), [0.05, 0.2, 1.0, 1.0]);
        assert_eq!(layer_ends(1, ends), [0.05; 4]);
        assert_eq!(fill_ends(3, ends, 2.0), [0.1, 0.4, f32::MAX, f32::MAX]);
        assert_eq!(fill_ends(1, ends, 2.0), [f32::MAX; 4]);
        // Lookup and drawing agree about every end that is one.
        for layers in 1..=4 {
            let (found, drawn) = (layer_ends(layers, ends), fill_ends(layers, ends, 3.0));
            let pairs = found.iter().zip(drawn).take(layers as usize - 1);
            assert!(pairs.clone().all(|(found, drawn)| found * 3.0 == drawn), "{layers}: {found:?} {drawn:?}");
        }
    }

    #[test]
    fn a_fiber_of_physical_opacity_has_optical_depth_one() {
        let settings = crate::settings::Settings::default().shadow;
        let table = LampTable::new(&settings, 512, f32::INFINITY, 0.1);
        assert!((table.optical - 1.0).abs() < 1e-6, "{}", table.optical);
        assert!(table.spacing.is_finite());
        assert_eq!(LampTable::new(&settings, 512, f32::NAN, 0.1).spacing, f32::MAX);
    }
}
