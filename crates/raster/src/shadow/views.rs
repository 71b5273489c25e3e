//! How the shadow map of a lamp looks at the scene.
//!
//! A map shows the hair as large as it can, because its texels are what shadows are made of; in depth it reaches over
//! everything, because meshes far away may stand in the light. A point beside the map is lit: no hair is in its way,
//! and a mesh that is was not drawn.

use math::{Frame, Vec3};

use crate::lights::{Lamp, LampKind};
use crate::view::{View, corners};

/// A box.
pub(super) type Bounds = (Vec3, Vec3);

/// Half of the widest opening of a map, radians. What is far off the axis has many texels, what is on it few.
const WIDEST: f32 = 75.0 * std::f32::consts::PI / 180.0;

/// What a map sees.
#[derive(Clone, Copy, Debug)]
pub(super) struct MapView {
    pub(super) view: View,
    /// Least and greatest depth of the hair's box.
    pub(super) hair: [f32; 2],
    /// Whether all hair is in the map; not when the lamp is within the hair or next to it.
    pub(super) whole: bool,
}

impl MapView {
    /// The view of `lamp`'s map, with `side` texels a side, of `hair` among `everything`.
    pub(super) fn new(lamp: &Lamp, side: u32, everything: Bounds, hair: Bounds) -> Self {
        let everything = (everything.0.min(hair.0), everything.1.max(hair.1));
        let (view, whole) = match lamp.kind {
            LampKind::Directional => (parallel(lamp, side, everything, hair), true),
            LampKind::Point | LampKind::Spot => perspective(lamp, side, everything, hair),
        };
        let [least, greatest] = depths(&view, hair);
        let least = least.max(view.near);
        // Flat hair has layers too.
        let thinnest = (1e-4 * view.far).max(1e-9);
        Self { view, hair: [least, greatest.max(least + thinnest)], whole }
    }
}

fn parallel(lamp: &Lamp, side: u32, everything: Bounds, hair: Bounds) -> View {
    let mut view = View::parallel(axes(lamp.direction), [side; 2], hair);
    let [least, greatest] = depths(&view, everything);
    let span = (greatest - least).max(1e-6);
    let forward = Vec3::from(view.forward);
    view.eye = (Vec3::from(view.eye) + forward * (least - 0.02 * span)).to_array();
    with_planes(view, 0.01 * span, 1.03 * span)
}

fn perspective(lamp: &Lamp, side: u32, everything: Bounds, hair: Bounds) -> (View, bool) {
    let middle = 0.5 * (hair.0 + hair.1);
    let radius = (0.5 * (hair.1 - hair.0).length()).max(1e-6);
    let towards = middle - lamp.position;
    let distance = towards.length();
    // A little more than the sphere around the hair, for the widths of what is at its edge.
    let half = if distance > radius { 1.01 * (radius / distance).asin() } else { WIDEST };
    let axes = axes(towards.normalize_or(lamp.direction));
    let view = View::perspective(lamp.position, axes, half.min(WIDEST).tan(), [side; 2], everything);
    // Depth values crowd at the near plane. What stands nearer to the lamp than a hundredth of the way to the hair
    // would be the lamp's own shade.
    let near = view.near.max(0.01 * (distance - radius)).min(0.5 * view.far);
    let far = view.far;
    (with_planes(view, near, far), half < WIDEST)
}

/// Right, up and forward of a map.
fn axes(forward: Vec3) -> [Vec3; 3] {
    let frame = Frame::around(forward.normalize_or(Vec3::NEG_Y));
    [frame.w, frame.v, frame.u]
}

/// The view with other clipping planes. The eye may have moved along the view.
fn with_planes(mut view: View, near: f32, far: f32) -> View {
    let forward = Vec3::from(view.forward);
    let scale = if view.perspective == 1 { far / (far - near) } else { 1.0 / (far - near) };
    let offset = -forward.dot(Vec3::from(view.eye)) - near;
    for (column, along) in view.clip_from_world.iter_mut().zip([forward.x, forward.y, forward.z, offset]) {
        column[2] = along * scale;
    }
    View { near, far, ..view }
}

/// Least and greatest depth of a box.
fn depths(view: &View, bounds: Bounds) -> [f32; 2] {
    let (eye, forward) = (Vec3::from(view.eye), Vec3::from(view.forward));
    corners(bounds)
        .map(|corner| (corner - eye).dot(forward))
        .fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], depth| [a.min(depth), b.max(depth)])
}

#[cfg(test)]
mod tests {
    use math::{Mat4, Rgb, Vec2, hash, warp};

    use super::*;

    const EVERYTHING: Bounds = (Vec3::new(-9.0, -2.0, -3.0), Vec3::new(4.0, 12.0, 7.0));
    const HAIR: Bounds = (Vec3::new(-1.0, -1.5, 1.0), Vec3::new(0.5, 2.0, 4.0));

    fn lamp(kind: LampKind, position: Vec3, direction: Vec3) -> Lamp {
        Lamp {
            kind,
            position,
            direction,
            color: Rgb::white(),
            cosine: false,
            two_sided: false,
            cone: None,
            source: 0,
            radius: 0.0,
            shadow: true,
        }
    }

    fn direction(i: u32) -> Vec3 {
        warp::uniform_sphere([hash::unit(i, 1), hash::unit(i, 2)])
    }

    /// Lamps from all sides, none of them near the hair.
    fn lamps() -> impl Iterator<Item = Lamp> {
        (0..64).flat_map(|i| {
            let direction = direction(i);
            let position = Vec3::new(-0.25, 0.25, 2.5) - direction * (3.0 + 20.0 * hash::unit(i, 3));
            let kinds = [LampKind::Directional, LampKind::Point, LampKind::Spot];
            kinds.map(|kind| lamp(kind, if kind == LampKind::Directional { Vec3::ZERO } else { position }, direction))
        })
    }

    /// The value that the device keeps of a point's depth.
    fn value(view: &View, p: Vec3) -> f32 {
        let clip = Mat4::from_cols_array_2d(&view.clip_from_world) * p.extend(1.0);
        clip.z / clip.w
    }

    /// `lamp_map_depth` of the shader.
    fn map_depth(view: &View, value: f32) -> f32 {
        let [near, far] = [view.near, view.far];
        if view.perspective == 1 { near * far / (far - value * (far - near)) } else { near + value * (far - near) }
    }

    #[test]
    fn a_map_holds_all_hair_and_its_depths_come_back() {
        for lamp in lamps() {
            let map = MapView::new(&lamp, 256, EVERYTHING, HAIR);
            assert!(map.whole);
            for p in corners(HAIR) {
                let [x, y, depth] = map.view.project(p);
                assert!((0.0..=256.0).contains(&x) && (0.0..=256.0).contains(&y), "{p}: {x} {y} of {lamp:?}");
                assert!(depth >= map.hair[0] - 1e-4 && depth <= map.hair[1] + 1e-4, "{p}: {depth} of {lamp:?}");
                let value = value(&map.view, p);
                assert!((0.0..=1.0).contains(&value), "{p}: {value} of {lamp:?}");
                // A few roundings of numbers as large as the way from the origin to the eye and on to the point. In
                // perspective the value is flat far away: there they count as often as the near plane fits in the depth.
                let size = p.length() + Vec3::from(map.view.eye).length() + depth;
                let step = depth / map.view.near * size * 2.0_f32.powi(-22) + 1e-4;
                assert!((map_depth(&map.view, value) - depth).abs() < step, "{p}: {depth} of {lamp:?}");
            }
        }
    }

    #[test]
    fn a_map_uses_its_texels_for_the_hair() {
        for lamp in lamps() {
            let map = MapView::new(&lamp, 256, EVERYTHING, HAIR);
            let seen: Vec<Vec2> = corners(HAIR).map(|p| Vec2::from_slice(&map.view.project(p))).collect();
            let [least, greatest] = [Vec2::min, Vec2::max].map(|pick| seen.iter().copied().reduce(pick));
            // The box is 1.5 x 3.5 x 3 in a sphere of diameter 4.9; whatever lies around it is not the scene.
            let widest = (greatest.unwrap_or_default() - least.unwrap_or_default()).max_element();
            assert!(widest > 0.5 * 256.0, "{widest} texels of {lamp:?}");
        }
    }

    #[test]
    fn what_stands_between_a_sun_and_the_hair_is_in_the_map() {
        for i in 0..64 {
            let map = MapView::new(&lamp(LampKind::Directional, Vec3::ZERO, direction(i)), 64, EVERYTHING, HAIR);
            for p in corners(EVERYTHING) {
                let value = value(&map.view, p);
                assert!(value > 0.0 && value < 1.0, "{p}: {value}");
            }
        }
    }

    #[test]
    fn a_lamp_in_the_hair_is_told_apart_and_has_a_view_all_the_same() {
        for position in [Vec3::new(-0.25, 0.25, 2.5), Vec3::new(0.0, 0.0, 2.0), Vec3::new(0.5, 2.05, 4.0)] {
            let map = MapView::new(&lamp(LampKind::Point, position, Vec3::NEG_Y), 64, EVERYTHING, HAIR);
            assert!(!map.whole, "{position}");
            assert!(map.view.clip_from_world.iter().flatten().all(|x| x.is_finite()), "{:?}", map.view);
            assert!(map.view.near > 0.0 && map.view.near < map.view.far);
            assert!(map.hair[0] < map.hair[1]);
        }
    }

    #[test]
    fn hair_without_extent_has_a_view() {
        let point = (Vec3::ONE, Vec3::ONE);
        for kind in [LampKind::Directional, LampKind::Point] {
            let map = MapView::new(&lamp(kind, Vec3::ZERO, Vec3::X), 16, point, point);
            assert!(map.view.clip_from_world.iter().flatten().all(|x| x.is_finite()), "{:?}", map.view);
            assert!(map.hair[0] < map.hair[1], "{:?}", map.hair);
        }
    }
}
