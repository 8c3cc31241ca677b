//! Pictures read back: PNG as a screen shows it, EXR as linear light.
//!
//! For comparing results, of this program or of others. Not here: textures of scenes (`texture`), which are 8-bit
//! and come in more formats; writing (`png`, `exr`).

use std::io::Cursor;

use exr::compression::Compression;
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, Vec2, read};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use twinray_render::Image;
use twinray_scene::texture::srgb_to_linear;

use crate::error::FormatError;
use crate::limits::{DECODING_BYTES, Limits};

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureFile {
    /// Linear Rec. 709: radiance from EXR, light of a screen (white is 1) from PNG.
    pub image: Image,
    /// `[height, width, 3]`, sRGB-encoded values in [0, 1] of a PNG as they stand in the file; `None` for EXR.
    pub display: Option<Vec<[f32; 3]>>,
}

/// Reads a PNG (8 or 16 bits, taken for sRGB) or an EXR picture (channels R, G and B, taken for Rec. 709); the first
/// bytes tell which. Transparency is ignored. `name` is for messages.
///
/// # Errors
/// `Unreadable` if it is neither, or damaged; `OverLimit` beyond `max_file_bytes` or `max_image_texels`; `Invalid` if
/// a pixel is not finite.
pub fn read_picture(name: &str, bytes: &[u8], limits: &Limits) -> Result<PictureFile, FormatError> {
    within(name, "max_file_bytes", bytes.len() as u64, limits.max_file_bytes, "bytes")?;
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        read_png(name, bytes, limits)
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        read_exr(name, bytes, limits)
    } else {
        Err(FormatError::unreadable(name, "a PNG or an EXR picture", "is no picture of a known kind"))
    }
}

fn read_png(name: &str, bytes: &[u8], limits: &Limits) -> Result<PictureFile, FormatError> {
    let unreadable = |e: image::ImageError| FormatError::unreadable(name, "a PNG picture", e.to_string());
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut caps = image::Limits::default();
    // The picture at 16 bits and four channels, and as much again while it is decoded.
    caps.max_alloc = Some(limits.max_image_texels.saturating_mul(DECODING_BYTES));
    reader.limits(caps);
    let decoder = reader.into_decoder().map_err(unreadable)?;
    let (width, height) = decoder.dimensions();
    within_texels(name, u64::from(width), u64::from(height), limits)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(unreadable)?;
    let deep = picture.color().bytes_per_pixel() > picture.color().channel_count();
    let display: Vec<[f32; 3]> = if deep {
        picture.into_rgb16().pixels().map(|p| p.0.map(|c| f32::from(c) / 65535.0)).collect()
    } else {
        picture.into_rgb8().pixels().map(|p| p.0.map(|c| f32::from(c) / 255.0)).collect()
    };
    let pixels = display.iter().map(|p| p.map(|c| srgb_to_linear(f64::from(c)) as f32)).collect();
    Ok(PictureFile { image: Image { width, height, pixels }, display: Some(display) })
}

pub(crate) fn read_exr(name: &str, bytes: &[u8], limits: &Limits) -> Result<PictureFile, FormatError> {
    let unreadable = |e: exr::error::Error| {
        FormatError::unreadable(name, "an EXR picture with the channels R, G and B", e.to_string())
    };
    // Sizes before anything is allocated for them.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(unreadable)?;
    for header in &meta.headers {
        if matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
            let hint =
                "Save it with ZIP or PIZ compression, for example by `oiiotool in.exr --compression zip -o out.exr`";
            return Err(FormatError::unsupported(name, "compression", "EXR compression DWAA or DWAB", hint));
        }
        let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        within_texels(name, width, height, limits)?;
        // A block is unpacked with all of its channels, wanted or not.
        let bytes = width.saturating_mul(height).saturating_mul(header.channels.bytes_per_pixel as u64);
        let allowed = limits.max_image_texels.saturating_mul(DECODING_BYTES);
        within(name, "max_image_texels", bytes, allowed, "bytes in all channels")?;
    }
    let picture = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: Vec2<usize>, _| (size, vec![[0.0f32; 3]; size.area()]),
            |(size, pixels), at, (r, g, b): (f32, f32, f32)| pixels[at.1 * size.0 + at.0] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(unreadable)?;
    let (size, pixels) = picture.layer_data.channel_data.pixels;
    if let Some(at) = pixels.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        let place = format!("pixel ({}, {})", at % size.0, at / size.0);
        return Err(FormatError::invalid(name, &place, format!("{:?}", pixels[at]), "finite numbers"));
    }
    Ok(PictureFile { image: Image { width: size.0 as u32, height: size.1 as u32, pixels }, display: None })
}

pub(crate) fn within_texels(name: &str, width: u64, height: u64, limits: &Limits) -> Result<(), FormatError> {
    let pixels = width.saturating_mul(height);
    within(name, "max_image_texels", pixels, limits.max_image_texels, "pixels")
}

pub(crate) fn within(
    name: &str,
    limit: &'static str,
    needed: u64,
    allowed: u64,
    unit: &str,
) -> Result<(), FormatError> {
    if needed <= allowed {
        return Ok(());
    }
    Err(FormatError::OverLimit {
        file: name.to_owned(),
        element: "the picture".to_owned(),
        limit,
        needed: format!("{needed} {unit}"),
        allowed,
    })
}
