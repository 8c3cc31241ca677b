//! Texture look-ups: wrap, filter, sRGB decoding.
//!
//! Not here: image files (format), averages over patches (`patch`).

use std::sync::OnceLock;

use crate::authored::{TextureImage, TextureRef, Wrap};
use crate::rgb::Rgb;

/// How the colour channels are encoded; alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// IEC 61966-2-1, as glTF has base colour and emission.
    Srgb,
    /// Values as they are, as glTF has metalness and roughness.
    Linear,
}

/// Decoded sRGB bytes.
fn srgb_table() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| srgb_to_linear(i as f64 / 255.0) as f32))
}

/// The sRGB decoding curve.
pub fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

/// The sRGB encoding curve.
pub fn linear_to_srgb(v: f64) -> f64 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::pow(v, 1.0 / 2.4) - 0.055 }
}

/// Colour and alpha where the mesh's texture coordinates are (`u`, `v`); v = 0 is the top row, texel centres at half
/// integers.
pub fn lookup(image: &TextureImage, texture: &TextureRef, encoding: Encoding, u: f64, v: f64) -> (Rgb, f64) {
    filtered([image.width, image.height], texture, [u, v], |i| decoded(image, encoding, i))
}

/// The same of a picture of `size`, width and height, whose texels `texel` gives by their index.
pub(crate) fn filtered(
    size: [u32; 2],
    texture: &TextureRef,
    place: [f64; 2],
    texel: impl Fn(usize) -> (Rgb, f64),
) -> (Rgb, f64) {
    let [u, v] = texture.transform.apply(place);
    let at = |x: f64, y: f64| {
        let [column, row] = [wrapped(x, size[0], texture.wrap[0]), wrapped(y, size[1], texture.wrap[1])];
        texel(row as usize * size[0] as usize + column as usize)
    };
    // Coordinates beyond all numbers have no place; any will do, but no NaN must come of them.
    let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
    let (x, y) = (finite(u * f64::from(size[0])), finite(v * f64::from(size[1])));
    if texture.nearest {
        return at(x.floor(), y.floor());
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let mix = |a: (Rgb, f64), b: (Rgb, f64), t: f64| (a.0.lerp(b.0, t), a.1 + (b.1 - a.1) * t);
    mix(mix(at(x0, y0), at(x0 + 1.0, y0), fx), mix(at(x0, y0 + 1.0), at(x0 + 1.0, y0 + 1.0), fx), fy)
}

/// Colour and alpha of texel number `index`, rows first.
pub(crate) fn decoded(image: &TextureImage, encoding: Encoding, index: usize) -> (Rgb, f64) {
    let Some(&[r, g, b, a]) = image.rgba.get(4 * index..4 * index + 4) else { return (Rgb::WHITE, 1.0) };
    let decode = |byte: u8| match encoding {
        Encoding::Srgb => f64::from(srgb_table()[usize::from(byte)]),
        Encoding::Linear => f64::from(byte) / 255.0,
    };
    (Rgb::new(decode(r), decode(g), decode(b)), f64::from(a) / 255.0)
}

/// The texel index of `x` (an integer in floating point, any size or sign) in a row of `size`.
fn wrapped(x: f64, size: u32, wrap: Wrap) -> u32 {
    let n = f64::from(size.max(1));
    let i = match wrap {
        Wrap::Clamp => x,
        Wrap::Repeat => x.rem_euclid(n),
        Wrap::Mirror => {
            let m = x.rem_euclid(2.0 * n);
            if m < n { m } else { 2.0 * n - 1.0 - m }
        }
    };
    // NaN becomes 0.
    i.clamp(0.0, n - 1.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::authored::TextureTransform;

    fn two_texels() -> TextureImage {
        TextureImage { name: "t".into(), width: 2, height: 1, rgba: vec![0, 0, 0, 255, 255, 255, 255, 0] }
    }

    fn reference(wrap: Wrap) -> TextureRef {
        TextureRef { wrap: [wrap; 2], ..TextureRef::of(0) }
    }

    #[test]
    fn bilinear_and_wrapping() {
        let image = two_texels();
        let red = |wrap, u| lookup(&image, &reference(wrap), Encoding::Linear, u, 0.5).0.r;
        assert!((red(Wrap::Clamp, 0.25) - 0.0).abs() < 1e-12);
        assert!((red(Wrap::Clamp, 0.5) - 0.5).abs() < 1e-12);
        assert!((red(Wrap::Clamp, 7.0) - 1.0).abs() < 1e-12);
        assert!((red(Wrap::Repeat, 1.25) - 0.0).abs() < 1e-12);
        assert!((red(Wrap::Mirror, 1.25) - 1.0).abs() < 1e-12);
        assert!((lookup(&image, &reference(Wrap::Clamp), Encoding::Srgb, 0.5, 0.5).1 - 0.5).abs() < 1e-12);
        assert!(red(Wrap::Repeat, f64::NAN).is_finite() || red(Wrap::Repeat, f64::NAN).is_nan());
    }

    /// The example of the extension's specification shows the lower left quarter of the picture, turned clockwise by a
    /// right angle: what was its upper left corner is on the upper right.
    #[test]
    fn transforms_turn_as_the_specification_says() {
        let quarter = TextureTransform { offset: [0.0, 1.0], rotation: std::f64::consts::FRAC_PI_2, scale: [0.5, 0.5] };
        for (at, expected) in [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [0.0, 0.5]), ([0.0, 1.0], [0.5, 1.0])] {
            let found = quarter.apply(at);
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{at:?}: {found:?}");
        }
        assert_eq!(TextureTransform::default().apply([0.3, 7.0]), [0.3, 7.0]);
        // And look-ups use it: half a picture to the right is the other texel.
        let moved = TextureTransform { offset: [0.5, 0.0], ..TextureTransform::default() };
        let texture = TextureRef { transform: moved, ..reference(Wrap::Repeat) };
        assert_eq!(lookup(&two_texels(), &texture, Encoding::Linear, 0.25, 0.5).0.r, 1.0);
    }

    #[test]
    fn coordinates_without_end_give_some_colour() {
        for u in [f64::INFINITY, f64::NAN, 1e308, -1e308] {
            for wrap in [Wrap::Clamp, Wrap::Repeat, Wrap::Mirror] {
                let (color, alpha) = lookup(&two_texels(), &reference(wrap), Encoding::Srgb, u, u);
                assert!(color.is_finite() && alpha.is_finite(), "{u} {wrap:?}");
            }
        }
    }

    #[test]
    fn the_srgb_curves_are_inverses() {
        for i in 0..=255 {
            let v = f64::from(i) / 255.0;
            assert!((linear_to_srgb(srgb_to_linear(v)) - v).abs() < 1e-6);
        }
    }
}
