//! Nodes: transforms, sharing, scenes, cameras, lights.

use glam::{DVec3, dvec3};
use serde_json::json;
use twinray_scene::Projection;

use crate::support::{Doc, assert_says, assert_warns, normal, world_triangles};

#[test]
fn transforms_compose_in_double_precision() {
    let mut doc = Doc::square();
    // Two places that f32 could not tell apart at 1e7: 0.001 apart.
    doc.json["nodes"] = json!([
        { "translation": [1e7, 0, 0], "children": [1] },
        { "rotation": [0, 0, (0.5f64).sqrt(), (0.5f64).sqrt()], "scale": [2, 3, 1], "translation": [0.001, 0, 0], "mesh": 0 },
    ]);
    let scene = doc.scene();
    let corner = scene.instances[0].transform.transform_point3(dvec3(1.0, 0.0, 0.0));
    // Scaled by 2 along x, turned by 90° to +y, moved.
    assert!((corner - dvec3(1e7 + 0.001, 2.0, 0.0)).length() < 1e-8, "{corner}");
}

#[test]
fn matrices_are_column_major() {
    let mut doc = Doc::square();
    doc.json["nodes"][0]["matrix"] = json!([0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]);
    let transform = doc.scene().instances[0].transform;
    assert_eq!(transform.transform_point3(dvec3(1.0, 1.0, 0.0)), dvec3(5.0 - 3.0, 6.0 + 2.0, 7.0));
}

#[test]
fn negative_scale_mirrors_and_the_front_goes_along() {
    let mut doc = Doc::square();
    doc.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let scene = doc.scene();
    assert!(scene.instances[0].transform.matrix3.determinant() < 0.0);
    // Mirrored left to right, the square still shows its front to +Z.
    assert!(world_triangles(&scene).iter().all(|t| normal(*t).z > 0.0));
}

#[test]
fn a_flattening_scale_leaves_what_has_area() {
    // The square upright and lying: squashed along z the lying one vanishes.
    let mut doc = Doc::square();
    let positions = doc.floats(&[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
    doc.primitive(json!({ "attributes": { "POSITION": positions } }));
    doc.json["nodes"][0]["scale"] = json!([1, 1, 0]);
    let scene = doc.scene();
    let triangles = world_triangles(&scene);
    assert_eq!(triangles.len(), 2);
    assert!(triangles.iter().all(|t| (normal(*t).length() - 1.0).abs() < 1e-12));
}

#[test]
fn meshes_are_shared_and_placed_many_times() {
    let mut doc = Doc::square();
    doc.primitive(json!({ "attributes": { "POSITION": 0 }, "indices": 2 }));
    doc.json["nodes"] = json!([{ "name": "a", "mesh": 0 }, { "mesh": 0, "translation": [5, 0, 0] }]);
    doc.json["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = doc.scene();
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.materials.len()), (2, 4, 2));
    let names: Vec<_> = scene.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["a", "a", "mesh", "mesh"]);
    assert_eq!((scene.meshes[0].name.as_str(), scene.meshes[1].name.as_str()), ("mesh#0", "mesh#1"));
}

#[test]
fn the_default_scene_is_read_and_the_others_are_named() {
    let mut doc = Doc::square();
    doc.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "translation": [5, 0, 0] }]);
    doc.json["scenes"] = json!([{ "name": "first", "nodes": [0] }, { "name": "second", "nodes": [1] }]);
    doc.json["scene"] = json!(1);
    let reading = doc.read().unwrap();
    assert_eq!(reading.scene.instances[0].transform.translation.x, 5.0);
    assert_warns(&reading, &["scenes[1] \"second\"", "ignored: scenes[0] \"first\""]);
    doc.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(doc.scene().instances[0].transform.translation.x, 0.0);
    doc.json.as_object_mut().unwrap().remove("scenes");
    let reading = doc.read().unwrap();
    assert_eq!(reading.scene.instances.len(), 2);
    assert_warns(&reading, &["no scene"]);
}

#[test]
fn cycles_shared_nodes_and_towers_are_errors() {
    let mut doc = Doc::square();
    doc.json["nodes"] = json!([{ "children": [1] }, { "children": [0] }]);
    assert_says(&doc.error(), &["test.glb: nodes[0]", "its own descendant"]);
    doc.json["nodes"] = json!([{ "children": [1, 2] }, { "children": [3] }, { "children": [3] }, { "mesh": 0 }]);
    assert_says(&doc.error(), &["nodes[3]", "listed twice"]);
    let depth = 600;
    let mut nodes: Vec<_> = (1..depth).map(|i| json!({ "children": [i] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    doc.json["nodes"] = json!(nodes);
    assert_says(&doc.error(), &["nodes[512]", "513 levels", "max_depth"]);
}

#[test]
fn cameras_look_along_minus_z_of_their_node() {
    let mut doc = Doc::square();
    doc.json["cameras"] = json!([
        { "type": "perspective", "name": "lens", "perspective": { "yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1 } },
        { "type": "orthographic", "name": "plan", "orthographic": { "xmag": 4, "ymag": 2, "zfar": 9, "znear": 0 } },
    ]);
    let s = (0.5f64).sqrt();
    doc.json["nodes"] = json!([
        { "name": "eye", "mesh": 0, "camera": 0, "translation": [1, 2, 3], "rotation": [0, s, 0, s], "scale": [2, 2, 2] },
        { "camera": 1, "rotation": [-s, 0, 0, s] },
    ]);
    doc.json["scenes"][0]["nodes"] = json!([0, 1]);
    let cameras = doc.scene().cameras;
    assert_eq!(cameras.len(), 2);
    // Turned by +90° about Y, −Z becomes −X.
    assert_eq!((cameras[0].name.as_str(), cameras[0].eye), ("eye", dvec3(1.0, 2.0, 3.0)));
    assert!((cameras[0].forward - DVec3::NEG_X).length() < 1e-12, "{}", cameras[0].forward);
    assert!((cameras[0].up - DVec3::Y).length() < 1e-12);
    assert_eq!((cameras[0].projection, cameras[0].aspect), (Projection::Perspective { vertical_fov: 0.7 }, Some(1.5)));
    // Turned by −90° about X it looks down; the node has no name, the camera has.
    assert_eq!(cameras[1].name, "plan");
    assert!((cameras[1].forward - DVec3::NEG_Y).length() < 1e-12);
    assert_eq!((cameras[1].projection, cameras[1].aspect), (Projection::Orthographic { half_height: 2.0 }, Some(2.0)));
}

#[test]
fn a_camera_that_cannot_be_used_is_named() {
    let mut doc = Doc::square();
    doc.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": -1 } }]);
    doc.json["nodes"][0]["camera"] = json!(0);
    let reading = doc.read().unwrap();
    assert!(reading.scene.cameras.is_empty());
    assert_warns(&reading, &["nodes[0] \"node\"", "camera is ignored", "-1"]);
}

#[test]
fn what_moves_is_named() {
    let mut doc = Doc::square();
    doc.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    doc.json["nodes"][0]["skin"] = json!(0);
    doc.json["skins"] = json!([{ "joints": [0] }]);
    doc.json["animations"] = json!([{ "name": "walk" }]);
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["extension KHR_materials_variants is ignored"]);
    assert_warns(&reading, &["nodes[0] \"node\"", "skin"]);
    assert_warns(&reading, &["animations", "\"walk\""]);
}
