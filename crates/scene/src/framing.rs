//! Finding a camera for what there is to see.

use std::f32::consts::FRAC_PI_2;

use math::Vec3;

use crate::scene::Camera;

/// From where an automatic camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Radians around the vertical: 0 looks from +z, π/2 from +x.
    pub azimuth: f32,
    /// Radians above the horizon, less than π/2 either way.
    pub elevation: f32,
    /// What is looked at; `None`: the middle of the box.
    pub target: Option<Vec3>,
    /// Distance from the target; `None`: so far that the box fills about 80 % of the frame.
    pub distance: Option<f32>,
}

/// A pinhole camera, with +y up, that frames `points`.
///
/// `fov_y` is the vertical field of view in radians and `aspect` the width of the frame over its height. With
/// no distance given, the points fill 80 % of the frame in the direction in which it is tighter; with no
/// target given, they are centred in it.
pub fn auto_camera(points: &[Vec3], view: Viewpoint, fov_y: f32, aspect: f32) -> Camera {
    let elevation = view.elevation.clamp(-0.995 * FRAC_PI_2, 0.995 * FRAC_PI_2);
    let (sin_azimuth, cos_azimuth) = view.azimuth.sin_cos();
    let (sin_elevation, cos_elevation) = elevation.sin_cos();
    // From the target to the camera.
    let back = Vec3::new(cos_elevation * sin_azimuth, sin_elevation, cos_elevation * cos_azimuth);
    let right = Vec3::Y.cross(back).normalize_or(Vec3::X);
    let up = back.cross(right);
    let tan_y = 0.8 * (0.5 * fov_y).tan();
    let tan_x = tan_y * aspect;

    let box_of = |points: &[Vec3]| {
        let first = points.first().copied().unwrap_or(Vec3::ZERO);
        points.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)))
    };
    let (lo, hi) = box_of(points);
    let mut target = view.target.unwrap_or((lo + hi) * 0.5);
    let distance_from = |target: Vec3| {
        let needed = points.iter().fold(0.0_f32, |needed, &p| {
            let p = p - target;
            let sideways = (p.dot(right).abs() / tan_x).max(p.dot(up).abs() / tan_y);
            needed.max(p.dot(back) + sideways)
        });
        // A single point needs no distance, but the camera cannot stand in it.
        if needed > 0.0 { needed } else { 1.0 }
    };
    let mut distance = view.distance.unwrap_or_else(|| distance_from(target));
    if view.target.is_none() {
        // Perspective makes near parts larger: centre what is seen, a few times over.
        for _ in 0..8 {
            let seen: Vec<Vec3> = points
                .iter()
                .map(|&p| {
                    let p = p - target;
                    let depth = (distance - p.dot(back)).max(1e-3 * distance);
                    Vec3::new(p.dot(right) / depth, p.dot(up) / depth, 0.0)
                })
                .collect();
            let (lo, hi) = box_of(&seen);
            let off = (lo + hi) * (0.5 * distance);
            target += right * off.x + up * off.y;
            distance = view.distance.unwrap_or_else(|| distance_from(target));
        }
    }
    Camera {
        position: target + back * distance,
        target,
        up: Vec3::Y,
        fov_y,
        aperture_radius: 0.0,
        focus_distance: distance,
    }
}

/// A few hundred of the points between which all others lie, nearly: the farthest ones in directions all
/// around. Framing them frames everything.
pub(crate) fn outline<'p>(points: impl Iterator<Item = &'p Vec3> + Clone) -> Vec<Vec3> {
    const DIRECTIONS: u32 = 256;
    // Enough to know the outline to a pixel or so, however large the groom.
    // Every so-manieth by chance: a fixed stride would miss the tips of strands of equal length.
    let stride = points.clone().count().div_ceil(40_000).max(1) as u32;
    let points: Vec<Vec3> = points
        .zip(0_u32..)
        .filter(|&(_, i)| i == 0 || math::hash::mix(i).is_multiple_of(stride))
        .map(|(&p, _)| p)
        .collect();
    (0..DIRECTIONS)
        .filter_map(|i| {
            // Spread evenly by the golden angle.
            let z = 1.0 - (2.0 * i as f32 + 1.0) / DIRECTIONS as f32;
            let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let d = Vec3::new(r * cos, r * sin, z);
            points.iter().copied().max_by(|a, b| a.dot(d).total_cmp(&b.dot(d)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners((lo, hi): (Vec3, Vec3)) -> Vec<Vec3> {
        (0..8)
            .map(|i| {
                let pick = |bit: i32, a: f32, b: f32| if (i >> bit) & 1 == 0 { a } else { b };
                Vec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z))
            })
            .collect()
    }

    #[test]
    fn the_outline_reaches_as_far_as_all_points() {
        let points: Vec<Vec3> = (0..100_000_u32)
            .map(|i| math::warp::uniform_sphere([math::hash::unit(i, 1), math::hash::unit(i, 2)]))
            .collect();
        let outline = outline(points.iter());
        assert!(outline.len() <= 256);
        for d in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, 0.0, 0.8)] {
            let most = outline.iter().map(|p| p.dot(d)).fold(f32::MIN, f32::max);
            // 256 directions are at most about 9 degrees off; a sphere recedes by 1.2 % over that.
            assert!(most > 0.98, "{most}");
        }
    }

    /// The largest share of the frame, horizontally or vertically, that the box's corners reach.
    fn reach(camera: &Camera, bounds: (Vec3, Vec3), aspect: f32) -> f32 {
        let [right, up, forward] = camera.axes();
        let tan_y = (0.5 * camera.fov_y).tan();
        let mut reach = 0.0_f32;
        for x in [bounds.0.x, bounds.1.x] {
            for y in [bounds.0.y, bounds.1.y] {
                for z in [bounds.0.z, bounds.1.z] {
                    let p = Vec3::new(x, y, z) - camera.position;
                    let depth = p.dot(forward);
                    assert!(depth > 0.0, "a corner is behind the camera");
                    reach = reach.max(p.dot(right).abs() / (depth * tan_y * aspect));
                    reach = reach.max(p.dot(up).abs() / (depth * tan_y));
                }
            }
        }
        reach
    }

    #[test]
    fn the_automatic_camera_fills_four_fifths_of_any_frame() {
        let boxes = [
            (Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, 1.0, 1.0)),
            (Vec3::new(100.0, 0.0, 3.0), Vec3::new(101.0, 40.0, 4.0)),
            (Vec3::new(-9.0, 5.0, -0.1), Vec3::new(9.0, 5.1, 0.1)),
        ];
        for bounds in boxes {
            for aspect in [0.5, 0.8, 1.0, 2.4] {
                for (azimuth, elevation) in [(0.0, 0.0), (0.7, 0.2), (-2.5, -1.2), (3.0, 1.5)] {
                    let view = Viewpoint { azimuth, elevation, target: None, distance: None };
                    let camera = auto_camera(&corners(bounds), view, 0.5, aspect);
                    let reach = reach(&camera, bounds, aspect);
                    // f32 cancellation in positions around 100 units.
                    assert!((reach - 0.8).abs() < 1e-3, "{bounds:?} {aspect} {azimuth}: {reach}");
                }
            }
        }
    }

    #[test]
    fn azimuth_zero_looks_from_the_front_and_ninety_degrees_from_the_right() {
        let bounds = (Vec3::splat(-1.0), Vec3::splat(1.0));
        let view = Viewpoint { azimuth: 0.0, elevation: 0.0, target: None, distance: Some(5.0) };
        let front = auto_camera(&corners(bounds), view, 0.5, 1.0);
        assert!((front.position - Vec3::new(0.0, 0.0, 5.0)).length() < 1e-5);
        let side = auto_camera(&corners(bounds), Viewpoint { azimuth: FRAC_PI_2, ..view }, 0.5, 1.0);
        assert!((side.position - Vec3::new(5.0, 0.0, 0.0)).length() < 1e-5);
        // From the front, the right of the picture is +x.
        assert!((front.axes()[0] - Vec3::X).length() < 1e-6);
    }

    #[test]
    fn a_box_without_size_still_gets_a_camera() {
        let point = Vec3::new(1.0, 2.0, 3.0);
        let view = Viewpoint { azimuth: 0.3, elevation: 0.1, target: None, distance: None };
        let camera = auto_camera(&[point], view, 0.5, 1.0);
        assert!(camera.position.is_finite() && camera.position != point);
    }
}
