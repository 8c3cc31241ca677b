//! Running the command and looking at what it leaves.

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

/// Options that make every solve and picture small.
pub const SMALL: [&str; 6] = ["--patches", "2000", "--rays", "100000", "--size", "64x48"];

/// A folder to run in.
pub struct Place(TempDir);

/// What a run left.
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Place {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file there.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}; there are {:?}", self.files()))
    }

    /// Names of all files and folders there, hidden ones included.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Runs the command here.
    pub fn run(&self, args: &[&str]) -> Run {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("twinray"));
        run(command.current_dir(self.0.path()).args(args))
    }

    /// Runs the command, which must succeed.
    pub fn done(&self, args: &[&str]) -> Run {
        let run = self.run(args);
        assert_eq!(run.code, Some(0), "{args:?}: {}", run.stderr);
        run
    }

    /// `render` in the small.
    pub fn render(&self, args: &[&str]) -> Run {
        self.done(&[&["render"], args, &SMALL].concat())
    }

    /// `render --json` in the small.
    pub fn report(&self, args: &[&str]) -> Value {
        self.render(&[args, &["--json"]].concat()).json()
    }
}

fn run(command: &mut Command) -> Run {
    let Output { status, stdout, stderr } = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("output is UTF-8");
    Run { code: status.code(), stdout: text(stdout), stderr: text(stderr) }
}

impl Run {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e} in {}", self.stdout))
    }
}

/// The warnings of a report.
pub fn warnings(report: &Value) -> Vec<&str> {
    report["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect()
}

/// Decodes a PNG: width, height, RGB bytes.
pub fn png(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
    let picture = image::load_from_memory_with_format(bytes, image::ImageFormat::Png).unwrap().into_rgb8();
    (picture.width(), picture.height(), picture.into_raw())
}

/// Asserts that a PNG has the small size and shows something: neither black nor white nor one colour.
pub fn shows_something(bytes: &[u8]) {
    let (width, height, rgb) = png(bytes);
    assert_eq!((width, height), (64, 48));
    let mean = rgb.iter().map(|&c| f64::from(c)).sum::<f64>() / rgb.len() as f64;
    assert!((10.0..245.0).contains(&mean), "mean {mean}");
    let (low, high) = (rgb.iter().min().unwrap(), rgb.iter().max().unwrap());
    assert!(high - low > 30, "from {low} to {high}");
}

/// The root of the workspace.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A floor that nothing lights, facing up.
pub const FLOOR: &str = "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";

/// The same floor, which shines: its material stands in `LAMP_MTL`.
pub const SHINING_FLOOR: &str = "mtllib lamp.mtl\nusemtl lamp\nv -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\nusemtl wall\nv -1 1 -1\nv 1 1 -1\nf 1 4 6 5\n";

/// `lamp.mtl`.
pub const LAMP_MTL: &str = "newmtl lamp\nKd 0 0 0\nKe 1 1 1\nnewmtl wall\nKd 0.5 0.5 0.5\n";

/// A closed room of 2 m, dark.
pub const ROOM: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 2 3 4\nf 6 5 8 7\nf 5 1 4 8\nf 2 6 7 3\nf 4 3 7 8\nf 5 6 2 1\n";
