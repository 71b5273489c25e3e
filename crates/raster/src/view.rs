//! Where a pass looks from: the camera, or a light.

use bytemuck::{Pod, Zeroable};
use math::{Mat4, Vec3, Vec4};
use scene::Camera;

/// Twin of `View` in `shaders/frame.wgsl`, which says what the numbers are.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct View {
    pub(crate) clip_from_world: [[f32; 4]; 4],
    pub(crate) eye: [f32; 3],
    pub(crate) perspective: u32,
    pub(crate) forward: [f32; 3],
    pub(crate) near: f32,
    pub(crate) across: [f32; 3],
    pub(crate) far: f32,
    pub(crate) down: [f32; 3],
    pub(crate) pixel: f32,
    pub(crate) size: [f32; 2],
    pub(crate) background: u32,
    pub(crate) frame: u32,
}

/// Nearest clipping plane as a share of the farthest one.
const LEAST_NEAR: f32 = 1e-4;

impl View {
    /// What a pinhole camera sees; `bounds` is the box around everything.
    pub(crate) fn camera(camera: &Camera, size: [u32; 2], bounds: (Vec3, Vec3)) -> Self {
        let axes = camera.axes();
        let half_y = (0.5 * camera.fov_y).tan();
        Self::perspective(camera.position, axes, half_y, size, bounds)
    }

    /// A perspective view from `eye` along `axes` (right, up, forward); `half_y` is half the height of the picture at
    /// depth 1.
    pub(crate) fn perspective(eye: Vec3, axes: [Vec3; 3], half_y: f32, size: [u32; 2], bounds: (Vec3, Vec3)) -> Self {
        let (least, most) = depth_range(eye, axes[2], bounds);
        let far = most.max(1e-6) * 1.001;
        let near = (least * 0.999).max(far * LEAST_NEAR);
        let pixel = 2.0 * half_y / size[1].max(1) as f32;
        // x/z and y/z over half the picture; depth 0 at the near plane, 1 at the far one.
        let aspect = size[0] as f32 / size[1].max(1) as f32;
        let depth = far / (far - near);
        let clip_from_view = Mat4::from_cols(
            Vec4::new(1.0 / (half_y * aspect), 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / half_y, 0.0, 0.0),
            Vec4::new(0.0, 0.0, depth, 1.0),
            Vec4::new(0.0, 0.0, -near * depth, 0.0),
        );
        Self::new(clip_from_view, eye, axes, true, [near, far], pixel, size)
    }

    /// A parallel view along `axes` that holds the box; `size` is square texels.
    pub(crate) fn parallel(axes: [Vec3; 3], size: [u32; 2], bounds: (Vec3, Vec3)) -> Self {
        let middle = 0.5 * (bounds.0 + bounds.1);
        let reach = |axis: Vec3| corners(bounds).map(|c| (c - middle).dot(axis).abs()).fold(0.0_f32, f32::max);
        let half = reach(axes[0]).max(reach(axes[1])).max(1e-6) * 1.01;
        let deep = reach(axes[2]).max(1e-6) * 1.01;
        let eye = middle - axes[2] * (2.0 * deep);
        let (near, far) = (deep, 3.0 * deep);
        let pixel = 2.0 * half / size[1].max(1) as f32;
        let half_x = 0.5 * pixel * size[0] as f32;
        let clip_from_view = Mat4::from_cols(
            Vec4::new(1.0 / half_x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / half, 0.0, 0.0),
            Vec4::new(0.0, 0.0, 1.0 / (far - near), 0.0),
            Vec4::new(0.0, 0.0, -near / (far - near), 1.0),
        );
        Self::new(clip_from_view, eye, axes, false, [near, far], pixel, size)
    }

    fn new(
        clip_from_view: Mat4,
        eye: Vec3,
        [right, up, forward]: [Vec3; 3],
        perspective: bool,
        [near, far]: [f32; 2],
        pixel: f32,
        size: [u32; 2],
    ) -> Self {
        // View space has x right, y up and z forward.
        let view_from_world = Mat4::from_cols(
            Vec4::new(right.x, up.x, forward.x, 0.0),
            Vec4::new(right.y, up.y, forward.y, 0.0),
            Vec4::new(right.z, up.z, forward.z, 0.0),
            Vec4::new(-right.dot(eye), -up.dot(eye), -forward.dot(eye), 1.0),
        );
        Self {
            clip_from_world: (clip_from_view * view_from_world).to_cols_array_2d(),
            eye: eye.to_array(),
            perspective: u32::from(perspective),
            forward: forward.to_array(),
            near,
            across: (right * pixel).to_array(),
            far,
            down: (-up * pixel).to_array(),
            pixel,
            size: size.map(|n| n as f32),
            background: 0,
            frame: 0,
        }
    }

    /// Pixel (centres at halves, y down) and depth of a point.
    #[cfg(test)]
    pub(crate) fn project(&self, p: Vec3) -> [f32; 3] {
        let clip = Mat4::from_cols_array_2d(&self.clip_from_world) * p.extend(1.0);
        let depth = (p - Vec3::from(self.eye)).dot(Vec3::from(self.forward));
        [(0.5 + 0.5 * clip.x / clip.w) * self.size[0], (0.5 - 0.5 * clip.y / clip.w) * self.size[1], depth]
    }
}

/// The eight corners of a box.
pub(crate) fn corners((a, b): (Vec3, Vec3)) -> impl Iterator<Item = Vec3> {
    (0..8).map(move |i| {
        Vec3::new(
            if i & 1 == 0 { a.x } else { b.x },
            if i & 2 == 0 { a.y } else { b.y },
            if i & 4 == 0 { a.z } else { b.z },
        )
    })
}

/// Least and largest depth of a box.
fn depth_range(eye: Vec3, forward: Vec3, bounds: (Vec3, Vec3)) -> (f32, f32) {
    corners(bounds)
        .map(|c| (c - eye).dot(forward))
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), d| (a.min(d), b.max(d)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: (Vec3, Vec3) = (Vec3::new(-1.0, -2.0, -3.0), Vec3::new(4.0, 2.0, 1.0));

    fn camera() -> Camera {
        Camera {
            position: Vec3::new(3.0, 4.0, 12.0),
            target: Vec3::new(1.0, 0.0, -1.0),
            up: Vec3::Y,
            fov_y: 0.7,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        }
    }

    /// `view_position` of the shader, in Rust.
    fn position(view: &View, [x, y, depth]: [f32; 3]) -> Vec3 {
        let aside =
            Vec3::from(view.across) * (x - 0.5 * view.size[0]) + Vec3::from(view.down) * (y - 0.5 * view.size[1]);
        let forward = Vec3::from(view.forward);
        if view.perspective == 1 {
            Vec3::from(view.eye) + depth * (forward + aside)
        } else {
            Vec3::from(view.eye) + depth * forward + aside
        }
    }

    #[test]
    fn a_pixel_and_its_depth_are_the_point_again() {
        let axes = camera().axes();
        for view in [View::camera(&camera(), [320, 200], BOX), View::parallel(axes, [256, 256], BOX)] {
            for p in corners(BOX).chain([Vec3::new(0.3, 0.2, -0.7)]) {
                let [x, y, depth] = view.project(p);
                assert!((position(&view, [x, y, depth]) - p).length() < 2e-4, "{p} of {view:?}");
                assert!(depth > view.near && depth < view.far);
            }
        }
    }

    #[test]
    fn a_parallel_view_holds_the_box() {
        let view = View::parallel(camera().axes(), [128, 128], BOX);
        for p in corners(BOX) {
            let [x, y, _] = view.project(p);
            assert!((0.0..=128.0).contains(&x) && (0.0..=128.0).contains(&y), "{p}: {x} {y}");
        }
    }
}
