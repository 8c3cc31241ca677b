//! PNG pictures: 8-bit sRGB with text that says where they come from.
//!
//! Not here: tone mapping (render), EXR (`exr`), decoding textures (`texture`).

/// The bytes of a PNG file.
///
/// `rgb` is `[height, width, 3]`, sRGB-encoded, first row on top. `text` are pairs of keyword and text for tEXt
/// chunks, such as `("Software", "twinray 0.1.0")`; see the PNG specification §11.3.3 for the usual keywords.
/// Keywords are cut to 79 characters; characters outside Latin-1 become `?`, which that chunk cannot hold.
/// Equal arguments give equal bytes.
///
/// # Panics
/// If `rgb` has not `3 × width × height` bytes, or width or height is 0 or above 2³¹ − 1.
pub fn write_png(width: u32, height: u32, rgb: &[u8], text: &[(&str, &str)]) -> Vec<u8> {
    encode(width, height, rgb, png::ColorType::Rgb, text)
}

/// As [`write_png`], with an alpha channel: `rgba` is `[height, width, 4]`.
///
/// # Panics
/// If `rgba` has not `4 × width × height` bytes, or width or height is 0 or above 2³¹ − 1.
pub fn write_png_rgba(width: u32, height: u32, rgba: &[u8], text: &[(&str, &str)]) -> Vec<u8> {
    encode(width, height, rgba, png::ColorType::Rgba, text)
}

/// The bytes of an RGBA picture, for textures embedded in scene files.
pub(crate) fn encode_rgba(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    encode(width, height, rgba, png::ColorType::Rgba, &[])
}

fn encode(width: u32, height: u32, pixels: &[u8], color: png::ColorType, text: &[(&str, &str)]) -> Vec<u8> {
    let expected = u64::from(width) * u64::from(height) * color.samples() as u64;
    assert_eq!(pixels.len() as u64, expected, "write_png: {width}×{height} pixels need {expected} bytes");
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    for (keyword, value) in text {
        let keyword: String = latin1(keyword).trim().chars().take(79).collect();
        if !keyword.is_empty() {
            encoder.add_text_chunk(keyword, latin1(value)).expect("keyword is short Latin-1 text");
        }
    }
    // Writing to memory cannot fail, and the size was checked above.
    let mut writer = encoder.write_header().expect("a PNG header in memory");
    writer.write_image_data(pixels).expect("PNG data in memory");
    writer.finish().expect("the end of a PNG in memory");
    out
}

fn latin1(text: &str) -> String {
    text.chars().map(|c| if u32::from(c) < 256 && c != '\0' { c } else { '?' }).collect()
}
