//! Primitives: modes, index types, accessors of every kind, cleaning.

use glam::DVec3;
use serde_json::json;

use crate::support::{Doc, assert_says, assert_warns, normal, world_triangles};

/// Corners of a strip: two unit squares side by side, seen from +Z.
const ZIGZAG: [[f32; 3]; 6] =
    [[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 0.0, 0.0]];

fn total_area_towards(doc: &Doc, direction: DVec3) -> (usize, f64) {
    let triangles = world_triangles(&doc.scene());
    (triangles.len(), triangles.iter().map(|t| normal(*t).dot(direction) / 2.0).sum())
}

#[test]
fn strips_and_fans_face_one_way() {
    let mut strip = Doc::new();
    let positions = strip.floats(&ZIGZAG);
    strip.primitive(json!({ "attributes": { "POSITION": positions }, "mode": 5 }));
    assert_eq!(total_area_towards(&strip, DVec3::Z), (4, 2.0));

    let mut fan = Doc::new();
    let positions = fan.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    fan.primitive(json!({ "attributes": { "POSITION": positions }, "mode": 6 }));
    assert_eq!(total_area_towards(&fan, DVec3::Z), (2, 1.0));

    let mut indexed = Doc::new();
    let positions = indexed.floats(&ZIGZAG);
    let indices = indexed.indices(&[0, 1, 2, 3, 4, 5]);
    indexed.primitive(json!({ "attributes": { "POSITION": positions }, "indices": indices, "mode": 5 }));
    assert_eq!(total_area_towards(&indexed, DVec3::Z), (4, 2.0));
}

#[test]
fn triangles_come_with_and_without_indices() {
    assert_eq!(total_area_towards(&Doc::square(), DVec3::Z), (2, 1.0));
    let mut doc = Doc::new();
    let positions = doc.floats(&[ZIGZAG[0], ZIGZAG[1], ZIGZAG[2], ZIGZAG[2], ZIGZAG[1], ZIGZAG[3]]);
    doc.primitive(json!({ "attributes": { "POSITION": positions } }));
    assert_eq!(total_area_towards(&doc, DVec3::Z), (2, 1.0));
    // Bytes as indices.
    let mut doc = Doc::new();
    let positions = doc.floats(&ZIGZAG);
    let indices = doc.bytes(&[0, 1, 2], "SCALAR", 1, 5121);
    doc.primitive(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let scene = doc.scene();
    assert_eq!(scene.meshes[0].positions.len(), 3, "vertices that no triangle uses are not kept");
}

#[test]
fn points_and_lines_are_named_and_left_out() {
    let mut doc = Doc::square();
    doc.primitive(json!({ "attributes": { "POSITION": 0 }, "mode": 1 }));
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["test.glb: meshes[0] \"mesh\".primitives[1]", "no area"]);
    assert_eq!(reading.scene.meshes.len(), 1);
}

#[test]
fn interleaved_attributes_are_read_by_their_stride() {
    let mut doc = Doc::new();
    // Position and texture coordinate of each vertex side by side: 20 bytes.
    let vertices: Vec<[f32; 1]> = [[0., 0., 0., 0.25, 0.5], [1., 0., 0., 0.5, 0.5], [0., 1., 0., 0.75, 0.5]]
        .concat()
        .iter()
        .map(|v| [*v])
        .collect();
    doc.floats(&vertices);
    doc.json["bufferViews"][0]["byteStride"] = json!(20);
    doc.json["accessors"] = json!([
        { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
        { "bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 3, "type": "VEC2" },
    ]);
    doc.primitive(json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 } }));
    let mesh = &doc.scene().meshes[0];
    assert_eq!(mesh.positions, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(mesh.texcoords.as_deref(), Some(&[[0.25, 0.5], [0.5, 0.5], [0.75, 0.5]][..]));
}

#[test]
fn sparse_accessors_replace_elements_with_and_without_a_base() {
    for with_base in [true, false] {
        let mut doc = Doc::new();
        let base = doc.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [9.0, 9.0, 9.0]]);
        doc.floats(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
        doc.indices(&[1, 2]);
        let sparse = json!({
            "count": 2, "indices": { "bufferView": 2, "componentType": 5123 }, "values": { "bufferView": 1 },
        });
        doc.json["accessors"][base]["sparse"] = sparse;
        if !with_base {
            doc.json["accessors"][base].as_object_mut().unwrap().remove("bufferView");
        }
        doc.primitive(json!({ "attributes": { "POSITION": base } }));
        // A right triangle with legs 1 and 2: area 1.
        assert_eq!(total_area_towards(&doc, DVec3::Z), (1, 1.0), "base: {with_base}");
    }
}

#[test]
fn accessors_without_data_are_zeros() {
    let mut doc = Doc::new();
    doc.json["accessors"] = json!([{ "componentType": 5126, "count": 300, "type": "VEC3" }]);
    doc.primitive(json!({ "attributes": { "POSITION": 0 } }));
    assert_says(&doc.error(), &["without usable triangles", "100 of 100", "no area"]);
}

#[test]
fn normalized_integers_are_numbers_between_zero_and_one() {
    let mut doc = Doc::square();
    let texcoords = doc.bytes(&[0, 255, 255, 255, 255, 0, 51, 0], "VEC2", 2, 5121);
    doc.json["accessors"][texcoords]["normalized"] = json!(true);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(texcoords);
    let texcoords = doc.scene().meshes[0].texcoords.clone().unwrap();
    assert_eq!(texcoords, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.2, 0.0]]);
}

#[test]
fn quantized_positions_need_their_extension() {
    let mut doc = Doc::new();
    let positions = doc.bytes(&[0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0], "VEC3", 4, 5120);
    doc.json["bufferViews"][0]["byteStride"] = json!(4);
    doc.json["accessors"][positions]["count"] = json!(3);
    doc.primitive(json!({ "attributes": { "POSITION": positions } }));
    assert_says(&doc.error(), &["accessors[0].componentType", "found 5120", "F32"]);
    doc.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    doc.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    assert_eq!(total_area_towards(&doc, DVec3::Z), (1, 2.0));
}

#[test]
fn damaged_empty_and_doubled_triangles_are_dropped_and_counted() {
    let mut doc = Doc::new();
    let positions = doc.floats(&[
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [f32::NAN, 0.0, 0.0],
        [0.0, 1e12, 0.0],
        [0.5, 0.0, 0.0],
        // The first corner again, with the other zero.
        [-0.0, 0.0, 0.0],
    ]);
    let indices = doc.indices(&[
        0, 1, 2, // good
        0, 1, 3, 0, 1, 4, // damaged
        0, 5, 1, 0, 0, 1, // empty
        1, 2, 6, // the first, rotated
        0, 2, 1, // its back: not a copy
    ]);
    doc.primitive(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let reading = doc.read().unwrap();
    assert_eq!(reading.scene.meshes[0].triangles.len(), 2);
    assert!(reading.scene.meshes[0].positions.iter().flatten().all(|c| c.is_finite()));
    assert_warns(&reading, &["mesh \"mesh\"", "2 of 7", "not a number"]);
    assert_warns(&reading, &["mesh \"mesh\"", "2 of 7", "no area"]);
    assert_warns(&reading, &["mesh \"mesh\"", "1 of 7", "copies"]);
}

#[test]
fn thin_triangles_stay() {
    // A sliver a thousandth of a millimetre high is an odd thing, but not an empty one.
    let mut doc = Doc::new();
    let positions = doc.floats(&[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [5.0, 1e-6, 0.0]]);
    doc.primitive(json!({ "attributes": { "POSITION": positions } }));
    assert_eq!(doc.scene().meshes[0].triangles.len(), 1);
}

#[test]
fn normals_without_direction_come_from_the_triangles() {
    let mut doc = Doc::square();
    let normals = doc.floats(&[[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["mesh \"mesh\"", "2 normals"]);
    assert_eq!(reading.scene.meshes[0].normals.as_deref(), Some(&[[0.0, 0.0, 1.0]; 4][..]));
}

#[test]
fn ignored_attributes_are_named() {
    let mut doc = Doc::square();
    doc.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(0);
    doc.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
    // Texture coordinates that do not match the positions cannot be used.
    doc.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(2);
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["primitives[0]", "vertex colours"]);
    assert_warns(&reading, &["primitives[0]", "morph targets"]);
    assert_warns(&reading, &["primitives[0].attributes.TEXCOORD_0", "ignored"]);
    assert!(reading.scene.meshes[0].texcoords.is_none());
}
