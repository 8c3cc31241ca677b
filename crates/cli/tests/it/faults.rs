//! Bad input: exit code 2, a message that names what is at fault and what was expected, and no file left behind.

use crate::support::{FLOOR, Place, SMALL};

/// Runs the command with bad input; the message must contain all of `words`.
fn refused(place: &Place, args: &[&str], words: &[&str]) {
    let before = place.files();
    let run = place.run(args);
    assert_eq!(run.code, Some(2), "{args:?}: {}", run.stderr);
    assert!(run.stderr.starts_with("error: "), "{args:?}: {}", run.stderr);
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
