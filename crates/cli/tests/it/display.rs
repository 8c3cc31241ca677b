//! Film, lens and screen: what the options of `render` do, and what they say when they cannot.

use crate::support::{Place, png, shows_something};

#[test]
fn a_crop_is_that_part_of_the_picture() {
    let place = Place::new();
    // Automatic exposure is that of what is seen; with stops the bytes are those of the whole picture.
    // And the default method sends rays where noise is, which is not the same place in a part.
    let options = ["cornell", "--exposure", "1", "--method", "patches"];
    place.render(&[&options[..], &["-o", "whole.png"]].concat());
    place.render(&[&options[..], &["-o", "part.png", "--crop", "10,20,30x8"]].concat());
    let (whole, part) = (png(&place.read("whole.png")), png(&place.read("part.png")));
    assert_eq!((part.0, part.1), (30, 8));
    let rows = (20..28).map(|y| 3 * (y * 64 + 10));
    let expected: Vec<u8> = rows.flat_map(|at| whole.2[at..at + 90].to_vec()).collect();
    assert_eq!(part.2, expected);
    let run = place.run(&["render", "cornell", "--size", "64x48", "--crop", "40,20,30x8"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("--crop 40,20,30x8") && run.stderr.contains("64x48"), "{}", run.stderr);
    assert!(!run.stderr.contains("picture in"), "it is refused before the solve: {}", run.stderr);
}

#[test]
fn wide_cameras_have_their_shapes() {
    let place = Place::new();
    let small = ["--patches", "500", "--rays", "1000", "--samples", "1", "--method", "patches"];
    let size = |name: &str, more: &[&str]| {
        place.done(&[&["render", "cornell-closed", "-o", name], &small[..], more].concat());
        let (width, height, rgb) = png(&place.read(name));
        ((width, height), rgb)
    };
    let (shape, rgb) = size("panorama.png", &["--panorama"]);
    assert_eq!(shape, (1024, 512));
    assert!(rgb.iter().filter(|&&c| c == 0).count() < rgb.len() / 10, "there is something all around");
    let (shape, rgb) = size("fisheye.png", &["--fisheye", "180"]);
    assert_eq!(shape, (512, 512));
    assert_eq!(rgb[..30], [0; 30], "outside the circle it is black");
    assert!(rgb[3 * (256 * 512 + 256)] > 0);
    for (more, words) in [
        (&["--panorama", "--fov", "50"][..], &["--panorama", "--fov"][..]),
        (&["--fisheye", "180", "--dof", "f/2"], &["--fisheye", "--dof"]),
        (&["--fisheye", "400"], &["--fisheye", "360 degrees"]),
    ] {
        let run = place.run(&[&["render", "cornell"], more].concat());
        assert_eq!(run.code, Some(2), "{more:?}");
        assert!(words.iter().all(|word| run.stderr.contains(word)), "{}", run.stderr);
    }
}

/// Sharpness: squares of differences between neighbouring blocks of 4 × 4 pixels, over which noise is averaged.
fn contrast(bytes: &[u8]) -> f64 {
    let (width, height, rgb) = png(bytes);
    let green = |x: u32, y: u32| f64::from(rgb[(3 * (y * width + x) + 1) as usize]);
    let block = |x: u32, y: u32| (0..16).map(|i| green(4 * x + i % 4, 4 * y + i / 4)).sum::<f64>() / 16.0;
    let places = (0..height / 4).flat_map(|y| (1..width / 4).map(move |x| (x, y)));
    places.map(|(x, y)| (block(x, y) - block(x - 1, y)).powi(2)).sum()
}

#[test]
fn depth_of_field_blurs_what_is_out_of_focus() {
    let place = Place::new();
    let look = |name: &str, more: &[&str]| {
        place.render(&[&["cornell", "--method", "patches", "--exposure", "1", "-o", name], more].concat());
        contrast(&place.read(name))
    };
    // The box lies .8 m to 1.36 m before the camera; the middle of its picture is its back wall.
    let sharp = look("sharp.png", &[]);
    let blurred = look("near.png", &["--dof", "0.05,0.3"]);
    let middle = look("middle.png", &["--dof", "0.005"]);
    println!("{blurred:.0} out of focus, {middle:.0} in focus, {sharp:.0} sharp");
    assert!(blurred < 0.7 * sharp && (middle / sharp - 1.0).abs() < 0.1, "{blurred}, {middle} and {sharp}");
    shows_something(&place.read("middle.png"));
    place.render(&["cornell", "--dof", "f/2.8,1", "--samples", "8", "-o", "full_frame.png"]);
    place.write("plan.gltf", PLAN);
    let run = place.run(&["render", "plan.gltf", "--dof", "f/2.8"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("--dof: camera") && run.stderr.contains("parallel"), "{}", run.stderr);
    let away = ["--eye", "0.2,0.2,-1", "--target", "0.2,0.2,-2", "--dof", "f/4"];
    let run = place.run(&[&["render", "cornell"], &away[..]].concat());
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("nothing in the middle") && run.stderr.contains("f/2.8,3.5"), "{}", run.stderr);
}

/// A triangle that a parallel projection looks at.
const PLAN: &str = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0, 1] }], "scene": 0,
    "nodes": [{ "mesh": 0 }, { "camera": 0, "translation": [0, 0, 5] }],
    "cameras": [{ "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "znear": 0, "zfar": 9 } }],
    "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
    "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }],
    "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
    "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }] }"#;

/// Means of the channels of a PNG.
fn means(bytes: &[u8]) -> [f64; 3] {
    let rgb = png(bytes).2;
    std::array::from_fn(|c| rgb.iter().skip(c).step_by(3).map(|&v| f64::from(v)).sum::<f64>() / (rgb.len() / 3) as f64)
}

#[test]
fn exposure_is_that_of_the_camera() {
    let place = Place::new();
    let ev = |exposure: &str| {
        place.report(&["doorway", "--method", "patches", "--exposure", exposure])["exposure_ev"].as_f64().unwrap()
    };
    // 1.2 · 2^EV100 nit become 1: EV100 of f/4 at 1/60 s is log₂(16 · 60) = 9.907.
    assert!((ev("camera:100,1/60,f/4") + 9.907 + 1.2f64.log2()).abs() < 1e-3);
    assert!((ev("camera:400,1/60,f/4") - ev("camera:100,1/60,f/4") - 2.0).abs() < 1e-9);
    let run = place.run(&["render", "cornell", "--exposure", "camera:100,1/60"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("camera:100,1/60,f/4"), "{}", run.stderr);
}

#[test]
fn every_curve_and_white_makes_a_picture() {
    let place = Place::new();
    let mut seen = Vec::new();
    for more in
        ["--tone agx", "--tone aces", "--tone reinhard", "--tone none", "--white-balance auto", "--white-balance 3000"]
    {
        let more: Vec<&str> = more.split(' ').collect();
        place.render(&[&["cornell", "--method", "patches", "-o", "p.png"], &more[..]].concat());
        let bytes = place.read("p.png");
        shows_something(&bytes);
        assert!(!seen.contains(&bytes), "{more:?} shows what another did");
        seen.push(bytes);
    }
    // The light of the Cornell box is warm, and all but white for a camera that is set to its 2,700 K or so.
    let [warm, balanced] = [0, 5].map(|i| means(&seen[i]));
    assert!(warm[2] < 0.8 * warm[0] && balanced[2] / balanced[0] > 1.3 * warm[2] / warm[0], "{warm:?} {balanced:?}");
    let run = place.run(&["render", "cornell", "--white-balance", "500"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("1667 to 25000 kelvin"), "{}", run.stderr);
}

/// Names of the channels of an EXR file.
fn channels(bytes: &[u8]) -> String {
    let meta = exr::meta::MetaData::read_from_buffered(std::io::Cursor::new(bytes), false).unwrap();
    let names = meta.headers[0].channels.list.iter().map(|c| c.name.to_string());
    names.collect::<Vec<_>>().join(" ")
}

/// Direct and indirect light are the picture together, and there is some of both.
fn light_adds_up(path: &std::path::Path) {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let file = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let channels = file.from_file(path).unwrap().layer_data.channel_data.list;
    let values = |name: &str| -> Vec<f32> {
        channels.iter().find(|c| c.name == *name).unwrap().sample_data.values_as_f32().collect()
    };
    let [all, direct, indirect] = ["R", "direct.R", "indirect.R"].map(values);
    assert_eq!(all.len(), 12);
    for (i, all) in all.iter().enumerate() {
        assert!((all - direct[i] - indirect[i]).abs() < 1e-5 * all.abs().max(1e-3), "{all} {direct:?} {indirect:?}");
    }
    assert!(direct.iter().sum::<f32>() > 0.0 && indirect.iter().sum::<f32>() > 0.0, "{direct:?} {indirect:?}");
}

#[test]
fn layers_are_written_on_demand() {
    let place = Place::new();
    place.render(&["cornell", "--samples", "8", "-o", "plain.exr"]);
    place.render(&["cornell", "--samples", "8", "-o", "some.exr", "--aov", "albedo,depth"]);
    place.render(&["cornell", "-o", "all.exr", "--aov", "all", "--crop", "31,22,3x4"]);
    place.done(&[
        "render",
        "cornell",
        "--method",
        "path",
        "--samples",
        "2",
        "--size",
        "8x8",
        "--aov",
        "error",
        "-o",
        "path.exr",
    ]);
    assert_eq!(channels(&place.read("plain.exr")), "B G R");
    assert_eq!(channels(&place.read("some.exr")), "B G R albedo.B albedo.G albedo.R depth.Z");
    let all = "B G R albedo.B albedo.G albedo.R depth.Z direct.B direct.G direct.R error.Y indirect.B indirect.G \
        indirect.R normal.X normal.Y normal.Z patch.id";
    assert_eq!(channels(&place.read("all.exr")), all);
    light_adds_up(&place.path("all.exr"));
    assert_eq!(channels(&place.read("path.exr")), "B G R error.Y");
    // Whoever compares pictures sees the picture alone, which layers do not change.
    let compared = place.done(&["compare", "plain.exr", "some.exr", "--json"]).json();
    assert_eq!(compared["rmse"], 0.0, "{compared}");
    for (more, words) in [
        (&["-o", "a.png", "--aov", "albedo"][..], &["--aov", ".exr"][..]),
        (
            &["-o", "a.exr", "--method", "patches", "--aov", "direct"],
            &["--aov direct", "--method patches", "albedo, normal, depth, patch"],
        ),
        (&["-o", "a.exr", "--aov", "colour"], &["--aov", "albedo"]),
    ] {
        let run = place.run(&[&["render", "cornell"], more].concat());
        assert_eq!(run.code, Some(2), "{more:?}");
        assert!(words.iter().all(|word| run.stderr.contains(word)), "{}", run.stderr);
    }
}

/// Without the library, or without the feature that looks for it, one is told where to get it; with both, noise goes away.
#[test]
fn denoising_says_what_it_needs() {
    let place = Place::new();
    let noisy = ["render", "cornell", "--method", "path", "--samples", "4", "--size", "64x48"];
    let run = place.run(&[&noisy[..], &["--denoise", "-o", "denoised.exr"]].concat());
    if cfg!(feature = "oidn") && run.code == Some(0) {
        place.done(&[&noisy[..], &["-o", "noisy.exr"]].concat());
        place.done(&[&noisy[..4], &["--samples", "400", "--size", "64x48", "-o", "long.exr"]].concat());
        let far = |name: &str| place.done(&["compare", name, "long.exr", "--json"]).json()["relmse"].as_f64().unwrap();
        let (before, after) = (far("noisy.exr"), far("denoised.exr"));
        println!("relMSE {before:.4} with noise, {after:.4} without");
        assert!(after < 0.4 * before, "{after} and {before}");
    } else {
        println!("skipped: Open Image Denoise is not there to be tried");
        assert_eq!(run.code, Some(2));
        assert!(run.stderr.contains("https://www.openimagedenoise.org"), "{}", run.stderr);
        let next = if cfg!(feature = "oidn") { "LD_LIBRARY_PATH" } else { "--features oidn" };
        assert!(run.stderr.contains(next), "{}", run.stderr);
        assert!(place.files().is_empty(), "it is refused before anything is written");
    }
}
