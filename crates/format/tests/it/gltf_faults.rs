//! Broken documents: each error names the file, the element, and what was expected.

use serde_json::{Value, json};
use twinray_format::FormatError;

use crate::support::{Doc, assert_says, glb, read, read_with};

/// Changes one value of a good file and asserts what the message says.
#[track_caller]
fn check(pointer: &str, value: Value, says: &[&str]) {
    let mut doc = Doc::square();
    assert!(doc.read().is_ok());
    match doc.json.pointer_mut(pointer) {
        Some(place) => *place = value,
        None => {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            doc.json.pointer_mut(parent).unwrap()[key] = value;
        }
    }
    let error = doc.read().expect_err(pointer);
    let message = error.to_string();
    assert!(matches!(error, FormatError::Invalid { .. }), "{pointer}: {message}");
    assert_says(&message, &["test.glb: "]);
    assert_says(&message, says);
}

#[test]
fn accessors_that_reach_outside_are_refused() {
    check("/accessors/0/count", json!(5), &["accessors[0]", "5 elements of 12 bytes", "48 bytes"]);
    check("/accessors/0/count", json!(0), &["accessors[0].count", "found 0"]);
    check("/accessors/0/count", json!(-1), &["accessors[0].count", "found -1"]);
    check("/accessors/0/count", json!(1u64 << 60), &["accessors[0].count"]);
    check("/accessors/0/byteOffset", json!(4), &["accessors[0]", "from byte 4"]);
    check("/accessors/0/byteOffset", json!(u64::MAX), &["accessors[0]"]);
    check("/accessors/0/componentType", json!(5130), &["accessors[0].componentType", "found 5130"]);
    check("/accessors/0/type", json!("VEC4"), &["accessors[0].type", "\"VEC4\"", "expected VEC3"]);
    check("/bufferViews/0/byteStride", json!(4), &["accessors[0]", "byteStride of 4", "at least 12"]);
    check("/bufferViews/0/byteStride", json!(u64::MAX), &["accessors[0]"]);
    check("/bufferViews/0/byteLength", json!(1000), &["bufferViews[0]", "bytes 0 to 1000", "buffers[0]"]);
    check("/bufferViews/0/byteOffset", json!(u64::MAX), &["bufferViews[0]", "buffers[0]"]);
    check("/bufferViews/0/buffer", json!(1), &["bufferViews[0].buffer", "found 1", "below 1, the number of buffers"]);
    check("/buffers/0/byteLength", json!(1000), &["buffers[0]", "1000"]);
    check("/accessors/0/sparse", json!({ "count": 9 }), &["accessors[0].sparse.count", "found 9", "1 to 4"]);
}

#[test]
fn links_to_nothing_are_refused() {
    check("/scene", json!(1), &["scene", "found 1", "below 1, the number of scenes"]);
    check("/scenes/0/nodes", json!([7]), &["scenes[0].nodes[0]", "found 7", "number of nodes"]);
    check("/nodes/0/mesh", json!(3), &["nodes[0] \"node\".mesh", "found 3", "below 1, the number of meshes"]);
    check("/nodes/0/mesh", json!(1.5), &["nodes[0] \"node\".mesh", "found 1.5"]);
    check("/nodes/0/mesh", json!(4294967296u64), &["nodes[0] \"node\".mesh", "4294967296"]);
    check("/meshes/0/primitives/0/indices", json!(30), &["meshes[0] \"mesh\".primitives[0].indices", "found 30"]);
    check("/meshes/0/primitives/0/attributes/POSITION", json!("x"), &["primitives[0].attributes.POSITION", "\"x\""]);
    check("/meshes/0/primitives/0/material", json!(5), &["primitives[0].material", "found 5", "number of materials"]);
    check("/meshes/0/primitives/0/mode", json!(9), &["primitives[0]", "mode 9"]);
    check("/meshes/0/primitives", json!({}), &["meshes[0] \"mesh\".primitives", "an object", "an array"]);
    check("/nodes/0/matrix", json!([1, 2]), &["nodes[0] \"node\".matrix", "16 numbers"]);
}

#[test]
fn indices_beyond_the_vertices_are_refused() {
    let mut doc = Doc::square();
    let indices = doc.indices(&[0, 1, 2, 0, 2, 4]);
    doc.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let says = [
        "test.glb: meshes[0] \"mesh\".primitives[0].indices",
        "accessors[3]",
        "index 4 at place 5",
        "below 4",
        "accessors[0]",
    ];
    assert_says(&doc.error(), &says);
}

#[test]
fn containers_that_are_cut_off_say_where() {
    let good = Doc::square().glb();
    for length in 0..good.len() {
        let error = read("test.glb", &good[..length]).expect_err("a cut file cannot be complete");
        assert!(matches!(error, FormatError::Unreadable { .. }), "{length}: {error}");
    }
    assert_says(&read("test.glb", &good[..100]).unwrap_err().to_string(), &["test.glb", "100 of the"]);
    let mut more = good.clone();
    more.extend(b"rubbish");
    assert!(read("test.glb", &more).is_ok(), "bytes beyond the announced length are ignored");
    let mut old = good;
    old[4] = 1;
    assert!(matches!(read("test.glb", &old), Err(FormatError::Unsupported { .. })));
}

#[test]
fn json_that_is_none_is_refused_with_its_place() {
    let message = read("test.gltf", b"{\n  \"asset\": }").unwrap_err().to_string();
    assert_says(&message, &["test.gltf", "line 2 column 12"]);
    assert!(matches!(read("test.gltf", b"[]"), Err(FormatError::Invalid { .. })));
    assert_says(&read("test.gltf", b"{}").unwrap_err().to_string(), &["asset", "found nothing"]);
    assert!(matches!(read("test.glb", &glb(b"\xff\xfe", b"")), Err(FormatError::Unreadable { .. })));
    let deep = "[".repeat(100_000);
    assert!(matches!(read("test.gltf", deep.as_bytes()), Err(FormatError::Unreadable { .. })));
}

#[test]
fn versions_and_required_extensions_are_checked() {
    let mut doc = Doc::square();
    for (version, good) in [("2.0", true), ("2.1", true), ("1.0", false), ("3.0", false)] {
        doc.json["asset"] = json!({ "version": version });
        assert_eq!(doc.read().is_ok(), good, "{version}");
    }
    doc.json["asset"] = json!({ "version": "2.1", "minVersion": "2.1" });
    assert!(matches!(doc.read(), Err(FormatError::Unsupported { .. })));
    doc.json["asset"] = json!({ "version": "2.0", "minVersion": "2.0" });
    doc.json["extensionsRequired"] = json!(["KHR_texture_transform", "KHR_draco_mesh_compression"]);
    let error = doc.read().unwrap_err();
    assert!(matches!(error, FormatError::Unsupported { .. }));
    assert_says(&error.to_string(), &["test.glb", "KHR_draco_mesh_compression", "Export without it"]);
}

#[test]
fn buffers_come_from_files_in_the_folder_only() {
    let mut doc = Doc::square();
    let text = |doc: &Doc| doc.json.to_string().into_bytes();
    doc.json["buffers"][0]["uri"] = json!("sub/my%20data.bin");
    let binary = doc.binary.clone();
    assert!(read_with("test.gltf", &text(&doc), &[("sub/my data.bin", &binary)]).is_ok());
    let error = read_with("test.gltf", &text(&doc), &[]).unwrap_err();
    assert!(matches!(&error, FormatError::Reference { reference, .. } if reference == "sub/my data.bin"));
    assert_says(&error.to_string(), &["test.gltf: buffers[0]", "sub/my data.bin", "Put it beside the scene"]);
    let error = read_with("test.gltf", &text(&doc), &[("sub/my data.bin", &binary[..20])]).unwrap_err();
    assert_says(&error.to_string(), &["buffers[0]", "20 bytes of data"]);
    for outside in
        ["../data.bin", "%2e%2e/data.bin", "/data.bin", "C:\\data.bin", "file:///data.bin", "a/..%2f../data.bin"]
    {
        doc.json["buffers"][0]["uri"] = json!(outside);
        let mut asked = Vec::new();
        let mut resolver = |path: &str| {
            asked.push(path.to_owned());
            Ok(binary.clone())
        };
        let limits = twinray_format::Limits::default();
        let result = twinray_format::read_scene("test.gltf", &text(&doc), &mut resolver, &limits);
        assert!(matches!(result, Err(FormatError::Reference { .. })), "{outside}");
        assert!(asked.is_empty(), "{outside}: the caller was asked for {asked:?}");
    }
}

#[test]
fn files_are_told_apart_by_mark_and_extension() {
    let square = Doc::square().glb();
    assert!(read("square", &square).is_ok(), "the mark is enough");
    assert_eq!(read("dir/my.scene.glb", &square).unwrap().scene.name, "my.scene");
    let error = read("room.fbx", b"Kaydara FBX").unwrap_err();
    assert!(matches!(error, FormatError::Unsupported { .. }));
    assert_says(&error.to_string(), &["room.fbx", ".fbx", ".glb, .gltf and .obj"]);
    assert_says(&read("room", b"").unwrap_err().to_string(), &["without an extension"]);
}
