//! Scenes that other people made, where there are any: they load.

use std::path::{Path, PathBuf};

use crate::support::{Place, workspace};

fn scenes_below(folder: &Path) -> Vec<PathBuf> {
    let (mut folders, mut files) = (vec![folder.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
            let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                // Malformed files have tests of their own.
                if !path.ends_with("bad") {
                    folders.push(path);
                }
            } else if ["glb", "gltf", "obj"].contains(&extension.as_str()) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

#[test]
fn real_scenes_load() {
    let folder = workspace().join("../shared/scenes");
    if !folder.is_dir() {
        println!("skipped: ../shared/scenes is not here");
        return;
    }
    let (place, files) = (Place::new(), scenes_below(&folder));
    for file in &files {
        let name = file.to_string_lossy();
        let run = place.run(&["info", &name, "--patches", "2000", "--json"]);
        println!("{name}: {:?}", run.code);
        assert_eq!(run.code, Some(0), "{name}: {}", run.stderr);
        let report = run.json();
        assert!(report["patches"].as_u64().unwrap() >= report["triangles"].as_u64().unwrap(), "{name}");
        let residual = report["power"]["residual"].as_f64().unwrap();
        assert!(residual.is_finite(), "{name}: {residual}");
    }
    assert!(files.len() > 10, "{files:?}");
}
