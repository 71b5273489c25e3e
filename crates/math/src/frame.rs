use glam::Vec3;

/// A right-handed orthonormal frame; `u` is the axis it was built around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First axis: a curve's tangent, or a surface's normal.
    pub u: Vec3,
    /// Second axis.
    pub v: Vec3,
    /// Third axis, `u × v`.
    pub w: Vec3,
}

impl Frame {
    /// The frame around unit `u`; `v` and `w` are chosen without branches that could flip abruptly
    /// except across `u.z = 0`.
    ///
    /// Source: Duff et al. 2017, "Building an orthonormal basis, revisited".
    #[inline]
    pub fn around(u: Vec3) -> Self {
        let sign = 1.0_f32.copysign(u.z);
        let a = -1.0 / (sign + u.z);
        let b = u.x * u.y * a;
        let v = Vec3::new(1.0 + sign * u.x * u.x * a, sign * b, -sign * u.x);
        let w = Vec3::new(b, sign + u.y * u.y * a, -u.y);
        Self { u, v, w }
    }

    /// World coordinates of a vector given in this frame as `(u, v, w)`.
    #[inline]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        self.u * local.x + self.v * local.y + self.w * local.z
    }

    /// Coordinates `(u, v, w)` in this frame of a world vector.
    #[inline]
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        Vec3::new(self.u.dot(world), self.v.dot(world), self.w.dot(world))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp;

    #[test]
    fn frames_are_orthonormal_and_round_trip() {
        for i in 0..1000 {
            let u = warp::uniform_sphere([crate::hash::unit(i, 1), crate::hash::unit(i, 2)]);
            let f = Frame::around(u);
            assert!(f.u.dot(f.v).abs() < 1e-6 && f.u.dot(f.w).abs() < 1e-6 && f.v.dot(f.w).abs() < 1e-6);
            assert!((f.u.cross(f.v) - f.w).length() < 1e-5);
            let x = Vec3::new(0.3, -0.7, 0.2);
            assert!((f.to_local(f.to_world(x)) - x).length() < 1e-5);
        }
    }
}
