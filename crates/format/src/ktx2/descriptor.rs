//! The data format descriptor: which bits of a texel are what (Khronos Data Format Specification 1.3, §5).

use super::Ktx2Format;

/// Bits of one channel.
struct Sample {
    offset: u16,
    bits: u8,
    /// 0, 1, 2: red, green, blue; 15: alpha; and what kind of number, below.
    channel: u8,
    /// Bits of what stands for 0 (or −1) and for 1.
    lower: u32,
    upper: u32,
}

const EXPONENT: u8 = 0x20;
const SIGNED: u8 = 0x40;
const FLOAT: u8 = 0x80;
const ALPHA: u8 = 15;

/// The descriptor of `format`, its length before it.
pub(super) fn of(format: Ktx2Format) -> Vec<u8> {
    let samples = samples(format);
    let block = 24 + 16 * samples.len();
    let plane: u32 = if format == Ktx2Format::Rgba16f { 8 } else { 4 };
    let mut out = Vec::with_capacity(4 + block);
    let mut words = |list: &[u32]| out.extend(list.iter().flat_map(|w| w.to_le_bytes()));
    words(&[4 + block as u32]);
    // Khronos's basic block, its version 2.
    words(&[0, 2 | (block as u32) << 16]);
    // Model RGBSDA, primaries of Rec. 709, linear, straight alpha.
    words(&[1 | 1 << 8 | 1 << 16]);
    // Blocks of one texel in one plane; its size stays when texels are packed further (KTX 2.0, pull request 221).
    words(&[0, plane, 0]);
    for sample in samples {
        let place = u32::from(sample.offset) | u32::from(sample.bits - 1) << 16 | u32::from(sample.channel) << 24;
        words(&[place, 0, sample.lower, sample.upper]);
    }
    out
}

fn samples(format: Ktx2Format) -> Vec<Sample> {
    match format {
        // Mantissa and exponent of each channel, which share the exponent's bits. The bounds, 8448 among them, are those that
        // Khronos's own tools write and insist on.
        Ktx2Format::Rgb9e5 => (0..3)
            .flat_map(|channel| {
                let offset = 9 * u16::from(channel);
                [
                    Sample { offset, bits: 9, channel, lower: 0, upper: 8448 },
                    Sample { offset: 27, bits: 5, channel: channel | EXPONENT, lower: 15, upper: 31 },
                ]
            })
            .collect(),
        Ktx2Format::B10g11r11 => [(0, 0, 11), (1, 11, 11), (2, 22, 10)]
            .map(|(channel, offset, bits)| Sample {
                offset,
                bits,
                channel: channel | FLOAT,
                lower: 0,
                upper: 1f32.to_bits(),
            })
            .into(),
        Ktx2Format::Rgba16f => [0, 1, 2, ALPHA]
            .into_iter()
            .zip((0..).step_by(16))
            .map(|(channel, offset)| Sample {
                offset,
                bits: 16,
                channel: channel | SIGNED | FLOAT,
                lower: (-1f32).to_bits(),
                upper: 1f32.to_bits(),
            })
            .collect(),
    }
}
