//! Files made to break readers, with memory counted: 356 malformed or odd scenes and a hundred broken pictures, none
//! from this project. An error or a warning each, never a panic, 10 s, or more memory than limits promise.
//!
//! A test binary of its own with one test, because the counting allocator counts every thread's memory.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Instant;

use peak_alloc::PeakAlloc;
use serde_json::json;
use twinray_format::{FormatError, Limits, Reading, read_scene};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What reading may take beside four times the bytes of the input.
const FREE_BYTES: usize = 256 << 20;
const SECONDS: u64 = 10;

#[test]
fn bad_files_are_read_or_refused_in_time_and_memory() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes/bad");
    if !root.is_dir() {
        println!("skipped: ../shared/scenes/bad is not here");
        return;
    }
    // That memory is counted at all: a megabyte is noticed.
    let (outcome, _) = watched(|_| {
        let bytes = std::hint::black_box(vec![1u8; 1 << 20]);
        Err(FormatError::Unreadable { file: String::new(), expected: String::new(), detail: bytes.len().to_string() })
    });
    assert!(outcome.peak >= 1 << 20, "{}", outcome.peak);

    let mut faults = Vec::new();
    let mut record = (0, PathBuf::new(), 0);
    let mut note = |file: &Path, outcome: Outcome, extra: Option<String>| {
        faults.extend(outcome.fault.or(extra).map(|what| format!("{}: {what}", file.display())));
        if outcome.peak > record.0 {
            record = (outcome.peak, file.to_owned(), outcome.input);
        }
    };

    let scenes = files_below(&root, &["gltf", "glb", "obj"]);
    assert!(scenes.len() > 300, "{} files", scenes.len());
    for file in &scenes {
        let (outcome, result) = watched(|input| read_file(file, input));
        // The validator's word, where there is one: a file without errors must not be called invalid.
        let refused = match result {
            Some(Err(error @ (FormatError::Invalid { .. } | FormatError::Unreadable { .. }))) if is_valid(file) => {
                Some(format!("refused though valid: {error}"))
            }
            _ => None,
        };
        note(file, outcome, refused);
    }

    let pictures = files_below(&root.join("images"), &[]);
    assert!(pictures.len() > 50, "{} files", pictures.len());
    for file in &pictures {
        let (outcome, result) = watched(|input| read_picture(file, input));
        let silent = match result {
            Some(Ok(reading)) if reading.scene.images.is_empty() && reading.warnings.is_empty() => {
                Some("left out without a word".to_owned())
            }
            Some(Err(error)) => Some(format!("a picture must not cost the scene: {error}")),
            _ => None,
        };
        note(file, outcome, silent);
    }

    let (peak, file, input) = record;
    let all = scenes.len() + pictures.len();
    println!("{all} files; most memory: {peak} bytes for an input of {input}, {}", file.display());
    assert!(faults.is_empty(), "{} of {all} files:\n{}", faults.len(), faults.join("\n"));
}

struct Outcome {
    fault: Option<String>,
    /// Bytes of memory at the worst moment, beyond what there was before.
    peak: usize,
    /// Bytes of all files that were read.
    input: usize,
}

/// Runs `read`, which adds the bytes it takes in to a sum, and watches time, memory and panics.
fn watched(
    read: impl FnOnce(&Cell<usize>) -> Result<Reading, FormatError>,
) -> (Outcome, Option<Result<Reading, FormatError>>) {
    let input = Cell::new(0);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let start = Instant::now();
    let result = catch_unwind(AssertUnwindSafe(|| read(&input))).ok();
    let (elapsed, peak) = (start.elapsed(), MEMORY.peak_usage().saturating_sub(before));
    let allowed = 4 * input.get() + FREE_BYTES;
    let fault = if result.is_none() {
        Some("panic".to_owned())
    } else if elapsed.as_secs() >= SECONDS {
        Some(format!("took {elapsed:?}"))
    } else if peak > allowed {
        Some(format!("took {peak} bytes, allowed are {allowed} for an input of {}", input.get()))
    } else {
        None
    };
    (Outcome { fault, peak, input: input.get() }, result)
}

fn load(path: &Path, input: &Cell<usize>) -> std::io::Result<Vec<u8>> {
    let bytes = std::fs::read(path)?;
    input.set(input.get() + bytes.len());
    Ok(bytes)
}

/// Reads a scene with the files beside it.
fn read_file(path: &Path, input: &Cell<usize>) -> Result<Reading, FormatError> {
    let bytes = load(path, input).unwrap();
    let folder = path.parent().unwrap();
    let mut resolver = |name: &str| load(&folder.join(name), input);
    read_scene(&path.file_name().unwrap().display().to_string(), &bytes, &mut resolver, &Limits::default())
}

/// Reads a triangle whose texture is the picture.
fn read_picture(path: &Path, input: &Cell<usize>) -> Result<Reading, FormatError> {
    let bytes = load(path, input).unwrap();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let materials = format!("newmtl a\nmap_Kd t.{extension}\n");
    let scene = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
    let mut resolver = |name: &str| Ok(if name == "a.mtl" { materials.clone().into_bytes() } else { bytes.clone() });
    read_scene("a.obj", scene.as_bytes(), &mut resolver, &Limits::default())
}

/// True if the validator's report beside the file counts no error.
fn is_valid(file: &Path) -> bool {
    let report = std::fs::read(file.with_file_name(format!("{}.report.json", file.file_name().unwrap().display())));
    let report: Option<serde_json::Value> = report.ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    report.is_some_and(|r| r["issues"]["numErrors"] == json!(0))
}

/// Files below `root` with one of `extensions`, or all, in a fixed order.
fn files_below(root: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let (mut folders, mut files) = (vec![root.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
            if path.is_dir() {
                folders.push(path);
            } else if extensions.is_empty() || extensions.contains(&extension.as_str()) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}
