//! Lights without area in glTF: places, colours, cones, profiles; what cannot be used is named.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DVec3;
use serde_json::{Value, json};
use twinray_format::{Limits, Reading, read_scene, write_glb};
use twinray_scene::{LightKind, Rgb, Scene};

use crate::real::{read_file, shared_scenes};
use crate::support::{Doc, assert_warns};

const IES: &str = "IESNA91\nTILT=NONE\n1 100 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n50 10\n";

/// A square with nodes beside it that carry these lights.
fn doc(lights: &Value, nodes: &[Value]) -> Doc {
    let mut doc = Doc::square();
    doc.json["extensionsUsed"] = json!(["KHR_lights_punctual", "EXT_lights_ies"]);
    doc.json["extensions"] = json!({
        "KHR_lights_punctual": { "lights": lights },
        "EXT_lights_ies": { "lights": [{ "uri": "lamp.ies", "name": "downlight" }, { "uri": "none.ies" }] },
    });
    doc.json["nodes"].as_array_mut().unwrap().extend(nodes.iter().cloned());
    doc.json["scenes"][0]["nodes"] = (0..=nodes.len()).collect::<Vec<_>>().into();
    doc
}

fn read(doc: &mut Doc) -> Reading {
    doc.json["buffers"][0]["uri"] = json!("a.bin");
    let binary = doc.binary.clone();
    let mut resolver = |path: &str| match path {
        "a.bin" => Ok(binary.clone()),
        "lamp.ies" => Ok(IES.as_bytes().to_vec()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    };
    read_scene("a.gltf", doc.json.to_string().as_bytes(), &mut resolver, &Limits::default()).unwrap()
}

fn node(light: usize) -> Value {
    json!({ "extensions": { "KHR_lights_punctual": { "light": light } } })
}

#[test]
fn lights_stand_where_their_nodes_are() {
    let lights = json!([
        { "name": "bulb", "type": "point", "color": [1, 0.5, 0.25], "intensity": 80 },
        { "type": "spot", "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.6 }, "intensity": 10, "range": 5 },
        { "type": "directional", "intensity": 3 },
        { "type": "spot", "spot": {} },
    ]);
    let mut moved = node(0);
    moved["translation"] = json!([1, 2, 3]);
    moved["scale"] = json!([2, 2, 2]);
    let mut turned = node(2);
    // A quarter turn about X: −Z becomes −Y.
    turned["rotation"] = json!([-0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()]);
    turned["name"] = json!("sun");
    let reading = read(&mut doc(&lights, &[moved, node(1), turned, node(3)]));
    let [bulb, spot, sun, default] = &reading.scene.lights[..] else { panic!("{:?}", reading.scene.lights) };
    assert_eq!((bulb.name.as_str(), bulb.kind, bulb.intensity), ("bulb", LightKind::Point, Rgb::new(80.0, 40.0, 20.0)));
    assert_eq!(bulb.transform.translation, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!((spot.kind, spot.intensity), (LightKind::Spot { inner: 0.2, outer: 0.6 }, Rgb::grey(10.0)));
    assert_warns(&reading, &["lights[1]", "range is ignored"]);
    assert_eq!((sun.name.as_str(), sun.kind, sun.intensity), ("sun", LightKind::Directional, Rgb::grey(3.0)));
    assert!((sun.transform.matrix3 * DVec3::NEG_Z - DVec3::NEG_Y).length() < 1e-12);
    assert_eq!((default.kind, default.intensity), (LightKind::Spot { inner: 0.0, outer: FRAC_PI_4 }, Rgb::WHITE));
    assert_eq!(reading.scene.validate(), []);
}

#[test]
fn profiles_are_read_and_scaled() {
    let link = |light: usize| json!({ "extensions": { "EXT_lights_ies": { "light": light, "multiplier": 2, "color": [1, 0.5, 0] } } });
    let reading = read(&mut doc(&json!([]), &[link(0), link(0), link(1), link(7)]));
    let lights = &reading.scene.lights;
    assert_eq!((lights.len(), lights[0].name.as_str()), (2, "downlight"));
    assert_eq!(lights[0].intensity, Rgb::new(2.0, 1.0, 0.0));
    let [a, b] = [0, 1].map(|k| lights[k].profile.as_ref().unwrap());
    assert!(std::sync::Arc::ptr_eq(a, b) && a.candela == [50.0, 10.0]);
    assert_warns(&reading, &["lights[1]", "none.ies"]);
    assert_warns(&reading, &["nodes[3]", "light is ignored"]);
    assert_warns(&reading, &["nodes[4]", "light is ignored", "index below 2"]);
}

#[test]
fn lights_that_cannot_be_used_are_named() {
    let lights = json!([
        { "type": "area" },
        { "type": "point", "intensity": -1 },
        { "type": "spot", "spot": { "innerConeAngle": 2, "outerConeAngle": 1 } },
        { "type": "point", "color": [1, 2] },
        { "type": "spot" },
    ]);
    let reading = read(&mut doc(&lights, &[node(0), node(1), node(2), node(3), node(4), node(9)]));
    assert_eq!(reading.scene.lights.len(), 1);
    for (place, words) in [
        ("nodes[1]", "spot"),
        ("nodes[2]", "expected 0 to"),
        ("lights[2]", "0 ≤ inner < outer"),
        ("nodes[4]", "an array of 3 numbers"),
        ("nodes[5]", "\"spot\""),
        ("nodes[6]", "index below 5"),
    ] {
        assert_warns(&reading, &[place, words]);
    }
    assert_eq!(reading.scene.validate(), []);
}

fn all_kinds() -> Scene {
    let lights = json!([
        { "name": "bulb", "type": "point", "color": [1, 0.5, 0.25], "intensity": 800.5 },
        { "name": "spot", "type": "spot", "spot": { "innerConeAngle": 0.3, "outerConeAngle": FRAC_PI_2 } },
        { "name": "sun", "type": "directional", "intensity": 1e5 },
    ]);
    let mut turned = node(1);
    turned["rotation"] = json!([0.6, 0, 0, 0.8]);
    turned["translation"] = json!([0.1, 0.2, 0.3]);
    let measured = json!({ "name": "pendant", "extensions": { "EXT_lights_ies": { "light": 0, "multiplier": 3 } } });
    read(&mut doc(&lights, &[node(0), turned, node(2), measured])).scene
}

#[test]
fn what_is_written_is_read_again() {
    let scene = all_kinds();
    let bytes = write_glb(&scene);
    assert_eq!(bytes, write_glb(&scene));
    let again =
        read_scene("a.glb", &bytes, &mut |_| Err(std::io::ErrorKind::NotFound.into()), &Limits::default()).unwrap();
    assert_eq!(again.warnings, []);
    assert_eq!(again.scene.lights.len(), 4);
    for (a, b) in again.scene.lights.iter().zip(&scene.lights) {
        assert_eq!((&a.name, a.kind), (&b.name, b.kind));
        assert!((a.intensity - b.intensity).map(f64::abs).max_channel() <= 1e-12 * b.intensity.max_channel(), "{a:?}");
        assert!(a.transform.abs_diff_eq(b.transform, 1e-15));
        let parts = |l: &twinray_scene::PunctualLight| {
            l.profile.as_ref().map(|p| (p.vertical.clone(), p.horizontal.clone(), p.candela.clone()))
        };
        assert_eq!(parts(a), parts(b));
    }
}

#[test]
fn the_lights_of_a_sample_scene() {
    let Some(root) = shared_scenes() else { return };
    let reading = read_file(&root.join("khronos/Lights.glb")).unwrap();
    let kinds: Vec<_> = reading.scene.lights.iter().map(|l| (l.name.as_str(), l.intensity.max_channel())).collect();
    println!("{kinds:?} {:?}", reading.warnings);
    assert_eq!(kinds.len(), 4);
    let sun = reading.scene.lights.iter().find(|l| l.kind == LightKind::Directional).unwrap();
    assert!((sun.intensity.b - 1.0).abs() < 1e-6 && sun.intensity.r == 0.0);
}
