//! A picture in linear light.

use twinray_scene::Rgb;

/// Linear Rec. 709 radiance `[height, width, 3]`, first row on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width × height` pixels, W·sr⁻¹·m⁻² (or nit).
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// Pixel in column `x` of row `y`.
    pub fn pixel(&self, x: u32, y: u32) -> Rgb {
        Rgb::from_f32(self.pixels[(y * self.width + x) as usize])
    }
}
