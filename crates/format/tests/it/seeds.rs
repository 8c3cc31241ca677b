//! The bodies of the fuzz targets (`fuzz/`) over their seeds: they hold without a fuzzer, too.
//!
//! The seeds are what our own writers make of a small scene. To write them anew:
//! `cargo test -p twinray-format --test it -- --ignored write_the_seeds`.

use std::path::{Path, PathBuf};

use serde_json::json;
use twinray_format::{write_exr, write_glb, write_obj};
use twinray_scene::{Rgb, builtin};
use twinray_solve::Params;

use crate::real::files_below;
use crate::support::{Doc, png};
use crate::twin;

#[path = "../../../../fuzz/bodies.rs"]
pub mod bodies;

type Body = fn(&[u8]);

const TARGETS: [(&str, Body); 8] = [
    ("gltf", bodies::gltf),
    ("glb", bodies::glb),
    ("obj", bodies::obj),
    ("texture", bodies::texture),
    ("picture", bodies::picture),
    ("map", bodies::map),
    ("ies", bodies::ies),
    ("solution", bodies::solution),
];

fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(target)
}

/// A file of every target, made by our writers.
fn seeds() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let mut doc = Doc::square();
    doc.texture(&png(&[[200, 100, 50], [1, 2, 3]]));
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    doc.json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    doc.json["materials"][0]["extensions"] = json!({ "KHR_materials_ior": { "ior": 1.4 } });
    doc.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }]);
    doc.json["nodes"] =
        json!([{ "children": [1], "scale": [-1, 1, 1] }, { "mesh": 0, "camera": 0, "rotation": [0, 0, 0, 1] }]);
    let embedded = [doc.json.to_string().as_bytes(), b"\0", &doc.binary].concat();
    let mut text = Doc::square();
    text.json["buffers"][0]["uri"] = "a.bin".into();
    text.json["images"] = json!([{ "uri": "t.png" }]);
    text.json["textures"] = json!([{ "source": 0 }]);
    text.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let mut plates = builtin::plates(1.0);
    plates.materials[0].emission = Rgb::new(3.0, 2.0, 1.0);
    let mut files = write_obj(&plates);
    files.obj.push(0);
    files.obj.extend(&files.mtl);
    let odd = b"mtllib a.mtl\no box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nvt 0 0\nvt 1 1\nvn 0 0 1\nusemtl a\n\
        f 1/1/1 2/2/1 3/1/1 4/2/1\ng more\nusemtl b\nf -4 -3 -2\nl 1 2\ns off\n\0newmtl a\nKd 0.5 0.5 0.5\n\
        Ks 0.5 0.5 0.5\nNs 10\nmap_Kd -o 1 1 t.png\nnewmtl b\nKe 1 1 1\nd 0.5\n";
    // The smallest true-colour TGA: a header of 18 bytes and one texel.
    let tga = [&[1u8, 0, 0, 2][..], &[0; 8], &[1, 0, 1, 0, 24, 0], &[10, 20, 30]].concat();
    let runs = [&[2u8, 2, 0, 8][..], &[136, 5].repeat(3), &[136, 128]].concat();
    let ies =
        b"IESNA:LM-63-1995\n[TEST] seed\nTILT=INCLUDE\n1 2\n0 90\n1 .9\n1 900 1.5 3 2 1 2 .1 .2 0\n1 .95 40\n0 45 90\n\
        0 90\n100 80 10\n100 60,0\n";
    let exr = write_exr(2, 1, &[[1.0, 2.0, 3.0], [0.5, 0.0, 1e6]], None, &[]);
    vec![
        ("gltf", "square.gltf", text.json.to_string().into_bytes()),
        ("glb", "square", embedded),
        ("glb", "plates.glb", write_glb(&plates)),
        ("obj", "plates", files.obj),
        ("obj", "odd", odd.to_vec()),
        ("texture", "stripe.png", [&[0u8][..], &png(&[[200, 100, 50]; 5])].concat()),
        ("texture", "dot.tga", tga),
        ("picture", "stripe.png", png(&[[200, 100, 50]; 5])),
        ("picture", "dots.exr", exr),
        ("map", "dots.exr", write_exr(2, 1, &[[1.0, 2.0, 3.0], [0.5, 0.0, 1e6]], None, &[])),
        (
            "map",
            "runs.hdr",
            [b"#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n", &runs[..], &runs].concat(),
        ),
        ("map", "old.hdr", b"#?RADIANCE\n\n+X 1 -Y 4\n\x09\x08\x07\x80\x01\x01\x01\x03".to_vec()),
        ("ies", "quadrant.ies", ies.to_vec()),
        ("solution", "three.twin", twin::write(&twin::small())),
        ("solution", "waves.twin", twin::write(&twin::solved(&Params::default_preset(1), false))),
        ("solution", "merged.twin", twin::write(&twin::solved(&Params::default_preset(1), true))),
        ("solution", "paper.twin", twin::write(&twin::solved(&Params::paper_preset(1), false))),
    ]
}

#[test]
fn the_bodies_hold_for_what_our_writers_make() {
    for (target, _, bytes) in seeds() {
        let (_, body) = TARGETS.iter().find(|(name, _)| *name == target).unwrap();
        body(&bytes);
    }
}

#[test]
fn the_bodies_hold_for_the_seeds() {
    for (target, body) in TARGETS {
        let files = files_below(&folder(target), &[]);
        assert!(!files.is_empty(), "{target}");
        files.iter().for_each(|file| body(&std::fs::read(file).unwrap()));
    }
}

#[test]
#[ignore = "writes fuzz/seeds"]
fn write_the_seeds() {
    for (target, name, bytes) in seeds() {
        std::fs::create_dir_all(folder(target)).unwrap();
        std::fs::write(folder(target).join(name), bytes).unwrap();
    }
}
