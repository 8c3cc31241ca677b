//! Solution files on the disk: mapped into memory, so that what nobody asks for is never read.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use memmap2::Mmap;
use twinray::format::{self, Limits, SceneSource, SolutionFile, StoredSolution};
use twinray::scene::builtin;

use crate::output::extension;

/// A solution file.
#[derive(Debug)]
pub struct Stored {
    name: String,
    /// `None` of an empty file, which no system maps.
    bytes: Option<Mmap>,
}

/// True if a name is that of a solution file.
pub fn is_solution(name: &str) -> bool {
    extension(Path::new(name)) == "twin"
}

impl Stored {
    /// Maps the file.
    pub fn open(name: &str) -> anyhow::Result<Self> {
        let unreadable = || format!("{name}: cannot be read");
        if !Path::new(name).exists() {
            bail!("{name}: no such file; expected a .twin file, as `twinray solve` writes it");
        }
        let file = File::open(name).with_context(unreadable)?;
        let metadata = file.metadata().with_context(unreadable)?;
        if !metadata.is_file() {
            bail!("{name}: cannot be read: it is no file");
        }
        let bytes = match metadata.len() {
            0 => None,
            _ => Some(map(&file).with_context(unreadable)?),
        };
        Ok(Self { name: name.to_owned(), bytes })
    }

    /// As the user named it.
    pub fn name(&self) -> &str {
        &self.name
    }

    fn bytes(&self) -> &[u8] {
        self.bytes.as_deref().unwrap_or_default()
    }

    /// Its header, and the rest on demand.
    pub fn read(&self) -> anyhow::Result<StoredSolution<'_>> {
        StoredSolution::open(&self.name, self.bytes(), &limits()).map_err(|e| anyhow!("{e}"))
    }

    /// All of it, every bit checked.
    pub fn read_whole(&self) -> anyhow::Result<SolutionFile<'_>> {
        format::read_solution(&self.name, self.bytes(), &limits()).map_err(|e| anyhow!("{e}"))
    }
}

/// A mapped file takes no memory that cannot be taken back, so it may be of any size.
fn limits() -> Limits {
    Limits { max_file_bytes: u64::MAX, ..Limits::default() }
}

/// Maps a file for reading.
#[allow(unsafe_code)]
fn map(file: &File) -> std::io::Result<Mmap> {
    // SAFETY: the bytes of a map must not change while they are borrowed. Our own writers never change a file: they
    // replace it by a new one, and the map keeps the old. Of other programs this must be asked, as of any file that is
    // being read: one that cuts the file off meanwhile ends this process with a signal, and changed numbers are found by
    // their checksums or, after these were compared, are other numbers in arrays of plain numbers, whose lengths are fixed.
    unsafe { Mmap::map(file) }
}

/// Where the scene of a solution is: as the user says now, or where the solution says it was.
pub fn scene_of(name: &str, source: &SceneSource, wish: Option<&str>) -> anyhow::Result<String> {
    if let Some(wish) = wish {
        return Ok(wish.to_owned());
    }
    if builtin::by_name(&source.file).is_some() {
        return Ok(source.file.clone());
    }
    let path = PathBuf::from(beside(name, &source.file));
    // A pipe would be waited for, a device may have no end: no file may send us there.
    if !path.is_file() {
        bail!(
            "{name}: its scene was {}, seen from its folder, and is not there; --scene-file FILE says where it is now",
            source.file
        );
    }
    Ok(path.to_string_lossy().into_owned())
}

/// A file that a solution names, as seen from the working folder.
pub fn beside(name: &str, file: &str) -> String {
    // Seen from the folder of the file itself, not of a link to it.
    let real = std::fs::canonicalize(name).unwrap_or_else(|_| PathBuf::from(name));
    let link = Path::new(name).parent().unwrap_or(Path::new(""));
    let folder = if Path::new(name).is_symlink() { real.parent().unwrap_or(link) } else { link };
    folder.join(file).to_string_lossy().into_owned()
}

/// A scene's name as it is written into a solution in `folder`: built-in scenes as they are, files as seen from there.
pub fn seen_from(scene: &str, folder: &Path) -> String {
    if builtin::by_name(scene).is_some() {
        return scene.to_owned();
    }
    let absolute = |path: &Path| std::fs::canonicalize(path).ok();
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = absolute(Path::new(scene)).zip(absolute(here)).and_then(|(file, here)| pathdiff::diff_paths(file, here));
    let path = path.unwrap_or_else(|| PathBuf::from(scene));
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    if path.is_absolute() { path.to_string_lossy().into_owned() } else { parts.join("/") }
}
