//! The 3D texture of an irradiance volume for Bevy: a KTX2 file with an ambient cube (Mitchell, "Shading in Valve's source
//! engine", SIGGRAPH 2006) for each probe.
//!
//! For a lattice of (X, Y, Z) probes the texture has (X, 2Y, 3Z) texels. Bevy's documentation tells two orders, in a formula
//! and in a table; its shader reads that of the table: the lower half of the rows is for normals whose component is positive,
//! the upper half for negative ones, and layers are those of x, then y, then z. What it reads for a normal is multiplied by
//! the albedo and nothing else: irradiance over π, in nit where the component's `intensity` is 1.

use exr::prelude::f16;

use super::ProbeLattice;

/// Texels along an axis that every graphics processor of a desktop samples.
const MOST: u32 = 2048;
/// `VK_FORMAT_R16G16B16A16_SFLOAT`.
const FORMAT: u32 = 97;
const HEADER: usize = 80;
const LEVEL_INDEX: usize = 24;

/// Why there is no texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BevyVolumeError {
    /// Beyond what graphics processors sample.
    #[error(
        "the texture of the irradiance volume would have {0:?} texels; graphics processors sample at most {MOST} along each axis"
    )]
    TooLarge([u32; 3]),
}

/// The bytes of the KTX2 file: RGBA of half precision, without mip maps or supercompression.
///
/// `cubes` has irradiance over π, in nit, for the normals +x, +y, +z, −x, −y, −z of each probe, x fastest, then y, then z. Values
/// beyond half precision are 65504. In the file, `twinrayBox` tells the low and the high corner of the volume in metres: Bevy's unit
/// cube is to be moved to its middle and scaled to its sides.
///
/// # Errors
/// If an axis of the texture is too long.
///
/// # Panics
/// If there is not a cube for each probe, or there is none.
pub fn write_bevy_volume(
    lattice: &ProbeLattice,
    cubes: &[[[f32; 3]; 6]],
    writer: &str,
) -> Result<Vec<u8>, BevyVolumeError> {
    assert!(!cubes.is_empty() && cubes.len() == lattice.len(), "{} cubes for {:?}", cubes.len(), lattice.counts);
    let [nx, ny, nz] = lattice.counts;
    let size = [nx, ny.saturating_mul(2), nz.saturating_mul(3)];
    if size.iter().any(|&n| n > MOST) {
        return Err(BevyVolumeError::TooLarge(size));
    }
    let mut texels: Vec<f16> = Vec::with_capacity(4 * 6 * cubes.len());
    for layer in 0..size[2] {
        let (axis, k) = (layer / nz, layer % nz);
        for row in 0..size[1] {
            let (negative, j) = (row / ny, row % ny);
            let side = (axis + 3 * negative) as usize;
            for i in 0..nx {
                let probe = (i + nx * (j + ny * k)) as usize;
                texels.extend(cubes[probe][side].map(|c| f16::from_f32(c.max(0.0).min(f16::MAX.to_f32()))));
                texels.push(f16::ONE);
            }
        }
    }
    let pixels: Vec<u8> = texels.iter().flat_map(|t| t.to_bits().to_le_bytes()).collect();
    Ok(container(size, &words(lattice, writer), &pixels))
}

/// Pairs of keys and values, in order of the keys.
fn words(lattice: &ProbeLattice, writer: &str) -> Vec<u8> {
    let high: [f64; 3] = std::array::from_fn(|a| lattice.low[a] + lattice.cell[a] * f64::from(lattice.counts[a]));
    let corners: Vec<String> = lattice.low.iter().chain(&high).map(f64::to_string).collect();
    let writer = writer.replace('\0', "");
    // Texels go to the right, up and out of the picture as x, y and z do.
    let pairs = [("KTXorientation", "ruo"), ("KTXwriter", &writer), ("twinrayBox", &corners.join(" "))];
    let mut bytes = Vec::new();
    for (key, value) in pairs {
        let pair = [key.as_bytes(), b"\0", value.as_bytes(), b"\0"].concat();
        bytes.extend((pair.len() as u32).to_le_bytes());
        bytes.extend(pair);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

/// A KTX2 file of one level.
fn container(size: [u32; 3], words: &[u8], pixels: &[u8]) -> Vec<u8> {
    let descriptor = descriptor();
    let descriptor_at = HEADER + LEVEL_INDEX;
    let words_at = descriptor_at + descriptor.len();
    let pixels_at = (words_at + words.len()).next_multiple_of(8);
    let mut bytes = b"\xABKTX 20\xBB\r\n\x1A\n".to_vec();
    let numbers = [
        FORMAT,
        2,
        size[0],
        size[1],
        size[2],
        // No array, one face, one level, no supercompression.
        0,
        1,
        1,
        0,
        descriptor_at as u32,
        descriptor.len() as u32,
        words_at as u32,
        words.len() as u32,
    ];
    bytes.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend([0u64; 2].iter().flat_map(|n| n.to_le_bytes()));
    let length = pixels.len() as u64;
    bytes.extend([pixels_at as u64, length, length].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(descriptor);
    bytes.extend(words);
    bytes.resize(pixels_at, 0);
    bytes.extend(pixels);
    bytes
}

/// What the bits of a texel are (Khronos Data Format Specification, basic descriptor block): linear BT.709 in four signed
/// floats of 16 bits.
fn descriptor() -> Vec<u8> {
    const BLOCK: u32 = 24 + 4 * 16;
    const VERSION: u32 = 2;
    let mut words = vec![
        4 + BLOCK,
        0,
        BLOCK << 16 | VERSION,
        u32::from_le_bytes([1, 1, 1, 0]), // RGBSDA, BT.709, linear, straight alpha
        0,                                // texel blocks of 1 × 1 × 1
        8,                                // bytes of a texel
        0,
    ];
    for (k, channel) in [0u8, 1, 2, 15].into_iter().enumerate() {
        let (float, signed) = (0x80, 0x40);
        let first = u32::from_le_bytes([16 * k as u8, 0, 15, channel | float | signed]);
        words.extend([first, 0, (-1.0f32).to_bits(), 1.0f32.to_bits()]);
    }
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}
