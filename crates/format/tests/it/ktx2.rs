//! KTX2 files: read back by a reader that is not ours, and by decoders that are written from the formats' definitions.

use std::io::Read;

use ktx2::{Format, Reader, SupercompressionScheme, dfd};
use proptest::prelude::*;
use twinray_format::{Ktx2Format, Ktx2Packing, write_ktx2};

const FORMATS: [(Ktx2Format, Format); 3] = [
    (Ktx2Format::Rgb9e5, Format::E5B9G9R9_UFLOAT_PACK32),
    (Ktx2Format::B10g11r11, Format::B10G11R11_UFLOAT_PACK32),
    (Ktx2Format::Rgba16f, Format::R16G16B16A16_SFLOAT),
];

const PACKINGS: [(Ktx2Packing, Option<SupercompressionScheme>); 3] = [
    (Ktx2Packing::None, None),
    (Ktx2Packing::Zlib, Some(SupercompressionScheme::ZLIB)),
    (Ktx2Packing::Zstandard, Some(SupercompressionScheme::Zstandard)),
];

/// The texels of a file, unpacked.
fn texels(file: &[u8]) -> Vec<u8> {
    let reader = Reader::new(file).unwrap();
    let level = reader.levels().next().unwrap();
    let mut out = Vec::new();
    match reader.header().supercompression_scheme {
        None => out.extend(level.data),
        Some(SupercompressionScheme::ZLIB) => {
            flate2::read::ZlibDecoder::new(level.data).read_to_end(&mut out).unwrap();
        }
        Some(_) => {
            let mut data = level.data;
            let mut decoder = ruzstd::decoding::StreamingDecoder::new(&mut data).unwrap();
            decoder.read_to_end(&mut out).unwrap();
        }
    }
    assert_eq!(out.len() as u64, level.uncompressed_byte_length);
    out
}

/// The value of an unsigned float of five bits of exponent, as OpenGL ES 3.0 §2.1.3 defines it.
fn small_float(bits: u32, mantissa_bits: i32) -> f64 {
    let (exponent, mantissa) = ((bits >> mantissa_bits) as i32, f64::from(bits & ((1 << mantissa_bits) - 1)));
    let part = mantissa / 2f64.powi(mantissa_bits);
    match exponent {
        0 => part * 2f64.powi(-14),
        31 => f64::INFINITY,
        _ => (1.0 + part) * 2f64.powi(exponent - 15),
    }
}

/// Colours of unpacked texels, in double precision.
fn colours(format: Ktx2Format, texels: &[u8]) -> Vec<[f64; 3]> {
    let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    match format {
        Ktx2Format::Rgb9e5 => texels
            .chunks(4)
            .map(|b| {
                let scale = 2f64.powi((word(b) >> 27) as i32 - 15 - 9);
                [0, 9, 18].map(|shift| f64::from(word(b) >> shift & 511) * scale)
            })
            .collect(),
        Ktx2Format::B10g11r11 => texels
            .chunks(4)
            .map(|b| [(0, 2047, 6), (11, 2047, 6), (22, 1023, 5)].map(|(s, m, n)| small_float(word(b) >> s & m, n)))
            .collect(),
        Ktx2Format::Rgba16f => texels
            .chunks(8)
            .map(|b| {
                assert_eq!([b[6], b[7]], [0, 0x3C], "alpha is 1");
                [0, 2, 4].map(|at| small_float(u32::from(u16::from_le_bytes([b[at], b[at + 1]])), 10))
            })
            .collect(),
    }
}

/// The largest error that rounding to the nearest value may make, from the format's definition.
fn bound(format: Ktx2Format, rgb: [f32; 3]) -> [f64; 3] {
    let half_step = |value: f32, bits: i32, lowest: i32| {
        let octave = if value > 0.0 { f64::from(value).log2().floor() as i32 } else { lowest };
        2f64.powi(octave.max(lowest) - bits - 1)
    };
    let largest = rgb.into_iter().fold(0.0, f32::max);
    match format {
        // Nine bits for values up to twice the octave; a tie may carry to the next, whose step is twice as large.
        Ktx2Format::Rgb9e5 => {
            let octave = if largest > 0.0 { f64::from(largest).log2().floor() as i32 } else { -16 };
            let scale = 2f64.powi((octave + 16).max(0) - 24);
            let carried = (f64::from(largest) / scale).round() >= 512.0;
            [if carried { scale } else { scale / 2.0 }; 3]
        }
        Ktx2Format::B10g11r11 => [(0, 6), (1, 6), (2, 5)].map(|(c, bits)| half_step(rgb[c], bits, -14)),
        Ktx2Format::Rgba16f => rgb.map(|c| half_step(c, 10, -14)),
    }
}

#[test]
fn the_header_and_the_descriptor_are_those_of_the_format() {
    let rgb: Vec<[f32; 3]> = (0..15).map(|k| [k as f32, 0.5, 100.0 - k as f32]).collect();
    for ((ours, format), (packing, scheme)) in FORMATS.into_iter().flat_map(|f| PACKINGS.map(|p| (f, p))) {
        let file = write_ktx2(5, 3, &rgb, ours, packing);
        let reader = Reader::new(&file).unwrap();
        let header = reader.header();
        let (descriptor, type_size) = dfd::Basic::from_format(format).unwrap();
        assert_eq!((header.format, header.type_size), (Some(format), type_size));
        assert_eq!((header.pixel_width, header.pixel_height, header.pixel_depth), (5, 3, 0));
        assert_eq!((header.layer_count, header.face_count, header.level_count), (0, 1, 1));
        assert_eq!(header.supercompression_scheme, scheme);
        assert_eq!((header.index.sgd_byte_offset, header.index.sgd_byte_length), (0, 0));

        let at = header.index.dfd_byte_offset as usize;
        let bytes = &file[at..at + header.index.dfd_byte_length as usize];
        assert_eq!(bytes[..4], (bytes.len() as u32).to_le_bytes());
        assert_eq!(bytes[4..], dfd::Block::Basic(descriptor).to_vec(), "{format:?}");
        assert_eq!(reader.transfer_function(), Some(ktx2::TransferFunction::Linear));
        assert_eq!(reader.color_primaries(), Some(ktx2::ColorPrimaries::BT709));

        let pairs: Vec<(&str, &[u8])> = reader.key_value_data().collect();
        let writer = format!("twinray {}\0", env!("CARGO_PKG_VERSION"));
        assert_eq!(pairs, [("KTXorientation", &b"rd\0"[..]), ("KTXwriter", writer.as_bytes())]);
        // Sections follow each other without gaps, but for the alignment of what is not packed.
        assert_eq!((at, header.index.kvd_byte_offset as usize), (104, at + bytes.len()));
        let end = (header.index.kvd_byte_offset + header.index.kvd_byte_length) as usize;
        let level = u64::from_le_bytes(file[80..88].try_into().unwrap()) as usize;
        assert_eq!(level, if packing == Ktx2Packing::None { end.next_multiple_of(8) } else { end });
        assert!(file[end..level].iter().all(|&b| b == 0));
        assert_eq!(level + u64::from_le_bytes(file[88..96].try_into().unwrap()) as usize, file.len());
    }
}

#[test]
fn a_small_file_is_that_written_by_hand() {
    let file = write_ktx2(2, 1, &[[1.0, 0.5, 0.25], [0.0, 3.0, 0.0]], Ktx2Format::Rgb9e5, Ktx2Packing::None);
    let mut hand = b"\xABKTX 20\xBB\r\n\x1A\n".to_vec();
    let writer = concat!("twinray ", env!("CARGO_PKG_VERSION"));
    let values = 4 + 15 + 3 + 2 + (4 + 10 + writer.len() + 1).next_multiple_of(4);
    let level = (104 + 124 + values).next_multiple_of(8);
    for word in [123, 4, 2, 1, 0, 0, 1, 1, 0, 104, 124, 228, values as u32, 0, 0, 0, 0, level as u32, 0, 8, 0, 8, 0] {
        hand.extend(u32::to_le_bytes(word));
    }
    for word in [124, 0, 0x78_0002, 0x1_0101, 0, 4, 0] {
        hand.extend(u32::to_le_bytes(word));
    }
    for (channel, offset) in [(0, 0), (1, 9), (2, 18)] {
        for word in [channel << 24 | 8 << 16 | offset, 0, 0, 8448, (channel | 32) << 24 | 4 << 16 | 27, 0, 15, 31] {
            hand.extend(u32::to_le_bytes(word));
        }
    }
    hand.extend(b"\x12\0\0\0KTXorientation\0rd\0\0\0");
    hand.extend((10 + writer.len() as u32 + 1).to_le_bytes());
    hand.extend(b"KTXwriter\0");
    hand.extend(writer.as_bytes());
    hand.resize(level, 0);
    // 1 = 256 · 2^(16 − 24) and 3 = 384 · 2^(17 − 24).
    hand.extend((16u32 << 27 | 64 << 18 | 128 << 9 | 256).to_le_bytes());
    hand.extend((17u32 << 27 | 384 << 9).to_le_bytes());
    assert_eq!(file, hand);
}

#[test]
fn packed_files_hold_the_same_texels() {
    // Smooth light, noise, darkness: longer than a block of Zstandard (128 KiB).
    let rgb: Vec<[f32; 3]> = (0..300 * 400)
        .map(|k| match k / 40_000 {
            0 => [(k % 400) as f32 * 0.01, 1.0, (k / 400) as f32 * 0.3],
            1 => [0, 7, 13].map(|s| (k as u32).wrapping_mul(2_654_435_761).rotate_left(s) as f32 / 1e6),
            _ => [0.0; 3],
        })
        .collect();
    for (format, _) in FORMATS {
        let files = PACKINGS.map(|(packing, _)| write_ktx2(400, 300, &rgb, format, packing));
        assert_eq!(files.each_ref().map(|f| texels(f) == texels(&files[0])), [true; 3]);
        assert!(files[1].len() < files[0].len() * 3 / 4 && files[2].len() < files[0].len() * 3 / 4);
        println!("{format:?}: {:?} bytes", files.each_ref().map(Vec::len));
        assert!(PACKINGS.iter().zip(&files).all(|(p, f)| write_ktx2(400, 300, &rgb, format, p.0) == *f), "same bytes");
    }
}

#[test]
fn one_texel_and_nothing_but_zeros_can_be_packed() {
    for (packing, _) in PACKINGS {
        let file = write_ktx2(1, 1, &[[2.0; 3]], Ktx2Format::B10g11r11, packing);
        assert_eq!(colours(Ktx2Format::B10g11r11, &texels(&file)), [[2.0; 3]]);
        let file = write_ktx2(1000, 1000, &vec![[0.0; 3]; 1_000_000], Ktx2Format::Rgb9e5, packing);
        assert_eq!(texels(&file), vec![0; 4_000_000]);
    }
}

proptest! {
    #[test]
    fn values_are_half_a_step_off_at_most(
        rgb in proptest::collection::vec(proptest::array::uniform3(-30f32..15.9), 1..40),
        dark in proptest::bool::ANY,
    ) {
        let rgb: Vec<[f32; 3]> = rgb.into_iter().map(|c| c.map(|e| if dark && e < -20.0 { 0.0 } else { e.exp2() })).collect();
        for (format, _) in FORMATS {
            let file = write_ktx2(rgb.len() as u32, 1, &rgb, format, Ktx2Packing::None);
            for (&given, found) in rgb.iter().zip(colours(format, &texels(&file))) {
                let bound = bound(format, given);
                for c in 0..3 {
                    let error = (f64::from(given[c]) - found[c]).abs();
                    prop_assert!(error <= bound[c], "{format:?} {given:?} became {found:?}, off by {error} > {}", bound[c]);
                }
            }
        }
    }
}
