//! Bytes of files that are not trusted: no more of them than allowed, and none outside of the scene's folder.
//!
//! The readers refuse references that lead out of the folder; links on the disk they cannot see, so these are followed
//! here and refused where they end elsewhere.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// All bytes of `path`, or an error if there are more than `most`: files may grow, and pipes have no size.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let size = file.metadata()?.len();
    let too_large =
        |size: String| io::Error::new(ErrorKind::FileTooLarge, format!("it has {size} bytes, and {most} are allowed"));
    if size > most {
        return Err(too_large(size.to_string()));
    }
    let mut bytes = Vec::with_capacity(size as usize);
    let count = file.take(most.saturating_add(1)).read_to_end(&mut bytes)? as u64;
    if count > most { Err(too_large(format!("more than {most}"))) } else { Ok(bytes) }
}

/// The folder of a scene, whose files may be read.
pub struct Folder {
    path: PathBuf,
    allow_outside: bool,
    most: u64,
}

impl Folder {
    /// The folder of the file `scene`; files of it, or of anywhere if that is allowed, of at most so many bytes each.
    pub fn of(scene: &Path, allow_outside: bool, most: u64) -> Self {
        let parent = scene.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self { path: parent.to_owned(), allow_outside, most }
    }

    /// The bytes of a file that the scene refers to.
    pub fn read(&self, reference: &str) -> io::Result<Vec<u8>> {
        let path = self.path.join(reference);
        let target = path.canonicalize()?;
        if !self.allow_outside && !target.starts_with(self.path.canonicalize()?) {
            let reason = "it is a link that leads out of the scene's folder; --allow-outside follows it";
            return Err(io::Error::new(ErrorKind::PermissionDenied, reason));
        }
        // A pipe would be waited for, a device may have no end.
        if !target.metadata()?.is_file() {
            return Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"));
        }
        read(&target, self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_up_to_their_limit() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a");
        std::fs::write(&path, b"12345").unwrap();
        assert_eq!(read(&path, 5).unwrap(), b"12345");
        assert_eq!(read(&path, u64::MAX).unwrap().len(), 5);
        let error = read(&path, 4).unwrap_err();
        assert!(error.to_string().contains("5 bytes, and 4 are allowed"), "{error}");
        // Devices say that they have no bytes.
        #[cfg(target_os = "linux")]
        assert!(read(Path::new("/dev/zero"), 1000).unwrap_err().to_string().contains("more than 1000"));
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_out_are_refused() {
        use std::os::unix::fs::symlink;
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        std::fs::create_dir_all(at("scene/t")).unwrap();
        std::fs::write(at("secret"), b"secret").unwrap();
        std::fs::write(at("scene/t/wood"), b"wood").unwrap();
        symlink(at("secret"), at("scene/a")).unwrap();
        symlink("..", at("scene/up")).unwrap();
        symlink("t/wood", at("scene/within")).unwrap();
        symlink("loop", at("scene/loop")).unwrap();
        // The folder itself may be reached by a link.
        symlink("scene", at("other")).unwrap();
        for scene in ["scene/x.obj", "other/x.obj"] {
            let closed = Folder::of(&at(scene), false, 100);
            let open = Folder::of(&at(scene), true, 100);
            for folder in [&closed, &open] {
                assert_eq!(folder.read("t/wood").unwrap(), b"wood");
                assert_eq!(folder.read("within").unwrap(), b"wood");
                assert!(folder.read("loop").is_err() && folder.read("none").is_err());
                assert!(folder.read("t").unwrap_err().to_string().contains("not a regular file"));
            }
            for reference in ["a", "up/secret", "../secret"] {
                let error = closed.read(reference).unwrap_err();
                assert_eq!(error.kind(), ErrorKind::PermissionDenied);
                assert!(error.to_string().contains("--allow-outside"), "{error}");
                assert_eq!(open.read(reference).unwrap(), b"secret", "{reference}");
            }
        }
    }
}
