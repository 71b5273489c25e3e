//! Triangle meshes: heads, bodies and whatever else hair grows on or falls over.

use std::collections::HashMap;
use std::fmt;

use math::{Affine3A, Mat3, Vec3};

/// Triangles over shared vertices; counter-clockwise seen from outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normal per vertex, where the source has them; see [`vertex_normals`](Self::vertex_normals).
    pub normals: Option<Vec<Vec3>>,
}

/// Why a mesh cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshError {
    /// It has no triangle.
    Empty,
    /// It has more vertices than 32 bits can number.
    TooManyVertices {
        /// How many there are.
        found: usize,
    },
    /// A triangle names a vertex that is not there.
    Index {
        /// The triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A position is infinite or not a number.
    NotFinite {
        /// The vertex, from 0.
        vertex: usize,
    },
    /// Normals and vertices differ in number, or a normal is not finite.
    Normals {
        /// How many finite normals there are.
        found: usize,
        /// How many vertices there are.
        expected: usize,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the mesh has no triangles"),
            Self::TooManyVertices { found } => {
                write!(f, "{found} vertices are more than a mesh can hold ({})", u32::MAX)
            }
            Self::Index { triangle, vertex, vertices } => {
                write!(f, "triangle {triangle} names vertex {vertex}, but there are only {vertices}")
            }
            Self::NotFinite { vertex } => write!(f, "the position of vertex {vertex} is not finite"),
            Self::Normals { found, expected } => {
                write!(f, "there are {found} finite normals for {expected} vertices")
            }
        }
    }
}

impl std::error::Error for MeshError {}

impl Mesh {
    /// A checked mesh.
    ///
    /// # Errors
    /// As [`validate`](Self::validate).
    pub fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, normals: Option<Vec<Vec3>>) -> Result<Self, MeshError> {
        let mesh = Self { positions, triangles, normals };
        mesh.validate()?;
        Ok(mesh)
    }

    /// Checks that there are triangles, that they name existing vertices, that positions and normals are finite
    /// and that there are none or as many normals as vertices.
    ///
    /// # Errors
    /// The first of these that does not hold.
    pub fn validate(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if u32::try_from(vertices).is_err() {
            return Err(MeshError::TooManyVertices { found: vertices });
        }
        if let Some(vertex) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
                return Err(MeshError::Index { triangle, vertex, vertices });
            }
        }
        if let Some(normals) = &self.normals {
            let found = normals.iter().filter(|n| n.is_finite()).count();
            if normals.len() != vertices || found != vertices {
                return Err(MeshError::Normals { found, expected: vertices });
            }
        }
        Ok(())
    }

    /// The three corners of a triangle.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// Smallest box around all vertices as `(least, greatest)`; `None` without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let &first = self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p))))
    }

    /// Moves the mesh. Mirroring transforms also turn the triangles around, so that outside stays outside.
    pub fn transform(&mut self, by: Affine3A) {
        for p in &mut self.positions {
            *p = by.transform_point3(*p);
        }
        let linear = Mat3::from_cols(
            by.transform_vector3(Vec3::X),
            by.transform_vector3(Vec3::Y),
            by.transform_vector3(Vec3::Z),
        );
        // The cofactor matrix carries normals and, unlike the inverse, exists for flat transforms too. Its
        // determinant's sign would turn normals inwards under a mirror.
        let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let (cx, cy, cz) = (y.cross(z) * sign, z.cross(x) * sign, x.cross(y) * sign);
        for n in self.normals.iter_mut().flatten() {
            *n = (cx * n.x + cy * n.y + cz * n.z).normalize_or(*n);
        }
        if sign < 0.0 {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
    }

    /// Smooth unit normals: the mesh's own, or the area-weighted mean of the adjoining faces. A vertex without
    /// area around it gets +y.
    pub fn vertex_normals(&self) -> Vec<Vec3> {
        if let Some(normals) = &self.normals {
            return normals.clone();
        }
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for (t, corners) in self.triangles.iter().enumerate() {
            let [a, b, c] = self.corners(t);
            // Twice the area long: larger faces count more.
            let n = (b - a).cross(c - a);
            for &v in corners {
                sums[v as usize] += n;
            }
        }
        sums.into_iter().map(|n| n.normalize_or(Vec3::Y)).collect()
    }

    /// The volume inside a closed mesh; negative when it is inside out.
    pub fn volume(&self) -> f32 {
        let sum: f64 = (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|p| p.as_dvec3());
                a.dot(b.cross(c))
            })
            .sum();
        (sum / 6.0) as f32
    }

    /// Whether every edge is used by exactly two triangles, once in each direction.
    pub fn is_closed(&self) -> bool {
        let mut balance: HashMap<(u32, u32), (u8, u8)> = HashMap::new();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let uses = balance.entry((from.min(to), from.max(to))).or_default();
                let side = if from < to { &mut uses.0 } else { &mut uses.1 };
                *side = side.saturating_add(1);
            }
        }
        !balance.is_empty() && balance.values().all(|&uses| uses == (1, 1))
    }

    /// A sphere of triangles: 20 of them, quartered `subdivisions` times (at most 7), with exact normals.
    pub fn sphere(center: Vec3, radius: f32, subdivisions: u32) -> Self {
        Self::ellipsoid(center, Vec3::splat(radius), subdivisions)
    }

    /// An axis-aligned ellipsoid of triangles, refined like [`sphere`](Self::sphere).
    pub fn ellipsoid(center: Vec3, radii: Vec3, subdivisions: u32) -> Self {
        let (directions, triangles) = icosphere(subdivisions.min(7));
        let normals = directions.iter().map(|&d| (d / radii).normalize_or(d)).collect();
        let positions = directions.iter().map(|&d| center + d * radii).collect();
        Self { positions, triangles, normals: Some(normals) }
    }
}

/// Unit directions and triangles of a refined icosahedron.
fn icosphere(subdivisions: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let t = 0.5 * (1.0 + 5.0_f32.sqrt());
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) / (1.0 + t * t).sqrt();
    let mut directions = vec![
        corner(-1.0, t, 0.0),
        corner(1.0, t, 0.0),
        corner(-1.0, -t, 0.0),
        corner(1.0, -t, 0.0),
        corner(0.0, -1.0, t),
        corner(0.0, 1.0, t),
        corner(0.0, -1.0, -t),
        corner(0.0, 1.0, -t),
        corner(t, 0.0, -1.0),
        corner(t, 0.0, 1.0),
        corner(-t, 0.0, -1.0),
        corner(-t, 0.0, 1.0),
    ];
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let m = directions[a as usize] + directions[b as usize];
                directions.push(m.normalize_or(Vec3::Y));
                directions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (directions, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spheres_are_closed_and_nearly_round() {
        let m = Mesh::sphere(Vec3::new(1.0, 2.0, 3.0), 2.0, 4);
        assert_eq!(m.triangles.len(), 20 * 256);
        assert!(m.validate().is_ok() && m.is_closed());
        // Chords lie inside the sphere: at 4 subdivisions an edge spans about 0.07 rad, so the facets lose
        // less than 1 % of the volume, and never gain any.
        let share = m.volume() / (4.0 / 3.0 * std::f32::consts::PI * 8.0);
        assert!(share > 0.99 && share < 1.0, "{share}");
    }

    #[test]
    fn smooth_normals_point_outwards() {
        let mut m = Mesh::ellipsoid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), 3);
        let exact = m.vertex_normals();
        m.normals = None;
        for (a, b) in exact.iter().zip(m.vertex_normals()) {
            // Facets of 8 degrees: the mean of the faces around a vertex is within a few of the exact one.
            assert!(a.dot(b) > 0.99, "{a} and {b}");
        }
    }

    #[test]
    fn mirrors_keep_the_outside_outside() {
        let mut m = Mesh::ellipsoid(Vec3::X, Vec3::new(1.0, 2.0, 3.0), 2);
        let before = m.volume();
        m.transform(Affine3A::from_scale(Vec3::new(-1.0, 1.0, 2.0)));
        assert!((m.volume() - 2.0 * before).abs() < 1e-3 * before);
        let exact = m.vertex_normals();
        m.normals = None;
        // Coarser facets on a stretched ellipsoid.
        assert!(exact.iter().zip(m.vertex_normals()).all(|(a, b)| a.dot(b) > 0.9));
    }

    #[test]
    fn broken_meshes_are_named() {
        let p = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(Mesh::new(p.clone(), vec![], None), Err(MeshError::Empty));
        assert_eq!(
            Mesh::new(p.clone(), vec![[0, 1, 2], [0, 1, 3]], None),
            Err(MeshError::Index { triangle: 1, vertex: 3, vertices: 3 })
        );
        assert_eq!(
            Mesh::new(p.clone(), vec![[0, 1, 2]], Some(vec![Vec3::Z; 2])),
            Err(MeshError::Normals { found: 2, expected: 3 })
        );
        let mut q = p.clone();
        q[1].x = f32::INFINITY;
        assert_eq!(Mesh::new(q, vec![[0, 1, 2]], None), Err(MeshError::NotFinite { vertex: 1 }));
        assert!(!Mesh::new(p, vec![[0, 1, 2]], None).unwrap().is_closed());
    }
}
