//! Readers and writers of groom and mesh files.
//!
//! | extension | what | here |
//! |---|---|---|
//! | `.hair` | strands with widths, colours and transparency | [`hair`], read and written |
//! | `.obj` | Wavefront meshes | [`obj`], read |
//! | `.ply` | Stanford meshes, text and binary | [`ply`], read |
//!
//! Readers take any [`Read`], check every size a file declares against what it holds before
//! making room for it, and never panic on what they read. What is merely odd becomes a warning; what cannot be
//! understood becomes an error that says what was found and what would have been right.
//!
//! ```
//! use formats::hair;
//! use groom::Groom;
//! use math::Vec3;
//!
//! let groom = Groom::new(vec![Vec3::ZERO, Vec3::new(0.0, -1.0, 0.0)], [2])?;
//! let mut bytes = Vec::new();
//! hair::write(&mut bytes, &groom, &hair::WriteOptions::default())?;
//!
//! // 128 bytes of header and two points of twelve; a single length needs no count per strand.
//! assert_eq!(bytes.len(), 128 + 24);
//! let back = hair::read(&mut bytes.as_slice(), None)?;
//! assert_eq!(back.groom.points(), groom.points());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod hair;
pub mod obj;
pub mod ply;

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use groom::{Groom, Mesh};

pub use hair::{HairError, HairFile, WriteOptions};
pub use obj::ObjError;
pub use ply::PlyError;

/// Extensions that [`read_groom`] knows.
pub const GROOM_EXTENSIONS: [&str; 1] = ["hair"];

/// Extensions that [`read_mesh`] knows.
pub const MESH_EXTENSIONS: [&str; 2] = ["obj", "ply"];

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The name's ending says nothing that this crate understands.
    #[error("{}: {what} files end in {known}, this one in {found:?}", .path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// What was wanted: a groom or a mesh.
        what: &'static str,
        /// Its extension, in lower case; empty when it has none.
        found: String,
        /// The extensions that are understood.
        known: String,
    },
    /// The file could not be opened.
    #[error("cannot open {}: {cause}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The content is not a readable `.hair` file.
    #[error("{}: {cause}", .path.display())]
    Hair {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: HairError,
    },
    /// The content is not a readable OBJ file.
    #[error("{}: {cause}", .path.display())]
    Obj {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: ObjError,
    },
    /// The content is not a readable PLY file.
    #[error("{}: {cause}", .path.display())]
    Ply {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: PlyError,
    },
}

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The name's ending says nothing that this crate writes.
    #[error("{}: grooms are written to files that end in .hair, not in {found:?}", .path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// Its extension, in lower case; empty when it has none.
        found: String,
    },
    /// The groom does not fit the format.
    #[error("{}: {cause}", .path.display())]
    Hair {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        cause: HairError,
    },
    /// The file could not be made or moved into its place.
    #[error("cannot write {}: {cause}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
}

/// Reads a groom; the format follows from the file's extension.
///
/// # Errors
/// When the extension is unknown, the file cannot be opened, or its content is not of that format.
pub fn read_groom(path: impl AsRef<Path>) -> Result<HairFile, ReadError> {
    let path = path.as_ref();
    match extension(path).as_str() {
        "hair" => {
            let (mut reader, len) = open(path)?;
            hair::read(&mut reader, len).map_err(|cause| ReadError::Hair { path: path.to_owned(), cause })
        }
        found => Err(unknown(path, "groom", found, &GROOM_EXTENSIONS)),
    }
}

/// Reads a mesh; the format follows from the file's extension.
///
/// # Errors
/// When the extension is unknown, the file cannot be opened, or its content is not of that format.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<Mesh, ReadError> {
    let path = path.as_ref();
    match extension(path).as_str() {
        "obj" => {
            let (mut reader, _) = open(path)?;
            obj::read(&mut reader).map_err(|cause| ReadError::Obj { path: path.to_owned(), cause })
        }
        "ply" => {
            let (mut reader, _) = open(path)?;
            ply::read(&mut reader).map_err(|cause| ReadError::Ply { path: path.to_owned(), cause })
        }
        found => Err(unknown(path, "mesh", found, &MESH_EXTENSIONS)),
    }
}

/// Writes a groom as a `.hair` file: first beside it under another name, then moved into place, so that a
/// reader never sees half a file and a failure leaves the old one untouched.
///
/// # Errors
/// When the extension is not `.hair`, the groom does not fit the format, or the file cannot be made.
pub fn write_groom(path: impl AsRef<Path>, groom: &Groom, options: &WriteOptions) -> Result<(), WriteError> {
    let path = path.as_ref();
    let found = extension(path);
    if found != "hair" {
        return Err(WriteError::Extension { path: path.to_owned(), found });
    }
    let io = |cause| WriteError::Io { path: path.to_owned(), cause };
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = write_to(&part, groom, options, path);
    if written.is_ok() {
        if let Err(cause) = std::fs::rename(&part, path) {
            // The error that matters is the first; a leftover is only untidy.
            let _ = std::fs::remove_file(&part);
            return Err(io(cause));
        }
    } else {
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// Writes to `part`; errors name `path`, which is what the caller asked for.
fn write_to(part: &Path, groom: &Groom, options: &WriteOptions, path: &Path) -> Result<(), WriteError> {
    let io = |cause| WriteError::Io { path: path.to_owned(), cause };
    // Somebody else's file of that name is not ours to overwrite.
    let file = File::options().write(true).create_new(true).open(part).map_err(io)?;
    let mut writer = BufWriter::new(file);
    hair::write(&mut writer, groom, options).map_err(|e| match e {
        HairError::Io(cause) => io(cause),
        cause => WriteError::Hair { path: path.to_owned(), cause },
    })?;
    writer.flush().map_err(io)?;
    writer.get_ref().sync_all().map_err(io)
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

fn unknown(path: &Path, what: &'static str, found: &str, known: &[&str]) -> ReadError {
    let known: Vec<String> = known.iter().map(|e| format!(".{e}")).collect();
    ReadError::Extension { path: path.to_owned(), what, found: found.to_owned(), known: known.join(" or ") }
}

/// A reader and, for an ordinary file, its length.
fn open(path: &Path) -> Result<(impl Read, Option<u64>), ReadError> {
    let file = File::open(path).map_err(|cause| ReadError::Open { path: path.to_owned(), cause })?;
    let about = file.metadata().map_err(|cause| ReadError::Open { path: path.to_owned(), cause })?;
    // Devices and pipes have no length to hold a header against, and may never end.
    if !about.is_file() {
        let cause = std::io::Error::other(if about.is_dir() { "it is a folder" } else { "it is no ordinary file" });
        return Err(ReadError::Open { path: path.to_owned(), cause });
    }
    let len = Some(about.len());
    Ok((BufReader::new(file), len))
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::Vec3;

    fn line() -> Groom {
        Groom::new(vec![Vec3::ZERO, Vec3::Y, Vec3::X, Vec3::Z], [2, 2]).unwrap()
    }

    #[test]
    fn files_are_written_whole_and_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hair");
        for _ in 0..2 {
            // The second time replaces the first.
            write_groom(&path, &line(), &WriteOptions::default()).unwrap();
            assert_eq!(read_groom(&path).unwrap().groom.points(), line().points());
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
    }

    #[test]
    fn a_groom_that_does_not_fit_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hair");
        write_groom(&path, &line(), &WriteOptions::default()).unwrap();
        let long = Groom::new(vec![Vec3::ZERO; 70_000], [70_000]).unwrap();
        let error = write_groom(&path, &long, &WriteOptions::default()).unwrap_err();
        assert!(matches!(error, WriteError::Hair { .. }), "{error}");
        assert_eq!(read_groom(&path).unwrap().groom.strand_count(), 2);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn errors_carry_the_path_and_what_is_known() {
        let text = read_groom("nowhere/some.abc").unwrap_err().to_string();
        assert!(text.contains("some.abc") && text.contains(".hair") && text.contains("\"abc\""), "{text}");
        let text = read_mesh("nowhere/some.stl").unwrap_err().to_string();
        assert!(text.contains(".obj or .ply"), "{text}");
        let text = read_mesh("nowhere/some.OBJ").unwrap_err().to_string();
        assert!(text.starts_with("cannot open") && text.contains("some.OBJ"), "{text}");
        assert!(write_groom("a.ply", &line(), &WriteOptions::default()).is_err());
    }
}
