//! Any bytes: random changes of good files never panic and never take long.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use twinray_format::write_glb;

use crate::support::{Doc, png, read, read_with};

/// A file that touches as much of the reader as fits into a few kilobytes.
fn good_glb() -> Vec<u8> {
    let mut doc = Doc::square();
    let normals = doc.floats(&[[0.0, 0.0, 1.0]; 4]);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    doc.texture(&png(&[[200, 100, 50], [1, 2, 3]]));
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = serde_json::json!({ "index": 0 });
    doc.json["materials"][0]["emissiveFactor"] = serde_json::json!([1, 1, 1]);
    doc.json["cameras"] = serde_json::json!([{ "type": "perspective", "perspective": { "yfov": 1 } }]);
    doc.json["nodes"] = serde_json::json!([{ "children": [1], "scale": [-1, 1, 1] }, { "mesh": 0, "camera": 0 }]);
    let (times, places) = (doc.floats(&[[0.0], [1.0]]), doc.floats(&[[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]));
    doc.json["animations"] = serde_json::json!([{
        "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
        "samplers": [{ "input": times, "output": places }],
    }]);
    doc.glb()
}

const OBJ: &str = "mtllib a.mtl\no box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nvt 0 0\nvt 1 1\nvn 0 0 1\n\
    usemtl a\nf 1/1/1 2/2/1 3/1/1 4/2/1\ng more\nusemtl b\nf -4 -3 -2\nl 1 2\ns off\n";
const MTL: &str = "newmtl a\nKd 0.5 0.5 0.5\nKs 0.5 0.5 0.5\nNs 10\nmap_Kd -o 1 1 t.png\nnewmtl b\nKe 1 1 1\nd 0.5\nmap_d t.png\nnorm -bm 2 t.png\n\
    newmtl c\nillum 7\nNi 1.5\nTf 1 0.5 1\nNs 30\n";

/// What random bytes rarely hit upon.
const WORDS: [&str; 24] = [
    "-1",
    "0",
    "1.0",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "1e999",
    "nan",
    "inf",
    "1e-320",
    "null",
    "[]",
    "{}",
    "\"\"",
    "[0]",
    "\\\n",
    "\n",
    " ",
    "/",
    "-",
    "- ",
    "\u{e4}\u{2003}",
    "\"sparse\":{\"count\":1},",
];

fn changed(mut bytes: Vec<u8>, changes: &[(u32, u8, u8)]) -> Vec<u8> {
    for &(place, kind, value) in changes {
        if bytes.is_empty() {
            break;
        }
        let at = place as usize % bytes.len();
        match kind % 6 {
            0 => bytes[at] = value,
            1 => bytes[at] ^= 1 << (value % 8),
            2 => bytes.insert(at, value),
            3 => drop(bytes.remove(at)),
            4 => drop(bytes.splice(at..at, WORDS[value as usize % WORDS.len()].bytes())),
            _ => drop(bytes.splice(at..(at + 1).min(bytes.len()), WORDS[value as usize % WORDS.len()].bytes())),
        }
    }
    bytes
}

fn changes() -> impl Strategy<Value = Vec<(u32, u8, u8)>> {
    prop::collection::vec((any::<u32>(), any::<u8>(), any::<u8>()), 1..8)
}

/// Some seconds. `map_Kd - a` once panicked, and took about ten thousand cases to appear.
const CASES: u32 = 20_000;

/// Whatever could be read can be written again.
fn use_it(result: Result<twinray_format::Reading, twinray_format::FormatError>) {
    if let Ok(reading) = result {
        for mesh in &reading.scene.meshes {
            assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
            assert!(mesh.positions.iter().flatten().all(|c| c.is_finite()));
            assert!(mesh.material < reading.scene.materials.len());
        }
        write_glb(&reading.scene);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: CASES, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn glb_files(changes in changes()) {
        use_it(read("a.glb", &changed(good_glb(), &changes)));
    }

    /// Changes of the text alone get further: the container stays whole.
    #[test]
    fn gltf_texts(changes in changes()) {
        let mut doc = Doc::square();
        doc.json["buffers"][0]["uri"] = "a.bin".into();
        let text = doc.json.to_string().into_bytes();
        use_it(read_with("a.gltf", &changed(text, &changes), &[("a.bin", &doc.binary)]));
    }

    #[test]
    fn obj_texts(obj in changes(), mtl in changes()) {
        let (obj, mtl) = (changed(OBJ.into(), &obj), changed(MTL.into(), &mtl));
        use_it(read_with("a.obj", &obj, &[("a.mtl", &mtl)]));
    }

    #[test]
    fn anything_at_all(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        use_it(read("a.obj", &bytes));
        use_it(read("a.gltf", &bytes));
        use_it(read("a.glb", &crate::support::glb(&bytes, b"")));
    }

    #[test]
    fn pictures(changes in changes()) {
        let mut doc = Doc::square();
        doc.texture(&changed(png(&[[200, 100, 50]; 40]), &changes));
        doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = serde_json::json!({ "index": 0 });
        use_it(doc.read());
    }
}
