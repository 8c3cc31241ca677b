//! Bad input: exit code 2, a message that names what is at fault and what was expected, and no file left behind.

use crate::support::{FLOOR, Place, SMALL};

/// Runs the command with bad input; the message must contain all of `words`.
fn refused(place: &Place, args: &[&str], words: &[&str]) {
    let before = place.files();
    let run = place.run(args);
    assert_eq!(run.code, Some(2), "{args:?}: {}", run.stderr);
    // What is to be expected may have been said already: some faults only show once a scene is loaded.
    let said: Vec<&str> = run.stderr.lines().filter(|line| !line.contains(": expecting ")).collect();
    assert!(said.first().is_some_and(|line| line.starts_with("error: ")), "{args:?}: {}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "{args:?}: no \"{word}\" in: {}", run.stderr);
    }
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    assert_eq!(run.stdout, "", "{args:?}");
    assert_eq!(place.files(), before, "{args:?}");
}

#[test]
fn scenes_that_do_not_exist() {
    let place = Place::new();
    for command in ["render", "info"] {
        refused(&place, &[command, "nowhere"], &["nowhere", "no such file", "cornell"]);
        refused(&place, &[command, "nowhere.glb"], &["nowhere.glb", "no such file"]);
    }
    refused(&place, &["scene", "nowhere", "-o", "x.glb"], &["nowhere", "no such file"]);
}

#[test]
fn files_that_cannot_be_read() {
    let place = Place::new();
    std::fs::create_dir(place.path("folder.glb")).unwrap();
    refused(&place, &["render", "folder.glb"], &["folder.glb", "cannot be read"]);
    place.write("notes.txt", "hello");
    refused(&place, &["render", "notes.txt"], &["notes.txt", ".txt", ".glb, .gltf and .obj"]);
}

#[test]
fn files_that_are_malformed() {
    let place = Place::new();
    place.write("cut.glb", b"glTF\x02\0\0\0\xff\0\0\0");
    refused(&place, &["render", "cut.glb"], &["cut.glb", "announces", "expected"]);
    place.write("text.gltf", "{ \"asset\": ");
    refused(&place, &["info", "text.gltf"], &["text.gltf", "JSON", "expected"]);
    place.write("beyond.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    refused(&place, &["render", "beyond.obj"], &["beyond.obj", "line 4", "vertex 9", "expected"]);
    place.write("words.obj", "v a b c\n");
    refused(&place, &["scene", "words.obj", "-o", "x.glb"], &["words.obj", "line 1", "expected 3 numbers"]);
    place.write("empty.obj", "");
    refused(&place, &["info", "empty.obj"], &["empty.obj", "without usable triangles"]);
}

#[test]
fn options_that_make_no_sense() {
    let place = Place::new();
    let render = |option: &[&str], words: &[&str]| {
        refused(&place, &[&["render", "cornell"], option].concat(), words);
    };
    render(&["--size", "big"], &["--size", "big", "WIDTHxHEIGHT"]);
    render(&["--size", "0x10"], &["--size", "0x10", "WIDTHxHEIGHT"]);
    render(&["--eye", "1,2"], &["--eye", "1,2", "three numbers"]);
    render(&["--eye", "1,2,3", "--target", "1,2,3"], &["--eye and --target", "expected two different"]);
    render(&["--fov", "180"], &["--fov", "less than 180"]);
    render(&["--camera", "cellar"], &["--camera cellar", "main"]);
    render(&["--camera", "3"], &["--camera 3", "main"]);
    render(&["--rays", "many"], &["--rays", "many", "expected a count"]);
    render(&["--rays", "1M", "--time", "3"], &["--rays", "--time"]);
    render(&["--rays", "1M", "--error", "2%"], &["--rays", "--error"]);
    render(&["--time", "3", "--error", "2%"], &["--time", "--error"]);
    for share in ["0", "-1%", "100%", "2", "good"] {
        render(&["--error", share], &["--error", share, "2% or 0.02"]);
    }
    render(&["--time", "-3"], &["'-3' for '--time", "expected a positive"]);
    render(&["--time", "0"], &["'0' for '--time", "expected a positive"]);
    render(&["--patch-size", "-1"], &["patch size of -1", "expected a positive"]);
    render(&["--patch-size", "0"], &["patch size of 0", "expected a positive"]);
    render(&["--threads", "0"], &["--threads"]);
    render(&["--samples", "0"], &["--samples"]);
    render(&["--exposure", "bright"], &["--exposure", "expected auto"]);
    render(&["--preset", "fast"], &["--preset", "default", "paper"]);
}

#[test]
fn places_that_cannot_be_written() {
    let place = Place::new();
    refused(
        &place,
        &["render", "cornell", "-o", "missing/picture.png"],
        &["missing/picture.png", "no folder missing", "expected"],
    );
    refused(&place, &["render", "cornell", "-o", "picture.jpg"], &["picture.jpg", "expected", ".png or .exr"]);
    refused(&place, &["render", "cornell", "-o", "picture"], &["picture", ".png or .exr"]);
    std::fs::create_dir(place.path("folder.png")).unwrap();
    refused(&place, &["render", "cornell", "-o", "folder.png"], &["folder.png", "is a folder", "expected"]);
    refused(&place, &["scene", "cornell", "-o", "x.stl"], &["x.stl", "expected", ".glb or .obj"]);
    refused(&place, &["scene", "cornell"], &["expected -o"]);
    refused(&place, &["scene", "cornell", "-o", "missing/x.obj"], &["missing/", "expected"]);
}

#[test]
fn the_paper_preset_under_a_sky() {
    let place = Place::new();
    place.write("floor.obj", FLOOR);
    let args = [&["render", "floor.obj", "--preset", "paper", "--quiet"], &SMALL[..]].concat();
    refused(&place, &args, &["floor.obj", "environment", "default preset"]);
}

/// The estimate comes before the work: what is too much is refused at once, with what to do.
#[test]
fn more_memory_than_allowed() {
    let place = Place::new();
    let too_much = ["solve", "cornell", "--patches", "50M", "--max-memory", "2G"];
    refused(&place, &too_much, &["cornell", "50", "patches", "--max-memory allows 2.00 GB", "--patches "]);
    refused(&place, &["info", "cornell", "--max-memory", "1k"], &["--max-memory allows 1 kB"]);
    refused(&place, &["render", "cornell", "--max-memory", "lots"], &["--max-memory", "8G"]);
    // The reader is bounded as well.
    place.write("floor.obj", FLOOR);
    refused(&place, &["scene", "floor.obj", "-o", "x.glb", "--max-memory", "100"], &["floor.obj"]);
    let run = place.run(&["solve", "cornell", "--patches", "2000", "--rays", "50k", "--max-memory", "1G", "--json"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stderr.contains("cornell: expecting ") && run.stderr.contains("a file of"), "{}", run.stderr);
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["expected"]["patches"], report["patches"]);
    assert_eq!(report["expected"]["rays"], 50_000);
    assert!(report["expected"]["memory"].as_u64().is_some_and(|bytes| bytes < 100_000_000), "{report}");
}

#[cfg(unix)]
#[test]
fn links_out_of_the_scenes_folder() {
    let place = Place::new();
    std::fs::create_dir(place.path("scene")).unwrap();
    place.write("paint.mtl", "newmtl paint\nKd 0.25 0.25 0.25\n");
    std::os::unix::fs::symlink("../paint.mtl", place.path("scene/link.mtl")).unwrap();
    for library in ["link.mtl", "../paint.mtl"] {
        let text = format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n");
        std::fs::write(place.path("scene/a.obj"), text).unwrap();
        let run = place.run(&["scene", "scene/a.obj", "-o", "a.glb"]);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        assert!(run.stderr.contains("--allow-outside"), "{library}: {}", run.stderr);
        let run = place.run(&["scene", "scene/a.obj", "-o", "b.glb", "--allow-outside"]);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        assert!(!run.stderr.contains("paint.mtl") && !run.stderr.contains("link.mtl"), "{library}: {}", run.stderr);
    }
}
