//! Pictures read back: what was written, what other programs write, and what is refused.

use std::io::Cursor;

use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, Rgba};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use twinray_format::{FormatError, Limits, PictureFile, read_picture, write_exr, write_png};

fn read(bytes: &[u8]) -> Result<PictureFile, FormatError> {
    read_picture("a.picture", bytes, &Limits::default())
}

fn encoded(picture: impl Into<DynamicImage>) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    picture.into().write_to(&mut out, ImageFormat::Png).unwrap();
    out.into_inner()
}

#[test]
fn what_was_written_comes_back() {
    let rgb: Vec<u8> = (0..3 * 5 * 4).map(|i| (i * 4) as u8).collect();
    let picture = read(&write_png(5, 4, &rgb, &[])).unwrap();
    let display = picture.display.unwrap();
    assert_eq!((picture.image.width, picture.image.height, display.len()), (5, 4, 20));
    assert_eq!(display[7], [84.0 / 255.0, 88.0 / 255.0, 92.0 / 255.0]);
    // IEC 61966-2-1: code 188 is half of the light.
    assert!((picture.image.pixels[15][2] - 0.502_886).abs() < 1e-5);

    let pixels: Vec<[f32; 3]> = (0..37 * 21).map(|i| [i as f32 * 0.37, 1e-6 * i as f32, -(i as f32)]).collect();
    let picture = read(&write_exr(37, 21, &pixels, None, &[])).unwrap();
    assert_eq!((picture.image.width, picture.image.height), (37, 21));
    assert_eq!((picture.image.pixels, picture.display), (pixels, None));
}

#[test]
fn other_kinds_of_png_are_read() {
    let deep = encoded(ImageBuffer::from_pixel(2, 1, Rgb([65535u16, 257 * 188, 1])));
    let display = read(&deep).unwrap().display.unwrap();
    assert_eq!(display[1], [1.0, 188.0 / 255.0, 1.0 / 65535.0]);
    let grey = encoded(ImageBuffer::from_pixel(2, 1, Luma([188u8])));
    let picture = read(&grey).unwrap();
    assert_eq!(picture.display.unwrap()[0], [188.0 / 255.0; 3]);
    assert!((picture.image.pixels[0][0] - 0.502_886).abs() < 1e-5);
    let clear = encoded(ImageBuffer::from_pixel(2, 1, Rgba([10u8, 20, 30, 0])));
    assert_eq!(read(&clear).unwrap().display.unwrap()[0], [10.0 / 255.0, 20.0 / 255.0, 30.0 / 255.0]);
}

#[track_caller]
fn refused(bytes: &[u8], words: &[&str]) {
    let message = read(bytes).expect_err("must be refused").to_string();
    for word in ["a.picture"].iter().chain(words) {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

#[test]
fn what_is_no_picture_is_refused() {
    refused(b"", &["no picture of a known kind", "PNG or an EXR"]);
    refused(b"GIF89a", &["no picture of a known kind"]);
    let (png, exr) = (write_png(5, 4, &[9; 60], &[]), write_exr(5, 4, &[[1.0; 3]; 20], None, &[]));
    refused(&png[..png.len() / 2], &["a PNG picture", "complete"]);
    refused(&exr[..exr.len() / 2], &["an EXR picture"]);
    let mut pixels = vec![[1.0; 3]; 20];
    pixels[7][1] = f32::NAN;
    refused(&write_exr(5, 4, &pixels, None, &[]), &["pixel (2, 1)", "NaN", "finite"]);
}

#[test]
fn large_pictures_are_refused_before_they_are_decoded() {
    // 8192 × 8192 black pixels in some 200 kB.
    let bomb = write_png(8192, 8192, &vec![0; 3 << 26], &[]);
    refused(&bomb, &["67108864 pixels", "max_image_texels"]);
    let limits = Limits { max_image_texels: 19, ..Limits::default() };
    let exr = write_exr(5, 4, &[[1.0; 3]; 20], None, &[]);
    let error = read_picture("a.exr", &exr, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_image_texels", .. }), "{error}");
    let limits = Limits { max_file_bytes: 10, ..Limits::default() };
    let error = read_picture("a.exr", &exr, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_file_bytes", .. }), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// Changed bytes are read or refused, without panic.
    #[test]
    fn changed_pictures_are_read_or_refused(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let pixels: Vec<[f32; 3]> = (0..40).map(|i| [i as f32; 3]).collect();
        let rgb: Vec<u8> = (0..120).collect();
        for mut bytes in [write_exr(8, 5, &pixels, None, &[]), write_png(8, 5, &rgb, &[("Comment", "x")])] {
            for (place, value) in &changes {
                let at = place.index(bytes.len());
                bytes[at] = *value;
            }
            let _ = read(&bytes);
        }
    }
}

/// A block of an EXR picture is unpacked with all of its channels: few pixels may ask for much.
#[test]
fn pictures_of_very_many_channels_are_refused() {
    let bytes = write_exr(64, 64, &[[0.5; 3]; 64 * 64], None, &[]);
    let limits = Limits { max_image_texels: 64 * 64, ..Limits::default() };
    assert!(read_picture("a.picture", &bytes, &limits).is_ok());
    // The list of channels: a name, a type and sixteen bytes of each. Five hundred more, of 32 bits.
    let at = bytes.windows(8).position(|w| w == b"chlist\0\x37").expect("the list of three channels");
    let (size_at, list_at) = (at + 7, at + 11);
    let entry = |name: &str| [name.as_bytes(), b"\0", &[2, 0, 0, 0], &[0; 4], &[1, 0, 0, 0], &[1, 0, 0, 0]].concat();
    let more: Vec<u8> = (0..500).flat_map(|i| entry(&format!("Z{i:03}"))).collect();
    let size = u32::from_le_bytes(bytes[size_at..size_at + 4].try_into().unwrap());
    let (head, rest) = (&bytes[..size_at], &bytes[list_at..]);
    let (list, rest) = rest.split_at(size as usize - 1);
    let grown = [head, &(size + more.len() as u32).to_le_bytes(), list, &more, rest].concat();
    match read_picture("a.picture", &grown, &limits) {
        Err(FormatError::OverLimit { limit: "max_image_texels", needed, .. }) => {
            assert!(needed.contains("channels"), "{needed}");
        }
        other => panic!("expected a refusal, got {:?}", other.map(|p| p.image.width)),
    }
}
