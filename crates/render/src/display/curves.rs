//! Tone curves: scaled radiance in, sRGB-encoded values out.
//!
//! The default is AgX-like: Troy Sobotka's AgX (2022) with the polynomial fit of Benjamin Wrensch
//! ("Minimal AgX implementation", 2023): bright colours fade to white as film does instead of clipping into hues,
//! with a little contrast and saturation added for interiors.

use glam::{DMat3, DVec3};
use twinray_scene::Rgb;
use twinray_scene::texture::linear_to_srgb;

/// How scaled radiance becomes display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// Filmic, see the module.
    #[default]
    AgX,
    /// As motion pictures are shown: Stephen Hill's fit of the ACES reference rendering and output transforms for sRGB
    /// ("BakingLab", 2016), scaled so that a middle grey of .18 stays where it is. More contrast and colour than AgX.
    Aces,
    /// Luminance by E. Reinhard, M. Stark, P. Shirley, J. Ferwerda, "Photographic tone reproduction for digital images",
    /// SIGGRAPH 2002, equation 4; hue and saturation stay. Soft, with dull lights.
    Reinhard,
    /// Clipping at 1.
    None,
}

impl ToneCurve {
    /// sRGB-encoded values, about 0 to 1, of a linear Rec. 709 colour.
    pub fn shown(self, color: Rgb) -> Rgb {
        match self {
            ToneCurve::AgX => agx(color),
            ToneCurve::Aces => encoded(aces(color)),
            ToneCurve::Reinhard => encoded(reinhard(color)),
            ToneCurve::None => encoded(color),
        }
    }
}

fn encoded(linear: Rgb) -> Rgb {
    linear.map(|c| linear_to_srgb(c.clamp(0.0, 1.0)))
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

/// Hill's fit. The matrices go to the primaries in which film responds and back.
fn aces(c: Rgb) -> Rgb {
    // By columns; the published ones are rows.
    const INPUT: DMat3 =
        DMat3::from_cols_array(&[0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777]);
    const OUTPUT: DMat3 = DMat3::from_cols_array(&[
        1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602,
    ]);
    // The curve is .18 at .263 147: exposures then mean the same in all curves.
    const SCALE: f64 = 0.263_147 / 0.18;
    let curve = |v: f64| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    let v = INPUT * DVec3::from_array(c.map(|x| SCALE * x.max(0.0)).to_array());
    // The published rows sum to one within 1e-5 only; scaled, greys stay exactly grey.
    let v = v / (INPUT * DVec3::ONE);
    let shown = OUTPUT * DVec3::new(curve(v.x), curve(v.y), curve(v.z)) / (OUTPUT * DVec3::ONE);
    Rgb::from_array(shown.to_array())
}

/// Scaled luminance that Reinhard's curve burns out: four stops and a half above middle grey.
const REINHARD_WHITE: f64 = 4.0;

fn reinhard(c: Rgb) -> Rgb {
    let c = c.map(|x| x.max(0.0));
    let luminance = c.luminance();
    c * ((1.0 + luminance / (REINHARD_WHITE * REINHARD_WHITE)) / (1.0 + luminance))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [ToneCurve; 4] = [ToneCurve::AgX, ToneCurve::Aces, ToneCurve::Reinhard, ToneCurve::None];

    fn grey(curve: ToneCurve, value: f64) -> f64 {
        curve.shown(Rgb::grey(value)).g
    }

    #[test]
    fn curves_are_monotone_neutral_and_bounded() {
        for curve in CURVES {
            let mut last = -1.0;
            for i in -120..80 {
                let shown = curve.shown(Rgb::grey(libm::exp2(f64::from(i) / 10.0)));
                assert!((shown.r - shown.g).abs() < 1e-6 && (shown.g - shown.b).abs() < 1e-6, "{curve:?}: {shown:?}");
                assert!(shown.g >= last - 1e-9 && (-0.01..1.01).contains(&shown.g), "{curve:?} at {i}: {shown:?}");
                last = shown.g;
            }
            assert!(last > 0.95, "{curve:?} ends at {last}");
            assert!(grey(curve, 0.0) < 0.01, "{curve:?} of black: {}", grey(curve, 0.0));
        }
    }

    /// Also of colours that no screen has, in every corner of them.
    #[test]
    fn no_colour_leaves_the_screen_far() {
        let values = [-0.1, 0.0, 1e-4, 0.18, 1.0, 12.0, 1e6];
        let colours = values.iter().flat_map(|&r| values.iter().flat_map(move |&g| values.map(|b| Rgb::new(r, g, b))));
        for color in colours {
            for curve in CURVES {
                let shown = curve.shown(color);
                assert!(
                    shown.is_finite() && shown.max_channel() < 1.3 && shown.min_channel() > -0.3,
                    "{color:?}: {shown:?}"
                );
            }
        }
    }

    #[test]
    fn middle_grey_is_about_the_middle() {
        let v = grey(ToneCurve::AgX, 0.18);
        assert!((0.35..0.55).contains(&v), "{v}");
    }

    /// The encoding of .18 by IEC 61966-2-1 is .46136: `None` shows it, and the curve of ACES is scaled to it. Reinhard's is
    /// .18 · (1 + .18/16)/1.18 = .15426, encoded .42920, and exactly 1 at its white.
    #[test]
    fn known_values() {
        for (curve, at, expected) in [
            (ToneCurve::None, 0.18, 0.46136),
            (ToneCurve::Aces, 0.18, 0.46136),
            (ToneCurve::Reinhard, 0.18, 0.42920),
            (ToneCurve::Reinhard, REINHARD_WHITE, 1.0),
            (ToneCurve::None, 1.0, 1.0),
        ] {
            let v = grey(curve, at);
            assert!((v - expected).abs() < 2e-5, "{curve:?} of {at}: {v}, expected {expected}");
        }
        // What the fit makes of pure red at full light, by hand: red bleeds into the other channels.
        let red = aces(Rgb::new(1.0 / (0.263_147 / 0.18), 0.0, 0.0));
        let curve = |v: f64| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
        let [r, g, b] = [0.59719, 0.07600, 0.02840].map(curve);
        let expected = Rgb::new(
            1.60475 * r - 0.53108 * g - 0.07367 * b,
            -0.10208 * r + 1.10813 * g - 0.00605 * b,
            -0.00327 * r - 0.07276 * g + 1.07602 * b,
        );
        for c in 0..3 {
            assert!((red[c] - expected[c]).abs() < 2e-5, "{red:?}, expected {expected:?}");
        }
    }

    #[test]
    fn reinhard_keeps_hues() {
        let color = Rgb::new(2.0, 1.0, 0.5);
        let shown = reinhard(color);
        assert!((shown / shown.g - color).max_channel().abs() < 1e-12);
    }
}
