//! `twinray check`: exit codes, reports, pictures.

use crate::support::{FLOOR, LAMP_MTL, Place, png};

/// A floor of a millimetre.
const SPECK: &str = "v -.001 0 -.001\nv -.001 0 .001\nv .001 0 .001\nv .001 0 -.001\nf 1 2 3 4\n";

#[test]
fn sound_scenes_end_with_0() {
    let place = Place::new();
    let run = place.done(&["check", "cornell"]);
    assert!(run.stdout.contains("cornell: 0 errors, 0 warnings"), "{}", run.stdout);
    assert_eq!(place.done(&["check", "doorway", "--quiet"]).stdout, "");
}

#[test]
fn findings_end_with_1_unless_allowed() {
    let place = Place::new();
    place.write("speck.obj", SPECK);
    let run = place.run(&["check", "speck.obj"]);
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(run.stdout.contains("warning units: "), "{}", run.stdout);
    place.done(&["check", "speck.obj", "--allow", "units,bright-albedo"]);
    // Of a thousandth of a kilometre there is nothing to say.
    place.write("floor.obj", FLOOR);
    place.done(&["check", "floor.obj"]);
}

#[test]
fn reports_are_json() {
    let place = Place::new();
    place.write("speck.obj", SPECK);
    let run = place.run(&["check", "speck.obj", "--json", "--density", "100"]);
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    let report = run.json();
    let of = |kind: &str| report["findings"].as_array().unwrap().iter().find(|f| f["kind"] == kind).cloned();
    let units = of("units").expect("units");
    assert_eq!((&units["severity"], &units["element"]), (&"warning".into(), &"scene".into()));
    assert!(units["worst"]["value"].as_f64().unwrap() < 0.01 && units["advice"].is_string(), "{units}");
    assert!(of("texel-density").is_some() && report["warnings"] == 1, "{report}");
}

#[test]
fn pictures_are_coloured() {
    let place = Place::new();
    let white = LAMP_MTL.replace("Kd 0.5 0.5 0.5", "Kd 0.95 0.95 0.95");
    place.write("lamp.mtl", white);
    place.write("room.obj", crate::support::SHINING_FLOOR);
    let args = ["check", "room.obj", "--two-sided", "--size", "64x48", "--eye", "0,3,3", "--target", "0,0,0"];
    let run = place.run(&[&args[..], &["--picture", "a.png", "--show", "albedo"]].concat());
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(run.stdout.contains("vermilion  bright-albedo"), "{}", run.stdout);
    let (width, height, rgb) = png(&place.read("a.png"));
    assert_eq!((width, height), (64, 48));
    assert!(rgb.chunks(3).any(|p| p[0] > p[2] + 50) && rgb.chunks(3).any(|p| p[0] == p[2]));
    place.run(&[&args[..], &["--picture", "b.png", "--show", "density"]].concat());
    assert!(png(&place.read("b.png")).2.chunks(3).all(|p| p[0] == p[1]), "without coordinates all is grey");
}

#[test]
fn bad_input_ends_with_2() {
    let place = Place::new();
    for (args, word) in [
        (&["check", "nowhere"][..], "no such file"),
        (&["check", "cornell", "--allow", "dust"], "uv2-overlap"),
        (&["check", "cornell", "--picture", "a.jpg"], ".png"),
        (&["check", "cornell", "--show", "leak"], "--picture"),
        (&["check", "cornell", "--density", "0"], "positive"),
    ] {
        let run = place.run(args);
        assert_eq!(run.code, Some(2), "{args:?}: {}", run.stderr);
        assert!(run.stderr.contains(word), "{args:?}: {}", run.stderr);
    }
    assert_eq!(place.files(), [""; 0]);
}
