//! Files made to break readers: 356 malformed or odd scenes and a hundred broken pictures, none from this project.

use std::panic::catch_unwind;
use std::time::Instant;

use serde_json::json;
use twinray_format::FormatError;

use crate::real::{files_below, read_file, shared_scenes};
use crate::support::Doc;

#[test]
fn bad_scenes_are_read_or_refused_in_time() {
    let Some(root) = shared_scenes() else { return };
    let files = files_below(&root.join("bad"), &["gltf", "glb", "obj"]);
    assert!(files.len() > 300, "{} files", files.len());
    let mut faults = Vec::new();
    for file in &files {
        let start = Instant::now();
        let Ok(result) = catch_unwind(|| read_file(file)) else {
            faults.push(format!("{}: panic", file.display()));
            continue;
        };
        if start.elapsed().as_secs() >= 10 {
            faults.push(format!("{}: took {:?}", file.display(), start.elapsed()));
        }
        // The validator's word, where there is one: a file without errors must not be called invalid.
        let report = std::fs::read(file.with_file_name(format!("{}.report.json", file.file_name().unwrap().display())));
        let report: Option<serde_json::Value> = report.ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let valid = report.is_some_and(|r| r["issues"]["numErrors"] == json!(0));
        match result {
            Err(error @ (FormatError::Invalid { .. } | FormatError::Unreadable { .. })) if valid => {
                faults.push(format!("refused though valid: {error}"));
            }
            _ => {}
        }
    }
    assert!(faults.is_empty(), "{} of {} files:\n{}", faults.len(), files.len(), faults.join("\n"));
}

#[test]
fn bad_pictures_are_used_or_left_out_in_time() {
    let Some(root) = shared_scenes() else { return };
    let files = files_below(&root.join("bad/images"), &[]);
    assert!(files.len() > 50, "{} files", files.len());
    for file in &files {
        let mut doc = Doc::square();
        doc.texture(&std::fs::read(file).unwrap());
        doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
        let start = Instant::now();
        let reading = doc.read().unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        assert!(start.elapsed().as_secs() < 10, "{}: {:?}", file.display(), start.elapsed());
        assert!(!reading.scene.images.is_empty() || !reading.warnings.is_empty(), "{}", file.display());
    }
}
