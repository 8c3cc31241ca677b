//! A solution: the light of a whole scene after some rays, immutable, independent of any camera.
//!
//! Products (pictures, bakes, readings) take it and never touch the solver's state. The main part is a mean and
//! converges; the representative is one fluctuating sample, whose average over solutions converges.

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::glossy::GlossyPatches;
use crate::patch_light::PatchLight;
use crate::patch_radiance::Directional;
use crate::tally::Tally;

/// Where the light goes, W (or lumen where radiance is in nit); luminances of powers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerBalance {
    /// Emitted by patches and by lights that have a place.
    pub emitted: f64,
    /// Received from the environment and from directional lights.
    pub sky: f64,
    /// Absorbed by patches.
    pub absorbed: f64,
    /// Left the scene.
    pub escaped: f64,
    /// Met the absorbing backs of one-sided surfaces from within.
    pub lost: f64,
}

impl PowerBalance {
    /// Share of the incoming power that is unaccounted for: 0 when converged.
    pub fn residual(&self) -> f64 {
        let incoming = self.emitted + self.sky;
        (self.absorbed + self.escaped + self.lost - incoming) / incoming
    }

    /// Share of the incoming power lost on backs.
    pub fn lost_share(&self) -> f64 {
        self.lost / (self.emitted + self.sky)
    }
}

/// The light of a scene.
#[derive(Debug)]
pub struct Solution {
    pub(crate) rays: u64,
    pub(crate) irradiance: Vec<[f32; 3]>,
    pub(crate) glossy: GlossyPatches,
    pub(crate) glossy_light: Vec<GlossySolution>,
    pub(crate) balance: PowerBalance,
    pub(crate) standard_error: Vec<f32>,
    pub(crate) hits: Vec<u32>,
    pub(crate) relative_error: f64,
    pub(crate) tally: Tally,
    pub(crate) splits_direct_light: bool,
}

/// What a glossy patch knows beside its irradiance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GlossySolution {
    /// Direction-independent main part of the reflected radiance.
    pub main_part: Rgb,
    /// The representative, scaled.
    pub directional: Option<Directional>,
    /// The lobe's radiance towards the observer, averaged: of light straight from emitting patches, and of all other.
    pub observed_lobe: Option<[Rgb; 2]>,
}

impl Solution {
    /// Rays behind this solution, n.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Incoming irradiance of a patch, W·m⁻² (or lux), mean over its area.
    #[inline]
    pub fn irradiance(&self, patch: PatchId) -> Rgb {
        Rgb::from_f32(self.irradiance[patch.index()])
    }

    /// Main part of the reflected radiance, W·sr⁻¹·m⁻². Paper: §2.1, L^d.
    pub fn main_part(&self, scene: &PatchScene, patch: PatchId) -> Rgb {
        match self.glossy.number_of(patch) {
            Some(k) => self.glossy_light[k].main_part,
            None => self.irradiance(patch) * scene.brdf(patch).mean_albedo() / std::f64::consts::PI,
        }
    }

    /// Radiance of a patch towards `wo`: emission, main part, and what the stored representative sends there now.
    pub fn radiance(&self, scene: &PatchScene, patch: PatchId, wo: DVec3) -> Rgb {
        let constant = scene.emission(patch) + self.main_part(scene, patch);
        let directional = self.glossy.number_of(patch).and_then(|k| self.glossy_light[k].directional);
        directional.map_or(constant, |d| {
            constant + d.irradiance * (d.brdf.eval(scene.normal(patch), d.wi, wo) - d.main_reflectance)
        })
    }

    /// What a glossy patch remembers: irradiance C/l · I(m), W·m⁻², and the direction it came from. Its reflection is right
    /// only in the mean over solutions. `None` for other patches, and before light has come. Paper: §2.1.
    pub fn representative(&self, patch: PatchId) -> Option<(Rgb, DVec3)> {
        let directional = self.glossy.number_of(patch).and_then(|k| self.glossy_light[k].directional);
        directional.map(|d| (d.irradiance, d.wi))
    }

    /// Radiance that the lobe of a glossy patch sends to the observer given to the solver, averaged over all
    /// iterations: of light that comes straight from emitting patches, and of all other light (the paper's schedule
    /// cannot tell them apart and calls all of it other). `None` for diffuse patches, without an observer, or if the
    /// eye is behind the patch.
    pub fn observed_lobe(&self, patch: PatchId) -> Option<[Rgb; 2]> {
        self.glossy.number_of(patch).and_then(|k| self.glossy_light[k].observed_lobe)
    }

    /// True if [`Solution::observed_lobe`] keeps direct light apart.
    pub fn splits_direct_light(&self) -> bool {
        self.splits_direct_light
    }

    /// True if lobes are known towards an observer, or there are none: what an observer needs was summed up during the solve.
    pub fn is_observed(&self) -> bool {
        self.glossy.is_observed() || self.glossy_light.is_empty()
    }

    /// Where the light went.
    pub fn balance(&self) -> PowerBalance {
        self.balance
    }

    /// Estimated relative RMS error of patch irradiance, √(ΣA ΔE²/ΣA E²) of luminance without emitters.
    pub fn relative_error(&self) -> f64 {
        self.relative_error
    }

    /// Standard error of the luminance of a patch's irradiance, W·m⁻²; infinite where no light arrived.
    ///
    /// About 68 % of the patches with a hundred hits or more are nearer to the truth than this, 95 % than twice this.
    pub fn standard_error(&self, patch: PatchId) -> f64 {
        f64::from(self.standard_error[patch.index()])
    }

    /// Rays that brought light to a patch.
    pub fn hits(&self, patch: PatchId) -> u32 {
        self.hits[patch.index()]
    }

    /// Deposits that were dropped because they were not finite; 0 unless something is wrong.
    pub fn invalid_deposits(&self) -> u64 {
        self.tally.invalid
    }

    /// The irradiance of all patches with its error bars, as plain arrays.
    pub fn patch_light(&self, scene: &PatchScene) -> PatchLight {
        PatchLight {
            area: scene.patches().map(|p| scene.area(p)).collect(),
            emits: scene.patches().map(|p| !scene.emission(p).is_black()).collect(),
            irradiance: self.irradiance.clone(),
            standard_error: self.standard_error.clone(),
            hits: self.hits.clone(),
        }
    }

    /// Power that arrives on all patches, W: ΣA E.
    pub fn arriving_power(&self, scene: &PatchScene) -> Rgb {
        scene.patches().map(|p| self.irradiance(p) * scene.area(p)).sum()
    }
}
