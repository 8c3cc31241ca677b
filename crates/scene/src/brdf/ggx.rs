//! The GGX lobe of glTF 2.0 over a diffuse base that keeps energy.
//!
//! Lobe: Trowbridge-Reitz distribution with the height-correlated Smith term and Schlick's Fresnel term, as in
//! appendix B of the glTF 2.0 specification and `KHR_materials_specular`. Base: glTF's own formula, base × (1 − F),
//! reflects more than it receives near grazing directions; its specification leaves the coupling free, and we take
//! that of Kelemen and Szirmay-Kalos ("A microfacet based coupled specular-matte BRDF model with importance
//! sampling", Eurographics 2001 short papers): ρ (1 − E(ωi)) (1 − E(ωo)) / (π (1 − Ē)), with E the lobe's albedo;
//! reciprocal, and exactly conserving at ρ = 1. Without a lobe (specular factor 0) it is Lambertian.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::table::{self, schlick};
use crate::geom::Frame;
use crate::rgb::Rgb;

/// A metallic-roughness BRDF of one place.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    /// Base reflectance × (1 − metalness).
    diffuse: Rgb,
    /// Lobe's reflectance at normal incidence and, common to all channels, at grazing incidence.
    f0: Rgb,
    f90: f64,
    /// The same of the dielectric coat over the base: what the base does not get.
    coat0: f64,
    coat90: f64,
    alpha: f64,
    /// The lobe is a mirror's, and not here: [`super::Specular`].
    is_sharp: bool,
}

impl Ggx {
    /// From glTF parameters: base colour, metalness, perceptual roughness, `KHR_materials_specular` factor and
    /// colour, index of refraction.
    pub fn new(base_color: Rgb, metallic: f64, roughness: f64, specular: f64, specular_color: Rgb, ior: f64) -> Self {
        let metallic = metallic.clamp(0.0, 1.0);
        let normal_incidence = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let coat = (specular_color * normal_incidence).map(|c| c.clamp(0.0, 1.0)) * specular;
        Self {
            diffuse: base_color * (1.0 - metallic),
            f0: coat.lerp(base_color, metallic),
            f90: specular + (1.0 - specular) * metallic,
            coat0: coat.max_channel(),
            coat90: specular,
            alpha: (roughness * roughness).clamp(1e-4, 1.0),
            is_sharp: false,
        }
    }

    /// The same without its lobe, which is a mirror's.
    pub fn sharp(self) -> Self {
        Self { is_sharp: true, ..self }
    }

    /// The same with a lobe that is at least so wide.
    pub fn at_least(self, alpha: f64) -> Self {
        Self { alpha: self.alpha.max(alpha), ..self }
    }

    /// The same with a part of the base that does not scatter.
    pub fn without(self, transmitted: f64) -> Self {
        Self { diffuse: self.diffuse * (1.0 - transmitted), ..self }
    }

    /// α, the square of the perceptual roughness.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// True if the lobe is a mirror's.
    pub fn is_sharp(&self) -> bool {
        self.is_sharp
    }

    /// Reflectance of the lobe at normal and at grazing incidence.
    pub fn fresnel(&self) -> [Rgb; 2] {
        [self.f0, Rgb::grey(self.f90)]
    }

    /// Directional albedo of the coat: what its base does not get.
    pub fn coat_albedo(&self, cosine: f64) -> f64 {
        let (scale, bias) = self.split_sum(cosine);
        self.coat0 * scale + self.coat90 * bias
    }

    /// Factors on the reflectance at normal and at grazing incidence.
    fn split_sum(&self, cosine: f64) -> (f64, f64) {
        if self.is_sharp {
            let fresnel = schlick(cosine);
            return (1.0 - fresnel, fresnel);
        }
        let t = table::ggx();
        (t.scale.at(cosine, self.alpha), t.bias.at(cosine, self.alpha))
    }

    /// The base's part of f_r for two cosines.
    pub(super) fn base(&self, ci: f64, co: f64) -> Rgb {
        let coat = |c| self.coat_albedo(c);
        self.diffuse * ((1.0 - coat(ci)) * (1.0 - coat(co)) / (PI * (1.0 - self.mean_coat())))
    }

    /// The base's part of f_r over what the other direction's cosine gives it, [`Ggx::base_under`].
    pub(super) fn base_towards(&self, co: f64) -> Rgb {
        self.diffuse * ((1.0 - self.coat_albedo(co)) / (PI * (1.0 - self.mean_coat())))
    }

    /// The part of the base that a direction's cosine decides.
    pub(super) fn base_under(&self, ci: f64) -> f64 {
        1.0 - self.coat_albedo(ci)
    }

    /// Cosine-weighted mean of the coat's albedo, Ē.
    fn mean_coat(&self) -> f64 {
        if self.is_sharp {
            // ∫ 2c (1 − c)⁵ dc = 1/21.
            return self.coat0 + (self.coat90 - self.coat0) / 21.0;
        }
        let t = table::ggx();
        self.coat0 * t.mean_scale.at(0.0, self.alpha) + self.coat90 * t.mean_bias.at(0.0, self.alpha)
    }

    pub(super) fn albedo(&self, cosine: f64) -> Rgb {
        let (scale, bias) = self.split_sum(cosine);
        let lobe = if self.is_sharp { Rgb::BLACK } else { self.f0 * scale + Rgb::grey(self.f90 * bias) };
        lobe + self.diffuse * (1.0 - self.coat0 * scale - self.coat90 * bias)
    }

    pub(super) fn lobe_albedo(&self, cosine: f64) -> Rgb {
        if self.is_sharp {
            return Rgb::BLACK;
        }
        let (scale, bias) = self.split_sum(cosine);
        self.f0 * scale + Rgb::grey(self.f90 * bias)
    }

    pub(super) fn lobe(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Rgb {
        let h = (wi + wo).normalize_or_zero();
        let fresnel = schlick(wi.dot(h));
        let f = self.f0 * (1.0 - fresnel) + Rgb::grey(self.f90 * fresnel);
        f * (distribution(n.dot(h), self.alpha) * visibility(n.dot(wi), n.dot(wo), self.alpha))
    }

    pub(super) fn lobe_sample(&self, n: DVec3, wi: DVec3, u: [f64; 2]) -> DVec3 {
        let frame = Frame::from_normal(n);
        let local = frame.to_local(wi);
        let h = visible_normal(local, self.alpha, u);
        frame.to_world(2.0 * local.dot(h) * h - local)
    }

    pub(super) fn lobe_pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        let h = (wi + wo).normalize_or_zero();
        // Density of visible normals, G1·D·(wi·h)/cos, times the Jacobian 1/(4 wi·h) of the reflection.
        masking(n.dot(wi), self.alpha) * distribution(n.dot(h), self.alpha) / (4.0 * n.dot(wi))
    }
}

/// Trowbridge-Reitz distribution of normals, sr⁻¹.
fn distribution(nh: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let d = nh * nh * (a2 - 1.0) + 1.0;
    a2 / (PI * d * d)
}

/// Smith's masking of one direction, G1.
fn masking(cosine: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    2.0 * cosine / (cosine + (a2 + (1.0 - a2) * cosine * cosine).sqrt())
}

/// Height-correlated Smith masking-shadowing over 4 cosθi cosθo.
fn visibility(ci: f64, co: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let term = |a: f64, b: f64| a * (b * b * (1.0 - a2) + a2).sqrt();
    0.5 / (term(ci, co) + term(co, ci)).max(1e-300)
}

/// G2/G1: the weight of a sampled visible normal.
pub(super) fn masking_ratio(ci: f64, co: f64, alpha: f64) -> f64 {
    visibility(ci, co, alpha) * 4.0 * ci * co / masking(ci, alpha)
}

/// A normal that `wi` sees, in the local frame (Heitz, "Sampling the GGX distribution of visible normals",
/// JCGT 7(4), 2018).
pub(super) fn visible_normal(wi: DVec3, alpha: f64, u: [f64; 2]) -> DVec3 {
    let stretched = DVec3::new(alpha * wi.x, alpha * wi.y, wi.z).normalize();
    let r = u[0].sqrt();
    let (sin, cos) = libm::sincos(TAU * u[1]);
    let t1 = r * cos;
    // The disc is squeezed on the side that points below the surface, hence an axis in the plane of the normal.
    let side = DVec3::Z.cross(stretched).try_normalize().unwrap_or(DVec3::X);
    let rise = stretched.cross(side);
    let s = 0.5 * (1.0 + stretched.z);
    let t2 = (1.0 - s) * (1.0 - t1 * t1).max(0.0).sqrt() + s * r * sin;
    let h = t1 * side + t2 * rise + (1.0 - t1 * t1 - t2 * t2).max(0.0).sqrt() * stretched;
    DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(DVec3::Z)
}
