use std::path::{Path, PathBuf};

use film::{BitDepth, Film, Metadata, PngOptions, View, WriteError};

/// Where a picture goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// All layers, scene-linear.
    pub exr: Option<PathBuf>,
    /// The picture as shown.
    pub png: Option<PathBuf>,
}

/// Why a picture cannot be saved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The name's ending is not one that can be written.
    #[error("cannot write {}: pictures are written as .exr or .png, not as .{found}", .path.display())]
    Extension {
        /// The name.
        path: PathBuf,
        /// Its extension.
        found: String,
    },
    /// The name is no name for a file.
    #[error("{} names no picture; write a name such as picture.exr", .path.display())]
    Name {
        /// The name.
        path: PathBuf,
    },
    /// The folder is missing or cannot be written to.
    #[error("cannot write into {}: {cause}", .folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A folder stands where the picture should.
    #[error("cannot write {}: it is a folder", .path.display())]
    IsFolder {
        /// The name.
        path: PathBuf,
    },
    /// The system will not have a file of that name.
    #[error("cannot write {}: {cause}", .path.display())]
    Impossible {
        /// The name.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// Writing failed; what was there before still is.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl Outputs {
    /// From one name: `.exr` (or no extension) gives both files, `.png` the PNG alone.
    ///
    /// # Errors
    /// For other extensions.
    pub fn from_name(name: &Path) -> Result<Self, SaveError> {
        // `a/` and `.exr` are names of a folder and of a hidden file, not of a picture.
        let ends_in_separator =
            name.as_os_str().as_encoded_bytes().last().is_some_and(|&b| std::path::is_separator(b.into()));
        let bare = name.file_name().is_some_and(|n| n == ".exr" || n == ".png");
        if name.file_name().is_none() || ends_in_separator || bare {
            return Err(SaveError::Name { path: name.to_owned() });
        }
        let extension = name.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            None => Ok(Self { exr: Some(name.with_extension("exr")), png: Some(name.with_extension("png")) }),
            Some("exr") => Ok(Self { exr: Some(name.to_owned()), png: Some(name.with_extension("png")) }),
            Some("png") => Ok(Self { exr: None, png: Some(name.to_owned()) }),
            Some(other) => Err(SaveError::Extension { path: name.to_owned(), found: other.to_owned() }),
        }
    }

    /// The files, in the order they are written.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        [&self.exr, &self.png].into_iter().filter_map(|p| p.as_deref())
    }

    /// Finds out before a render, not after it, that nothing could be written.
    ///
    /// # Errors
    /// When a folder is missing or refuses new files, or a folder stands where a file should.
    pub fn check(&self) -> Result<(), SaveError> {
        for path in self.paths() {
            let folder = match path.parent() {
                Some(folder) if !folder.as_os_str().is_empty() => folder,
                _ => Path::new("."),
            };
            let error = |cause| SaveError::Folder { folder: folder.to_owned(), cause };
            match std::fs::symlink_metadata(path) {
                Ok(_) if path.is_dir() => return Err(SaveError::IsFolder { path: path.to_owned() }),
                Ok(_) => {}
                Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {}
                Err(cause) => return Err(SaveError::Impossible { path: path.to_owned(), cause }),
            }
            // The same kind of temporary file that writing makes; gone again at once.
            let probe = folder.join(format!(".cuticle-{}.probe", std::process::id()));
            std::fs::File::create_new(&probe).map_err(error)?;
            std::fs::remove_file(&probe).map_err(error)?;
        }
        Ok(())
    }

    /// Writes the files, each whole or not at all.
    ///
    /// # Errors
    /// When writing fails; files that were there before are then unchanged.
    pub fn save(&self, film: &Film, view: View, exposure_ev: f32, metadata: &Metadata) -> Result<(), SaveError> {
        if let Some(path) = &self.exr {
            film::write_exr(path, film, metadata)?;
        }
        if let Some(path) = &self.png {
            let options = PngOptions { view, exposure_ev, depth: BitDepth::Eight, ..PngOptions::default() };
            film::write_png(path, &film.image(), &options)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_is_written() {
        let both = Outputs::from_name(Path::new("a/b.exr")).unwrap();
        assert_eq!(both.png.as_deref(), Some(Path::new("a/b.png")));
        assert_eq!(Outputs::from_name(Path::new("a/b")).unwrap().exr.as_deref(), Some(Path::new("a/b.exr")));
        assert_eq!(Outputs::from_name(Path::new("b.PNG")).unwrap().exr, None);
        let error = Outputs::from_name(Path::new("b.jpg")).unwrap_err().to_string();
        assert!(error.contains(".exr or .png") && error.contains("jpg"), "{error}");
    }

    #[test]
    fn a_missing_folder_is_found_before_rendering() {
        let outputs = Outputs::from_name(Path::new("no/such/folder/a.exr")).unwrap();
        let error = outputs.check().unwrap_err().to_string();
        assert!(error.contains("no/such/folder"), "{error}");
    }
}
