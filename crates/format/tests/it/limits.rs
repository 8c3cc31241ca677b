//! Small files that ask for much are refused before anything is allocated.

use std::time::Instant;

use serde_json::json;
use twinray_format::{FormatError, Limits, read_scene};

use crate::support::{Doc, assert_warns, colour, png, read, read_with};

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

/// A name is copied for every part of what it names: a long one times many parts is more than the file itself.
#[test]
fn long_names_are_cut() {
    let long = "n".repeat(100_000);
    let mut doc = Doc::square();
    doc.json["meshes"][0]["name"] = json!(long);
    doc.json["nodes"][0].as_object_mut().unwrap().remove("name");
    let part = doc.json["meshes"][0]["primitives"][0].clone();
    doc.json["meshes"][0]["primitives"] = json!(vec![part; 1000]);
    let scene = doc.scene();
    let bytes: usize = scene.meshes.iter().map(|m| m.name.len()).sum();
    assert!(scene.meshes.len() == 1000 && bytes < 300_000, "{bytes} bytes of names");
    let bytes: usize = scene.instances.iter().map(|i| i.name.len()).sum();
    assert!(bytes < 300_000, "{bytes} bytes of names");

    // One material and a thousand groups, each of which knows it by name.
    let mut text = format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl {long}ä\n");
    (0..1000).for_each(|i| text += &format!("g {i}\nf 1 2 3\n"));
    let library = format!("newmtl {long}ä\nKd 0.25 0.25 0.25\n");
    let reading = read_with("a.obj", text.as_bytes(), &[("a.mtl", library.as_bytes())]).unwrap();
    assert_eq!(reading.scene.meshes.len(), 1000);
    assert_eq!(colour(&reading.scene.materials[0].surface).factor.r, 0.25);
    assert!(reading.scene.materials[0].name.len() < 300);
    let limits = Limits { extra_memory: 1 << 20, memory_per_byte: 4, ..Limits::default() };
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    assert!(read_scene("a.obj", text.as_bytes(), &mut none, &limits).is_err(), "groups are not for nothing");
}

/// The same damaged picture again and again: each attempt costs what the whole picture would.
#[test]
fn damaged_pictures_are_not_decoded_without_end() {
    let mut doc = Doc::square();
    let whole = twinray_format::write_png(512, 512, &vec![7; 3 << 18], &[]);
    let cut = &whole[..whole.len() - 30];
    doc.texture(cut);
    let n = 100;
    doc.json["images"] = json!(vec![doc.json["images"][0].clone(); n]);
    doc.json["textures"] = json!((0..n).map(|i| json!({ "source": i })).collect::<Vec<_>>());
    let paint = |i: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } });
    doc.json["materials"] = json!((0..n).map(paint).collect::<Vec<_>>());
    let mut part = doc.json["meshes"][0]["primitives"][0].clone();
    let parts = (0..n).map(|i| {
        part["material"] = json!(i);
        part.clone()
    });
    doc.json["meshes"][0]["primitives"] = json!(parts.collect::<Vec<_>>());
    // Room for eight times 512² texels: nine attempts, and no more.
    let limits = Limits { max_texels: 1 << 18, ..Limits::default() };
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let reading = read_scene("a.glb", &doc.glb(), &mut none, &limits).unwrap();
    let attempts = reading.warnings.iter().filter(|w| w.message.contains("cannot be decoded")).count();
    assert!((8..=9).contains(&attempts), "{attempts} attempts");
    assert_warns(&reading, &["images[99]", "too many texels"]);
}

#[test]
fn memory_in_all_has_a_limit_too() {
    let limits = Limits { max_memory: 3000, ..Limits::default() };
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let error = read_scene("a.glb", &Doc::square().glb(), &mut none, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_memory", .. }), "{error}");
    // Files beside the scene count: here one is named by a hundred buffers of as many names.
    let mut doc = Doc::square();
    let buffers = (1..=100).map(|i| json!({ "uri": format!("{i}.bin"), "byteLength": 1000 }));
    let all = [doc.json["buffers"][0].clone()].into_iter().chain(buffers);
    doc.json["buffers"] = json!(all.collect::<Vec<_>>());
    let mut thousand = |_: &str| Ok(vec![0; 1000]);
    let read = |max_memory, resolver: &mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>| {
        let limits = Limits { max_memory, ..Limits::default() };
        read_scene("a.glb", &doc.glb(), &mut |path: &str| resolver(path), &limits)
    };
    assert!(read(400_000, &mut thousand).is_ok());
    let error = read(90_000, &mut thousand).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_memory", .. }), "{error}");
}

#[test]
fn limits_within_a_memory_leave_room_for_pictures() {
    let wide = Limits::default().within(u64::MAX);
    assert_eq!(Limits { max_memory: u64::MAX, ..wide }, Limits::default());
    let limits = Limits::default().within(64 << 20);
    // A picture at work (16 bytes a texel), pictures kept (4 bytes), and all else.
    assert_eq!(16 * limits.max_image_texels + 4 * limits.max_texels + limits.max_memory, 64 << 20);
}

#[test]
fn files_outside_are_read_where_that_is_allowed() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[100, 100, 100]]));
    doc.json["images"][0] = json!({ "uri": "../textures/a%20b.png" });
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let mut asked = Vec::new();
    let mut resolver = |path: &str| {
        asked.push(path.to_owned());
        Ok(png(&[[100, 100, 100]]))
    };
    let reading = read_scene("a.glb", &doc.glb(), &mut resolver, &Limits::default()).unwrap();
    assert_warns(&reading, &["images[0]", "leaves the scene's folder", "--allow-outside"]);
    let limits = Limits { allow_outside: true, ..Limits::default() };
    let reading = read_scene("a.glb", &doc.glb(), &mut resolver, &limits).unwrap();
    assert_eq!((reading.warnings.len(), reading.scene.images.len()), (0, 1));
    assert_eq!(asked, ["../textures/a b.png"]);
}
