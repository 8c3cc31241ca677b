//! Built-in scenes: listed, described, written to files and read again.

use crate::support::{Place, shows_something, warnings};

const NAMES: [&str; 10] = [
    "furnace",
    "plates",
    "cube",
    "cornell",
    "cornell-closed",
    "doorway",
    "hall",
    "hall-diffuse",
    "uneven",
    "uneven-glowing",
];

#[test]
fn the_list_and_the_help_name_them_all() {
    let place = Place::new();
    let list = place.done(&["scene"]).stdout;
    let listed: Vec<&str> = list.lines().filter_map(|l| l.split_whitespace().next()).collect();
    assert_eq!(listed, NAMES);
    let help = place.done(&["--help"]).stdout;
    assert!(NAMES.iter().all(|name| help.contains(name)), "{help}");
    assert!(place.files().is_empty());
}

#[test]
fn info_knows_each_of_them_and_has_nothing_to_complain_of() {
    let place = Place::new();
    for name in NAMES {
        let run = place.done(&["info", name, "--patches", "5000", "--json"]);
        assert_eq!(run.stderr, "", "{name}");
        let report = run.json();
        assert_eq!(report["scene"], name);
        assert!(warnings(&report).is_empty(), "{name}: {report}");
        assert!(report["triangles"].as_u64().unwrap() > 0);
        assert!(report["patches"].as_u64().unwrap() > 0);
        // 200 000 rays leave some tenths of a percent.
        assert!(report["power"]["residual"].as_f64().unwrap().abs() < 0.01, "{name}: {}", report["power"]);
        let closed = !["plates", "cornell"].contains(&name);
        assert_eq!(report["escaping_rays"].as_f64().unwrap() == 0.0, closed, "{name}");
        let text = place.done(&["info", name, "--patches", "5000"]).stdout;
        for word in ["triangles", "patches", "emission", "closed", "memory", "cameras", "power"] {
            assert!(text.contains(word), "{name}: no {word} in {text}");
        }
    }
    assert!(place.files().is_empty());
}

#[test]
fn pictures_of_them_come_without_a_warning() {
    let place = Place::new();
    for name in NAMES {
        let run = place.render(&[name, "-o", "picture.png", "--json"]);
        assert!(warnings(&run.json()).is_empty(), "{name}: {}", run.stdout);
        assert!(!run.stderr.contains("warning"), "{name}: {}", run.stderr);
        // Furnaces are of one colour.
        if !["furnace", "uneven-glowing"].contains(&name) {
            shows_something(&place.read("picture.png"));
        }
    }
}

#[test]
fn the_hall_suggests_as_many_patches_as_the_paper_had() {
    let report = Place::new().done(&["info", "hall", "--json"]).json();
    let patches = report["patches"].as_f64().unwrap();
    assert!((patches / 78_443.0 - 1.0).abs() < 0.01, "{patches}");
}

#[test]
fn a_glb_is_the_scene_again() {
    let place = Place::new();
    place.done(&["scene", "cornell", "-o", "x.glb"]);
    assert_eq!(place.files(), ["x.glb"]);
    let direct = place.report(&["cornell", "-o", "a.png"]);
    let read = place.report(&["x.glb", "-o", "b.png"]);
    shows_something(&place.read("b.png"));
    assert!(warnings(&read).is_empty(), "{read}");
    assert_eq!(read["camera"], direct["camera"]);
    for key in ["triangles", "patches", "rays"] {
        assert_eq!(read[key], direct[key], "{key}");
    }
    // Both are solved with the same random numbers, and material values are stored as written: the rest is rounding.
    for key in ["emitted", "absorbed", "escaped", "lost"] {
        let [a, b] = [&direct, &read].map(|report| report["power"][key].as_f64().unwrap());
        assert!((a - b).abs() < 0.005 * direct["power"]["emitted"].as_f64().unwrap(), "{key}: {a} and {b}");
    }
}

#[test]
fn an_obj_with_its_materials_is_the_scene_again_but_for_sides_and_camera() {
    let place = Place::new();
    place.done(&["scene", "cornell", "-o", "x.obj"]);
    assert_eq!(place.files(), ["x.mtl", "x.obj"]);
    let report = place.report(&["x.obj", "-o", "b.png"]);
    shows_something(&place.read("b.png"));
    let emitted = report["power"]["emitted"].as_f64().unwrap();
    assert!((emitted - 0.518_14).abs() < 1e-4, "{emitted}");
    assert!(warnings(&report).iter().any(|w| w.contains("no camera")), "{report}");
}

#[test]
fn files_are_converted() {
    let place = Place::new();
    place.done(&["scene", "hall", "-o", "hall.obj"]);
    place.done(&["scene", "hall.obj", "-o", "hall.glb"]);
    let [built_in, converted] = ["hall", "hall.glb"]
        .map(|name| place.done(&["info", name, "--patches", "20000", "--json"]).json()["emitted_power_rgb"].clone());
    for (a, b) in built_in.as_array().unwrap().iter().zip(converted.as_array().unwrap()) {
        let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 1e-4, "{a} and {b}");
    }
}
