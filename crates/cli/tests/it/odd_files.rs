//! Odd glTF files: perfectly white (its default colour is 1, with which light would never die out), or flattened.

use serde_json::{Value, json};

use crate::support::{Place, warnings};

/// A closed box of 2 m from inside as glTF, all of it white by default; its floor glows.
fn white_room() -> Value {
    // Corners of the box, then quadrilaterals whose fronts are inside.
    let corner = |i: u32| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 1f32 } else { -1.0 });
    let faces = [[0u16, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3], [0, 1, 3, 2], [4, 6, 7, 5]];
    let positions = (0..8).flat_map(corner).flat_map(f32::to_le_bytes);
    let indices = faces.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).flat_map(u16::to_le_bytes);
    let data: String = positions.chain(indices).map(|b| format!("%{b:02x}")).collect();
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "buffers": [{ "byteLength": 168, "uri": format!("data:application/octet-stream,{data}") }],
        "bufferViews": [{ "buffer": 0, "byteLength": 96 }, { "buffer": 0, "byteOffset": 96, "byteLength": 72 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
            { "bufferView": 1, "byteOffset": 12, "componentType": 5123, "count": 30, "type": "SCALAR" },
        ],
        "materials": [
            { "name": "floor", "emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": { "metallicFactor": 0 } },
            { "name": "wall", "pbrMetallicRoughness": { "metallicFactor": 0 } },
        ],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 },
            { "attributes": { "POSITION": 0 }, "indices": 2, "material": 1 },
        ] }],
    })
}

/// The readers bring white down to .98 and say so; the solve ends, and what is emitted is absorbed.
#[test]
fn white_rooms_are_toned_down_and_solved() {
    let place = Place::new();
    place.write("white.gltf", white_room().to_string());
    let info = place.done(&["info", "white.gltf", "--patches", "600", "--json"]).json();
    assert_eq!((&info["triangles"], &info["escaping_rays"]), (&json!(12), &json!(0.0)), "{info}");
    assert!(warnings(&info).iter().any(|w| w.contains("2 materials") && w.contains("0.98")), "{info}");
    let report = place.report(&["white.gltf"]);
    assert!(warnings(&report).iter().any(|w| w.contains("0.98") && w.contains("floor")), "{report}");
    let power = |key: &str| report["power"][key].as_f64().unwrap();
    let residual = (power("absorbed") + power("escaped") + power("lost")) / power("emitted") - 1.0;
    // Light lives for some thirty bounces of coated white: 1e5 rays leave a few percent of it.
    assert!(residual.abs() < 0.1, "{report}");
    assert_eq!(power("escaped"), 0.0, "the room is closed");
}

/// A node may flatten its mesh to nothing: the rest is used, and the loss is counted.
#[test]
fn flattened_meshes_are_left_out_with_a_word() {
    let place = Place::new();
    let mut room = white_room();
    room["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "scale": [0, 0, 1] }]);
    room["scenes"] = json!([{ "nodes": [0, 1] }]);
    place.write("flat.gltf", room.to_string());
    let info = place.done(&["info", "flat.gltf", "--patches", "600", "--json"]).json();
    assert_eq!(info["triangles"], json!(12), "{info}");
    let said = warnings(&info);
    for count in ["2 of 2", "10 of 10"] {
        assert!(said.iter().any(|w| w.contains(count) && w.contains("dropped: no area")), "{said:?}");
    }
}
