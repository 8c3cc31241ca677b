//! Scenes that lack a camera or light get one, and the user is told.

use crate::support::{FLOOR, LAMP_MTL, Place, ROOM, SHINING_FLOOR, shows_something, warnings};

#[test]
fn an_open_scene_without_light_gets_a_sky() {
    let place = Place::new();
    place.write("floor.obj", FLOOR);
    let run = place.render(&["floor.obj", "--json"]);
    let report = run.json();
    let said = warnings(&report);
    assert!(said.iter().any(|w| w.starts_with("floor.obj: ") && w.contains("uniform sky")), "{said:?}");
    assert!(run.stderr.contains("warning: floor.obj: the scene has no light"), "{}", run.stderr);
    assert!(report["power"]["sky"].as_f64().unwrap() > 0.0 && report["power"]["emitted"] == 0.0);
    assert_eq!(place.done(&["info", "floor.obj", "--json"]).json()["environment"], true);
}

#[test]
fn a_closed_scene_without_light_gets_a_lamp() {
    let place = Place::new();
    place.write("room.obj", ROOM);
    let report = place.report(&["room.obj"]);
    let said = warnings(&report);
    assert!(said.iter().any(|w| w.contains("a small lamp was added at the camera")), "{said:?}");
    assert!(report["power"]["emitted"].as_f64().unwrap() > 0.0 && report["power"]["sky"] == 0.0);
    // Inside a closed room no light escapes: the camera, and with it the lamp, was put inside.
    assert_eq!(report["power"]["escaped"], 0.0);
    shows_something(&place.read("room.png"));
}

#[test]
fn a_scene_without_a_camera_gets_one() {
    let place = Place::new();
    place.write("lamp.mtl", LAMP_MTL);
    place.write("shining.obj", SHINING_FLOOR);
    let report = place.report(&["shining.obj"]);
    assert_eq!(report["camera"], "chosen");
    let said = warnings(&report);
    assert!(said.len() == 1 && said[0].contains("no camera: one was chosen"), "{said:?}");
    shows_something(&place.read("shining.png"));
}

#[test]
fn eye_and_target_are_camera_enough() {
    let place = Place::new();
    place.write("lamp.mtl", LAMP_MTL);
    place.write("shining.obj", SHINING_FLOOR);
    let report = place.report(&["shining.obj", "--eye", "0,0.5,2", "--target", "0,0.3,-1"]);
    assert_eq!(report["camera"], "command line");
    assert!(warnings(&report).is_empty(), "{report}");
    shows_something(&place.read("shining.png"));
    let run = place.run(&["render", "shining.obj", "--eye", "0,0.5,2"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("give both --eye and --target"), "{}", run.stderr);
}

#[test]
fn the_unit_scales_areas_and_power() {
    let place = Place::new();
    place.write("lamp.mtl", LAMP_MTL);
    place.write("shining.obj", SHINING_FLOOR);
    let area = |unit: &str| place.done(&["info", "shining.obj", "--unit", unit, "--json"]).json()["area"].as_f64();
    let (metres, centimetres) = (area("m").unwrap(), area("cm").unwrap());
    assert!((centimetres * 1e4 / metres - 1.0).abs() < 1e-6, "{metres} and {centimetres}");
}
