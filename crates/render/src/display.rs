//! From radiance to a screen: exposure, tone curve, sRGB.
//!
//! The default curve is AgX-like: Troy Sobotka's AgX (2022) with the polynomial fit of Benjamin Wrensch
//! ("Minimal AgX implementation", 2023): bright colours fade to white as film does instead of clipping into hues,
//! with a little contrast and saturation added for interiors.

use glam::{DMat3, DVec3};
use twinray_scene::Rgb;
use twinray_scene::texture::linear_to_srgb;

use crate::picture::Picture;

/// How radiance is scaled before the tone curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// The log-mean of lit surfaces, emitters and empty pixels left out, becomes a middle grey.
    Auto,
    /// Times 2^EV.
    Stops(f64),
}

/// How scaled radiance becomes display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Filmic, see the module.
    #[default]
    AgX,
    /// Clipping at 1.
    None,
}

/// Where automatic exposure puts the log-mean of a picture.
const MIDDLE_GREY: f64 = 0.20;

impl Exposure {
    /// The factor on radiance for a picture; 1 for an automatic exposure of darkness.
    pub fn factor(self, picture: &Picture) -> f64 {
        match self {
            Exposure::Stops(ev) => libm::exp2(ev),
            Exposure::Auto => picture.log2_luminance.map_or(1.0, |l| MIDDLE_GREY * libm::exp2(-l)),
        }
    }
}

/// Scaled luminance to which lights are limited before they mix with their neighbours within a pixel: white in
/// every curve, and no more, so that the edge of a lamp is as smooth as any other.
const BRIGHTEST_LIGHT: f64 = 12.0;

/// sRGB bytes `[height, width, 3]` of a picture.
pub fn to_srgb8(picture: &Picture, exposure: f64, curve: ToneCurve) -> Vec<u8> {
    let pixels = picture.image.pixels.iter().zip(&picture.lights);
    pixels
        .flat_map(|(pixel, (lights, covered))| {
            let lights = Rgb::from_f32(*lights) * exposure;
            let limit = BRIGHTEST_LIGHT * f64::from(*covered);
            let excess = (1.0 - limit / lights.max_channel().max(1e-300)).max(0.0);
            let scaled = Rgb::from_f32(*pixel) * exposure - lights * excess;
            let shown = match curve {
                ToneCurve::AgX => agx(scaled),
                ToneCurve::None => scaled.map(|c| linear_to_srgb(c.clamp(0.0, 1.0))),
            };
            shown.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
        })
        .collect()
}

/// The AgX-like curve: linear Rec. 709 in, sRGB-encoded values out.
fn agx(c: Rgb) -> Rgb {
    // Mixing the primaries a little first is what lets saturated lights fade to white.
    const INSET: DMat3 = DMat3::from_cols_array(&[
        0.842479062253094,
        0.0423282422610123,
        0.0423756549057051, //
        0.0784335999999992,
        0.878468636469772,
        0.0784336, //
        0.0792237451477643,
        0.0791661274605434,
        0.879142973793104,
    ]);
    const STOPS: [f64; 2] = [-12.47393, 4.026069];
    // The published rows sum to one within 1e-4 only; scaled, greys stay exactly grey.
    let white = INSET * DVec3::ONE;
    let v = INSET * DVec3::from_array(c.map(|x| x.max(0.0)).to_array()) / white;
    let curve = |x: f64| {
        let x = ((libm::log2(x.max(1e-10)) - STOPS[0]) / (STOPS[1] - STOPS[0])).clamp(0.0, 1.0);
        let x2 = x * x;
        let x4 = x2 * x2;
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232
    };
    let v = DVec3::new(curve(v.x), curve(v.y), curve(v.z));
    // Look: contrast around black, then saturation.
    let v = v.max(DVec3::ZERO).powf(1.12);
    let luminance = Rgb::from_array(v.to_array()).luminance();
    let v = DVec3::splat(luminance) + (v - DVec3::splat(luminance)) * 1.18;
    let shown = INSET.inverse() * (v * white);
    Rgb::from_array(shown.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_monotone_neutral_and_bounded() {
        let mut last = -1.0;
        for i in -120..80 {
            let grey = agx(Rgb::grey(libm::exp2(f64::from(i) / 10.0)));
            assert!((grey.r - grey.g).abs() < 1e-6 && (grey.g - grey.b).abs() < 1e-6);
            assert!(grey.g >= last - 1e-9 && grey.g < 1.01);
            last = grey.g;
        }
        assert!(last > 0.95);
    }

    #[test]
    fn middle_grey_is_about_the_middle() {
        let v = agx(Rgb::grey(0.18)).g;
        assert!((0.35..0.55).contains(&v), "{v}");
    }
}
