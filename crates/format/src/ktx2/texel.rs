//! Colours as bits of a texel, rounded to the nearest value.
//!
//! Computed in double precision, which holds every single-precision number over every power of two at hand exactly.

/// Nine bits a channel under one exponent.
pub(super) fn rgb9e5(rgb: [f32; 3]) -> u32 {
    const LARGEST: f64 = 65_408.0; // 511 · 2⁷
    let rgb = rgb.map(|c| within(c, LARGEST));
    let largest = rgb.into_iter().fold(0.0, f64::max);
    // Value = mantissa · 2^(exponent − 24); mantissas below 512.
    let mut exponent = (floor_log2(largest) + 16).max(0);
    let mantissa = |c: f64, exponent: i32| (c / power_of_two(exponent - 24)).round() as u32;
    if mantissa(largest, exponent) == 512 {
        exponent += 1;
    }
    let [r, g, b] = rgb.map(|c| mantissa(c, exponent));
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// Floats without sign: eleven bits, eleven, ten.
pub(super) fn b10g11r11([r, g, b]: [f32; 3]) -> u32 {
    small_float(r, 6) | small_float(g, 6) << 11 | small_float(b, 5) << 22
}

/// Half floats, none of them negative, and an alpha of 1.
pub(super) fn rgba16f([r, g, b]: [f32; 3]) -> [u16; 4] {
    [r, g, b, 1.0].map(|c| small_float(c, 10) as u16)
}

/// A float of five bits of exponent (bias 15) and some of mantissa, without the sign.
fn small_float(value: f32, mantissa_bits: i32) -> u32 {
    let largest = (2.0 - power_of_two(-mantissa_bits)) * 32_768.0;
    let value = within(value, largest);
    // Below 2⁻¹⁴ the step stays the same.
    let exponent = floor_log2(value).max(-14);
    let steps = (value / power_of_two(exponent - mantissa_bits)).round_ties_even() as u32;
    // From 2^bits on the steps' upper bit is implied; it adds the 1 that exponents of normal numbers are larger by, and where
    // rounding carries into the next power of two it adds 2.
    (((exponent + 14) as u32) << mantissa_bits) + steps
}

/// What a format without sign and infinity can hold.
fn within(value: f32, largest: f64) -> f64 {
    // `max` answers with the other one where a value is not a number; adding 0 takes the sign from −0.
    f64::from(value).max(0.0).min(largest) + 0.0
}

/// ⌊log₂ value⌋, of 0 and of what is below single precision's normal numbers something that is small enough.
fn floor_log2(value: f64) -> i32 {
    (value.to_bits() >> 52) as i32 - 1023
}

fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_the_formats_own_are_kept() {
        assert_eq!(rgb9e5([0.0; 3]), 0);
        // 1 = 256 · 2⁻⁸, exponent 16; half of it is 128, a quarter 64.
        assert_eq!(rgb9e5([1.0, 0.5, 0.25]), 256 | 128 << 9 | 64 << 18 | 16 << 27);
        assert_eq!(rgb9e5([65_408.0, 0.0, 128.0]), 511 | 1 << 18 | 31 << 27);
        assert_eq!(rgb9e5([2f32.powi(-24); 3]), 1 | 1 << 9 | 1 << 18);
        assert_eq!(b10g11r11([1.0, 2.0, 0.5]), 15 << 6 | 16 << 17 | 14 << 27);
        assert_eq!(rgba16f([1.0, 0.5, 65_504.0]), [0x3C00, 0x3800, 0x7BFF, 0x3C00]);
    }

    #[test]
    fn rounding_carries_into_the_exponent() {
        // 511.5 steps are 512, which is 256 of twice the size.
        assert_eq!(rgb9e5([511.5, 0.0, 3.0]), 256 | 2 << 18 | 25 << 27);
        assert_eq!(rgb9e5([511.49, 0.0, 3.0]), 511 | 3 << 18 | 24 << 27);
        // The largest half below 1 is 1 − 2⁻¹¹; the next quarter of a step belongs to 1.
        assert_eq!(rgba16f([1.0 - 2f32.powi(-11), 1.0 - 2f32.powi(-13), 0.0])[..2], [0x3BFF, 0x3C00]);
        // Numbers below the normal ones become the smallest normal one.
        let smallest = 2f32.powi(-14);
        assert_eq!(rgba16f([smallest * 0.9999, smallest, 0.0])[..2], [0x0400, 0x0400]);
        assert_eq!(b10g11r11([smallest * 0.9999, 0.0, 0.0]), 1 << 6);
    }

    #[test]
    fn ties_go_to_even() {
        let step = 2f32.powi(-10);
        let bits = |steps: f32| rgba16f([1.0 + steps * step, 0.0, 0.0])[0];
        assert_eq!([bits(0.5), bits(1.5), bits(2.5)], [0x3C00, 0x3C02, 0x3C02]);
    }

    #[test]
    fn what_no_format_holds_is_brought_within() {
        for bad in [f32::NAN, -1.0, f32::NEG_INFINITY, -0.0, f32::MIN_POSITIVE / 4.0] {
            assert_eq!((rgb9e5([bad; 3]), b10g11r11([bad; 3]), rgba16f([bad; 3])), (0, 0, [0, 0, 0, 0x3C00]), "{bad}");
        }
        for large in [f32::INFINITY, f32::MAX, 65_505.0] {
            assert_eq!(rgb9e5([large; 3]), 511 | 511 << 9 | 511 << 18 | 31 << 27);
            assert_eq!(b10g11r11([large; 3]), 0x7BF | 0x7BF << 11 | 0x3DF << 22);
            assert_eq!(rgba16f([large; 3]), [0x7BFF, 0x7BFF, 0x7BFF, 0x3C00]);
        }
    }
}
