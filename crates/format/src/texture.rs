//! Pictures for surfaces: compressed bytes to 8-bit RGBA, inside the limits of texels.
//!
//! Lives here: decoding, the shrinking of pictures beyond the common limit, the brightest texel (reflectance
//! must stay below 1 everywhere). Not here: which pictures are needed and how they are wrapped (`gltf::material`,
//! `obj::material`), writing PNG files of results (`png`).

use std::io::Cursor;
use std::sync::Arc;

use image::{ImageDecoder, ImageFormat, ImageReader};
use twinray_scene::TextureImage;

use crate::limits::{DECODING_BYTES, Limits};

/// The pictures decoded so far.
#[derive(Default)]
pub(crate) struct Pictures {
    images: Vec<Arc<TextureImage>>,
    brightest: Vec<[f64; 3]>,
    texels: u64,
    /// Work so far, in texels, before any shrinking: time is limited too.
    work: u64,
}

impl Pictures {
    /// Decodes `bytes` and answers with the picture's index and, if it was kept smaller than it is, a remark.
    /// An error is for a warning: the surface does without.
    pub(crate) fn add(&mut self, name: &str, bytes: &[u8], limits: &Limits) -> Result<(usize, Option<String>), String> {
        // Sixteen 4096² pictures with the default limits, a few seconds; then the same picture again and again
        // would cost time without end.
        if self.work > limits.max_texels.saturating_mul(8) {
            return Err("too many texels were decoded before it (Limits::max_texels)".to_owned());
        }
        let mut image = decode(name, bytes, limits, &mut self.work)?;
        let full = (image.width, image.height);
        let room = limits.max_texels.saturating_sub(self.texels);
        while u64::from(image.width) * u64::from(image.height) > room {
            if image.width == 1 && image.height == 1 {
                return Err("no texels are left (Limits::max_texels)".to_owned());
            }
            image = halve(image);
        }
        let remark = (full != (image.width, image.height)).then(|| {
            let (w, h) = (image.width, image.height);
            format!("kept at {w}×{h} instead of {}×{} texels (Limits::max_texels)", full.0, full.1)
        });
        self.texels += u64::from(image.width) * u64::from(image.height);
        self.brightest.push(brightest_texel(&image));
        self.images.push(Arc::new(image));
        Ok((self.images.len() - 1, remark))
    }

    /// A picture made texel by texel of picture `index`, within the same limits; `None` beyond them.
    pub(crate) fn derive(
        &mut self,
        index: usize,
        prefix: &str,
        limits: &Limits,
        mut texel: impl FnMut([u8; 4]) -> [u8; 4],
    ) -> Option<usize> {
        let source = self.images.get(index)?.clone();
        let texels = u64::from(source.width) * u64::from(source.height);
        if texels > limits.max_texels.saturating_sub(self.texels) {
            return None;
        }
        self.texels += texels;
        let rgba = source.rgba.as_chunks::<4>().0.iter().flat_map(|t| texel(*t)).collect();
        let image = TextureImage { name: format!("{prefix}{}", source.name), rgba, ..*source };
        self.brightest.push(brightest_texel(&image));
        self.images.push(Arc::new(image));
        Some(self.images.len() - 1)
    }

    /// The colours of picture `colour`, or white, with picture `mask` as alpha: its own alpha channel if that says
    /// anything, else its brightness. `None` where the sizes differ or the limits are reached.
    pub(crate) fn with_mask(&mut self, colour: Option<usize>, mask: usize, limits: &Limits) -> Option<usize> {
        let mask_image = self.images.get(mask)?.clone();
        let masks = mask_image.rgba.as_chunks::<4>().0;
        let by_alpha = masks.iter().any(|t| t[3] < 255);
        let alpha = |t: &[u8; 4]| if by_alpha { t[3] } else { t[1] };
        let base = self.images.get(colour.unwrap_or(mask))?.clone();
        if (base.width, base.height) != (mask_image.width, mask_image.height) {
            return None;
        }
        let mut alphas = masks.iter().map(alpha);
        let masked = |[r, g, b, _]: [u8; 4]| {
            let a = alphas.next().unwrap_or(255);
            if colour.is_some() { [r, g, b, a] } else { [255, 255, 255, a] }
        };
        self.derive(colour.unwrap_or(mask), "mask of ", limits, masked)
    }

    /// Largest linear value of each channel of picture `index`.
    pub(crate) fn brightest(&self, index: usize) -> [f64; 3] {
        self.brightest.get(index).copied().unwrap_or([1.0; 3])
    }

    /// The pictures, by index.
    pub(crate) fn into_images(self) -> Vec<Arc<TextureImage>> {
        self.images
    }
}

/// Decodes a picture; `work` grows by what that costs, whether it succeeds or not: a damaged picture shows it at its end.
fn decode(name: &str, bytes: &[u8], limits: &Limits, work: &mut u64) -> Result<TextureImage, String> {
    // Some decoders look at all bytes before they know a size.
    *work = work.saturating_add(bytes.len() as u64 / 4);
    // The bytes know better than the name; only TGA has no mark of its own.
    let format = match image::guess_format(bytes) {
        Ok(format) => format,
        Err(_) if name.to_ascii_lowercase().ends_with(".tga") => ImageFormat::Tga,
        Err(_) => return Err("is of an unknown picture format (PNG, JPEG, BMP, TGA and WebP are read)".to_owned()),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut caps = image::Limits::default();
    caps.max_alloc = Some(limits.max_image_texels.saturating_mul(DECODING_BYTES));
    reader.limits(caps);
    let decoder = reader.into_decoder().map_err(|error| format!("cannot be decoded ({error})"))?;
    let (width, height) = decoder.dimensions();
    let texels = u64::from(width) * u64::from(height);
    if texels == 0 {
        return Err("has no texels".to_owned());
    }
    // 16-bit and float pictures take more memory per texel while they are decoded: they count for as much.
    if texels > limits.max_image_texels || decoder.total_bytes() > limits.max_image_texels.saturating_mul(4) {
        let allowed = limits.max_image_texels;
        return Err(format!("has {width}×{height} texels, more than Limits::max_image_texels = {allowed}"));
    }
    *work = work.saturating_add(texels);
    let picture = image::DynamicImage::from_decoder(decoder).map_err(|error| format!("cannot be decoded ({error})"))?;
    let rgba = picture.into_rgba8().into_raw();
    Ok(TextureImage { name: name.to_owned(), width, height, rgba })
}

/// `image` at half its width and height (at least 1), each texel the mean light of those it covers.
fn halve(image: TextureImage) -> TextureImage {
    let (width, height) = (image.width.div_ceil(2), image.height.div_ceil(2));
    let linear = linear_table();
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0f64; 4];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                // An odd last row or column counts twice.
                let (sx, sy) = ((2 * x + dx).min(image.width - 1), (2 * y + dy).min(image.height - 1));
                let at = (sy as usize * image.width as usize + sx as usize) * 4;
                for c in 0..3 {
                    sum[c] += linear[image.rgba[at + c] as usize];
                }
                sum[3] += f64::from(image.rgba[at + 3]);
            }
            // The table is increasing: the nearest code is where it passes the mean.
            let encode = |v: f64| linear.partition_point(|&l| l < v - 1e-12).min(255) as u8;
            rgba.extend([
                encode(sum[0] / 4.0),
                encode(sum[1] / 4.0),
                encode(sum[2] / 4.0),
                (sum[3] / 4.0).round() as u8,
            ]);
        }
    }
    TextureImage { name: image.name, width, height, rgba }
}

fn brightest_texel(image: &TextureImage) -> [f64; 3] {
    let mut brightest = [0u8; 3];
    for texel in image.rgba.chunks_exact(4) {
        for c in 0..3 {
            brightest[c] = brightest[c].max(texel[c]);
        }
    }
    let linear = linear_table();
    brightest.map(|code| linear[code as usize])
}

/// Linear value of each sRGB code (IEC 61966-2-1).
fn linear_table() -> [f64; 256] {
    std::array::from_fn(|code| {
        let v = code as f64 / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkers(width: u32, height: u32) -> TextureImage {
        let texel =
            |i: u32| if (i % width + i / width).is_multiple_of(2) { [255, 255, 255, 255] } else { [0, 0, 0, 255] };
        TextureImage { name: "c".into(), width, height, rgba: (0..width * height).flat_map(texel).collect() }
    }

    #[test]
    fn halving_keeps_the_mean_light() {
        let half = halve(checkers(4, 2));
        assert_eq!((half.width, half.height), (2, 1));
        // Half the light is sRGB code 188 (0.5 → 0.7354 × 255 = 187.5).
        assert_eq!(half.rgba, [188, 188, 188, 255, 188, 188, 188, 255]);
        let odd = halve(checkers(1, 3));
        assert_eq!((odd.width, odd.height), (1, 2));
    }

    #[test]
    fn the_brightest_texel_is_linear() {
        assert_eq!(brightest_texel(&checkers(2, 2)), [1.0; 3]);
        let dim = TextureImage { name: "d".into(), width: 1, height: 1, rgba: vec![188, 0, 10, 0] };
        let [r, g, b] = brightest_texel(&dim);
        assert!((r - 0.5).abs() < 0.005 && g == 0.0 && (b - 0.003_035).abs() < 1e-5, "{r} {g} {b}");
    }
}
