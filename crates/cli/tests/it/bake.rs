//! `bake`: from a scene to the same scene with its light in it.

use serde_json::Value;
use twinray::format::{Limits, Reading, read_scene};

use crate::support::Place;

const TINY: [&str; 4] = ["--patches", "1000", "--rays", "100000"];

/// Bakes with the given options and gives the place and the report.
fn bake(scene: &str, args: &[&str]) -> (Place, Value) {
    let place = Place::new();
    let report = place.done(&[&["bake", scene, "-o", "lit.glb", "--json"], &TINY[..], args].concat()).json();
    (place, report)
}

fn reading(place: &Place, name: &str) -> Reading {
    let mut none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    read_scene(name, &place.read(name), &mut none, &Limits::default()).unwrap()
}

/// The JSON chunk of a binary file.
fn document(place: &Place, name: &str) -> Value {
    let bytes = place.read(name);
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// Triangles of a scene in the world, as a multiset of rounded corners.
fn triangles(reading: &Reading) -> Vec<[[i64; 3]; 3]> {
    let scene = &reading.scene;
    let mut found: Vec<[[i64; 3]; 3]> = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        for t in &mesh.triangles {
            let corner = |k: u32| {
                let p = instance.transform.transform_point3(glam::Vec3::from(mesh.positions[k as usize]).as_dvec3());
                (p * 1e4).round().to_array().map(|c| c as i64)
            };
            let mut corners = t.map(corner);
            // Rotations are the same triangle, mirror images are not.
            let least = (0..3).min_by_key(|&k| corners[k]).unwrap();
            corners.rotate_left(least);
            found.push(corners);
        }
    }
    found.sort();
    found
}

/// Nothing of the geometry changes; every surface has a place on the page, and materials know their light.
#[test]
fn a_lit_scene_is_the_scene() {
    let (place, report) = bake("cornell", &["--page-size", "256"]);
    assert_eq!(place.files(), ["lit.glb"]);
    place.done(&["scene", "cornell", "-o", "plain.glb"]);
    let (lit, plain) = (reading(&place, "lit.glb"), reading(&place, "plain.glb"));
    assert_eq!(triangles(&lit), triangles(&plain));
    for mesh in &lit.scene.meshes {
        let uv = mesh.second_texcoords.as_ref().expect("a place on the page");
        assert!(uv.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
    }
    let document = document(&place, "lit.glb");
    for extension in ["TWINRAY_lightmap", "MOZ_lightmap"] {
        assert!(document["extensionsUsed"].as_array().unwrap().iter().any(|e| e == extension));
        let materials = document["materials"].as_array().unwrap();
        assert!(materials.iter().any(|m| m["extensions"][extension].is_object()));
    }
    assert_eq!(document["asset"]["extras"]["twinray_bake"], report["bake"]);
    assert_eq!(report["bake"]["layout"]["texcoords"], "unwrapped");
}

/// What was baked can be baked again, with the coordinates that it has then.
#[test]
fn a_lit_scene_keeps_its_page() {
    let (place, _) = bake("cornell", &["--page-size", "256"]);
    let report = place
        .done(&[&["bake", "lit.glb", "-o", "again.glb", "--json", "--page-size", "256"], &TINY[..]].concat())
        .json();
    assert_eq!(report["bake"]["layout"]["texcoords"], "authored", "{report:#}");
    assert_eq!(triangles(&reading(&place, "lit.glb")), triangles(&reading(&place, "again.glb")));
    // The old page is gone from it.
    let images = |name: &str| document(&place, name)["images"].as_array().unwrap().len();
    assert_eq!(images("again.glb"), images("lit.glb"));
}

/// Every engine and carrier gives its kind of file.
#[test]
fn engines_get_what_they_load() {
    let (place, _) = bake("doorway", &["--for", "unlit", "--page-size", "256"]);
    let unlit = document(&place, "lit.glb");
    assert!(unlit["materials"].as_array().unwrap().iter().any(|m| m["extensions"]["KHR_materials_unlit"].is_object()));

    for (engine, extension) in [("bevy", "ktx2"), ("godot", "exr")] {
        let (place, report) = bake("doorway", &["--for", engine, "--page-size", "256"]);
        let uri = format!("lit-0.{extension}");
        let mut files = place.files();
        files.sort();
        assert_eq!(files, [uri.clone(), "lit.glb".into()]);
        assert_eq!(report["files"][0], uri.as_str());
        let document = document(&place, "lit.glb");
        let named = |m: &Value| m["extras"]["twinray_lightmap"]["uri"] == uri.as_str();
        assert!(document["materials"].as_array().unwrap().iter().any(named));
    }

    let (place, _) = bake("doorway", &["--to", "vertex"]);
    let vertex = document(&place, "lit.glb");
    let primitive = &vertex["meshes"][0]["primitives"][0];
    assert!(primitive["attributes"]["_IRRADIANCE"].is_u64() && primitive["attributes"]["COLOR_0"].is_u64());
    // One white for all meshes, so that they are as bright as they are beside each other.
    let white = |mesh: &Value| mesh["extras"]["twinray_irradiance_scale"].as_f64().unwrap();
    let whites: Vec<f64> = vertex["meshes"].as_array().unwrap().iter().map(white).collect();
    assert!(whites.len() > 1 && whites[0] > 0.0 && whites.iter().all(|w| *w == whites[0]), "{whites:?}");
}

/// The scene is not overwritten by its own bake.
#[test]
fn a_scene_is_not_baked_onto_itself() {
    let place = Place::new();
    place.done(&["scene", "cornell", "-o", "plain.glb"]);
    let scene = place.read("plain.glb");
    let run = place.run(&[&["bake", "plain.glb", "-o", "./plain.glb"], &TINY[..]].concat());
    assert_eq!((run.code, place.read("plain.glb") == scene), (Some(2), true), "{}", run.stderr);
    assert!(run.stderr.contains("the scene itself"), "{}", run.stderr);
    assert_eq!(place.files(), ["plain.glb"]);
}

/// A grid of probes in every kind of file, and the numbers of the one that is read most easily.
#[test]
fn probes_are_written_as_asked() {
    for extension in ["json", "exr", "ktx2"] {
        let place = Place::new();
        let file = format!("p.{extension}");
        let args = ["bake", "doorway", "--to", "probes", "-o", &file, "--spacing", "2", "--probe-rays", "16", "--json"];
        let report = place.done(&[&args[..], &TINY[..]].concat()).json();
        assert_eq!(place.files(), std::slice::from_ref(&file));
        let counts: Vec<u64> =
            report["bake"]["layout"]["counts"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
        assert!(counts.iter().all(|n| *n >= 1) && counts.iter().product::<u64>() >= 8, "{counts:?}");
        if extension == "json" {
            let volume: Value = serde_json::from_slice(&place.read(&file)).unwrap();
            assert!(volume.is_object());
        }
    }
}

/// Probes for Bevy have the name that it reads.
#[test]
fn probes_are_named_for_their_engine() {
    let place = Place::new();
    let args = ["bake", "doorway", "--to", "probes", "--for", "bevy", "--spacing", "2", "--probe-rays", "4"];
    place.done(&[&args[..], &TINY[..]].concat());
    assert_eq!(place.files(), ["doorway-probes.ktx2"]);
}

/// Pages that a larger bake left are told, and stay; light that is hardly known is told too.
#[test]
fn what_one_should_know_is_said() {
    let place = Place::new();
    let args = ["bake", "cornell", "-o", "lit.glb", "--for", "bevy", "--page-size", "64", "--json"];
    let pages = |density: &str| place.done(&[&args[..], &TINY[..], &["--density", density]].concat()).json();
    let many = pages("100")["files"].as_array().unwrap().len();
    assert!(many > 2, "{many}");
    let report = pages("20");
    let few = report["files"].as_array().unwrap().len();
    assert!(few < many - 1);
    let said = report["warnings"].to_string();
    assert!(said.contains(&format!("lit-{few}.ktx2 to lit-{}.ktx2 ({})", many - 1, many - few)), "{said}");
    assert_eq!(place.files().len(), many + 1);

    let report = place.done(&["bake", "hall", "-o", "hall.glb", "--to", "vertex", "--rays", "2k", "--json"]).json();
    assert!(report["warnings"].to_string().contains("is known to"), "{report:#}");
    assert!(report["bake"]["layout"]["off"].as_f64().unwrap() > 0.25, "{report:#}");
    assert!(report["warnings"].to_string().contains("finer meshes"), "{report:#}");
}

/// Lights that are baked leave the file unless they are to stay.
#[test]
fn baked_lights_leave() {
    let lamp = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
        "extensionsUsed":["KHR_lights_punctual"],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":100.0,"name":"lamp"}]}},
        "nodes":[{"mesh":0,"name":"floor"},{"translation":[0,1,0],"name":"lamp","extensions":{"KHR_lights_punctual":{"light":0}}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
        "materials":[{"name":"grey","pbrMetallicRoughness":{"metallicFactor":0.0,"baseColorFactor":[0.5,0.5,0.5,1]}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,0,-1],"max":[1,0,1]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"floor.bin"}]}"#;
    let place = Place::new();
    place.write("lamp.gltf", lamp);
    let corners: [[f32; 3]; 3] = [[-1.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
    place.write("floor.bin", corners.iter().flatten().flat_map(|c| c.to_le_bytes()).collect::<Vec<u8>>());
    let args = [&["bake", "lamp.gltf", "-o", "lit.glb", "--json"], &TINY[..]].concat();
    let report = place.done(&args).json();
    let dark = document(&place, "lit.glb");
    assert_eq!(report["bake"]["lights"]["punctual"][0], "lamp");
    assert!(dark["extensions"]["KHR_lights_punctual"].is_null());
    assert_eq!(dark["nodes"][1]["name"], "lamp");
    assert!(dark["buffers"][0]["uri"].is_null());
    // Its light is gone from it, so that it cannot be baked again; with its lamp it can.
    let again = [&["bake", "lit.glb", "-o", "again.glb"], &TINY[..]].concat();
    let run = place.run(&again);
    assert_eq!(run.code, Some(2), "{}", run.stderr);
    assert!(run.stderr.contains("baked already"), "{}", run.stderr);
    place.done(&[&args[..], &["--keep-lights"]].concat());
    place.done(&again);
    assert_eq!(document(&place, "lit.glb")["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"], 0);
}

/// What pictures would need is not put into a scene; one without light is not baked.
#[test]
fn nothing_is_invented() {
    let place = Place::new();
    let corners = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n";
    place.write("floor.obj", format!("{corners}f 1 5 6 2\n"));
    place.write("closed.obj", format!("{corners}f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 5 1 4 8\n"));
    let report = place.done(&[&["bake", "floor.obj", "-o", "lit.glb", "--json"], &TINY[..]].concat()).json();
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("uniform sky") && !warnings.contains("camera"), "{warnings}");
    assert!(document(&place, "lit.glb")["cameras"].is_null());
    let run = place.run(&[&["bake", "closed.obj", "-o", "dark.glb"], &TINY[..]].concat());
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("closed.obj: has no light"), "{}", run.stderr);
}

#[test]
fn threads_change_no_byte() {
    let args = ["--quality", "high", "--texel-rays", "4", "--page-size", "128"];
    let [one, three] =
        ["1", "3"].map(|threads| bake("doorway", &[&args[..], &["--threads", threads]].concat()).0.read("lit.glb"));
    assert!(one == three);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let place = Place::new();
    for (args, expected) in [
        (&["bake", "cornell", "-o", "lit.png"][..], ".glb"),
        (&["bake", "cornell", "-o", "lit.glb", "--density", "1e9"], "texels per metre here"),
        (&["bake", "cornell", "-o", "lit.glb", "--for", "unlit", "--exposure", "nan"], "stops"),
        (&["bake", "cornell", "-o", "lit.glb", "--to", "vertex", "--unwrap"], "is for lightmaps"),
        (&["bake", "cornell", "-o", "lit.glb", "--spacing", "1"], "is for probes"),
        (&["bake", "cornell", "-o", "lit.glb", "--probe-rays", "9"], "is for probes"),
        (&["bake", "cornell", "-o", "lit.glb", "--texel-rays", "9"], "is for --quality high"),
        (&["bake", "cornell", "--to", "probes", "--quality", "high"], "for light on surfaces"),
        (&["bake", "cornell", "--to", "probes", "--for", "unlit"], "leave one"),
        (&["bake", "cornell", "--to", "probes", "--for", "bevy", "-o", "p.exr"], ".ktx2"),
        (&["bake", "cornell", "--to", "probes", "--for", "godot", "-o", "p.ktx2"], ".ktx2"),
        (&["bake", "cornell", "--to", "probes", "--spacing", "1e-9", "--rays", "1e12"], "too many"),
        (&["bake", "cornell", "--page-size", "-1"], "is not in 64..=8192"),
        (&["bake", "cornell", "--density", "0"], "a positive number"),
        (&["bake", "cornell", "--exposure", "1"], "--for unlit"),
        (&["bake", "cornell", "--to", "vertex", "--for", "unlit"], "leave one"),
        (&["bake", "cornell", "--to", "probes", "-o", "p.glb"], ".json"),
        (&["bake", "no-such.glb"], "no such file"),
    ] {
        let run = place.run(args);
        assert_eq!(run.code, Some(2), "{args:?}");
        assert!(run.stderr.contains(expected), "{args:?}: {}", run.stderr);
    }
    assert!(place.files().is_empty());
}
