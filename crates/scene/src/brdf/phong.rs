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
    /// The lobe is a mirror's, and not here: [`super::Specular`].
    is_sharp: bool,
}

impl Phong {
    /// Lambertian reflectance, lobe reflectance at normal incidence, exponent.
    pub fn new(diffuse: Rgb, specular: Rgb, exponent: f64) -> Self {
        Self { diffuse, specular, exponent: exponent.clamp(0.0, 2e8), is_sharp: false }
    }

    /// The same without its lobe, which is a mirror's.
    pub fn sharp(self) -> Self {
        Self { is_sharp: true, ..self }
    }

    /// The same with a lobe that is at least as wide as a GGX lobe of `alpha`.
    pub fn at_least(self, alpha: f64) -> Self {
        Self { exponent: self.exponent.min(2.0 / (alpha * alpha) - 2.0), ..self }
    }

    /// The same with a part of the base that does not scatter.
    pub fn without(self, transmitted: f64) -> Self {
        Self { diffuse: self.diffuse * (1.0 - transmitted), ..self }
    }

    /// √(2/(n + 2)), the α of the GGX lobe of about the same width.
    pub fn alpha(&self) -> f64 {
        (2.0 / (self.exponent + 2.0)).sqrt()
    }

    /// True if the lobe is a mirror's.
    pub fn is_sharp(&self) -> bool {
        self.is_sharp
    }

    /// Reflectance of the lobe at normal incidence.
    pub fn reflectance(&self) -> Rgb {
        self.specular
    }

    pub(super) fn lobe(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Rgb {
        self.specular * ((self.exponent + 2.0) / TAU * libm::pow(cosine_to_mirror(n, wi, wo), self.exponent))
    }

    pub(super) fn lobe_albedo(&self, cosine: f64) -> Rgb {
        if self.is_sharp {
            return Rgb::BLACK;
        }
        self.specular * table::phong().at(cosine, self.alpha())
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
