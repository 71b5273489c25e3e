//! The built-in head: a stylised shop-window bust, modelled as smoothly united solids.
//!
//! Centimetres, y up, facing +z, the middle of the cranium near the origin. Vertex at y = 11.5, chin at about
//! -11.4, 15 wide and 19 deep without nose and ears, shoulders 39 wide, cut off at y = -32.
//!
//! The model is a signed distance function, sampled once on a grid that serves both as the collider and for
//! meshing with surface nets.

use std::collections::HashMap;

use math::Vec3;

use crate::{DistanceGrid, GridError, Mesh, Scalp};

/// Something to groom and to render: the built-in bust, or any other body.
#[derive(Clone, Debug)]
pub struct Head {
    /// The surface, closed, with smooth normals.
    pub mesh: Mesh,
    /// The same surface as distances, to keep hair out.
    pub collider: DistanceGrid,
    /// Where hair grows.
    pub scalp: Scalp,
    /// One unit in metres, where it is known.
    pub metres_per_unit: Option<f32>,
}

impl Head {
    /// A body with hair all over, measured on a grid of `resolution` cells along its longest side.
    ///
    /// # Errors
    /// As [`DistanceGrid::from_mesh`].
    pub fn from_mesh(mesh: Mesh, resolution: usize) -> Result<Self, GridError> {
        let collider = DistanceGrid::from_mesh(&mesh, resolution)?;
        Ok(Self { mesh, collider, scalp: Scalp::Everywhere, metres_per_unit: None })
    }
}

/// Edge length of a grid cell: fine enough for lips and ears, coarse enough to build in a fraction of a second.
const CELL: f32 = 0.35;

/// The built-in bust. It takes a few tenths of a second to build and is always the same.
pub fn mannequin() -> Head {
    let bounds = (Vec3::new(-21.5, -33.5, -14.0), Vec3::new(21.5, 13.0, 12.0));
    let cells = ((bounds.1 - bounds.0).max_element() / CELL).round() as usize;
    let collider = match DistanceGrid::from_symmetric_fn(bounds, cells, bust) {
        Ok(grid) => grid,
        Err(_) => unreachable!("the box and the resolution are constants that a test checks"),
    };
    let mesh = surface_nets(&collider, bust);
    Head { mesh, collider, scalp: Scalp::Head, metres_per_unit: Some(0.01) }
}

/// Signed distance to the bust, exact enough near the surface: within a few per cent of the distance.
fn bust(q: Vec3) -> f32 {
    let p = q.with_x(q.x.abs());
    let v = Vec3::new;
    let skull = ellipsoid(p, v(0.0, 2.6, -1.5), v(7.5, 8.9, 9.2));
    let forehead = ellipsoid(p, v(0.0, 1.4, 1.6), v(6.5, 7.6, 6.5));
    let cheeks = ellipsoid(p, v(0.0, -3.9, 2.0), v(5.9, 6.4, 6.0));
    let mouth = ellipsoid(p, v(0.0, -6.6, 2.9), v(4.6, 4.3, 5.0));
    let jaw = cone(p, v(4.7, -5.6, -0.2), 1.4, v(1.5, -9.5, 5.5), 1.3);
    let chin = ellipsoid(p, v(0.0, -9.9, 6.2), v(1.7, 1.4, 1.6));
    let cheekbone = ellipsoid(p, v(3.9, -2.7, 4.6), v(2.0, 1.6, 2.2));
    let brow = cone(p, v(1.2, 1.75, 7.2), 0.6, v(4.9, 1.7, 5.0), 0.7);
    let mut d = skull;
    for (part, blend) in
        [(forehead, 2.0), (cheeks, 2.5), (mouth, 2.5), (jaw, 2.6), (chin, 1.6), (cheekbone, 2.4), (brow, 1.6)]
    {
        d = unite(d, part, blend);
    }

    let socket = ellipsoid(p, v(3.05, -0.05, 8.7), v(1.75, 0.95, 1.5));
    d = subtract(d, socket, 1.4);
    let eyelid = ellipsoid(p, v(3.05, -0.25, 5.7), v(1.5, 1.05, 1.45));
    let nose = cone(p, v(0.0, 1.0, 7.6), 0.6, v(0.0, -3.3, 9.7), 0.85);
    let nostril = ellipsoid(p, v(1.0, -3.65, 8.6), v(0.8, 0.65, 0.9));
    let upper_lip = ellipsoid(p, v(0.55, -6.2, 7.65), v(1.35, 0.5, 0.75));
    let lower_lip = ellipsoid(p, v(0.0, -7.1, 7.45), v(1.75, 0.62, 0.9));
    for (part, blend) in [(eyelid, 0.6), (nose, 1.3), (nostril, 0.7), (upper_lip, 0.6), (lower_lip, 0.6)] {
        d = unite(d, part, blend);
    }

    // Ears lean back by 15 degrees.
    let (sin, cos) = (0.259, 0.966);
    let e = v(p.x - 7.25, (p.y + 0.9) * cos - (p.z + 1.0) * sin, (p.y + 0.9) * sin + (p.z + 1.0) * cos);
    let conch = ellipsoid(e, v(0.75, 0.1, 0.15), v(0.55, 1.7, 0.85));
    let ear = subtract(ellipsoid(e, Vec3::ZERO, v(0.75, 2.9, 1.7)), conch, 0.5);
    d = unite(d, ear, 0.6);

    let neck = cone(p, v(0.0, -6.0, -2.8), 5.2, v(0.0, -18.5, -3.6), 5.4);
    let trapezius = cone(p, v(2.5, -19.5, -4.6), 3.5, v(14.8, -24.6, -4.4), 3.9);
    let arm = cone(p, v(14.9, -24.9, -4.4), 4.1, v(15.6, -36.0, -4.2), 4.0);
    let chest = ellipsoid(p, v(0.0, -31.5, -2.8), v(15.0, 11.0, 8.4));
    let body = unite(unite(unite(neck, trapezius, 5.0), arm, 3.0), chest, 4.5);
    // The base is cut flat, with a rounded rim.
    -unite(-unite(d, body, 2.2), q.y + 32.0, 1.0)
}

/// Distance to an ellipsoid, to first order in the distance.
fn ellipsoid(p: Vec3, center: Vec3, radii: Vec3) -> f32 {
    let q = (p - center) / radii;
    let level = q.length();
    let slope = (q / radii).length();
    if slope > 0.0 { level * (level - 1.0) / slope } else { -radii.min_element() }
}

/// Distance to a thick line whose radius changes from `ra` at `a` to `rb` at `b`; slightly too small beside it.
fn cone(p: Vec3, a: Vec3, ra: f32, b: Vec3, rb: f32) -> f32 {
    let axis = b - a;
    let t = ((p - a).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    (p - a - axis * t).length() - math::lerp(ra, rb, t)
}

/// The lesser distance, rounded where the two differ by less than `blend`.
fn unite(a: f32, b: f32, blend: f32) -> f32 {
    let h = (blend - (a - b).abs()).max(0.0) / blend;
    a.min(b) - 0.25 * blend * h * h
}

/// `a` without `b`, rounded likewise.
fn subtract(a: f32, b: f32, blend: f32) -> f32 {
    -unite(-a, b, blend)
}

/// The zero surface of `f` by surface nets: one vertex in every cell that the surface crosses, one quad across
/// every grid edge that it crosses.
///
/// Vertices start at the mean of the crossings and take one step along the gradient of `f` onto the surface;
/// normals are that gradient.
fn surface_nets(grid: &DistanceGrid, f: impl Fn(Vec3) -> f32) -> Mesh {
    let [nx, ny, nz] = grid.dims();
    let inside = |x: usize, y: usize, z: usize| grid.value([x, y, z]) < 0.0;
    let step = 0.05 * grid.cell();
    let reach = 0.5 * grid.cell();
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let mut vertex_of: HashMap<[usize; 3], u32> = HashMap::new();
    for z in 0..nz - 1 {
        for y in 0..ny - 1 {
            for x in 0..nx - 1 {
                let Some(mean) = mean_crossing(grid, [x, y, z]) else {
                    continue;
                };
                let slope = gradient(&f, mean, step);
                let normal = slope.normalize_or(Vec3::Y);
                let p = mean - normal * f(mean).clamp(-reach, reach);
                vertex_of.insert([x, y, z], positions.len() as u32);
                positions.push(p);
                normals.push(normal);
            }
        }
    }
    let mut triangles = Vec::new();
    let mut quad = |cells: [[usize; 3]; 4], flip: bool| {
        let corners = cells.map(|c| vertex_of.get(&c).copied());
        if let [Some(a), Some(b), Some(c), Some(d)] = corners {
            let [a, b, c, d] = if flip { [d, c, b, a] } else { [a, b, c, d] };
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        }
    };
    // Cells around an edge along each axis, counter-clockwise seen from the edge's far end.
    for z in 1..nz - 1 {
        for y in 1..ny - 1 {
            for x in 1..nx - 1 {
                let here = inside(x, y, z);
                if here != inside(x + 1, y, z) {
                    quad([[x, y - 1, z - 1], [x, y, z - 1], [x, y, z], [x, y - 1, z]], !here);
                }
                if here != inside(x, y + 1, z) {
                    quad([[x - 1, y, z - 1], [x - 1, y, z], [x, y, z], [x, y, z - 1]], !here);
                }
                if here != inside(x, y, z + 1) {
                    quad([[x - 1, y - 1, z], [x, y - 1, z], [x, y, z], [x - 1, y, z]], !here);
                }
            }
        }
    }
    Mesh { positions, triangles, normals: Some(normals) }
}

/// Mean of the places where the surface crosses the twelve edges of a cell; `None` where it crosses none.
fn mean_crossing(grid: &DistanceGrid, cell: [usize; 3]) -> Option<Vec3> {
    let corner = |k: usize| [cell[0] + (k & 1), cell[1] + ((k >> 1) & 1), cell[2] + (k >> 2)];
    let values: [f32; 8] = std::array::from_fn(|k| grid.value(corner(k)));
    let negative = values.iter().filter(|&&v| v < 0.0).count();
    if negative == 0 || negative == 8 {
        return None;
    }
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for from in 0..8 {
        for axis in [1, 2, 4] {
            let to = from | axis;
            if to != from && (values[from] < 0.0) != (values[to] < 0.0) {
                let t = values[from] / (values[from] - values[to]);
                sum += grid.position(corner(from)).lerp(grid.position(corner(to)), t);
                count += 1.0;
            }
        }
    }
    Some(sum / count)
}

/// Gradient of `f` from four evaluations at the corners of a tetrahedron.
fn gradient(f: impl Fn(Vec3) -> f32, p: Vec3, step: f32) -> Vec3 {
    let corners = [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::ONE];
    corners.into_iter().map(|c| c * f(p + c * step)).sum::<Vec3>() / (4.0 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bust_is_a_closed_solid_of_human_size() {
        let head = mannequin();
        assert!(head.mesh.validate().is_ok() && head.mesh.is_closed());
        // A head has 4 to 5 litres; neck, shoulders and this slice of a chest about as much again.
        let litres = head.mesh.volume() / 1000.0;
        assert!((8.0..12.0).contains(&litres), "{litres} litres");
        let (low, high) = head.mesh.bounds().unwrap();
        assert!((high.y - 11.5).abs() < 0.3 && (low.y + 32.0).abs() < 0.5, "{low} to {high}");
        assert!((high.x + low.x).abs() < 0.05 && high.x > 18.5 && high.x < 20.5, "{low} to {high}");
    }

    #[test]
    fn mesh_and_collider_agree() {
        let head = mannequin();
        for (p, n) in head.mesh.positions.iter().zip(head.mesh.vertex_normals()) {
            // A fifth of a cell: linear interpolation between nodes rounds off lips and ears.
            assert!(head.collider.distance(*p).abs() < 0.2 * CELL, "{p}");
            assert!((n.length() - 1.0).abs() < 1e-4);
        }
        assert!(head.collider.distance(Vec3::ZERO) < -5.0);
        assert!(head.collider.distance(Vec3::new(0.0, 12.0, 0.0)) > 0.3);
    }

    #[test]
    fn surface_nets_face_outwards() {
        let ball = |p: Vec3| p.length() - 1.0;
        let grid = DistanceGrid::from_fn((Vec3::splat(-1.5), Vec3::splat(1.5)), 24, ball).unwrap();
        let mesh = surface_nets(&grid, ball);
        assert!(mesh.is_closed());
        // Cells of an eighth: facets of a unit sphere lose about 0.5 % of the volume.
        let share = mesh.volume() / (4.0 / 3.0 * std::f32::consts::PI);
        assert!(share > 0.98 && share < 1.0, "{share}");
    }
}
