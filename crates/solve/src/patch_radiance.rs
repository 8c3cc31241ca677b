//! What one patch sends out at this moment: L_i(ω), and the density λ_i(ω) with which rays start there.
//!
//! Evaluation, sampling and density stand together, so that they cannot disagree. The solver's states build an
//! [`Outgoing`]; nobody else knows how radiance is put together. Paper: §2 (p), §2.1 (L_i).

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::Rgb;
use twinray_scene::brdf::Brdf;
use twinray_scene::geom::Frame;
use twinray_scene::sample::warp;

use crate::transfer::Endpoint;

/// The directional part: one stored sample, scaled, as the light of its direction.
#[derive(Clone, Copy, Debug)]
pub struct Directional {
    /// Irradiance C/l · I(m), W·m⁻².
    pub irradiance: Rgb,
    /// Direction it came from.
    pub wi: DVec3,
    /// What reflects it.
    pub brdf: Brdf,
    /// a/π of the main part that the BRDF's average is already in; black if there is no main part.
    pub main_reflectance: Rgb,
}

/// Outgoing light of a patch, and how it is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Outgoing {
    /// Emission and main part: the same in every direction, W·sr⁻¹·m⁻².
    pub constant: Rgb,
    /// The rest.
    pub directional: Option<Directional>,
    /// Cosine-distributed part of λ: a constant, sr⁻¹·m⁻².
    pub cosine_density: f64,
    /// Lobe-distributed part of λ: times pdf_lobe(ω)/cosθ, m⁻².
    pub lobe_density: f64,
}

impl Outgoing {
    /// L(`wo`); signed, since the difference BRDF is.
    #[inline]
    pub fn radiance(&self, n: DVec3, wo: DVec3) -> Rgb {
        let Some(d) = &self.directional else { return self.constant };
        self.constant + d.irradiance * (d.brdf.eval(n, d.wi, wo) - d.main_reflectance)
    }

    /// λ(`wo`) = pmf · pdf(ω) / (A cosθ).
    #[inline]
    pub fn density(&self, n: DVec3, wo: DVec3) -> f64 {
        let Some(d) = &self.directional else { return self.cosine_density };
        self.cosine_density + self.lobe_density * d.brdf.lobe_pdf(n, d.wi, wo) / n.dot(wo).max(1e-12)
    }

    /// Both, for the transfer.
    #[inline]
    pub fn endpoint(&self, n: DVec3, wo: DVec3) -> Endpoint {
        Endpoint { radiance: self.radiance(n, wo), density: self.density(n, wo) }
    }

    /// A direction with density ∝ λ(ω) cosθ; `None` where the lobe's choice falls below the horizon.
    #[inline]
    pub fn sample(&self, n: DVec3, u: [f64; 2]) -> Option<DVec3> {
        let cosine_power = PI * self.cosine_density;
        let share = self.lobe_density / (cosine_power + self.lobe_density);
        match &self.directional {
            Some(d) if u[0] < share => d.brdf.lobe_sample(n, d.wi, [u[0] / share, u[1]]),
            _ => {
                let first = if share > 0.0 { (u[0] - share) / (1.0 - share) } else { u[0] };
                Some(Frame::from_normal(n).to_world(warp::cosine_hemisphere([first, u[1]])))
            }
        }
    }
}

/// A non-negative stand-in for a radiance of which only a part can be sampled: coefficient of the cosine part
/// (radiance) and power of the lobe part (W·m⁻²).
///
/// The true radiance may be negative where the main part holds less than what the difference BRDF takes away
/// (the paper leaves sampling ∝ 𝓛(L) undefined there). The floor of 5 % of the main part keeps every direction
/// possible; deposits stay signed, so nothing is biased.
#[inline]
pub fn stand_in(emitted: Rgb, main_part: Rgb, directional: Option<(Rgb, Rgb, Rgb)>) -> (f64, f64) {
    let main = main_part.luminance();
    let Some((irradiance, lobe_albedo, base_albedo)) = directional else {
        return (emitted.luminance() + main.max(0.0), 0.0);
    };
    let lobe_power = (irradiance * lobe_albedo).luminance();
    if main_part.is_black() {
        // The sample alone, reflected by the whole BRDF: its base is the cosine part.
        return (emitted.luminance() + (irradiance * base_albedo).luminance() / PI, lobe_power);
    }
    (emitted.luminance() + (main - lobe_power / PI).max(0.05 * main), lobe_power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::brdf::{Ggx, Phong};
    use twinray_scene::sample::Stream;
    use twinray_testkit::chi2;

    #[test]
    fn samples_follow_the_density() {
        let n = DVec3::new(0.48, 0.6, 0.64);
        let wi = Frame::from_normal(n).to_world(DVec3::new(0.6, 0.0, 0.8));
        let brdfs = [
            Brdf::Phong(Phong::new(Rgb::grey(0.3), Rgb::grey(0.5), 30.0)),
            Brdf::Ggx(Ggx::new(Rgb::grey(0.4), 0.0, 0.5, 1.0, Rgb::WHITE, 1.5)),
        ];
        for (i, brdf) in brdfs.into_iter().enumerate() {
            let directional = Directional { irradiance: Rgb::WHITE, wi, brdf, main_reflectance: Rgb::grey(0.1) };
            let out = Outgoing {
                constant: Rgb::WHITE,
                directional: Some(directional),
                cosine_density: 0.2,
                lobe_density: 0.4,
            };
            let total = PI * out.cosine_density + out.lobe_density;
            let mut stream = Stream::new(31, i as u64, 0);
            let samples =
                (0..200_000).map(|_| out.sample(n, [stream.uniform(), stream.uniform()]).map(|d| d.to_array()));
            let pdf = |d: [f64; 3]| {
                let d = DVec3::from_array(d);
                if n.dot(d) > 0.0 { out.density(n, d) * n.dot(d) / total } else { 0.0 }
            };
            let outcome = chi2::sphere(samples, pdf, 24, 48);
            assert!(outcome.p_value > 1e-3, "{outcome:?}");
        }
    }
}
