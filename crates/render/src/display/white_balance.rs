//! Which light is shown as white: chromatic adaptation of a picture.
//!
//! Colours of light are those of the daylight and Planckian loci; the adaptation is Bradford's (K. M. Lam, "Metamerism and
//! colour constancy", 1985, as in ICC.1:2010, annex E): what has the colour of the chosen light becomes neutral at the same luminance.

use glam::{DMat3, DVec3};
use twinray_scene::Rgb;

use crate::picture::Picture;

/// Which light is shown as white.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum WhiteBalance {
    /// D65, the white of Rec. 709: colours as they were computed.
    #[default]
    None,
    /// The light of this correlated colour temperature, kelvin, within [`WhiteBalance::KELVIN`]: daylight (CIE 15) from
    /// 5000 K on, a black body below 4000 K, and a mixture in between.
    Kelvin(f64),
    /// The mean of what lit surfaces reflect: "grey world" (G. Buchsbaum, "A spatial processor model for object colour
    /// perception", 1980). Every pixel counts by its colour, not by its brightness. Wrong where most of a room is red.
    Auto,
}

/// Chromaticities of Rec. 709 (and sRGB): red, green, blue, and D65.
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
const D65: [f64; 2] = [0.3127, 0.3290];

/// Bradford's cone responses of X, Y, Z; by columns.
const BRADFORD: DMat3 =
    DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);

/// X, Y, Z of a chromaticity at luminance 1.
fn xyz([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// X, Y, Z of linear Rec. 709 channels, whose (1, 1, 1) is D65 at luminance 1.
fn to_xyz() -> DMat3 {
    let [r, g, b] = PRIMARIES.map(xyz);
    let primaries = DMat3::from_cols(r, g, b);
    primaries * DMat3::from_diagonal(primaries.inverse() * xyz(D65))
}

/// Chromaticity of the light of a colour temperature.
fn locus(kelvin: f64) -> [f64; 2] {
    match kelvin {
        t if t <= 4000.0 => planckian(t),
        t if t >= 5000.0 => daylight(t),
        t => {
            let ([px, py], [dx, dy]) = (planckian(t), daylight(t));
            let share = (t - 4000.0) / 1000.0;
            [px + (dx - px) * share, py + (dy - py) * share]
        }
    }
}

/// CIE 15:2004, equations 3.2 to 3.4, for 4000 K to 25,000 K.
fn daylight(t: f64) -> [f64; 2] {
    let [a, b, c, d] = if t <= 7000.0 {
        [-4.6070e9, 2.9678e6, 0.09911e3, 0.244063]
    } else {
        [-2.0064e9, 1.9018e6, 0.24748e3, 0.237040]
    };
    let x = ((a / t + b) / t + c) / t + d;
    [x, (-3.000 * x + 2.870) * x - 0.275]
}

/// Cubic pieces of the Planckian locus by B. Kang et al., "Design of advanced color temperature control system for HDTV
/// applications", Journal of the Korean Physical Society 41 (2002), for 1667 K to 25,000 K.
fn planckian(t: f64) -> [f64; 2] {
    let [a, b, c, d] = if t <= 4000.0 {
        [-0.2661239e9, -0.2343589e6, 0.8776956e3, 0.179910]
    } else {
        [-3.0258469e9, 2.1070379e6, 0.2226347e3, 0.240390]
    };
    let x = ((a / t + b) / t + c) / t + d;
    let [a, b, c, d] = match t {
        t if t <= 2222.0 => [-1.1063814, -1.34811020, 2.18555832, -0.20219683],
        t if t <= 4000.0 => [-0.9549476, -1.37418593, 2.09137015, -0.16748867],
        _ => [3.0817580, -5.87338670, 3.75112997, -0.37001483],
    };
    [x, ((a * x + b) * x + c) * x + d]
}

impl WhiteBalance {
    /// Colour temperatures that have a white, kelvin.
    pub const KELVIN: std::ops::RangeInclusive<f64> = 1667.0..=25_000.0;

    /// Linear Rec. 709 channels of adapted light from those of light, for a picture.
    pub fn matrix(self, picture: &Picture) -> DMat3 {
        match self {
            WhiteBalance::None => DMat3::IDENTITY,
            WhiteBalance::Kelvin(t) => adaptation(xyz(locus(t.clamp(*Self::KELVIN.start(), *Self::KELVIN.end())))),
            WhiteBalance::Auto => grey_world(picture).map_or(DMat3::IDENTITY, |white| {
                let white = to_xyz() * DVec3::from_array(white.to_array());
                adaptation(white / white.y)
            }),
        }
    }

    /// Adapts the light of a picture, in place.
    pub fn apply(self, picture: &mut Picture) {
        let matrix = self.matrix(picture);
        Self::adapt(matrix, picture);
    }

    /// Adapts the light of a picture by a matrix of [`WhiteBalance::matrix`], perhaps that of another picture: what is shown
    /// one after the other must not change its colour.
    pub fn adapt(matrix: DMat3, picture: &mut Picture) {
        if matrix == DMat3::IDENTITY {
            return;
        }
        let adapted = |c: [f32; 3]| {
            let light = DVec3::from_array(Rgb::from_f32(c).to_array());
            Rgb::from_array((matrix * light).to_array()).to_f32()
        };
        picture.image.pixels.iter_mut().for_each(|c| *c = adapted(*c));
        picture.lights.iter_mut().for_each(|(c, _)| *c = adapted(*c));
    }
}

/// The matrix that makes `white`, X, Y, Z at luminance 1, neutral.
fn adaptation(white: DVec3) -> DMat3 {
    let gains = (BRADFORD * xyz(D65)) / (BRADFORD * white);
    let to_xyz = to_xyz();
    (BRADFORD * to_xyz).inverse() * DMat3::from_diagonal(gains) * (BRADFORD * to_xyz)
}

/// Mean colour at luminance 1 of what pixels show beside lights; `None` in the dark.
fn grey_world(picture: &Picture) -> Option<Rgb> {
    let mut sum = Rgb::BLACK;
    for (pixel, (lights, covered)) in picture.image.pixels.iter().zip(&picture.lights) {
        let reflected = Rgb::from_f32(*pixel) - Rgb::from_f32(*lights);
        let luminance = reflected.luminance();
        // What is left beside a lamp is rounding.
        if luminance > 1e-6 * Rgb::from_f32(*pixel).luminance() && reflected.min_channel() >= 0.0 {
            sum += reflected * ((1.0 - f64::from(*covered)) / luminance);
        }
    }
    (sum.luminance() > 0.0).then(|| sum / sum.luminance())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    fn picture(pixels: Vec<[f32; 3]>) -> Picture {
        let lights = vec![([0.0; 3], 0.0); pixels.len()];
        let image = Image { width: pixels.len() as u32, height: 1, pixels };
        Picture { image, lights, log2_luminance: None, empty: 0.0 }
    }

    #[track_caller]
    fn near([x, y]: [f64; 2], expected: [f64; 2], tolerance: f64) {
        assert!((x - expected[0]).abs() < tolerance && (y - expected[1]).abs() < tolerance, "({x}, {y})");
    }

    /// Illuminant A is a black body of 2856 K, (0.44757, 0.40745); D50 and D65 are daylight of 5003 K and 6504 K; a black
    /// body of 2000 K is at (0.5267, 0.4133).
    #[test]
    fn known_lights_have_their_colours() {
        near(locus(2856.0), [0.44757, 0.40745], 5e-4);
        near(locus(2000.0), [0.5267, 0.4133], 5e-4);
        near(locus(5003.0), [0.34567, 0.35850], 2e-4);
        near(locus(6504.0), D65, 2e-4);
        // The pieces meet.
        for t in [2222.0, 4000.0, 5000.0, 7000.0] {
            near(locus(t - 1e-6), locus(t + 1e-6), 1e-3);
        }
    }

    /// The first two columns of the well-known matrix of sRGB (IEC 61966-2-1).
    #[test]
    fn rec_709_has_its_matrix() {
        let expected = [[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]];
        for (column, expected) in to_xyz().to_cols_array_2d().iter().zip(expected) {
            assert!(column.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{column:?}");
        }
    }

    #[test]
    fn the_chosen_light_becomes_neutral_at_its_luminance() {
        for t in [1667.0, 2700.0, 4500.0, 6504.0, 20_000.0] {
            let light = to_xyz().inverse() * xyz(locus(t));
            let shown = WhiteBalance::Kelvin(t).matrix(&picture(vec![])) * light;
            assert!((shown - DVec3::ONE).length() < 1e-12, "{t} K: {shown}");
        }
        // Daylight of 6504 K is all but the white of Rec. 709.
        let identity = WhiteBalance::Kelvin(6504.0).matrix(&picture(vec![]));
        assert!((identity - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 2e-3), "{identity}");
        // A warm light is taken for white by a warm balance, and daylight then looks blue.
        let blue = WhiteBalance::Kelvin(2700.0).matrix(&picture(vec![])) * DVec3::ONE;
        assert!(blue.z > 1.5 * blue.x, "{blue}");
    }

    /// Bruce Lindbloom's published Bradford matrix from D50 to D65, applied to (1, 1, 1) of X, Y, Z.
    #[test]
    fn the_adaptation_is_bradfords() {
        let d50 = [0.34567, 0.35850];
        let to_xyz = to_xyz();
        let adapted = to_xyz * adaptation(xyz(d50)) * to_xyz.inverse();
        let expected =
            [0.9555766 - 0.0230393 + 0.0631636, -0.0282895 + 1.0099416 + 0.0210077, 0.0122982 - 0.0204830 + 1.3299098];
        let found = (adapted * DVec3::ONE).to_array();
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{found:?}, expected {expected:?}");
    }

    #[test]
    fn grey_worlds_are_grey_and_lights_do_not_count() {
        let tint = Rgb::new(1.2, 0.9, 0.5);
        let mut seen = picture([0.02, 0.4, 3.0].map(|x| (tint * x).to_f32()).to_vec());
        seen.image.pixels.push([0.0, 0.0, 900.0]);
        seen.lights.push(([0.0, 0.0, 900.0], 1.0));
        let before = Rgb::from_f32(seen.image.pixels[1]).luminance();
        WhiteBalance::Auto.apply(&mut seen);
        for pixel in &seen.image.pixels[..3] {
            let c = Rgb::from_f32(*pixel);
            assert!((c.max_channel() - c.min_channel()) / c.luminance() < 1e-5, "{c:?}");
        }
        // The weights of luminance are rounded to four digits.
        assert!((Rgb::from_f32(seen.image.pixels[1]).luminance() / before - 1.0).abs() < 2e-4);
        let mut dark = picture(vec![[0.0; 3]]);
        WhiteBalance::Auto.apply(&mut dark);
        assert_eq!(dark.image.pixels, [[0.0; 3]]);
    }
}
