//! Signed distance on a regular grid: what keeps hair out of the head.

use std::collections::HashMap;
use std::fmt;

use math::Vec3;

use crate::{Mesh, MeshError};

/// Distance to a surface, negative inside, sampled on the nodes of a regular grid.
///
/// Lookups interpolate linearly in all three axes. Outside the box the distance to the box is added, which
/// never understates how far the surface is by more than the box's own error.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceGrid {
    origin: Vec3,
    cell: f32,
    /// Nodes per axis, each at least 2.
    dims: [usize; 3],
    /// x runs fastest, then y.
    values: Vec<f32>,
}

/// Why no distance grid could be made.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum GridError {
    /// The number of cells along the longest side is out of range.
    Resolution {
        /// What was asked for.
        found: usize,
    },
    /// The box is empty or not finite.
    Bounds {
        /// Its least corner.
        low: Vec3,
        /// Its greatest corner.
        high: Vec3,
    },
    /// The mesh has no triangle with an area.
    Empty,
    /// The mesh is broken.
    Mesh(MeshError),
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Resolution { found } => write!(
                f,
                "a distance grid of {found} cells; it takes {} to {}",
                DistanceGrid::RESOLUTION.start(),
                DistanceGrid::RESOLUTION.end()
            ),
            Self::Bounds { low, high } => write!(f, "the box from {low} to {high} is empty or not finite"),
            Self::Empty => write!(f, "the mesh has no triangle with an area"),
            Self::Mesh(e) => write!(f, "the mesh cannot be measured: {e}"),
        }
    }
}

impl std::error::Error for GridError {}

impl DistanceGrid {
    /// Allowed numbers of cells along the longest side.
    pub const RESOLUTION: std::ops::RangeInclusive<usize> = 4..=256;

    /// Samples `f`, a signed distance, on a box from `bounds.0` to `bounds.1` with `resolution` cells along its
    /// longest side.
    ///
    /// # Errors
    /// When the resolution is outside [`RESOLUTION`](Self::RESOLUTION) or the box has no extent.
    pub fn from_fn(bounds: (Vec3, Vec3), resolution: usize, f: impl Fn(Vec3) -> f32) -> Result<Self, GridError> {
        let mut grid = Self::empty(bounds, resolution)?;
        for i in 0..grid.values.len() {
            grid.values[i] = f(grid.node(i));
        }
        Ok(grid)
    }

    /// [`from_fn`](Self::from_fn) for shapes that are symmetric about x = 0: half the calls. The box reaches as
    /// far to the left as to the right.
    pub(crate) fn from_symmetric_fn(
        bounds: (Vec3, Vec3),
        resolution: usize,
        f: impl Fn(Vec3) -> f32,
    ) -> Result<Self, GridError> {
        let reach = bounds.1.x.max(-bounds.0.x);
        let mut grid = Self::empty((bounds.0.with_x(-reach), bounds.1.with_x(reach)), resolution)?;
        let nx = grid.dims[0];
        grid.origin.x = -0.5 * grid.cell * (nx - 1) as f32;
        for row in 0..grid.values.len() / nx {
            for x in nx / 2..nx {
                let value = f(grid.node(row * nx + x));
                grid.values[row * nx + x] = value;
                grid.values[row * nx + (nx - 1 - x)] = value;
            }
        }
        Ok(grid)
    }

    /// Measures a mesh, with `resolution` cells along the longest side of its box plus a border.
    ///
    /// Near the surface distances are exact at the nodes; farther away each node measures the best triangle that
    /// its neighbours know of. The sign comes from the angle-weighted normal of the nearest face, edge or
    /// corner, so the mesh should be closed and face outwards; an open one is taken to end at its rim.
    ///
    /// # Errors
    /// When the resolution is outside [`RESOLUTION`](Self::RESOLUTION), the mesh is broken, or it has no area.
    pub fn from_mesh(mesh: &Mesh, resolution: usize) -> Result<Self, GridError> {
        mesh.validate().map_err(GridError::Mesh)?;
        let solid = Solid::new(mesh);
        let (Some((low, high)), false) = (mesh.bounds(), solid.faces.is_empty()) else {
            return Err(GridError::Empty);
        };
        let border = Vec3::splat(0.15 * (high - low).max_element());
        let mut grid = Self::empty((low - border, high + border), resolution)?;
        let unknown = u32::MAX;
        let mut nearest = vec![unknown; grid.values.len()];
        grid.values.fill(f32::INFINITY);

        // Exact in a band of two cells around every triangle.
        let band = 2.0 * grid.cell;
        for (t, corners) in solid.faces.iter().enumerate() {
            let p = corners.map(|v| solid.positions[v as usize]);
            let lo = grid.clamp_index((p[0].min(p[1]).min(p[2]) - Vec3::splat(band) - grid.origin) / grid.cell);
            let hi =
                grid.clamp_index((p[0].max(p[1]).max(p[2]) + Vec3::splat(band) - grid.origin) / grid.cell + Vec3::ONE);
            for z in lo[2]..=hi[2] {
                for y in lo[1]..=hi[1] {
                    for x in lo[0]..=hi[0] {
                        let i = grid.index([x, y, z]);
                        solid.improve(t as u32, grid.node(i), &mut nearest[i], &mut grid.values[i]);
                    }
                }
            }
        }
        // The rest asks its neighbours, forwards and backwards through the grid, twice.
        let [nx, ny, nz] = grid.dims.map(|n| n as isize);
        let before: Vec<[isize; 3]> = (0..13).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]).collect();
        for pass in 0..4 {
            let forward = pass % 2 == 0;
            let total = grid.values.len();
            for step in 0..total {
                let i = if forward { step } else { total - 1 - step };
                let at = grid.coordinates(i).map(|c| c as isize);
                let node = grid.node(i);
                for offset in &before {
                    let q = [0, 1, 2].map(|k| if forward { at[k] + offset[k] } else { at[k] - offset[k] });
                    if q[0] < 0 || q[1] < 0 || q[2] < 0 || q[0] >= nx || q[1] >= ny || q[2] >= nz {
                        continue;
                    }
                    let from = nearest[grid.index(q.map(|c| c as usize))];
                    if from != unknown && from != nearest[i] {
                        solid.improve(from, node, &mut nearest[i], &mut grid.values[i]);
                    }
                }
            }
        }
        // Values hold signed distances; what no triangle reached (it cannot happen) counts as far outside.
        for v in &mut grid.values {
            if !v.is_finite() {
                *v = (high - low).length();
            }
        }
        Ok(grid)
    }

    fn empty((low, high): (Vec3, Vec3), resolution: usize) -> Result<Self, GridError> {
        if !Self::RESOLUTION.contains(&resolution) {
            return Err(GridError::Resolution { found: resolution });
        }
        let size = high - low;
        if !(size.is_finite() && low.is_finite() && size.min_element() >= 0.0 && size.max_element() > 0.0) {
            return Err(GridError::Bounds { low, high });
        }
        let cell = size.max_element() / resolution as f32;
        let dims = size.to_array().map(|s| ((s / cell).ceil() as usize).clamp(1, resolution + 1) + 1);
        Ok(Self { origin: low, cell, dims, values: vec![0.0; dims[0] * dims[1] * dims[2]] })
    }

    /// Edge length of a cell.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// Nodes along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The box that is sampled, as `(least, greatest)`.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let far = Vec3::from_array(self.dims.map(|n| (n - 1) as f32)) * self.cell;
        (self.origin, self.origin + far)
    }

    /// Signed distance at `p`; negative inside.
    #[inline]
    pub fn distance(&self, p: Vec3) -> f32 {
        self.sample(p).0
    }

    /// Direction in which the distance grows fastest; not of unit length, zero where the grid is flat.
    #[inline]
    pub fn gradient(&self, p: Vec3) -> Vec3 {
        self.sample(p).1
    }

    /// [`distance`](Self::distance) and [`gradient`](Self::gradient) in one go.
    #[inline]
    pub fn sample(&self, p: Vec3) -> (f32, Vec3) {
        let (low, high) = self.bounds();
        // `max` before `min` sends NaN to the corner instead of out of range.
        let inside = p.max(low).min(high);
        let local = (inside - self.origin) / self.cell;
        let [nx, ny, nz] = self.dims;
        let (x, y, z) =
            ((local.x as usize).min(nx - 2), (local.y as usize).min(ny - 2), (local.z as usize).min(nz - 2));
        let t = local - Vec3::new(x as f32, y as f32, z as f32);
        let i = self.index([x, y, z]);
        let (dy, dz) = (nx, nx * ny);
        let v = &self.values;
        let (a, b, c, d) = (v[i], v[i + 1], v[i + dy], v[i + dy + 1]);
        let (e, f, g, h) = (v[i + dz], v[i + dz + 1], v[i + dy + dz], v[i + dy + dz + 1]);
        // Interpolate along x first, keeping the differences for the gradient.
        let (ab, cd, ef, gh) = (a + (b - a) * t.x, c + (d - c) * t.x, e + (f - e) * t.x, g + (h - g) * t.x);
        let (near, far) = (ab + (cd - ab) * t.y, ef + (gh - ef) * t.y);
        let value = near + (far - near) * t.z;
        let lerp2 = |p: f32, q: f32, r: f32, s: f32, u: f32, v: f32| {
            let (pq, rs) = (p + (q - p) * u, r + (s - r) * u);
            pq + (rs - pq) * v
        };
        let gradient = Vec3::new(
            lerp2(b - a, d - c, f - e, h - g, t.y, t.z),
            lerp2(c - a, d - b, g - e, h - f, t.x, t.z),
            far - near,
        ) / self.cell;
        let outside = p - inside;
        let gap = outside.length_squared();
        if gap > 0.0 {
            let gap = gap.sqrt();
            return (value + gap, outside / gap);
        }
        (value, gradient)
    }

    /// `p`, moved along the gradient until it is at least `margin` away from the surface, or as far as a few
    /// steps get it.
    #[inline]
    pub fn push_out(&self, mut p: Vec3, margin: f32) -> Vec3 {
        for _ in 0..4 {
            let (distance, gradient) = self.sample(p);
            if distance >= margin {
                break;
            }
            // A little more than needed: the distance is only nearly linear.
            p += gradient.normalize_or_zero() * (1.02 * (margin - distance) + 1e-4 * self.cell);
        }
        p
    }

    /// Value at node `(x, y, z)`.
    pub(crate) fn value(&self, node: [usize; 3]) -> f32 {
        self.values[self.index(node)]
    }

    /// Position of node `(x, y, z)`.
    pub(crate) fn position(&self, node: [usize; 3]) -> Vec3 {
        self.origin + Vec3::from_array(node.map(|c| c as f32)) * self.cell
    }

    #[inline]
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.dims[1] + y) * self.dims[0] + x
    }

    fn coordinates(&self, i: usize) -> [usize; 3] {
        let [nx, ny, _] = self.dims;
        [i % nx, i / nx % ny, i / (nx * ny)]
    }

    fn node(&self, i: usize) -> Vec3 {
        self.position(self.coordinates(i))
    }

    /// The node at or below a place in grid coordinates.
    fn clamp_index(&self, p: Vec3) -> [usize; 3] {
        let p = p.to_array();
        // A cast from float saturates, so places before the grid become 0.
        [0, 1, 2].map(|k| (p[k] as usize).min(self.dims[k] - 1))
    }
}

/// A mesh with welded corners and a normal for each face, edge and corner.
struct Solid {
    positions: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    face_normals: Vec<Vec3>,
    edge_normals: HashMap<(u32, u32), Vec3>,
    corner_normals: Vec<Vec3>,
}

impl Solid {
    fn new(mesh: &Mesh) -> Self {
        // Seams carry several vertices at one place; for the sign they must be one.
        let mut known: HashMap<[u32; 3], u32> = HashMap::new();
        let mut positions = Vec::new();
        let welded: Vec<u32> = mesh
            .positions
            .iter()
            .map(|p| {
                // Adding 0 turns -0 into 0, which has other bits.
                *known.entry((*p + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert_with(|| {
                    positions.push(*p);
                    positions.len() as u32 - 1
                })
            })
            .collect();
        let mut solid = Self {
            corner_normals: vec![Vec3::ZERO; positions.len()],
            positions,
            faces: Vec::new(),
            face_normals: Vec::new(),
            edge_normals: HashMap::new(),
        };
        for triangle in &mesh.triangles {
            let face = triangle.map(|v| welded[v as usize]);
            let p = face.map(|v| solid.positions[v as usize]);
            let Some(n) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else {
                continue;
            };
            for k in 0..3 {
                let (a, b, c) = (k, (k + 1) % 3, (k + 2) % 3);
                let key = (face[a].min(face[b]), face[a].max(face[b]));
                *solid.edge_normals.entry(key).or_insert(Vec3::ZERO) += n;
                let (ab, ac) = ((p[b] - p[a]).normalize_or_zero(), (p[c] - p[a]).normalize_or_zero());
                solid.corner_normals[face[a] as usize] += n * ab.dot(ac).clamp(-1.0, 1.0).acos();
            }
            solid.faces.push(face);
            solid.face_normals.push(n);
        }
        solid
    }

    /// Takes face `t` as the nearest of `p` if it is nearer than what is known.
    fn improve(&self, t: u32, p: Vec3, nearest: &mut u32, value: &mut f32) {
        let face = self.faces[t as usize];
        let (closest, feature) = closest_point(p, face.map(|v| self.positions[v as usize]));
        let away = p - closest;
        let squared = away.length_squared();
        if squared >= *value * *value {
            return;
        }
        let edge = |a: usize, b: usize| {
            let key = (face[a].min(face[b]), face[a].max(face[b]));
            self.edge_normals.get(&key).copied().unwrap_or(self.face_normals[t as usize])
        };
        let normal = match feature {
            Feature::Corner(k) => self.corner_normals[face[k] as usize],
            Feature::Edge(k) => edge(k, (k + 1) % 3),
            Feature::Face => self.face_normals[t as usize],
        };
        *nearest = t;
        *value = squared.sqrt().copysign(away.dot(normal));
    }
}

/// The part of a triangle that a point is nearest to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Feature {
    Corner(usize),
    /// From corner `k` to the next.
    Edge(usize),
    Face,
}

/// The point of a triangle nearest to `p`.
fn closest_point(p: Vec3, corners: [Vec3; 3]) -> (Vec3, Feature) {
    let [a, b, c] = corners;
    let n = (b - a).cross(c - a);
    let along = |k: usize| {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let edge = to - from;
        let t = (p - from).dot(edge) / edge.length_squared();
        if t <= 0.0 {
            (from, Feature::Corner(k))
        } else if t >= 1.0 {
            (to, Feature::Corner((k + 1) % 3))
        } else {
            (from + edge * t, Feature::Edge(k))
        }
    };
    // Inside all three walls that stand on the edges, the foot of the perpendicular is it.
    let within = |k: usize| {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        n.cross(to - from).dot(p - from) >= 0.0
    };
    let (w0, w1, w2) = (within(0), within(1), within(2));
    if w0 && w1 && w2 {
        return (p - n * (n.dot(p - a) / n.length_squared()), Feature::Face);
    }
    let mut best: Option<(f32, (Vec3, Feature))> = None;
    for (k, inside) in [w0, w1, w2].into_iter().enumerate() {
        if !inside {
            let candidate = along(k);
            let d = p.distance_squared(candidate.0);
            if best.is_none_or(|(known, _)| d < known) {
                best = Some((d, candidate));
            }
        }
    }
    best.map_or((a, Feature::Corner(0)), |(_, found)| found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::{hash, warp};

    #[test]
    fn a_meshed_sphere_measures_like_a_sphere() {
        let (center, radius) = (Vec3::new(0.5, -1.0, 2.0), 3.0);
        let grid = DistanceGrid::from_mesh(&Mesh::sphere(center, radius, 4), 48).unwrap();
        for i in 0..4000 {
            let direction = warp::uniform_sphere([hash::unit(i, 1), hash::unit(i, 2)]);
            let r = 3.7 * hash::unit(i, 3);
            let exact = r - radius;
            let got = grid.distance(center + direction * r);
            // One cell: interpolation blunts the kink at the centre by up to 0.87 cells, facets add 0.1 %.
            assert!((got - exact).abs() < grid.cell(), "at {r}: {got}, not {exact}");
        }
    }

    #[test]
    fn seams_do_not_confuse_the_sign() {
        // Every triangle with its own vertices.
        let m = Mesh::sphere(Vec3::ZERO, 2.0, 2);
        let positions: Vec<Vec3> = (0..m.triangles.len()).flat_map(|t| m.corners(t)).collect();
        let triangles = (0..m.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let soup = Mesh::new(positions, triangles, None).unwrap();
        let (a, b) = (DistanceGrid::from_mesh(&m, 24).unwrap(), DistanceGrid::from_mesh(&soup, 24).unwrap());
        for i in 0..a.values.len() {
            // Equal faces visited in equal order: only equally near ones could differ, in the last bits.
            assert!((a.values[i] - b.values[i]).abs() < 1e-5, "node {i}");
        }
    }

    #[test]
    fn pushing_out_gets_points_out() {
        let ball = |p: Vec3| p.length() - 2.0;
        let grid = DistanceGrid::from_fn((Vec3::splat(-3.0), Vec3::splat(3.0)), 48, ball).unwrap();
        for i in 0..1000 {
            let direction = warp::uniform_sphere([hash::unit(i, 4), hash::unit(i, 5)]);
            let p = direction * (0.5 + 1.6 * hash::unit(i, 6));
            let out = grid.push_out(p, 0.1);
            assert!(grid.distance(out) > 0.099, "{p} went to {out}");
            // The exact distance may differ by the error of linear interpolation, cell² / 8 / radius ~ 1e-3.
            assert!(ball(out) > 0.095);
        }
        let far = Vec3::new(0.0, 9.0, 0.0);
        assert_eq!(grid.push_out(far, 0.1), far);
        assert!((grid.distance(far) - 7.0).abs() < 1e-3);
    }

    #[test]
    fn impossible_grids_are_refused() {
        let unit = (Vec3::ZERO, Vec3::ONE);
        assert_eq!(DistanceGrid::from_fn(unit, 2, |p| p.x), Err(GridError::Resolution { found: 2 }));
        assert!(DistanceGrid::from_fn((Vec3::ONE, Vec3::ZERO), 8, |p| p.x).is_err());
        assert!(DistanceGrid::from_fn((Vec3::ZERO, Vec3::splat(f32::NAN)), 8, |p| p.x).is_err());
        let flat = Mesh { positions: vec![Vec3::ZERO; 3], triangles: vec![[0, 1, 2]], normals: None };
        assert_eq!(DistanceGrid::from_mesh(&flat, 8), Err(GridError::Empty));
    }
}
