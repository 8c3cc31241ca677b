//! The normalised Phong lobe over a Lambertian base, the glossy material of the paper's time.
//!
//! f = ρ_d/π + ρ_s (n + 2)/(2π) cosⁿα, α measured from the mirror direction (Lafortune and Willems, "Using the
//! modified Phong reflectance model for physically based rendering", 1994). Reciprocal; the lobe's albedo is ρ_s
//! at normal incidence and less elsewhere, where part of the lobe is below the horizon.

use std::f64::consts::TAU;

use glam::DVec3;

use super::table;
use crate::geom::Frame;
use crate::rgb::Rgb;

/// A Phong BRDF of one place.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    pub(super) diffuse: Rgb,
    specular: Rgb,
    exponent: f64,
}

impl Phong {
    /// Lambertian reflectance, lobe reflectance at normal incidence, exponent (limited as [`super::MIN_ALPHA`] asks).
    pub fn new(diffuse: Rgb, specular: Rgb, exponent: f64) -> Self {
        // √(2/(n + 2)) is the α of the GGX lobe of about the same width.
        let sharpest = 2.0 / (super::MIN_ALPHA * super::MIN_ALPHA) - 2.0;
        Self { diffuse, specular, exponent: exponent.clamp(0.0, sharpest) }
    }

    pub(super) fn lobe(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Rgb {
        self.specular * ((self.exponent + 2.0) / TAU * libm::pow(cosine_to_mirror(n, wi, wo), self.exponent))
    }

    pub(super) fn lobe_albedo(&self, cosine: f64) -> Rgb {
        self.specular * table::phong().at(cosine, (2.0 / (self.exponent + 2.0)).sqrt())
    }

    pub(super) fn lobe_sample(&self, n: DVec3, wi: DVec3, u: [f64; 2]) -> DVec3 {
        let mirror = (2.0 * n.dot(wi) * n - wi).normalize();
        Frame::from_normal(mirror).to_world(around_axis(self.exponent, u))
    }

    pub(super) fn lobe_pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        (self.exponent + 1.0) / TAU * libm::pow(cosine_to_mirror(n, wi, wo), self.exponent)
    }
}

fn cosine_to_mirror(n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
    (2.0 * n.dot(wi) * n - wi).dot(wo).clamp(0.0, 1.0)
}

/// A direction about +Z with density (n + 1)/(2π) cosⁿ.
pub(super) fn around_axis(exponent: f64, u: [f64; 2]) -> DVec3 {
    // At 0 the density would be 0 as well, and a weight over it not a number.
    let z = libm::pow(u[0].max(1e-12), 1.0 / (exponent + 1.0));
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(TAU * u[1]);
    DVec3::new(r * cos, r * sin, z)
}
