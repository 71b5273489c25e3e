//! Stanford `.ply`, text or binary: positions and faces; polygons become fans of triangles.

use std::io::Read;

use groom::{Mesh, MeshError};
use math::Vec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};

/// Why a PLY file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlyError {
    /// The header or the data cannot be understood.
    #[error("not a readable PLY file: {0}")]
    Parse(ParseError),
    /// The header promises more than the file holds.
    #[error("the header declares {count} of {element:?}, at least {needed} bytes, but only {left} are left")]
    Counts {
        /// Which element.
        element: String,
        /// How many of it.
        count: usize,
        /// What all elements up to and with this one take at least.
        needed: u64,
        /// How many bytes follow the header.
        left: u64,
    },
    /// Something that a mesh needs is not declared.
    #[error("the header declares no {missing}")]
    Missing {
        /// What is missing.
        missing: &'static str,
    },
    /// The mesh cannot be used.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Reading failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Reads a mesh from the elements `vertex` (`x`, `y`, `z`) and `face` (`vertex_indices` or `vertex_index`).
///
/// # Errors
/// When the file is no PLY file or ends early, those elements are absent, a face names a missing vertex, or a
/// position is not finite.
pub fn read(reader: &mut impl Read) -> Result<Mesh, PlyError> {
    let mut bytes = Vec::new();
    reader.read_to_end(&mut bytes)?;
    let parser = Parser::<Element>::new();
    let mut source = Reader::new(bytes.as_slice());
    let header = parser.read_header(&mut source).map_err(PlyError::Parse)?;

    let left = source.get_ref().len() as u64;
    let mut needed = 0_u64;
    for element in header.elements.values() {
        needed = needed.saturating_add(least_size(element, header.encoding).saturating_mul(element.count as u64));
        if needed > left {
            let (element, count) = (element.name.clone(), element.count);
            return Err(PlyError::Counts { element, count, needed, left });
        }
    }
    let has = |element: &str, property: &str| {
        header.elements.get(element).is_some_and(|e| e.properties.contains_key(property))
    };
    if !["x", "y", "z"].iter().all(|axis| has("vertex", axis)) {
        return Err(PlyError::Missing { missing: "element \"vertex\" with x, y and z" });
    }
    if !INDICES.iter().any(|name| has("face", name)) {
        return Err(PlyError::Missing { missing: "element \"face\" with vertex_indices" });
    }

    let payload = parser.read_payload(&mut source, &header).map_err(PlyError::Parse)?;
    let elements = |name: &str| payload.get(name).map(Vec::as_slice).unwrap_or_default();
    let positions = elements("vertex").iter().map(|v| Vec3::from_array(v.position)).collect();
    let mut triangles = Vec::new();
    for face in elements("face") {
        if let [first, rest @ ..] = face.corners.as_slice() {
            triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        }
    }
    Ok(Mesh::new(positions, triangles, None)?)
}

/// The names that writers use for a face's corners.
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The fewest bytes that one element can take; never 0, so that counts are bounded by the file's length.
fn least_size(element: &ElementDef, encoding: Encoding) -> u64 {
    let size = |scalar: &ScalarType| -> u64 {
        match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        }
    };
    let properties = element.properties.values();
    let sum: u64 = match encoding {
        // A digit each; only the last line may lack its end.
        Encoding::Ascii => properties.count() as u64,
        Encoding::BinaryBigEndian | Encoding::BinaryLittleEndian => properties
            .map(|p| match &p.data_type {
                PropertyType::Scalar(scalar) => size(scalar),
                PropertyType::List(count, _) => size(count),
            })
            .sum(),
    };
    sum.max(1)
}

/// A vertex or a face, whichever the parser fills.
#[derive(Debug, Default)]
struct Element {
    position: [f32; 3],
    corners: Vec<u32>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ if INDICES.contains(&name) => {
                return match property.to_u32_list() {
                    Some(corners) => {
                        self.corners = corners;
                        PropertyAccessResult::Set
                    }
                    None => PropertyAccessResult::UnsupportedType,
                };
            }
            _ => return PropertyAccessResult::Ignored,
        };
        match property.to_f32_lossy() {
            Some(x) => {
                self.position[axis] = x;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::UnsupportedType,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TEXT: &str = "ply\nformat ascii 1.0\ncomment a pyramid\n\
        element vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
        element face 5\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n0.5 0.5 1 9\n\
        4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";

    fn binary(big: bool) -> Vec<u8> {
        let name = if big { "big" } else { "little" };
        let mut b = format!(
            "ply\nformat binary_{name}_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\n\
             property double z\nelement face 4\nproperty list uchar uint vertex_index\nend_header\n"
        )
        .into_bytes();
        for x in [0.0_f64, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0] {
            b.extend(if big { x.to_be_bytes() } else { x.to_le_bytes() });
        }
        for face in [[0_u32, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
            b.push(3);
            for v in face {
                b.extend(if big { v.to_be_bytes() } else { v.to_le_bytes() });
            }
        }
        b
    }

    #[test]
    fn text_and_binary_are_read() {
        let m = read(&mut TEXT.as_bytes()).unwrap();
        assert_eq!((m.positions.len(), m.triangles.len()), (5, 6));
        assert!(m.is_closed());
        // A third of base times height, in numbers that floats hold exactly up to the last division.
        assert!((m.volume() - 1.0 / 3.0).abs() < 1e-6);
        for big in [false, true] {
            let m = read(&mut binary(big).as_slice()).unwrap();
            assert!(m.is_closed() && (m.volume() - 1.0 / 6.0).abs() < 1e-6);
        }
    }

    #[test]
    fn lying_headers_are_caught() {
        let lie = TEXT.replace("vertex 5", "vertex 4000000000000");
        let error = read(&mut lie.as_bytes()).unwrap_err();
        assert!(matches!(error, PlyError::Counts { count: 4_000_000_000_000, .. }), "{error}");
        let empty = "ply\nformat ascii 1.0\nelement nothing 18000000000000000000\nend_header\n";
        assert!(matches!(read(&mut empty.as_bytes()), Err(PlyError::Counts { .. })));
        assert!(matches!(read(&mut TEXT.replace("float z", "float w").as_bytes()), Err(PlyError::Missing { .. })));
        let far = TEXT.replace("3 3 0 4\n", "3 3 0 5\n");
        assert!(matches!(read(&mut far.as_bytes()), Err(PlyError::Mesh(MeshError::Index { vertex: 5, .. }))));
        let negative = TEXT.replace("3 3 0 4\n", "3 3 0 -4\n");
        assert!(read(&mut negative.as_bytes()).is_err());
    }

    #[test]
    fn truncation_anywhere_is_an_error() {
        for whole in [TEXT.as_bytes().to_vec(), binary(false)] {
            // All but the last two bytes: without the closing line break, and without the "4" before it, the
            // text still reads as something.
            for end in (0..whole.len() - 2).step_by(7) {
                assert!(read(&mut &whole[..end]).is_err(), "cut at {end}");
            }
        }
    }

    proptest! {
        /// Whatever the bytes, reading ends with a mesh or an error.
        #[test]
        fn random_bytes_never_panic(noise in prop::collection::vec(any::<u8>(), 1..200), at in 0..400_usize) {
            let _ = read(&mut noise.as_slice());
            for mut whole in [TEXT.as_bytes().to_vec(), binary(true)] {
                let at = at % whole.len();
                for (x, y) in whole[at..].iter_mut().zip(&noise) {
                    *x = *y;
                }
                let _ = read(&mut whole.as_slice());
            }
        }
    }
}
