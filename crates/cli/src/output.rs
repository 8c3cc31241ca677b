//! Files are written beside their place and renamed: nobody ever meets half of one, whatever happens to the program.
//!
//! The file beside has a fixed name, so that a killed program leaves at most one, which the next run takes over; it is
//! locked from the start to the end, so that two programs never write to one place.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, bail};

/// Files beside their places, to be removed by whoever ends the program at once.
static BESIDE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A place to write to, found writable before the long work starts.
#[derive(Debug)]
pub struct Output {
    /// As the user named it.
    name: String,
    path: PathBuf,
    beside: PathBuf,
    /// Locked; `None` only if it could not be opened anew after a checkpoint.
    file: Option<File>,
}

impl Output {
    /// Opens a temporary file beside `path`.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        if path.is_dir() {
            bail!("{}: is a folder; expected the name of a file to write", path.display());
        }
        // Pipes and devices cannot be replaced by a file.
        if std::fs::metadata(path).is_ok_and(|m| !m.is_file()) {
            bail!("{}: is no file; expected the name of a file to write", path.display());
        }
        let folder = folder_of(path);
        if !folder.is_dir() {
            bail!("{}: there is no folder {}; expected one that exists", path.display(), folder.display());
        }
        let name = path.display().to_string();
        // Through links, so that a link to a file stays one.
        let path = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let last = path.file_name().context("expected the name of a file to write")?.to_string_lossy();
        let beside = folder_of(&path).join(format!(".{last}.twinray"));
        let file = open_beside(&name, &beside)?;
        BESIDE.lock().unwrap_or_else(|e| e.into_inner()).push(beside.clone());
        Ok(Self { name, path, beside, file: Some(file) })
    }

    /// As the user named it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Writes all of the file and puts it in its place.
    pub fn write(mut self, bytes: &[u8]) -> anyhow::Result<()> {
        self.put(|out| out.write_all(bytes))
    }

    /// Writes what there is so far and puts it in the file's place; more may follow.
    pub fn put(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> anyhow::Result<()> {
        let name = &self.name;
        let file = match self.file.take() {
            Some(file) => file,
            None => open_beside(name, &self.beside)?,
        };
        let written = file.set_len(0).and_then(|()| {
            let mut buffered = BufWriter::new(&file);
            write(&mut buffered)?;
            buffered.flush()
        });
        let written = written.and_then(|()| file.sync_all());
        if let Err(error) = written {
            // Half a file helps nobody, and its room may be needed.
            let _ = file.set_len(0);
            self.file = Some(file);
            return Err(error).context(format!("{name}: writing failed; what was there before is untouched"));
        }
        std::fs::rename(&self.beside, &self.path).with_context(|| {
            format!("{name}: cannot be replaced; what was to replace it is {}", self.beside.display())
        })?;
        // The place stays taken between checkpoints, or a second program would come in and shut this one out at its end.
        self.file = open_beside(name, &self.beside).ok();
        // The new name itself must outlive a loss of power. Not every system lets a folder be opened for it.
        if let Ok(folder) = File::open(folder_of(&self.path)) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if self.file.is_some() {
            let _ = std::fs::remove_file(&self.beside);
        }
        BESIDE.lock().unwrap_or_else(|e| e.into_inner()).retain(|path| *path != self.beside);
    }
}

/// A folder beside the place of a file, for what the file is made of. Removed at the end.
#[derive(Debug)]
pub struct BesideFolder {
    path: PathBuf,
    is_kept: bool,
}

impl BesideFolder {
    /// Makes the folder for a file that is open, which keeps other programs out of it. What a killed program left there is removed.
    pub fn of(output: &Output) -> anyhow::Result<Self> {
        let mut name = output.beside.clone().into_os_string();
        name.push(".frames");
        let path = PathBuf::from(name);
        let made = match std::fs::remove_dir_all(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => std::fs::create_dir(&path),
        };
        made.with_context(|| format!("{}: cannot make the folder {}", output.name, path.display()))?;
        BESIDE.lock().unwrap_or_else(|e| e.into_inner()).push(path.clone());
        Ok(Self { path, is_kept: false })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Leaves it there.
    pub fn keep(&mut self) {
        self.is_kept = true;
    }
}

impl Drop for BesideFolder {
    fn drop(&mut self) {
        if !self.is_kept {
            let _ = std::fs::remove_dir_all(&self.path);
        }
        BESIDE.lock().unwrap_or_else(|e| e.into_inner()).retain(|path| *path != self.path);
    }
}

/// Removes what is written beside its place: for a program that ends at once.
pub fn abandon() {
    if let Ok(paths) = BESIDE.try_lock() {
        for path in paths.iter() {
            let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
        }
    }
}

fn open_beside(name: &str, beside: &Path) -> anyhow::Result<File> {
    let folder = folder_of(Path::new(name));
    for _ in 0..100 {
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(beside);
        let file = file.with_context(|| format!("{name}: cannot write into the folder {}", folder.display()))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => break,
            // Where nothing can be locked, nothing protects from a second program, and one alone needs nothing.
            Err(TryLockError::Error(_)) => return Ok(file),
            // Between the opening and the lock its owner may have put it in its place: then it is no longer beside.
            Ok(()) if is_at(&file, beside) => return Ok(file),
            Ok(()) => {}
        }
    }
    bail!("{name}: another twinray is writing it; expected a name of its own for every run")
}

/// True if the open file is the one that has this name now.
fn is_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let there = std::fs::metadata(path).and_then(|there| Ok((there, file.metadata()?)));
        there.is_ok_and(|(a, b)| (a.dev(), a.ino()) == (b.dev(), b.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = (file, path);
        true
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The extension in lower case.
pub fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
