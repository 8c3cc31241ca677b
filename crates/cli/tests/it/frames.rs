//! `render --path`: one light, many pictures.

use glam::DQuat;
use serde_json::{Value, json};

use crate::support::{Place, png, shows_something, warnings};

/// Few patches, few rays: frames are compared with each other, not with the truth.
const TINY: [&str; 8] = ["--patches", "500", "--rays", "50000", "--size", "64x48", "--spp", "8"];
/// Half of it for what looks at no picture.
const TINIEST: [&str; 8] = ["--patches", "300", "--rays", "10000", "--size", "16x12", "--spp", "1"];

/// Three frames of a walk towards the boxes of `cornell`.
const WALK: &str = r#"{ "fps": 2, "keys": [
    { "time": 0, "eye": [0.1, 0.4, -0.5], "target": [0.3, 0.1, 0.3], "fov": 60 },
    { "time": 1, "eye": [0.3, 0.3, -0.3], "target": [0.3, 0.2, 0.3], "fov": 70 } ] }"#;

fn walk(args: &[&str]) -> (Place, Value) {
    let place = Place::new();
    place.write("walk.json", WALK);
    let report = place.done(&[&["render", "cornell", "--path", "walk.json", "--json"], args].concat()).json();
    (place, report)
}

fn files(report: &Value) -> Vec<&str> {
    report["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect()
}

/// The first frame has the bytes of the picture that `render` takes from there, by every method; the others have noise of their own.
#[test]
fn frames_are_pictures() {
    for method in ["gather", "patches", "path"] {
        let tiny = &TINY[if method == "path" { 4 } else { 0 }..];
        let tiny = &[tiny, &["--exposure", "1.5", "--method", method]].concat();
        let (place, report) = walk(&[&tiny[..], &["-o", "f%02d.png"]].concat());
        assert_eq!(files(&report), ["f00.png", "f01.png", "f02.png"], "{method}");
        assert_eq!(report["frames"], json!({ "count": 3, "first": 0, "done": 3 }));
        assert_eq!((report["fps"].as_f64(), report["exposure_ev"].as_f64()), (Some(2.0), Some(1.5)));
        let view = ["--eye", "0.1,0.4,-0.5", "--target", "0.3,0.1,0.3", "--fov", "60", "-o", "alone.png"];
        place.done(&[&["render", "cornell"], &view[..], &tiny[..]].concat());
        if method == "patches" {
            // A single picture's solve knows its camera, and frames are as a solution file would have them.
            shows_something(&place.read("f00.png"));
        } else {
            assert!(place.read("f00.png") == place.read("alone.png"), "{method}: the first frame differs");
        }
        let view = ["--eye", "0.3,0.3,-0.3", "--target", "0.3,0.2,0.3", "--fov", "70", "-o", "last.png"];
        place.done(&[&["render", "cornell"], &view[..], &tiny[..]].concat());
        let (ours, alone) = (png(&place.read("f02.png")).2, png(&place.read("last.png")).2);
        let difference =
            ours.iter().zip(&alone).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / ours.len() as f64;
        assert!(difference < 25.0, "{method}: {difference}");
        assert!(method == "patches" || difference > 0.0, "{method}: noise stands still");
    }
}

/// Frames of a solution file, whatever the threads and whichever part is asked for, are the same bytes, exposure included.
#[test]
fn parts_fit_together() {
    let place = Place::new();
    place.write("walk.json", WALK);
    place.done(&["solve", "cornell", "-o", "c.twin", "--patches", "500", "--rays", "50000"]);
    let small = ["--size", "32x24", "--spp", "4", "--path", "walk.json", "--white-balance", "auto"];
    let whole = place.done(&[&["render", "c.twin", "-o", "a%d.png", "--threads", "1"], &small[..]].concat());
    assert!(whole.stderr.contains("for all frames"), "{}", whole.stderr);
    let rest = ["render", "c.twin", "-o", "b%d.png", "--threads", "3", "--frames", "1..", "--json"];
    let rest = place.done(&[&rest[..], &small[..]].concat()).json();
    assert_eq!(rest["frames"], json!({ "count": 3, "first": 1, "done": 2 }));
    assert_eq!(files(&rest), ["b1.png", "b2.png"]);
    for k in 1..3 {
        assert!(place.read(&format!("a{k}.png")) == place.read(&format!("b{k}.png")), "frame {k}");
    }
    assert_eq!(place.files(), ["a0.png", "a1.png", "a2.png", "b1.png", "b2.png", "c.twin", "walk.json"]);
}

/// Linear frames need no exposure; what was there is replaced, as it is by `render`.
#[test]
fn exr_frames_replace_what_was_there() {
    let place = Place::new();
    place.write("walk.json", WALK);
    place.write("f1.exr", "old");
    let args = ["render", "cornell", "--path", "walk.json", "-o", "f%d.exr", "--fps", "1", "--aov", "depth", "--json"];
    let report = place.done(&[&args[..], &TINIEST].concat()).json();
    assert_eq!((report["frames"]["count"].as_u64(), report["exposure_ev"].is_null()), (Some(2), true));
    assert!(place.read("f1.exr").starts_with(&[0x76, 0x2f, 0x31, 0x01]));
}

/// A square under a sky, and a camera 2 m from a mast that turns by a quarter in one second, as glTF.
fn mast() -> String {
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2).as_quat().to_array();
    let floats: Vec<f32> = [
        &[-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0][..],
        &[0.0, 1.0],
        &[0.0, 0.0, 0.0, 1.0],
        &turn,
    ]
    .concat();
    let mut bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    let view = |from: usize, length: usize| json!({ "buffer": 0, "byteOffset": from, "byteLength": length });
    let accessor = |view: usize, kind: &str, count: usize, component: u32| json!({ "bufferView": view, "type": kind, "count": count, "componentType": component });
    let (data, length) = (base64(&bytes), bytes.len());
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0 }, { "name": "mast", "children": [2] }, { "name": "eye", "camera": 0, "translation": [0, 0, 2] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1.0, "aspectRatio": 1.333 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 3, "material": 0 }] }],
        "materials": [{ "doubleSided": true }],
        "animations": [{ "name": "round",
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "rotation" } }],
            "samplers": [{ "input": 1, "output": 2 }] }],
        "accessors": [accessor(0, "VEC3", 4, 5126), accessor(1, "SCALAR", 2, 5126), accessor(2, "VEC4", 2, 5126), accessor(3, "SCALAR", 6, 5123)],
        "bufferViews": [view(0, 48), view(48, 8), view(56, 32), view(88, 12)],
        "buffers": [{ "byteLength": length, "uri": format!("data:application/octet-stream;base64,{data}") }],
    })
    .to_string()
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |w, i| w << 8 | u32::from(chunk.get(i).copied().unwrap_or(0)));
        let digit = |i: usize| char::from(DIGITS[(word >> (18 - 6 * i) & 63) as usize]);
        (0..4).for_each(|i| text.push(if i <= chunk.len() { digit(i) } else { '=' }));
    }
    text
}

/// A frame of an animation is the picture from where the camera analytically is, in every unit.
#[test]
fn animations_move_the_camera() {
    let place = Place::new();
    place.write("mast.gltf", mast());
    for (unit, path) in [("m", "animation"), ("cm", "animation:round")] {
        let common = [
            "--unit",
            unit,
            "--method",
            "path",
            "--size",
            "32x24",
            "--spp",
            "4",
            "--exposure",
            "0",
            "--patches",
            "100",
        ];
        let frames = ["render", "mast.gltf", "--path", path, "--fps", "2", "-o", "f%d.exr", "--json"];
        let report = place.done(&[&frames[..], &common].concat()).json();
        assert_eq!(report["frames"]["count"], 3);
        assert!(!warnings(&report).iter().any(|w| w.contains("animation")), "{:?}", warnings(&report));
        let still = ["render", "mast.gltf", "-o", "still.exr", "--eye", "0,0,2", "--target", "0,0,0"];
        place.done(&[&still[..], &common].concat());
        assert!(place.read("f0.exr") == place.read("still.exr"), "{unit}: the first frame differs");
        let info = place.done(&["info", "mast.gltf"]);
        assert!(info.stdout.contains("animations round (of eye, 1.0 s)"), "{}", info.stdout);
        // From the side too the middle of the square is 2 m away.
        let depth = ["render", "mast.gltf", "--path", path, "--fps", "2", "-o", "d%d.exr", "--aov", "depth"];
        place.done(&[&depth[..], &common].concat());
        let metres = if unit == "m" { 1.0 } else { 0.01 };
        for frame in 0..2 {
            let found = middle_depth(&place.read(&format!("d{frame}.exr")));
            assert!((found - 2.0 * metres).abs() < 0.06 * metres, "{unit}, frame {frame}: {found}");
        }
    }
}

/// Depth of the pixel in the middle.
fn middle_depth(bytes: &[u8]) -> f32 {
    use exr::prelude::*;
    let image = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let image = image.from_buffered(std::io::Cursor::new(bytes)).unwrap();
    let channels =
        image.layer_data.iter().flat_map(|layer| layer.channel_data.list.iter().map(move |c| (layer.size, c)));
    let mut found = channels.filter(|(_, c)| c.name.to_string().contains('Z') || c.name.to_string().contains("depth"));
    let (size, channel) = found.next().unwrap();
    channel.sample_data.value_by_flat_index(size.y() / 2 * size.x() + size.x() / 2).to_f32()
}

#[test]
fn faults_say_what_to_do() {
    let place = Place::new();
    place.write("walk.json", WALK);
    place.write("mast.gltf", mast());
    place.write("bad.json", r#"{ "keys": [{ "time": 0, "camera": "main" }, { "time": 1, "camera": "nobody" }] }"#);
    place.write("up.json", r#"{ "keys": [{ "time": 0, "eye": [0, 3, 0], "target": [0, 0, 0] }] }"#);
    place.write("focus.json", r#"{ "keys": [{ "time": 0, "eye": [0, 1, 3], "target": [0, 0, 0], "focus": 2 }] }"#);
    let walk = |extra: &[&'static str]| [&["cornell", "--path", "walk.json"], extra].concat();
    let cases: [(Vec<&str>, &[&str]); 15] = [
        (vec!["cornell", "--path", "none.json"], &["none.json", "no such file", "animation:NAME"]),
        (vec!["hall", "--path", "bad.json"], &["bad.json: keys[1]", "nobody", "0 \"main\", 1 \"gallery\""]),
        (vec!["cornell", "--path", "up.json"], &["up.json: keys[0]", "looks along its \"up\""]),
        (vec!["cornell", "--path", "focus.json"], &["focus.json: keys[0].focus", "--dof"]),
        (walk(&["-o", "a.png"]), &["a.png", "no place for a number", "frames/%04d.png"]),
        (walk(&["-o", "a.jpg"]), &["a.jpg", ".mp4"]),
        (walk(&["-o", "nowhere/%d.png"]), &["nowhere", "there is no folder"]),
        (walk(&["--frames", "2..9"]), &["--frames 2..9", "3 frames", "0..3"]),
        (walk(&["--frames", "2..2"]), &["--frames", "A less than B"]),
        (walk(&["--time", "3"]), &["--time", "--path"]),
        (walk(&["--eye", "0,0,0"]), &["--eye", "--path"]),
        (walk(&["--fps", "1e9"]), &["--fps", "0.001 to 1000"]),
        (vec!["cornell", "--path", "animation"], &["no animation in the scene moves a camera"]),
        (
            vec!["mast.gltf", "--path", "animation:walk"],
            &["animation:walk", "the scene has \"round\" of the camera \"eye\""],
        ),
        (vec!["mast.gltf", "--path", "animation", "--dof", "f/2"], &["--dof", "a distance"]),
    ];
    for (args, parts) in cases {
        let run = place.run(&[&["render"], &args[..], &["--patches", "300"]].concat());
        assert_eq!(run.code, Some(2), "{args:?}: {}", run.stderr);
        for part in parts {
            assert!(run.stderr.contains(part), "{args:?}: \"{part}\" is missing in: {}", run.stderr);
        }
    }
    assert_eq!(place.files(), ["bad.json", "focus.json", "mast.gltf", "up.json", "walk.json"]);
}

/// Films, with a stand-in for ffmpeg that writes down what it was told and which frames it found.
#[cfg(unix)]
mod films {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    const FFMPEG: &str = "#!/bin/sh\ncase \"$*\" in *-encoders*) echo ' V..... libx264 H.264'; exit 0;; esac\n\
        for last; do :; done\n\
        [ -e ../fail ] && { echo 'no room' >&2; exit 1; }\n\
        { echo \"$*\"; ls; } > told; mv told \"$last\"\n";

    fn place(ffmpeg: bool) -> Place {
        let place = Place::new();
        place.write("walk.json", WALK);
        std::fs::create_dir(place.path("bin")).unwrap();
        if ffmpeg {
            place.write("bin/ffmpeg", FFMPEG);
            std::fs::set_permissions(place.path("bin/ffmpeg"), PermissionsExt::from_mode(0o755)).unwrap();
        }
        place
    }

    fn film(place: &Place, output: &str) -> (Option<i32>, String) {
        let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("twinray"));
        command.args(["render", "cornell", "--path", "walk.json", "-o", output]).args(TINIEST);
        // What the stand-in itself calls is where it always is, and no ffmpeg of this machine is.
        command.current_dir(place.path("")).env("PATH", place.path("bin"));
        if place.path("bin/ffmpeg").exists() {
            for program in ["ls", "mv"] {
                let real = ["/bin", "/usr/bin"]
                    .iter()
                    .map(|d| format!("{d}/{program}"))
                    .find(|p| std::path::Path::new(p).exists());
                let _ = std::os::unix::fs::symlink(real.unwrap(), place.path(&format!("bin/{program}")));
            }
        }
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    }

    #[test]
    fn frames_become_a_film() {
        let place = place(true);
        let (code, said) = film(&place, "walk.mp4");
        assert_eq!(code, Some(0), "{said}");
        let told = String::from_utf8(place.read("walk.mp4")).unwrap();
        for part in
            ["-framerate 2 ", "-start_number 0 ", "libx264", "yuv420p", "00000000.png\n00000001.png\n00000002.png"]
        {
            assert!(told.contains(part), "{part} is missing in {told}");
        }
        assert_eq!(place.files(), ["bin", "walk.json", "walk.mp4"], "frames are removed");
    }

    #[test]
    fn without_ffmpeg_nothing_is_paid_for() {
        let bare = place(false);
        let (code, said) = film(&bare, "walk.mp4");
        assert!(code == Some(2) && said.contains("https://ffmpeg.org") && said.contains("%04d.png"), "{said}");
        assert_eq!(bare.files(), ["bin", "walk.json"]);
        let (code, said) = film(&place(true), "walk.webm");
        assert!(code == Some(2) && said.contains("libvpx-vp9"), "{said}");
    }

    /// Frames may have taken hours.
    #[test]
    fn a_film_that_fails_keeps_its_frames() {
        let place = place(true);
        place.write("fail", "");
        let (code, said) = film(&place, "walk.mp4");
        assert!(code == Some(2) && said.contains("no room") && said.contains("frames are kept in"), "{said}");
        assert!(place.path(".walk.mp4.twinray.frames/00000002.png").exists());
        std::fs::remove_file(place.path("fail")).unwrap();
        assert_eq!(film(&place, "walk.mp4").0, Some(0));
        assert_eq!(place.files(), ["bin", "walk.json", "walk.mp4"], "the next one takes the folder over");
    }
}
