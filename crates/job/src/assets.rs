use std::path::{Path, PathBuf};
use std::sync::Mutex;

use groom::{Groom, Mesh};
use scene::{AssetError, Assets, EnvironmentImage};

/// Assets from the disk; relative paths count from the folder of the scene file.
#[derive(Debug)]
pub struct DiskAssets {
    base: PathBuf,
    warnings: Mutex<Vec<String>>,
}

impl DiskAssets {
    /// Files below `base`, unless their paths are absolute.
    pub fn new(base: PathBuf) -> Self {
        Self { base, warnings: Mutex::new(Vec::new()) }
    }

    /// What was odd about the files read so far.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().map(|w| w.clone()).unwrap_or_default()
    }

    fn warn(&self, path: &Path, warnings: impl IntoIterator<Item = String>) {
        if let Ok(mut all) = self.warnings.lock() {
            all.extend(warnings.into_iter().map(|w| format!("{}: {w}", path.display())));
        }
    }

    fn path(&self, path: &str) -> PathBuf {
        self.base.join(path)
    }
}

impl Assets for DiskAssets {
    fn groom(&self, path: &str) -> Result<Groom, AssetError> {
        let path = self.path(path);
        let file = formats::read_groom(&path).map_err(AssetError::new)?;
        self.warn(&path, file.warnings);
        let (groom, counts) = groom::clean(file.groom, true);
        self.warn(&path, counts.warnings());
        if groom.strand_count() == 0 {
            return Err(AssetError::new(format_args!("{}: every strand has zero length", path.display())));
        }
        Ok(groom)
    }

    fn mesh(&self, path: &str) -> Result<Mesh, AssetError> {
        formats::read_mesh(self.path(path)).map_err(AssetError::new)
    }

    fn environment(&self, path: &str) -> Result<EnvironmentImage, AssetError> {
        let image = film::image::read(self.path(path)).map_err(AssetError::new)?;
        Ok(EnvironmentImage { width: image.width, height: image.height, pixels: image.pixels })
    }
}
