//! Maps of all directions: Radiance pictures of all forms, EXR, faults, real files.

use proptest::prelude::*;
use twinray_format::{FormatError, Limits, read_radiance_map, write_exr};
use twinray_scene::RadianceMap;

use crate::real::shared_scenes;

fn read(bytes: &[u8]) -> Result<RadianceMap, FormatError> {
    read_radiance_map("a.hdr", bytes, &Limits::default()).map(|(map, _)| map)
}

fn hdr(header: &str, size: &str, data: &[u8]) -> Vec<u8> {
    [format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n{size}\n").as_bytes(), data].concat()
}

/// Four pixels whose exponent of 136 makes the value the mantissa and a half.
const FOUR: [u8; 16] = [10, 0, 0, 136, 20, 0, 0, 136, 30, 0, 0, 136, 40, 0, 0, 136];

fn reds(map: &RadianceMap) -> Vec<f32> {
    map.pixels.iter().map(|p| p[0] - 0.5).collect()
}

#[test]
fn all_orientations() {
    for (size, width, expected) in [
        ("-Y 2 +X 2", 2, [10.0, 20.0, 30.0, 40.0]),
        ("+Y 2 +X 2", 2, [30.0, 40.0, 10.0, 20.0]),
        ("-Y 2 -X 2", 2, [20.0, 10.0, 40.0, 30.0]),
        ("+X 2 -Y 2", 2, [10.0, 30.0, 20.0, 40.0]),
        ("-X 2 +Y 2", 2, [40.0, 20.0, 30.0, 10.0]),
        ("-Y 1 +X 4", 4, [10.0, 20.0, 30.0, 40.0]),
    ] {
        let map = read(&hdr("", size, &FOUR)).unwrap();
        assert_eq!((map.width, &reds(&map)[..]), (width, &expected[..]), "{size}");
    }
}

#[test]
fn exposure_and_colour_are_taken_back() {
    let map =
        read(&hdr("EXPOSURE=2\nEXPOSURE= 2.5\nCOLORCORR=2 1 1\n# EXPOSURE\nVIEW=x\n", "-Y 1 +X 4", &FOUR)).unwrap();
    assert_eq!(map.pixels[0], [10.5 / 10.0, 0.1, 0.1]);
    // Black is exactly that.
    assert_eq!(read(&hdr("", "-Y 1 +X 1", &[9, 9, 9, 0])).unwrap().pixels, [[0.0; 3]]);
}

#[test]
fn both_run_length_codings() {
    // New: per channel, a run of 5 and 3 single values.
    let channel = |v: u8| [vec![133, v, 3], vec![v + 1, v + 2, v + 3]].concat();
    let data = [vec![2, 2, 0, 8], channel(10), channel(20), channel(30), vec![136, 136]].concat();
    let map = read(&hdr("", "-Y 1 +X 8", &data)).unwrap();
    assert_eq!(reds(&map), [10.0, 10.0, 10.0, 10.0, 10.0, 11.0, 12.0, 13.0]);
    // Old: a pixel, 2 + 256 repetitions of it, another.
    let data = [10, 0, 0, 136, 1, 1, 1, 2, 1, 1, 1, 1, 20, 0, 0, 136];
    let map = read(&hdr("", "-Y 1 +X 260", &data)).unwrap();
    assert!(reds(&map)[..259].iter().all(|&r| r == 10.0) && reds(&map)[259] == 20.0);
}

#[test]
fn faults_are_named() {
    let small = Limits { max_image_texels: 3, ..Limits::default() };
    let cases: [(Vec<u8>, &str); 9] = [
        (b"PNG".to_vec(), "of neither kind"),
        (b"#?RADIANCE\nFORMAT=x\n".to_vec(), "unknown format"),
        (b"#?RADIANCE\n".to_vec(), "no end"),
        (hdr("EXPOSURE=0\n", "-Y 1 +X 4", &FOUR), "EXPOSURE"),
        (hdr("", "-Y 1 +Z 4", &FOUR), "-Y 1 +Z 4"),
        (hdr("", "-Y 0 +X 4", &FOUR), "no pixels"),
        (hdr("", "-Y 2 +X 4", &FOUR), "line 1"),
        // A run that goes on beyond the line, and one of nothing before.
        (hdr("", "-Y 1 +X 8", &[2, 2, 0, 8, 137, 1]), "line 0"),
        (hdr("", "-Y 1 +X 4", &[1, 1, 1, 3]), "line 0"),
    ];
    for (bytes, words) in cases {
        let message = read(&bytes).unwrap_err().to_string();
        assert!(message.starts_with("a.hdr: ") && message.contains(words), "{message}");
    }
    let over = read_radiance_map("a.hdr", &hdr("", "-Y 1 +X 4", &FOUR), &small);
    assert!(matches!(over, Err(FormatError::OverLimit { limit: "max_image_texels", .. })));
    // As large as can be asked for, of no bytes at all.
    let huge = read(&hdr("", "-Y 1000000 +X 1000000", &[]));
    assert!(matches!(huge, Err(FormatError::OverLimit { .. })));
}

#[test]
fn exr_maps_are_brought_into_range_with_a_warning() {
    let bytes = write_exr(2, 1, &[[1.0, -2.0, 3.0], [0.5, 0.0, 1e20]], None, &[]);
    let (map, warnings) = read_radiance_map("a.exr", &bytes, &Limits::default()).unwrap();
    assert_eq!(map.pixels, [[1.0, 0.0, 3.0], [0.5, 0.0, 1e12]]);
    let text: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(text.len() == 2 && text[0].contains("1 negative") && text[1].contains("max_radiance"), "{text:?}");
    let square = write_exr(2, 2, &[[1.0; 3]; 4], None, &[]);
    let (_, warnings) = read_radiance_map("a.exr", &square, &Limits::default()).unwrap();
    assert!(warnings[0].message.contains("twice as wide as high"));
}

#[test]
fn real_maps() {
    let Some(root) = shared_scenes() else { return };
    let load = |name: &str| {
        let bytes = std::fs::read(root.join(name)).unwrap();
        read_radiance_map(name, &bytes, &Limits::default())
    };
    let (beach, warnings) = load("hdr/spiaggia_di_mondello_1k.hdr").unwrap();
    assert_eq!((beach.width, beach.height, warnings.len()), (1024, 512, 0));
    // The sky is brighter than the ground, and the sun brighter than the sky.
    let mean = |rows: std::ops::Range<usize>| {
        let part = &beach.pixels[1024 * rows.start..1024 * rows.end];
        part.iter().map(|p| f64::from(p[1])).sum::<f64>() / part.len() as f64
    };
    let most = beach.pixels.iter().map(|p| p[1]).fold(0.0, f32::max);
    assert!(mean(0..256) > 1.5 * mean(256..512) && f64::from(most) > 100.0 * mean(0..256), "{most}");
    for (name, width) in [
        ("hdr/parser-image1.hdr", 128),
        ("hdr/parser-old-rle.hdr", 0),
        ("hdr/parser-rgbr4x4.hdr", 4),
        ("hdr/parser-scale.hdr", 256),
    ] {
        let (map, _) = load(name).unwrap_or_else(|error| panic!("{error}"));
        assert!(width == 0 || map.width == width, "{name}");
    }
    let (sky, _) = load("grey-white-room/sky19.exr").unwrap();
    assert_eq!((sky.width, sky.height), (2048, 1024));
    let message = load("hdr/park.exr").unwrap_err().to_string();
    assert!(message.contains("DWAA or DWAB") && message.contains("ZIP"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_panic(junk in proptest::collection::vec(any::<u8>(), 0..80), width in 0u32..40) {
        let _ = read(&[b"#?", &junk[..]].concat());
        if let Ok(map) = read(&hdr("", &format!("-Y 2 +X {width}"), &junk)) {
            prop_assert!(map.pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0));
        }
        let lead = [&[2, 2, 0, width as u8][..], &junk[..]].concat();
        let _ = read(&hdr("", &format!("-Y 1 +X {width}"), &lead));
    }
}
