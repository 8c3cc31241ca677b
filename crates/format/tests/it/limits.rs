//! Small files that ask for much are refused before anything is allocated.

use std::time::Instant;

use serde_json::json;
use twinray_format::{FormatError, Limits, read_scene};

use crate::support::{Doc, assert_warns, colour, png, read};

#[track_caller]
fn check(name: &str, bytes: &[u8], limit: &str) {
    let start = Instant::now();
    match read(name, bytes) {
        Err(FormatError::OverLimit { limit: found, .. }) => assert_eq!(found, limit),
        other => panic!("expected {limit}, got {:?}", other.map(|r| r.scene.instances.len())),
    }
    assert!(start.elapsed().as_secs() < 10);
}

#[test]
fn accessors_without_data_cannot_claim_gigabytes() {
    let mut doc = Doc::new();
    doc.json["accessors"] = json!([{ "componentType": 5126, "count": 4_000_000_000u32, "type": "VEC3" }]);
    doc.primitive(json!({ "attributes": { "POSITION": 0 } }));
    check("a.glb", &doc.glb(), "max_triangles");
    // Few triangles over many vertices that are not there.
    let indices = doc.indices(&[0, 1, 2]);
    doc.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    check("a.glb", &doc.glb(), "extra_memory");
    // Just below the triangle limit: memory decides.
    doc.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    doc.json["accessors"][0]["count"] = json!(59_000_000);
    check("a.glb", &doc.glb(), "extra_memory");
}

#[test]
fn meshes_placed_without_end_are_refused() {
    let mut doc = Doc::square();
    let nodes: Vec<_> = (0..40_000).map(|_| json!({ "mesh": 0 })).collect();
    doc.json["scenes"][0]["nodes"] = json!((0..40_000).collect::<Vec<_>>());
    doc.json["nodes"] = json!(nodes);
    let limits = Limits { max_instances: 30_000, ..Limits::default() };
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let error = read_scene("a.glb", &doc.glb(), &mut none, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_instances", .. }), "{error}");
    let limits = Limits { max_triangles: 70_000, ..Limits::default() };
    let error = read_scene("a.glb", &doc.glb(), &mut none, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_triangles", .. }), "{error}");
    assert!(doc.read().is_ok());
}

#[test]
fn json_that_unpacks_to_much_is_refused() {
    // Three bytes a node, hundreds in memory.
    let text = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(2_000_000));
    check("a.gltf", text.as_bytes(), "extra_memory");
}

#[test]
fn obj_text_that_unpacks_to_much_is_refused() {
    let limits = Limits { extra_memory: 1 << 20, ..Limits::default() };
    let text = format!("v 0 0 0\nf {}\n", "1 ".repeat(1_000_000));
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let error = read_scene("a.obj", text.as_bytes(), &mut none, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "extra_memory", .. }), "{error}");
}

#[test]
fn files_beyond_the_limit_are_refused() {
    let limits = Limits { max_file_bytes: 100, ..Limits::default() };
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let error = read_scene("a.glb", &Doc::square().glb(), &mut none, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_file_bytes", .. }), "{error}");
    let obj = b"mtllib big.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let mut big = |_: &str| Ok(vec![b'#'; 101]);
    let reading = read_scene("a.obj", obj, &mut big, &limits).unwrap();
    assert_warns(&reading, &["mtllib", "max_file_bytes"]);
}

#[test]
fn picture_bombs_are_left_out_and_large_pictures_kept_small() {
    let mut doc = Doc::square();
    // 8192 × 8192 black texels in some 200 kB.
    let bomb = twinray_format::write_png(8192, 8192, &vec![0; 3 << 26], &[]);
    assert!(bomb.len() < 1 << 20);
    doc.texture(&bomb);
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["images[0] \"picture\"", "8192×8192", "max_image_texels"]);
    assert!(colour(&reading.scene.materials[0].surface).texture.is_none());

    let mut doc = Doc::square();
    doc.texture(&png(&[[100, 100, 100]; 64]));
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let limits = Limits { max_texels: 20, ..Limits::default() };
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let reading = read_scene("a.glb", &doc.glb(), &mut none, &limits).unwrap();
    assert_warns(&reading, &["images[0]", "kept at 16×1 instead of 64×1"]);
    assert_eq!(reading.scene.images[0].width, 16);
    assert_eq!(reading.scene.images[0].rgba[..4], [100, 100, 100, 255]);
}

#[test]
fn warnings_do_not_pile_up() {
    let text =
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{}", (0..5000).map(|i| format!("odd{i}\n")).collect::<String>());
    let reading = read("a.obj", text.as_bytes()).unwrap();
    assert!(reading.warnings.len() < 220);
    assert_warns(&reading, &["4800 more warnings"]);
}

#[test]
fn polygons_with_very_many_corners_end() {
    // A star of 30,000 spikes: quadratic ear clipping gives up in time.
    let n = 60_000;
    let mut text = String::new();
    for i in 0..n {
        let (r, a) = (1.0 + f64::from(i % 2), f64::from(i) * std::f64::consts::TAU / f64::from(n));
        text += &format!("v {} {} 0\n", r * a.cos(), r * a.sin());
    }
    text += "f";
    (1..=n).for_each(|i| text += &format!(" {i}"));
    let start = Instant::now();
    let reading = read("a.obj", text.as_bytes()).unwrap();
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
    assert_warns(&reading, &["too many corners"]);
}
