//! Animations: cameras move by the tracks of their nodes, and nothing else does.

use glam::{DQuat, DVec3, dvec3};
use serde_json::{Value, json};
use twinray_scene::{Camera, Scene};

use crate::support::{Doc, assert_warns};

/// A square, and a camera on an arm of 2 m on a mast at (5, 0, 0).
fn mast() -> Doc {
    let mut doc = Doc::square();
    doc.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.7 } }]);
    doc.json["nodes"] = json!([
        { "mesh": 0 },
        { "name": "mast", "children": [2], "translation": [5, 0, 0], "scale": [2, 2, 2] },
        { "name": "arm", "children": [3], "translation": [0, 0, 1] },
        { "name": "eye", "camera": 0 },
    ]);
    doc.json["scenes"][0]["nodes"] = json!([0, 1]);
    doc
}

/// Adds an animation of one channel.
fn animate(doc: &mut Doc, name: &str, node: usize, path: &str, input: usize, output: usize, interpolation: &str) {
    let animation = json!({
        "name": name, "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
        "samplers": [{ "input": input, "output": output, "interpolation": interpolation }],
    });
    match &mut doc.json["animations"] {
        Value::Array(list) => list.push(animation),
        none => *none = json!([animation]),
    }
}

fn pose(scene: &Scene, animation: usize, time: f64) -> Camera {
    let animation = &scene.animations[animation];
    animation.at(&scene.cameras[animation.camera], time)
}

#[track_caller]
fn stands(camera: &Camera, eye: DVec3, forward: DVec3) {
    let off = (camera.eye - eye).length().max((camera.forward - forward).length());
    assert!(off < 1e-6, "at {} towards {}, expected {eye} towards {forward}", camera.eye, camera.forward);
}

/// A mast that turns by 120° in two seconds carries its camera along a circle: analytic at every time, and beyond its ends.
#[test]
fn a_mast_turns_its_camera() {
    let mut doc = mast();
    let turn = |degrees: f32| glam::Quat::from_rotation_y(degrees.to_radians()).to_array();
    let (times, turns) = (doc.floats(&[[0.5], [2.5]]), doc.floats(&[turn(0.0), turn(120.0)]));
    animate(&mut doc, "round", 1, "rotation", times, turns, "LINEAR");
    let reading = doc.read().unwrap();
    assert!(reading.warnings.is_empty(), "{:?}", reading.warnings);
    let scene = reading.scene;
    assert_eq!((scene.animations.len(), scene.animations[0].name.as_str()), (1, "round"));
    assert_eq!(scene.animations[0].span(), [0.5, 2.5]);
    for time in [0.0, 0.5, 0.9, 1.5, 2.2, 2.5, 7.0] {
        let angle = 60f64.to_radians() * (f64::clamp(time, 0.5, 2.5) - 0.5);
        let out = dvec3(angle.sin(), 0.0, angle.cos());
        stands(&pose(&scene, 0, time), dvec3(5.0, 0.0, 0.0) + 2.0 * out, -out);
    }
    // At rest it is where the nodes put it.
    stands(&scene.cameras[0], dvec3(5.0, 0.0, 2.0), DVec3::NEG_Z);
}

/// Steps of the arm, a cubic of the eye, and turns stored as normalised bytes.
#[test]
fn every_interpolation_and_storage() {
    let mut doc = mast();
    let times = doc.floats(&[[0.0], [1.0]]);
    let steps = doc.floats(&[[0.0, 0.0, 1.0], [0.0, 3.0, 1.0]]);
    animate(&mut doc, "step", 2, "translation", times, steps, "STEP");
    // t² from 0 to 1: slopes 0 and 2.
    let (zero, x) = ([0.0; 3], |x: f32| [x, 0.0, 0.0]);
    let cubic = doc.floats(&[zero, zero, zero, x(2.0), x(1.0), zero]);
    animate(&mut doc, "cubic", 3, "translation", times, cubic, "CUBICSPLINE");
    // 0 and 180° about Y.
    let turns = doc.bytes(&[0, 0, 0, 127, 0, 127, 0, 0], "VEC4", 4, 5120);
    doc.json["accessors"][turns]["normalized"] = json!(true);
    animate(&mut doc, "bytes", 3, "rotation", times, turns, "LINEAR");
    let scene = doc.scene();
    let at = |animation, time| pose(&scene, animation, time);
    stands(&at(0, 0.99), dvec3(5.0, 0.0, 2.0), DVec3::NEG_Z);
    stands(&at(0, 1.0), dvec3(5.0, 6.0, 2.0), DVec3::NEG_Z);
    for time in [0.0, 0.3, 0.5, 1.0] {
        stands(&at(1, time), dvec3(5.0 + 2.0 * time * time, 0.0, 2.0), DVec3::NEG_Z);
        let turned = DQuat::from_rotation_y(std::f64::consts::PI * time) * DVec3::NEG_Z;
        stands(&at(2, time), dvec3(5.0, 0.0, 2.0), turned);
    }
}

#[test]
fn what_does_not_move_is_named() {
    let mut doc = mast();
    let times = doc.floats(&[[0.0], [1.0]]);
    let places = doc.floats(&[[1.0, 1.0, 1.0], [2.0, 3.0, 1.0]]);
    animate(&mut doc, "door", 0, "translation", times, places, "LINEAR");
    animate(&mut doc, "zoom", 1, "scale", times, places, "LINEAR");
    let reading = doc.read().unwrap();
    assert!(reading.scene.animations.is_empty());
    assert_warns(&reading, &["animations", "only cameras move", "\"door\"", "\"zoom\""]);
    assert_warns(&reading, &["animations[1] \"zoom\".channels[0].target.path", "scale"]);
}

/// Light needs no animation: a fault in one costs that one.
#[test]
fn faults_cost_the_animation_alone() {
    type Spoil = fn(&mut Doc);
    let cases: [(&str, Spoil); 5] = [
        ("times that do not increase", |doc| {
            doc.json["animations"][0]["samplers"][0]["input"] = json!(doc.floats(&[[1.0], [1.0]]));
        }),
        ("2 values for 3 keys", |doc| {
            doc.json["animations"][0]["samplers"][0]["input"] = json!(doc.floats(&[[1.0], [2.0], [3.0]]));
        }),
        ("CUBIC", |doc| doc.json["animations"][0]["samplers"][0]["interpolation"] = json!("CUBIC")),
        ("a number that is none", |doc| {
            doc.json["animations"][0]["samplers"][0]["output"] = json!(doc.floats(&[[f32::NAN; 3], [0.0; 3]]));
        }),
        ("an index below", |doc| doc.json["animations"][0]["channels"][0]["sampler"] = json!(7)),
    ];
    for (says, spoil) in cases {
        let mut doc = mast();
        let (times, places) = (doc.floats(&[[0.0], [1.0]]), doc.floats(&[[1.0, 1.0, 1.0], [2.0, 3.0, 1.0]]));
        animate(&mut doc, "bad", 3, "translation", times, places, "LINEAR");
        animate(&mut doc, "good", 3, "translation", times, places, "LINEAR");
        spoil(&mut doc);
        let reading = doc.read().unwrap();
        assert_warns(&reading, &["animations[0] \"bad\"", "the animation is ignored", says]);
        assert_eq!(reading.scene.animations.len(), 1, "{says}");
        assert_eq!(reading.scene.animations[0].name, "good");
    }
}

/// An accessor without data claims four billion keys.
#[test]
fn keys_without_data_cannot_claim_gigabytes() {
    let mut doc = mast();
    let accessors = doc.json["accessors"].as_array_mut().unwrap();
    accessors.push(json!({ "componentType": 5126, "count": 4_000_000_000u32, "type": "SCALAR" }));
    accessors.push(json!({ "componentType": 5126, "count": 4_000_000_000u32, "type": "VEC3" }));
    let at = accessors.len() - 2;
    animate(&mut doc, "endless", 3, "translation", at, at + 1, "LINEAR");
    assert!(doc.error().contains("extra_memory"), "{}", doc.error());
}
