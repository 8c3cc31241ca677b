//! From radiance to a screen: `exposure`, then `white_balance`, then one of the `curves`, then sRGB.
//!
//! Not here: writing files (format). Pictures of linear light leave without any of this.

mod curves;
mod exposure;
mod white_balance;

use twinray_scene::Rgb;

pub use curves::ToneCurve;
pub use exposure::{Exposure, PhysicalCamera};
pub use white_balance::WhiteBalance;

use crate::picture::Picture;

/// Scaled luminance to which lights are limited before they mix with their neighbours within a pixel: white in
/// every curve, and no more, so that the edge of a lamp is as smooth as any other.
const BRIGHTEST_LIGHT: f64 = 12.0;

/// sRGB bytes `[height, width, 3]` of a picture, whose radiance is multiplied by `exposure`.
pub fn to_srgb8(picture: &Picture, exposure: f64, curve: ToneCurve) -> Vec<u8> {
    let pixels = picture.image.pixels.iter().zip(&picture.lights);
    pixels
        .flat_map(|(pixel, (lights, covered))| {
            let lights = Rgb::from_f32(*lights) * exposure;
            let limit = BRIGHTEST_LIGHT * f64::from(*covered);
            let excess = (1.0 - limit / lights.max_channel().max(1e-300)).max(0.0);
            let scaled = Rgb::from_f32(*pixel) * exposure - lights * excess;
            curve.shown(scaled).to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
        })
        .collect()
}
