//! Wavefront `.obj`: positions and faces of all its objects as one mesh; polygons become fans of triangles.
//!
//! Texture coordinates, materials and the file's own normals are left aside: Cuticle shades meshes plainly, with
//! normals from [`Mesh::vertex_normals`]. So only `v` and `f` lines reach the parser, without what it would need
//! those for.

use std::io::{BufRead, Read};

use groom::{Mesh, MeshError};
use math::Vec3;

/// Why an OBJ file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// A line cannot be understood.
    #[error("line {line} cannot be understood ({reason}): {text:?}")]
    Line {
        /// The line, from 1.
        line: usize,
        /// What the parser says.
        reason: tobj::LoadError,
        /// The beginning of the line.
        text: String,
    },
    /// Every line can be understood, but together they are no mesh.
    #[error("the faces do not fit the vertices: {reason}")]
    Faces {
        /// What the parser says.
        reason: tobj::LoadError,
    },
    /// The mesh cannot be used.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Reading failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Reads a mesh.
///
/// # Errors
/// When a vertex or a face cannot be understood, a face names a missing vertex, a position is not finite, or
/// there are no faces of three or more corners.
pub fn read(reader: &mut impl Read) -> Result<Mesh, ObjError> {
    let mut bytes = Vec::new();
    reader.read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut sieve = Sieve { lines: text.lines().enumerate(), line: (0, ""), kept: Vec::new(), used: 0 };
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let loaded = tobj::load_obj_buf(&mut sieve, &options, |_| Ok((Vec::new(), Default::default())));
    let models = match loaded {
        Ok((models, _)) => models,
        Err(reason) => {
            // Lines are handed out one by one: an error before the end is about the last of them.
            let (line, text) = sieve.line;
            return Err(if sieve.at_end() {
                ObjError::Faces { reason }
            } else {
                ObjError::Line { line: line + 1, reason, text: text.chars().take(60).collect() }
            });
        }
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for mesh in models.into_iter().map(|m| m.mesh) {
        let base = positions.len() as u32;
        positions.extend(mesh.positions.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])));
        triangles.extend(mesh.indices.chunks_exact(3).map(|t| [base + t[0], base + t[1], base + t[2]]));
    }
    Ok(Mesh::new(positions, triangles, None)?)
}

/// Hands the `v` and `f` lines of a text on, one per buffer, reduced to positions and their indices.
struct Sieve<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    /// Number, from 0, and text of the line in `kept`; meaningless at the end.
    line: (usize, &'a str),
    kept: Vec<u8>,
    used: usize,
}

impl Sieve<'_> {
    /// Whether all lines have been asked for and used.
    fn at_end(&self) -> bool {
        self.kept.is_empty()
    }
}

impl Read for Sieve<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let available = self.fill_buf()?;
        let n = available.len().min(buffer.len());
        buffer[..n].copy_from_slice(&available[..n]);
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for Sieve<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        while self.used == self.kept.len() {
            self.kept.clear();
            self.used = 0;
            let Some((number, line)) = self.lines.next() else {
                break;
            };
            self.line = (number, line);
            let mut words = line.split_whitespace();
            match words.next() {
                Some("v") => {
                    self.kept.push(b'v');
                    // Weights and colours may follow the coordinates.
                    for word in words.take(3) {
                        self.kept.push(b' ');
                        self.kept.extend_from_slice(word.as_bytes());
                    }
                }
                Some("f") => {
                    self.kept.push(b'f');
                    for word in words {
                        self.kept.push(b' ');
                        // A corner without a position must not vanish: the parser shall complain about it.
                        let position = word.split('/').next().filter(|p| !p.is_empty()).unwrap_or("?");
                        self.kept.extend_from_slice(position.as_bytes());
                    }
                }
                _ => continue,
            }
            self.kept.push(b'\n');
        }
        Ok(&self.kept[self.used..])
    }

    fn consume(&mut self, n: usize) {
        self.used += n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn get(text: &str) -> Result<Mesh, ObjError> {
        read(&mut text.as_bytes())
    }

    #[test]
    fn a_cube_of_quads_closes() {
        let text = "# a cube\nmtllib none.mtl\no cube\n\
            v 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
            vn 0 0 1\nusemtl steel\n\
            f 4/9/1 3/9/1 2/9/1 1/9/1\nf 5 6 7 8\ng side\nf -8 -7 -3 -4\nf 2//1 3//1 7//1 6//1\nf 3 4 8 7\nf 4 1 5 8\n";
        let m = get(text).unwrap();
        assert_eq!((m.positions.len(), m.triangles.len()), (8, 12));
        assert!(m.is_closed());
        assert_eq!(m.volume(), 1.0);
        assert!(get(&text.replace('\n', "\r\n")).is_ok());
    }

    #[test]
    fn errors_name_the_line() {
        let error = get("v 0 0 0\n\nv 1 zero 0\n").unwrap_err();
        assert!(matches!(error, ObjError::Line { line: 3, .. }), "{error}");
        let error = get("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n").unwrap_err();
        assert!(matches!(error, ObjError::Faces { .. }), "{error}");
        let error = get("v 0 0 0\nf 1 b\n").unwrap_err();
        assert!(matches!(error, ObjError::Line { line: 2, .. }), "{error}");
        assert!(matches!(get("v 0 0 0\n"), Err(ObjError::Mesh(MeshError::Empty))));
        let error = get("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap_err();
        assert!(matches!(error, ObjError::Mesh(MeshError::NotFinite { vertex: 0 })), "{error}");
    }

    proptest! {
        /// Whatever the text, reading ends with a mesh or an error.
        #[test]
        fn random_text_never_panics(
            noise in prop::collection::vec(any::<u8>(), 0..200),
            lines in prop::collection::vec("(v|f|vn|vt|o|l|mtllib)( -?[0-9]{0,20}(/-?[0-9]{0,20}){0,3}){0,6}", 0..12),
        ) {
            let _ = read(&mut noise.as_slice());
            let _ = get(&lines.join("\n"));
        }
    }
}
