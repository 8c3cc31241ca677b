//! How radiance is scaled before the tone curve: automatic, by stops, or by the settings of a camera.

use crate::picture::Picture;

/// How radiance is scaled before the tone curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// The log-mean of lit surfaces, emitters and empty pixels left out, becomes a middle grey.
    Auto,
    /// Times 2^EV.
    Stops(f64),
    /// As a camera with these settings. It takes radiance for nit (cd/m²). Where a scene means W·sr⁻¹·m⁻², a nit is one
    /// 683rd of that at most, and pictures come out dark by seven stops and more: such scenes want another exposure.
    Camera(PhysicalCamera),
}

/// The settings of a camera that decide its exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhysicalCamera {
    /// Sensitivity, ISO.
    pub iso: f64,
    /// Time that the shutter is open, seconds.
    pub shutter: f64,
    /// Aperture, as the focal length over its diameter.
    pub f_number: f64,
}

/// Where automatic exposure puts the log-mean of a picture.
const MIDDLE_GREY: f64 = 0.20;

/// A sensor is saturated by 78/S lux seconds, S its ISO speed (ISO 12232, saturation-based speed).
const SATURATION: f64 = 78.0;
/// Lux on the sensor of a nit of the scene at f/1: π/4 times transmittance, vignetting and cos⁴ of a usual lens (ISO 12232).
const LENS: f64 = 0.65;

impl PhysicalCamera {
    /// Exposure value at ISO 100: log₂ (N²/t · 100/S).
    pub fn ev100(self) -> f64 {
        libm::log2(self.f_number * self.f_number / self.shutter * 100.0 / self.iso)
    }

    /// Luminance that saturates the sensor, nit: 78 N² / (q t S) with q = .65, which is 1.2 · 2^EV100. It becomes 1.
    /// Source: ISO 12232; S. Lagarde, C. de Rousiers, "Moving Frostbite to physically based rendering", SIGGRAPH 2014
    /// course notes, §5.1.
    pub fn saturating_luminance(self) -> f64 {
        SATURATION / LENS * 0.01 * libm::exp2(self.ev100())
    }
}

impl Exposure {
    /// The factor on radiance for a picture; 1 for an automatic exposure of darkness.
    pub fn factor(self, picture: &Picture) -> f64 {
        match self {
            Exposure::Stops(ev) => libm::exp2(ev),
            Exposure::Auto => picture.log2_luminance.map_or(1.0, |l| MIDDLE_GREY * libm::exp2(-l)),
            Exposure::Camera(camera) => 1.0 / camera.saturating_luminance(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(iso: f64, shutter: f64, f_number: f64) -> PhysicalCamera {
        PhysicalCamera { iso, shutter, f_number }
    }

    /// f/1 and one second are EV 0 by definition; the "sunny 16" rule is about EV 15.
    #[test]
    fn exposure_values_are_those_of_photographers() {
        assert_eq!(camera(100.0, 1.0, 1.0).ev100(), 0.0);
        assert!((camera(100.0, 1.0 / 125.0, 16.0).ev100() - 14.966).abs() < 1e-3);
        assert!((camera(200.0, 0.01, 2.8).ev100() - camera(100.0, 0.02, 2.8).ev100()).abs() < 1e-12);
    }

    /// 1.2 · 2^EV100 nit saturate; each stop halves the factor.
    #[test]
    fn saturation_is_that_of_iso_12232() {
        assert!((camera(100.0, 1.0, 1.0).saturating_luminance() - 1.2).abs() < 1e-12);
        let ratio = camera(400.0, 0.01, 4.0).saturating_luminance() / camera(400.0, 0.01, 2.0).saturating_luminance();
        assert!((ratio - 4.0).abs() < 1e-12);
    }
}
