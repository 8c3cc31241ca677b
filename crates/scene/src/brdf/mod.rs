//! How a surface scatters light: BRDFs with evaluation, sampling, density and albedo.
//!
//! A [`Brdf`] is a small value made for one patch. It is split into a base, which is diffuse or nearly so, and
//! at most one lobe, because the solver samples the two differently. All directions are unit vectors in the
//! world, pointing away from the surface; `n` is its geometric normal. Not here: which material a patch has
//! (`patch`), the difference BRDF (solve). Paper: §1 (f_r), §2.1 (albedo a).

mod ggx;
mod phong;
mod scatter;
mod specular;
mod table;
mod towards;

use std::f64::consts::PI;

use glam::DVec3;

use crate::rgb::Rgb;
use crate::sample::warp;

pub use ggx::Ggx;
pub use phong::Phong;
pub use scatter::{Detail, Passing, Scatter};
pub use specular::{Choices, Event, Specular, attenuated, mirrored};
pub use towards::Towards;

/// Lobes on patches are never more peaked than this α (roughness 0.2): a patch stores light by its area, and a lobe
/// sharper than its neighbours are far apart would show as single bright cells. Lobes below half of this roughness
/// are mirrors for the solver's rays, those between are blurred to this. Pictures show them as they are.
pub const MIN_ALPHA: f64 = 0.04;

/// A bidirectional reflectance distribution function.
#[derive(Clone, Copy, Debug)]
pub enum Brdf {
    /// Constant ρ/π.
    Lambertian {
        /// Reflectance ρ.
        reflectance: Rgb,
    },
    /// Microfacet lobe over a coupled diffuse base.
    Ggx(Ggx),
    /// Normalised Phong lobe over a Lambertian base.
    Phong(Phong),
}

impl Brdf {
    /// f_r(`wi`, `wo`) in sr⁻¹; black if either direction is below the surface.
    pub fn eval(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Rgb {
        let (ci, co) = (n.dot(wi), n.dot(wo));
        if ci <= 0.0 || co <= 0.0 {
            return Rgb::BLACK;
        }
        match self {
            Brdf::Lambertian { reflectance } => *reflectance / PI,
            Brdf::Ggx(g) => g.base(ci, co) + self.lobe_eval(n, wi, wo),
            Brdf::Phong(p) => p.diffuse / PI + self.lobe_eval(n, wi, wo),
        }
    }

    /// Directional-hemispherical reflectance a(ω) for light at the given cosine: what share is reflected.
    pub fn albedo(&self, cosine: f64) -> Rgb {
        match self {
            Brdf::Lambertian { reflectance } => *reflectance,
            Brdf::Ggx(g) => g.albedo(cosine),
            Brdf::Phong(p) => p.diffuse + p.lobe_albedo(cosine),
        }
    }

    /// Reflectance under uniform illumination: the cosine-weighted mean of [`Brdf::albedo`].
    pub fn mean_albedo(&self) -> Rgb {
        match self {
            Brdf::Lambertian { reflectance } => *reflectance,
            _ => {
                // Midpoints in sin²θ are the quantiles of the cosine-weighted hemisphere.
                const N: u32 = 16;
                let cosines = (0..N).map(|i| (1.0 - (f64::from(i) + 0.5) / f64::from(N)).sqrt());
                cosines.map(|c| self.albedo(c)).sum::<Rgb>() / f64::from(N)
            }
        }
    }

    /// Hemispherical-directional reflectance of the base alone towards the given cosine, under uniform light.
    pub fn base_reflectance(&self, cosine: f64) -> Rgb {
        self.albedo(cosine) - self.lobe_albedo(cosine)
    }

    /// True if there is a lobe beside the base.
    pub fn is_glossy(&self) -> bool {
        match self {
            Brdf::Lambertian { .. } => false,
            Brdf::Ggx(g) => !g.is_sharp(),
            Brdf::Phong(p) => !p.is_sharp(),
        }
    }

    /// The lobe's part of f_r; black without a lobe.
    pub fn lobe_eval(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Rgb {
        if n.dot(wi) <= 0.0 || n.dot(wo) <= 0.0 || !self.is_glossy() {
            return Rgb::BLACK;
        }
        match self {
            Brdf::Lambertian { .. } => Rgb::BLACK,
            Brdf::Ggx(g) => g.lobe(n, wi, wo),
            Brdf::Phong(p) => p.lobe(n, wi, wo),
        }
    }

    /// The lobe's part of the albedo.
    pub fn lobe_albedo(&self, cosine: f64) -> Rgb {
        match self {
            Brdf::Lambertian { .. } => Rgb::BLACK,
            Brdf::Ggx(g) => g.lobe_albedo(cosine),
            Brdf::Phong(p) => p.lobe_albedo(cosine),
        }
    }

    /// A direction about proportional to the lobe × cosine, given the other direction; `None` where the choice
    /// falls below the horizon (the density then integrates to less than one) or without a lobe.
    pub fn lobe_sample(&self, n: DVec3, wi: DVec3, u: [f64; 2]) -> Option<DVec3> {
        if n.dot(wi) <= 0.0 || !self.is_glossy() {
            return None;
        }
        let wo = match self {
            Brdf::Lambertian { .. } => return None,
            Brdf::Ggx(g) => g.lobe_sample(n, wi, u),
            Brdf::Phong(p) => p.lobe_sample(n, wi, u),
        };
        (n.dot(wo) > 0.0).then_some(wo)
    }

    /// Density of [`Brdf::lobe_sample`] per solid angle of `wo`.
    pub fn lobe_pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        if n.dot(wi) <= 0.0 || n.dot(wo) <= 0.0 || !self.is_glossy() {
            return 0.0;
        }
        match self {
            Brdf::Lambertian { .. } => 0.0,
            Brdf::Ggx(g) => g.lobe_pdf(n, wi, wo),
            Brdf::Phong(p) => p.lobe_pdf(n, wi, wo),
        }
    }

    /// Probability with which [`Brdf::sample`] takes the lobe.
    fn lobe_share(&self, cosine: f64) -> f64 {
        let total = self.albedo(cosine).luminance();
        if total > 0.0 { self.lobe_albedo(cosine).luminance() / total } else { 0.0 }
    }

    /// A direction about proportional to f_r × cosine, given the other direction: `u[0]` also chooses between
    /// base and lobe. `None` where the lobe's choice falls below the horizon.
    pub fn sample(&self, n: DVec3, wi: DVec3, u: [f64; 2]) -> Option<DVec3> {
        let share = self.lobe_share(n.dot(wi));
        if u[0] < share {
            self.lobe_sample(n, wi, [u[0] / share, u[1]])
        } else {
            let local = warp::cosine_hemisphere([(u[0] - share) / (1.0 - share), u[1]]);
            Some(crate::geom::Frame::from_normal(n).to_world(local))
        }
    }

    /// Density of [`Brdf::sample`] per solid angle of `wo`.
    pub fn pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        let share = self.lobe_share(n.dot(wi));
        share * self.lobe_pdf(n, wi, wo) + (1.0 - share) * warp::cosine_hemisphere_pdf(n.dot(wo))
    }
}

#[cfg(test)]
mod tests;
