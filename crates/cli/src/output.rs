//! Files are written beside their place and renamed: nobody ever meets half of one.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

/// A place to write to, found writable before the long work starts.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    beside: tempfile::NamedTempFile,
}

impl Output {
    /// Opens a temporary file beside `path`.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        if path.is_dir() {
            bail!("{}: is a folder; expected the name of a file to write", path.display());
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            bail!("{}: there is no folder {}; expected one that exists", path.display(), folder.display());
        }
        let beside = tempfile::Builder::new()
            .prefix(".twinray-")
            .tempfile_in(folder)
            .with_context(|| format!("{}: cannot write into the folder {}", path.display(), folder.display()))?;
        Ok(Self { path: path.to_owned(), beside })
    }

    /// Writes all of the file and puts it in its place.
    pub fn write(mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.path.display().to_string();
        self.beside.write_all(bytes).with_context(|| format!("{path}: writing failed"))?;
        self.beside.as_file().sync_all().with_context(|| format!("{path}: writing failed"))?;
        // Temporary files are private; a result is as readable as the user's other files.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::Permissions::from_mode(0o644);
            self.beside.as_file().set_permissions(mode).with_context(|| format!("{path}: writing failed"))?;
        }
        self.beside.persist(&self.path).with_context(|| format!("{path}: cannot be replaced"))?;
        Ok(())
    }
}

/// The extension in lower case.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
