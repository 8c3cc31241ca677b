//! What each fuzz target does with its bytes. An ordinary test (`crates/format/tests/it/seeds.rs`) runs the same
//! functions, so that they compile and hold without a fuzzer.
//!
//! A body panics if a promise is broken: whatever can be read has no faults, can be cut into patches or is refused
//! in words, and can be written and read again.

use std::io;

use twinray_format::{
    FormatError, Limits, Reading, read_ies, read_picture, read_radiance_map, read_scene, read_solution, write_glb,
    write_obj, write_solution,
};
use twinray_scene::{
    LightKind, PatchBudget, PatchOptions, PatchScene, PunctualLight, Rgb, Scene, Surface, Texel, builtin,
};
use twinray_solve::{Params, Record, Solver};

/// Small enough that no input takes long; what is over them is refused as with the usual ones.
fn limits() -> Limits {
    Limits {
        max_file_bytes: 1 << 20,
        extra_memory: 32 << 20,
        max_triangles: 20_000,
        max_instances: 1000,
        max_image_texels: 1 << 18,
        max_texels: 1 << 19,
        ..Limits::default()
    }
}

/// JSON of glTF. Buffers it refers to are numbers between −1 and 1, pictures are a small PNG.
pub fn gltf(bytes: &[u8]) {
    let buffer: Vec<u8> = (0..256u32).flat_map(|i| ((i * 37 % 41) as f32 / 20.0 - 1.0).to_le_bytes()).collect();
    let picture = twinray_format::write_png(2, 1, &[200, 100, 50, 1, 2, 3], &[]);
    let mut resolver = |path: &str| Ok(if path.ends_with(".bin") { buffer.clone() } else { picture.clone() });
    check(read_scene("a.gltf", bytes, &mut resolver, &limits()));
}

/// Binary glTF. Bytes without its mark are JSON, a zero byte, and the binary part: the container is put around them.
pub fn glb(bytes: &[u8]) {
    let whole = if bytes.starts_with(b"glTF") { bytes.to_vec() } else { container(split(bytes)) };
    check(read_scene("a.glb", &whole, &mut |_: &str| Err(io::ErrorKind::NotFound.into()), &limits()));
}

/// OBJ, a zero byte, and the MTL file beside it.
pub fn obj(bytes: &[u8]) {
    let (text, materials) = split(bytes);
    let picture = twinray_format::write_png(2, 1, &[200, 100, 50, 1, 2, 3], &[]);
    let mut resolver = |path: &str| Ok(if path.ends_with(".mtl") { materials.to_vec() } else { picture.clone() });
    check(read_scene("a.obj", text, &mut resolver, &limits()));
}

/// A picture on a surface. An odd first byte names it `.tga`, the one format that only its name tells.
pub fn texture(bytes: &[u8]) {
    let Some((&first, picture)) = bytes.split_first() else { return };
    let name = if first % 2 == 1 { "t.tga" } else { "t.png" };
    let scene = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
    let materials = format!("newmtl a\nKd 1 1 1\nmap_Kd {name}\n").into_bytes();
    let mut resolver = |path: &str| Ok(if path == name { picture.to_vec() } else { materials.clone() });
    let reading = check(read_scene("a.obj", scene.as_bytes(), &mut resolver, &limits()));
    let reading = reading.expect("a picture is used or left out");
    assert!(!reading.scene.images.is_empty() || !reading.warnings.is_empty(), "left out without a word");
}

/// A picture to be compared: PNG or EXR.
pub fn picture(bytes: &[u8]) {
    if let Ok(picture) = read_picture("a.png", bytes, &limits()) {
        assert!(picture.image.pixels.iter().flatten().all(|c| c.is_finite()), "a pixel is not finite");
        assert!(picture.display.is_none_or(|d| d.len() == picture.image.pixels.len()));
    }
}

/// A map of all directions: Radiance or EXR.
pub fn map(bytes: &[u8]) {
    if let Ok((map, _)) = read_radiance_map("a.hdr", bytes, &limits()) {
        assert_eq!(map.pixels.len(), map.width as usize * map.height as usize);
        assert!(map.pixels.iter().flatten().all(|c| *c >= 0.0 && c.is_finite()), "a pixel is no radiance");
    }
}

/// A luminaire. What can be read is a light without faults.
pub fn ies(bytes: &[u8]) {
    let Ok(profile) = read_ies("a.ies", bytes, &limits()) else { return };
    assert!(profile.flux() >= 0.0 && profile.flux().is_finite());
    let light = PunctualLight {
        name: String::new(),
        kind: LightKind::Point,
        intensity: Rgb::WHITE,
        transform: glam::DAffine3::IDENTITY,
        profile: Some(profile.into()),
    };
    let faults = Scene { lights: vec![light], ..Scene::default() }.validate();
    assert!(faults.is_empty(), "what was read has faults: {faults:?}");
}

/// A stored solution, as it is and with its checksums put right, without which no change would get any further. What can
/// be read can be written, looked at, added up, and gone on from where it is of the scene that seeds are of.
pub fn solution(bytes: &[u8]) {
    for bytes in [bytes.to_vec(), with_checksums(bytes.to_vec())] {
        let Ok(file) = read_solution("a.twin", &bytes, &limits()) else { continue };
        let mut written = Vec::new();
        write_solution(&file, &mut written).expect("memory takes everything");
        let again = read_solution("a.twin", &written, &Limits::default());
        assert_eq!(again.expect("what was written can be read"), file);
        let Some(record) = &file.record else { continue };
        if let Record::Waves(waves) = record {
            twinray_solve::merge(&[(2, waves), (1, waves)]).expect("what was read can be added up");
        }
        let scene = lobes();
        for params in [Params::default_preset(1), Params::paper_preset(1)] {
            let _ = record.solution(&scene, &params);
            if let Ok(mut solver) = Solver::resume(&scene, params, record) {
                solver.advance(record.rays() + 1);
                let _ = solver.solution();
            }
        }
    }
}

/// Two plates with a lobe, one of which shines: the scene of the solutions among the seeds.
pub fn lobes() -> PatchScene {
    let mut scene = builtin::plates(1.0);
    for material in &mut scene.materials {
        let (diffuse, specular) = (Texel::constant(Rgb::grey(0.3)), Rgb::grey(0.4));
        material.surface = Surface::Phong { diffuse, specular, exponent: 20.0 };
    }
    let options = PatchOptions { budget: PatchBudget::Size(f64::INFINITY), two_sided: false };
    PatchScene::new(&scene, options).expect("a good scene")
}

/// The container of `docs/formats.md` with the checksums that its sections and its table have.
fn with_checksums(mut bytes: Vec<u8>) -> Vec<u8> {
    let number = |bytes: &[u8], at: usize, n: usize| -> Option<usize> {
        let part = bytes.get(at..at.checked_add(n)?)?;
        Some(part.iter().rev().fold(0, |sum, &b| sum << 8 | usize::from(b)))
    };
    let Some(sections) = number(&bytes, 12, 4).filter(|&n| n < 64) else { return bytes };
    for at in (0..sections).map(|i| 16 + 40 * i) {
        let range = number(&bytes, at + 16, 8).zip(number(&bytes, at + 24, 8));
        let range = range.and_then(|(from, length)| Some(from..from.checked_add(length)?));
        let Some(sum) = range.and_then(|range| bytes.get(range)).map(crc) else { continue };
        bytes[at + 12..at + 16].copy_from_slice(&sum.to_le_bytes());
    }
    let end = 16 + 40 * sections;
    if bytes.len() >= end + 8 {
        let sum = u64::from(crc(&bytes[..end]));
        bytes[end..end + 8].copy_from_slice(&sum.to_le_bytes());
    }
    bytes
}

/// CRC-32 of zlib and PNG, bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    let bit = |c: u32, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 };
    !bytes.iter().fold(!0, |crc, &b| (0..8).fold(crc ^ u32::from(b), bit))
}

/// Before and after the first zero byte.
fn split(bytes: &[u8]) -> (&[u8], &[u8]) {
    match bytes.iter().position(|&b| b == 0) {
        Some(at) => (&bytes[..at], &bytes[at + 1..]),
        None => (bytes, &[]),
    }
}

/// Binary glTF of a JSON and a binary part.
fn container((json, binary): (&[u8], &[u8])) -> Vec<u8> {
    let padded = |part: &[u8], with: u8| {
        let mut part = part.to_vec();
        part.resize(part.len().next_multiple_of(4), with);
        part
    };
    let (json, binary) = (padded(json, b' '), padded(binary, 0));
    let word = |n: usize| (n as u32).to_le_bytes();
    let chunk = |kind: &[u8; 4], part: &[u8]| [&word(part.len())[..], &kind[..], part].concat();
    let body = [chunk(b"JSON", &json), chunk(b"BIN\0", &binary)].concat();
    [&b"glTF"[..], &word(2), &word(12 + body.len()), &body].concat()
}

fn check(result: Result<Reading, FormatError>) -> Option<Reading> {
    let reading = match result {
        Ok(reading) => reading,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return None;
        }
    };
    let scene = &reading.scene;
    let faults = scene.validate();
    assert!(faults.is_empty(), "what was read has faults: {faults:?}");
    // Written and read again there are as many triangles, unless what was placed has no extent.
    let again = write_glb(scene);
    let mut nothing = |_: &str| Err(io::ErrorKind::NotFound.into());
    let again = read_scene("a.glb", &again, &mut nothing, &Limits::default());
    let again = again.unwrap_or_else(|error| panic!("what was written cannot be read: {error}"));
    let triangles =
        |r: &Reading| r.scene.instances.iter().map(|i| r.scene.meshes[i.mesh].triangles.len()).sum::<usize>();
    assert_eq!(triangles(&again), triangles(&reading));
    write_obj(scene);
    let options = PatchOptions { budget: PatchBudget::Count(64), two_sided: false };
    if let Ok(patches) = PatchScene::new(scene, options) {
        for patch in patches.patches() {
            assert!(patches.area(patch) > 0.0 && patches.area(patch).is_finite(), "area {}", patches.area(patch));
            assert!((patches.normal(patch).length() - 1.0).abs() < 1e-9, "normal {}", patches.normal(patch));
            assert!(patches.brdf(patch).mean_albedo().is_finite() && patches.emission(patch).is_finite());
        }
    }
    Some(reading)
}
