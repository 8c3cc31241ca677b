//! Colours of cells, for viewers that show nothing else: what a person in the room would see, roughly.
//!
//! Not here: pictures, which have a tone curve (render).

use twinray_scene::texture::linear_to_srgb;
use twinray_scene::{PatchId, Rgb};

use super::CellTable;

/// Where the log-mean of cells that do not emit comes to lie, of 1.
const MIDDLE_GREY: f64 = 0.2;

/// What radiosity is multiplied by: the mean logarithm of its luminance, by area and over what is lit but does not
/// emit, becomes a middle grey. 1 where there is no such cell.
pub fn scale(table: &CellTable) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for p in table.scene.patches() {
        let luminance = Rgb::from_f32(table.radiosity[p.index()]).luminance();
        if luminance > 0.0 && !table.light.emits[p.index()] {
            let a = table.scene.area(p);
            sum += a * libm::log2(luminance);
            area += a;
        }
    }
    if area > 0.0 { MIDDLE_GREY * libm::exp2(-sum / area) } else { 1.0 }
}

/// Radiosity times `scale` in sRGB, clipped.
pub fn of(table: &CellTable, patch: PatchId, scale: f64) -> [u8; 3] {
    let shown = Rgb::from_f32(table.radiosity[patch.index()]) * scale;
    shown.map(|c| linear_to_srgb(c.clamp(0.0, 1.0))).to_array().map(|c| (255.0 * c).round() as u8)
}
