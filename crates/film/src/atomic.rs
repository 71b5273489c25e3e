//! Files that are either complete or not there.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use crate::SizeError;

/// Why an image file could not be written; what stood there before is untouched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// No file can be made in the folder.
    #[error("cannot write {path:?}: {cause}")]
    Create {
        /// The file to be written.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },

    /// There is a folder of that name.
    #[error("cannot write {path:?}: it is a folder")]
    Folder {
        /// The file to be written.
        path: PathBuf,
    },

    /// The picture could not be encoded or the disk is full.
    #[error("cannot write the contents of {path:?}: {what}")]
    Encode {
        /// The file to be written.
        path: PathBuf,
        /// What the encoder said.
        what: String,
    },

    /// The finished file could not be flushed or moved to its name.
    #[error("cannot finish {path:?}: {cause}")]
    Finish {
        /// The file to be written.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },

    /// The image is not an image.
    #[error("cannot write {path:?}: {cause}")]
    Size {
        /// The file to be written.
        path: PathBuf,
        /// What is wrong with its size.
        cause: SizeError,
    },

    /// A metadata name that the file format has no room for.
    #[error("cannot write {path:?}: the metadata name {name:?} must be 1 to 200 printable ASCII characters and unique")]
    MetadataName {
        /// The file to be written.
        path: PathBuf,
        /// The name found.
        name: String,
    },
}

/// Writes `bytes` to `path`; the file is complete or not there.
///
/// # Errors
/// The file cannot be written; what stood there before is untouched.
pub fn write_bytes(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), WriteError> {
    write(path.as_ref(), |file| file.write_all(bytes).map_err(|error| error.to_string()))
}

/// Writes `path` through a temporary file beside it: filled, flushed to the disk, then renamed.
///
/// Whoever opens `path` meanwhile sees the old file or the new one, never half of one.
pub(crate) fn write(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), String>) -> Result<(), WriteError> {
    let owned = || path.to_path_buf();
    if path.is_dir() {
        return Err(WriteError::Folder { path: owned() });
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".cuticle-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // Temporary files are private by default, but this one becomes the user's picture: the umask decides.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).map_err(|cause| {
        // The system's error names the temporary file, which means nothing to anyone.
        let cause = cause.raw_os_error().map_or_else(|| cause.kind().into(), std::io::Error::from_raw_os_error);
        WriteError::Create { path: owned(), cause }
    })?;
    fill(file.as_file_mut()).map_err(|what| WriteError::Encode { path: owned(), what })?;
    file.as_file().sync_all().map_err(|cause| WriteError::Finish { path: owned(), cause })?;
    file.persist(path).map_err(|failed| WriteError::Finish { path: owned(), cause: failed.error })?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn a_failing_writer_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("kept.bin");
        std::fs::write(&path, b"old").unwrap();
        let result = write(&path, |file| {
            file.write_all(b"half of the ne").map_err(|error| error.to_string())?;
            Err("no space left".to_owned())
        });
        assert!(result.unwrap_err().to_string().contains("no space left"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent").join("picture.exr");
        let error = write(&path, |_| Ok(())).unwrap_err();
        assert!(matches!(error, WriteError::Create { .. }));
        assert!(error.to_string().contains("absent"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_folder_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        assert!(matches!(write(&path, |_| Ok(())), Err(WriteError::Folder { .. })));
        assert!(path.is_dir());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
