//! The hair region of the lab, the same for all renderers: `hair_mask` of `lab/hairscene.py`.
//!
//! Every segment is cut at six places; a pixel belongs to the hair when at least so many of these places fall
//! into it and the head does not hide them. Interpolation is in `f32` and projection in `f64`, as there.

use math::{DVec3, Vec3};

use crate::lab_scene::{Camera, Head};

/// Places per segment.
const PLACES: u32 = 6;

/// Which pixels are hair; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mask {
    pub(crate) width: usize,
    pub(crate) inside: Vec<bool>,
}

impl Mask {
    /// The pixels that at least `min_hits` places of the strands fall into.
    pub(crate) fn of<'a>(
        camera: &Camera,
        head: &Head,
        strands: impl Iterator<Item = &'a [Vec3]>,
        min_hits: u32,
    ) -> Self {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let (w, h) = (f64::from(camera.width), f64::from(camera.height));
        let origin = DVec3::from_array(camera.origin);
        let view = DVec3::from_array(camera.target) - origin;
        let forward = view / view.length();
        let right = forward.cross(DVec3::from_array(camera.up));
        let right = right / right.length();
        let up = right.cross(forward);
        let focal = 1.0 / (camera.fov_y_deg.to_radians() / 2.0).tan();

        let to_camera = origin - DVec3::from_array(head.center);
        let outside = to_camera.dot(to_camera) - head.radius * head.radius;
        let mut hits = vec![0_u32; width * height];
        for strand in strands {
            for ends in strand.windows(2) {
                let step = ends[1] - ends[0];
                for place in 0..PLACES {
                    let t = ((f64::from(place) + 0.5) / f64::from(PLACES)) as f32;
                    let d = (ends[0] + step * t).as_dvec3() - origin;
                    let depth = d.dot(forward);
                    let x = (d.dot(right) / depth * focal * h / w + 1.0) * 0.5 * w;
                    let y = (1.0 - d.dot(up) / depth * focal) * 0.5 * h;
                    if !((0.0..w).contains(&x) && (0.0..h).contains(&y)) {
                        continue;
                    }
                    let distance = d.length();
                    let b = (d / distance).dot(to_camera);
                    let discriminant = b * b - outside;
                    let head_at = -b - discriminant.max(0.0).sqrt();
                    if discriminant < 0.0 || head_at > distance {
                        hits[y as usize * width + x as usize] += 1;
                    }
                }
            }
        }
        Self { width, inside: hits.iter().map(|&n| n >= min_hits).collect() }
    }

    /// Pixels inside.
    pub(crate) fn count(&self) -> usize {
        self.inside.iter().filter(|&&inside| inside).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three strands: before the head, mostly behind it, and out of the frame.
    fn small(min_hits: u32) -> Vec<String> {
        let strands = [
            [[-2.0, 2.5, 1.0], [-2.6, 1.0, 1.2], [-2.9, -1.0, 1.0], [-2.5, -3.0, 0.5]],
            [[0.0, 2.6, -1.5], [0.3, 0.5, -2.8], [0.2, -1.5, -2.6], [-0.5, -3.6, -1.0]],
            [[1.5, 2.0, 1.5], [2.6, 1.6, 1.0], [3.9, 0.5, 0.2], [9.0, -1.0, 0.0]],
        ];
        let strands = strands.map(|strand| strand.map(Vec3::from_array));
        let camera = Camera {
            origin: [1.0, 1.5, 12.0],
            target: [0.0, -0.25, 0.0],
            up: [0.0, 1.0, 0.0],
            fov_y_deg: 36.0,
            width: 24,
            height: 16,
            pixel_filter: String::new(),
        };
        let head = Head { center: [0.0, 0.25, 0.0], radius: 2.0, albedo: [0.5; 3] };
        let mask = Mask::of(&camera, &head, strands.iter().map(|s| &s[..]), min_hits);
        mask.inside.chunks(24).map(|row| row.iter().map(|&x| if x { '#' } else { '.' }).collect()).collect()
    }

    /// Both pictures were drawn by the Python original.
    #[test]
    fn the_mask_is_that_of_the_lab() {
        assert_eq!(
            small(1),
            [
                "........................",
                "........................",
                ".......#....#...........",
                "......#........###......",
                "......#..........##.....",
                ".....##...........##....",
                ".....#.............###..",
                ".....#................#.",
                ".....#..................",
                ".....#..................",
                ".....#..................",
                "......#....##...........",
                "......#....#............",
                "......#....#............",
                "........................",
                "........................",
            ]
        );
        assert_eq!(
            small(2),
            [
                "........................",
                "........................",
                "........................",
                "......#........##.......",
                "......#..........#......",
                "........................",
                "........................",
                "........................",
                ".....#..................",
                "........................",
                ".....#..................",
                "........................",
                "......#.................",
                "........................",
                "........................",
                "........................",
            ]
        );
    }
}
