//! Pictures of textures as files that browsers read: JPEG where they are opaque, PNG where they are not.

use std::io::Cursor;
use std::sync::Arc;

use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use image::{DynamicImage, ImageFormat, RgbaImage};
use rayon::prelude::*;
use serde_json::{Value, json};
use twinray::scene::authored::TextureImage;

use crate::container::Container;

/// Quality of JPEG files, of 100.
const QUALITY: u8 = 90;

/// Which pictures are asked for.
pub(crate) struct Textures {
    largest: u32,
    /// Number of the picture in the scene, and whether its numbers are colours (sRGB).
    wanted: Vec<(usize, bool)>,
}

impl Textures {
    pub fn new(largest: u32) -> Self {
        Self { largest: largest.max(1), wanted: Vec::new() }
    }

    /// The number in the package of a picture of the scene.
    pub fn wanted(&mut self, image: usize, is_colour: bool) -> usize {
        let found = self.wanted.iter().position(|w| *w == (image, is_colour));
        found.unwrap_or_else(|| {
            self.wanted.push((image, is_colour));
            self.wanted.len() - 1
        })
    }

    /// Adds the files to the container; their descriptions.
    pub fn write(self, images: &[Arc<TextureImage>], container: &mut Container) -> Vec<Value> {
        let files: Vec<_> = self.wanted.par_iter().map(|&(image, _)| encode(&images[image], self.largest)).collect();
        let described =
            files.into_iter().zip(&self.wanted).enumerate().map(|(k, ((bytes, kind), &(image, colour)))| {
                let name = format!("image{k}");
                container.add(&name, bytes);
                json!({ "array": name, "type": kind, "colour": colour, "name": images[image].name })
            });
        described.collect()
    }
}

fn encode(texture: &TextureImage, largest: u32) -> (Vec<u8>, &'static str) {
    let mut picture = RgbaImage::from_raw(texture.width, texture.height, texture.rgba.clone()).unwrap_or_default();
    let longer = texture.width.max(texture.height);
    if longer > largest {
        let smaller = |side: u32| (u64::from(side) * u64::from(largest)).div_ceil(u64::from(longer)).max(1) as u32;
        let (width, height) = (smaller(texture.width), smaller(texture.height));
        picture = image::imageops::resize(&picture, width, height, FilterType::Triangle);
    }
    let is_opaque = picture.pixels().all(|p| p.0[3] == 255);
    let mut bytes = Vec::new();
    if is_opaque {
        let rgb = DynamicImage::ImageRgba8(picture.clone()).into_rgb8();
        if rgb.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY)).is_ok() {
            return (bytes, "image/jpeg");
        }
        bytes.clear();
    }
    // Writing to memory fails only for sizes that JPEG or PNG cannot have; a texture without a file is white.
    let done = picture.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png);
    if done.is_err() {
        bytes.clear();
    }
    (bytes, "image/png")
}
