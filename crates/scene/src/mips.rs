//! Smaller and smaller copies of pictures, for texels that are smaller than what looks at them.
//!
//! Each level has half the width and height of the one below, and its texels are means of linear light over what they
//! cover, so that every level keeps the mean. Made when first asked for: who leaves the footprint at 0 pays nothing.

use std::sync::OnceLock;

use crate::authored::{TextureImage, TextureRef};
use crate::rgb::Rgb;
use crate::texture::{self, Encoding};

/// The smaller copies of one picture, by encoding.
#[derive(Debug, Default)]
pub(crate) struct Mips {
    srgb: OnceLock<Vec<Level>>,
    linear: OnceLock<Vec<Level>>,
}

/// Decoded texels as sixteen bits a channel, which loses nothing of eight.
#[derive(Debug)]
struct Level {
    size: [u32; 2],
    texels: Vec<[u16; 4]>,
}

impl Mips {
    /// As [`texture::lookup`], between the copies around `level`: 0 is the picture, 1 the first copy.
    pub fn lookup(
        &self,
        image: &TextureImage,
        texture: &TextureRef,
        encoding: Encoding,
        [u, v]: [f64; 2],
        level: f64,
    ) -> (Rgb, f64) {
        // NaN is the picture itself, too.
        if level.is_nan() || level <= 0.0 || image.width.max(image.height) == 1 {
            return texture::lookup(image, texture, encoding, u, v);
        }
        let levels = self.levels(image, encoding);
        let level = level.min(levels.len() as f64);
        let at = |k: usize| match k.checked_sub(1).map(|k| &levels[k]) {
            None => texture::lookup(image, texture, encoding, u, v),
            Some(copy) => texture::filtered(copy.size, texture, [u, v], |i| {
                let [r, g, b, a] = copy.texels[i].map(|c| f64::from(c) / 65535.0);
                (Rgb::new(r, g, b), a)
            }),
        };
        let (below, share) = (level.floor(), level.fract());
        let (fine, coarse) = (at(below as usize), at(level.ceil() as usize));
        (fine.0.lerp(coarse.0, share), fine.1 + (coarse.1 - fine.1) * share)
    }

    fn levels(&self, image: &TextureImage, encoding: Encoding) -> &[Level] {
        let cell = if encoding == Encoding::Srgb { &self.srgb } else { &self.linear };
        cell.get_or_init(|| {
            let mut levels: Vec<Level> = Vec::new();
            let mut size = [image.width, image.height];
            while size != [1, 1] {
                let next = match levels.last() {
                    None => halved(size, |i| {
                        let (c, a) = texture::decoded(image, encoding, i);
                        [c.r, c.g, c.b, a].map(|c| c * 65535.0)
                    }),
                    Some(last) => halved(size, |i| last.texels[i].map(f64::from)),
                };
                size = next.size;
                levels.push(next);
            }
            levels
        })
    }
}

/// A picture of half the width and height, rounded down but to 1 at least. Odd sizes share texels between neighbours.
fn halved(size: [u32; 2], texel: impl Fn(usize) -> [f64; 4]) -> Level {
    let half = size.map(|n| (n / 2).max(1));
    // The texels under the new texel `i` of a row, with their shares.
    let under = |k: usize, i: u32| {
        let step = f64::from(size[k]) / f64::from(half[k]);
        let (from, to) = (f64::from(i) * step, f64::from(i + 1) * step);
        let last = (to.ceil() as u32).min(size[k]);
        (from as u32..last).map(move |j| (j, (to.min(f64::from(j + 1)) - from.max(f64::from(j))) / step))
    };
    let mut texels = Vec::with_capacity(half[0] as usize * half[1] as usize);
    for y in 0..half[1] {
        for x in 0..half[0] {
            let mut sum = [0.0; 4];
            for (j, share_y) in under(1, y) {
                for (i, share_x) in under(0, x) {
                    let t = texel(j as usize * size[0] as usize + i as usize);
                    sum.iter_mut().zip(t).for_each(|(s, t)| *s += t * share_x * share_y);
                }
            }
            texels.push(sum.map(|s| s.round() as u16));
        }
    }
    Level { size: half, texels }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> TextureImage {
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let rgba = places.flat_map(|(x, y)| texel(x, y)).collect();
        TextureImage { name: String::new(), width, height, rgba }
    }

    /// Whatever the size, and in linear light: half white and half black is 0.5, not the sRGB code between.
    #[test]
    fn every_level_keeps_the_mean() {
        for (width, height) in [(8, 8), (5, 3), (1, 7), (6, 1), (13, 10)] {
            let image = picture(width, height, |x, y| [255 * ((x + y) % 2) as u8, (x * 19) as u8, (y * 25) as u8, 200]);
            for encoding in [Encoding::Srgb, Encoding::Linear] {
                let n = (width * height) as usize;
                let mean = (0..n).map(|i| texture::decoded(&image, encoding, i).0).sum::<Rgb>() / n as f64;
                let mips = Mips::default();
                let mut size = [width, height];
                for level in mips.levels(&image, encoding) {
                    assert_eq!(level.size, size.map(|n| (n / 2).max(1)));
                    size = level.size;
                    let n = level.texels.len();
                    let sum: Vec<f64> =
                        (0..4).map(|c| level.texels.iter().map(|t| f64::from(t[c]) / 65535.0).sum::<f64>()).collect();
                    // Each texel is rounded to 1/65535, once a level.
                    for (c, sum) in sum[..3].iter().enumerate() {
                        assert!((sum / n as f64 - mean[c]).abs() < 5e-5, "{width}×{height}, {size:?}, {c}: {sum}");
                    }
                    assert!((sum[3] / n as f64 - 200.0 / 255.0).abs() < 5e-5);
                }
                assert_eq!(size, [1, 1]);
            }
        }
    }

    #[test]
    fn levels_blend_from_the_picture_to_its_mean() {
        let image = picture(4, 4, |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
        let (mips, texture) = (Mips::default(), TextureRef { nearest: true, ..TextureRef::of(0) });
        let at = |level| mips.lookup(&image, &texture, Encoding::Srgb, [0.1, 0.1], level).0.r;
        for level in [-3.0, 0.0, f64::NAN] {
            assert_eq!(at(level), 1.0);
        }
        assert!((at(0.5) - 0.75).abs() < 1e-4 && (at(1.0) - 0.5).abs() < 1e-4);
        assert!((at(50.0) - 0.5).abs() < 1e-4);
        let pixel = picture(1, 1, |_, _| [255; 4]);
        assert_eq!(Mips::default().lookup(&pixel, &texture, Encoding::Srgb, [0.1, 0.1], 5.0).0.r, 1.0);
    }
}
