//! KTX2 files: pictures of light for renderers, in formats that graphics processors sample as they are.
//!
//! Lives here: the container of one two-dimensional picture without smaller copies. `texel` packs colours,
//! `descriptor` says how to the file's readers. Called by: whoever bakes.

mod descriptor;
mod texel;

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};

/// How a colour is stored. Values are at most half a step of the format off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ktx2Format {
    /// Four bytes: nine bits a channel, and one exponent for the three, that of the largest. Up to 65 408; step 2⁻⁸ to 2⁻⁹
    /// of the largest channel, or 2⁻²⁴ where that is more.
    Rgb9e5,
    /// Four bytes: floats of eleven, eleven and ten bits. Up to 65 024 and, for blue, 64 512; step 2⁻⁶ of each channel,
    /// 2⁻⁵ of blue.
    B10g11r11,
    /// Eight bytes: half floats, and an alpha of 1. Up to 65 504; step 2⁻¹⁰ of each channel.
    Rgba16f,
}

/// How the texels are packed further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ktx2Packing {
    /// Not at all.
    None,
    /// Deflate with the header of zlib.
    Zlib,
    /// Zstandard: faster to read than zlib.
    Zstandard,
}

const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";

/// Where the descriptor starts: after the identifier, nine words, the index and one level.
const DESCRIPTOR_AT: usize = 12 + 9 * 4 + 4 * 4 + 2 * 8 + 3 * 8;

/// The bytes of a KTX2 file. `rgb` is `[height, width, 3]`, linear Rec. 709, first row on top.
///
/// Every channel is rounded to the nearest value that the format has; what is negative or not a number becomes 0, what is
/// too large the largest. Equal arguments give equal bytes.
///
/// # Panics
/// If `rgb` has not `width × height` colours, or there is none.
pub fn write_ktx2(width: u32, height: u32, rgb: &[[f32; 3]], format: Ktx2Format, packing: Ktx2Packing) -> Vec<u8> {
    let expected = u64::from(width) * u64::from(height);
    assert!(
        rgb.len() as u64 == expected && expected > 0,
        "write_ktx2: {} colours for {width}×{height} texels",
        rgb.len()
    );
    let texels: Vec<u8> = match format {
        Ktx2Format::Rgb9e5 => rgb.iter().flat_map(|&c| texel::rgb9e5(c).to_le_bytes()).collect(),
        Ktx2Format::B10g11r11 => rgb.iter().flat_map(|&c| texel::b10g11r11(c).to_le_bytes()).collect(),
        Ktx2Format::Rgba16f => rgb.iter().flat_map(|&c| texel::rgba16f(c)).flat_map(u16::to_le_bytes).collect(),
    };
    let (scheme, level) = packed(&texels, packing);
    let descriptor = descriptor::of(format);
    // Pairs are sorted by their keys; `rd`: rows go to the right, the first one is on top.
    let values =
        [pair("KTXorientation", "rd"), pair("KTXwriter", concat!("twinray ", env!("CARGO_PKG_VERSION")))].concat();

    let values_at = DESCRIPTOR_AT + descriptor.len();
    // Texels that are read as they lie there start at multiples of their size, which is at most eight bytes.
    let level_at = match packing {
        Ktx2Packing::None => (values_at + values.len()).next_multiple_of(8),
        _ => values_at + values.len(),
    };
    let mut out = IDENTIFIER.to_vec();
    let mut words = |list: &[u32]| out.extend(list.iter().flat_map(|w| w.to_le_bytes()));
    // No depth and no layers, one face, one level.
    words(&[vulkan_format(format), type_size(format), width, height, 0, 0, 1, 1, scheme]);
    words(&[DESCRIPTOR_AT, descriptor.len(), values_at, values.len()].map(|n| n as u32));
    // Data for all levels, of which there is none; then where the level lies, and its size unpacked.
    let mut longs = |list: &[usize]| out.extend(list.iter().flat_map(|&w| (w as u64).to_le_bytes()));
    longs(&[0, 0]);
    longs(&[level_at, level.len(), texels.len()]);
    out.extend(descriptor);
    out.extend(values);
    out.resize(level_at, 0);
    out.extend(level);
    out
}

/// Number of the scheme, and the bytes.
fn packed(texels: &[u8], packing: Ktx2Packing) -> (u32, Vec<u8>) {
    match packing {
        Ktx2Packing::None => (0, texels.to_vec()),
        Ktx2Packing::Zlib => {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
            encoder.write_all(texels).expect("memory takes all bytes");
            (3, encoder.finish().expect("memory takes all bytes"))
        }
        // The only level of that encoder which packs at all.
        Ktx2Packing::Zstandard => (2, compress_to_vec(texels, CompressionLevel::Fastest)),
    }
}

fn vulkan_format(format: Ktx2Format) -> u32 {
    match format {
        Ktx2Format::Rgba16f => 97,
        Ktx2Format::B10g11r11 => 122,
        Ktx2Format::Rgb9e5 => 123,
    }
}

/// Bytes of what has to be turned round on machines of the other byte order.
fn type_size(format: Ktx2Format) -> u32 {
    match format {
        Ktx2Format::Rgba16f => 2,
        Ktx2Format::B10g11r11 | Ktx2Format::Rgb9e5 => 4,
    }
}

/// A key and its text with their length, filled up to four bytes.
fn pair(key: &str, text: &str) -> Vec<u8> {
    let content = [key.as_bytes(), b"\0", text.as_bytes(), b"\0"].concat();
    let mut out = (content.len() as u32).to_le_bytes().to_vec();
    out.extend(content);
    out.resize(out.len().next_multiple_of(4), 0);
    out
}
