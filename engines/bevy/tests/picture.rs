//! What Bevy shows of a baked scene is what twinray shows of the scene. Needs the command `twinray` (in `TWINRAY`, or in the
//! path) and a Vulkan driver, if only in software: `check.sh` sees to both.

use std::path::Path;
use std::process::Command;

use image::Rgb32FImage;

/// Side of the squares of pixels that are compared.
const SQUARE: u32 = 8;

#[test]
#[ignore = "needs twinray and a Vulkan driver: check.sh"]
fn cornell_looks_as_twinray_shows_it() {
    looks_right("cornell", "--density 100", 0.02);
}

#[test]
#[ignore = "needs twinray and a Vulkan driver: check.sh"]
fn doorway_looks_as_twinray_shows_it() {
    looks_right("doorway", "--density 20", 0.04);
}

#[test]
#[ignore = "needs twinray and a Vulkan driver: check.sh"]
fn hall_looks_as_twinray_shows_it() {
    looks_right("hall-diffuse", "", 0.05);
}

/// Bakes a scene and compares pictures: means within 2 %, half of the squares within `most`.
fn looks_right(name: &str, how: &str, most: f64) {
    let folder = tempfile::tempdir().unwrap();
    twinray(folder.path(), &format!("solve {name} --rays 20M -o {name}.twin -q"));
    twinray(folder.path(), &format!("bake {name}.twin --for bevy -o lit.glb -q {how}"));
    let size = "--size 480x360";
    twinray(folder.path(), &format!("render {name}.twin -o twinray.exr {size} --method gather --samples 16 -q"));
    let log = shot(folder.path(), &format!("lit.glb --shot bevy.exr {size}"));
    let [ours, theirs] = ["bevy.exr", "twinray.exr"].map(|name| read(&folder.path().join(name)));
    let (ratio, median) = compare(&ours, &theirs);
    println!("{name}: ratio of means {ratio:.4}, half of the squares within {:.2} %", 100.0 * median);
    assert!((ratio - 1.0).abs() < 0.02, "ratio of means {ratio}\n{log}");
    assert!(median < most, "half of the squares within {median}\n{log}");
}

/// A copy with a lamp of its own under the ceiling, baked with and without it in the file: what is baked is not added again.
#[test]
#[ignore = "needs twinray and a Vulkan driver: check.sh"]
fn lights_that_are_kept_do_not_light_twice() {
    let folder = tempfile::tempdir().unwrap();
    twinray(folder.path(), "scene cornell -o cornell.glb");
    add_light(&folder.path().join("cornell.glb"));
    for (name, how) in [("dropped", ""), ("kept", "--keep-lights")] {
        twinray(folder.path(), &format!("bake cornell.glb --for bevy --rays 2M -o {name}.glb -q {how}"));
        shot(folder.path(), &format!("{name}.glb --shot {name}.exr --size 240x180"));
    }
    let [dropped, kept] = ["dropped.exr", "kept.exr"].map(|name| read(&folder.path().join(name)));
    let (ratio, _) = compare(&kept, &dropped);
    println!("kept lights: ratio of means {ratio:.4}");
    assert!((ratio - 1.0).abs() < 0.005, "ratio of means {ratio}");
}

fn twinray(folder: &Path, arguments: &str) {
    let program = std::env::var_os("TWINRAY").unwrap_or_else(|| "twinray".into());
    let status = Command::new(program).args(arguments.split_whitespace()).current_dir(folder).status().unwrap();
    assert!(status.success(), "twinray {arguments}: {status}");
}

fn shot(folder: &Path, arguments: &str) -> String {
    let program = env!("CARGO_BIN_EXE_twinray-bevy");
    let output = Command::new(program).args(arguments.split_whitespace()).current_dir(folder).output().unwrap();
    let log = [output.stdout, output.stderr].map(|s| String::from_utf8_lossy(&s).into_owned()).concat();
    assert!(output.status.success(), "twinray-bevy {arguments}: {}\n{log}", output.status);
    log
}

fn read(path: &Path) -> Rgb32FImage {
    image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).into_rgb32f()
}

/// The ratio of the means over all pixels, and the median over squares of how far they are off.
fn compare(ours: &Rgb32FImage, theirs: &Rgb32FImage) -> (f64, f64) {
    assert_eq!(ours.dimensions(), theirs.dimensions());
    let sum = |picture: &Rgb32FImage, x: u32, y: u32, width: u32, height: u32| -> f64 {
        let places = (y..y + height).flat_map(|y| (x..x + width).map(move |x| (x, y)));
        places.flat_map(|(x, y)| picture.get_pixel(x, y).0).map(f64::from).sum()
    };
    let (width, height) = ours.dimensions();
    let ratio = sum(ours, 0, 0, width, height) / sum(theirs, 0, 0, width, height);
    let mut off = Vec::new();
    for y in (0..=height - SQUARE).step_by(SQUARE as usize) {
        for x in (0..=width - SQUARE).step_by(SQUARE as usize) {
            let [ours, theirs] = [ours, theirs].map(|picture| sum(picture, x, y, SQUARE, SQUARE));
            if theirs > 0.0 {
                off.push((ours / theirs - 1.0).abs());
            }
        }
    }
    off.sort_by(f64::total_cmp);
    (ratio, off[off.len() / 2])
}

/// Puts a point light into the middle of the box.
fn add_light(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let light = serde_json::json!({ "lights": [{ "type": "point", "intensity": 0.5, "name": "bulb" }] });
    document["extensions"] = serde_json::json!({ "KHR_lights_punctual": light });
    let mut used = document["extensionsUsed"].as_array().cloned().unwrap_or_default();
    used.push("KHR_lights_punctual".into());
    document["extensionsUsed"] = used.into();
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.push(serde_json::json!({
        "name": "lamp", "translation": [0.278, 0.4, 0.28], "extensions": { "KHR_lights_punctual": { "light": 0 } },
    }));
    let node = nodes.len() - 1;
    document["scenes"][0]["nodes"].as_array_mut().unwrap().push(node.into());
    let mut text = serde_json::to_vec(&document).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = Vec::from(&bytes[..8]);
    out.extend(((bytes.len() - length + text.len()) as u32).to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(&bytes[16..20]);
    out.extend(text);
    out.extend(&bytes[20 + length..]);
    std::fs::write(path, out).unwrap();
}
