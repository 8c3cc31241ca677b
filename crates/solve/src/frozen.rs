//! The state that a wave of rays starts from: every patch's outgoing light, frozen, and the choice among patches.
//!
//! Strategies (shares sum to 1): by power, evenly over area and patches, from the environment. All are one density
//! λ_i(ω) = power_share · q_i(ω)/P + gather_share · w_i/(π A_i) at patches, w_i half A_i/A_total and half 1/K, and
//! λ_env(ω) = environment_share · pdf_line(ω) at the sky, so one formula of the balance heuristic covers them.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::glossy::GlossyPatches;
use crate::patch_radiance::{Directional, Outgoing, stand_in};
use crate::select::Table;
use crate::transfer::Endpoint;

/// Wishes for the strategies; what has no power gives its share to the gather.
#[derive(Clone, Copy, Debug)]
pub struct Shares {
    /// Evenly, half by area and half by number of patches.
    pub gather: f64,
    /// From the environment; 0 where it does not shine in this wave.
    pub environment: f64,
}

/// What a caller says of one patch.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Emission, W·sr⁻¹·m⁻².
    pub emitted: Rgb,
    /// Main part of the reflected radiance, W·sr⁻¹·m⁻².
    pub main_part: Rgb,
    /// Directional part of a glossy patch.
    pub directional: Option<Directional>,
}

/// A frozen state.
#[derive(Debug, Default)]
pub struct Frozen {
    /// Per patch: E + main part.
    constant: Vec<[f32; 3]>,
    /// Per glossy patch.
    directional: Vec<GlossyLight>,
    table: Table,
    /// 𝓛 of the power of all patches' stand-ins, W.
    power: f64,
    /// power_share / P.
    per_power: f64,
    /// gather_share / (2π A_total), and gather_share / (2π K): the latter over the patch's own area.
    gather: [f64; 2],
    environment_share: f64,
    /// False in the later steps of the warm start, whose light is reflected only.
    emits: bool,
}

/// Bytes of a frozen glossy patch.
pub(crate) const BYTES_PER_GLOSSY_PATCH: usize = size_of::<GlossyLight>();

#[derive(Clone, Copy, Debug)]
struct GlossyLight {
    directional: Option<Directional>,
    cosine_density: f64,
    lobe_density: f64,
}

impl Frozen {
    /// Refills the state. `light` is asked once per patch; `total_area` is that of all patches.
    pub fn fill(
        &mut self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        total_area: f64,
        shares: Shares,
        light: impl Fn(PatchId) -> Light,
    ) {
        self.constant.clear();
        self.directional.clear();
        self.emits = false;
        // First pass: radiance and the stand-in's power of every patch; glossy ones keep (cosine, lobe) for now.
        let mut power = 0.0;
        for patch in scene.patches() {
            let l = light(patch);
            self.emits |= !l.emitted.is_black();
            // Stored in single precision: the stored value is the state, so nothing is inconsistent.
            let constant = (l.emitted + l.main_part).to_f32();
            self.constant.push(constant);
            let mut radiosity = PI * Rgb::from_f32(constant).luminance();
            if glossy.number_of(patch).is_some() {
                let n = scene.normal(patch);
                let parts = l.directional.map(|d| {
                    let cosine = n.dot(d.wi);
                    let lobe = d.brdf.lobe_albedo(cosine);
                    (d.irradiance, lobe, d.brdf.albedo(cosine) - lobe)
                });
                let (cosine, lobe) = stand_in(l.emitted, l.main_part, parts);
                radiosity = PI * cosine + lobe;
                self.directional.push(GlossyLight {
                    directional: l.directional,
                    cosine_density: cosine,
                    lobe_density: lobe,
                });
            }
            power += radiosity * scene.area(patch);
        }

        self.power = power;
        self.environment_share = if scene.environment().is_some() { shares.environment } else { 0.0 };
        let power_share = if power > 0.0 { 1.0 - self.environment_share - shares.gather } else { 0.0 };
        let gather_share = 1.0 - self.environment_share - power_share;
        self.per_power = if power > 0.0 { power_share / power } else { 0.0 };
        // By area alone the tiny patches of uneven meshes would hardly ever shoot, by number alone the large ones.
        self.gather = [total_area, scene.len() as f64].map(|x| 0.5 * gather_share / (PI * x));

        // Second pass: densities.
        for (&patch, g) in glossy.patches().iter().zip(&mut self.directional) {
            g.cosine_density = g.cosine_density * self.per_power + self.gather[0] + self.gather[1] / scene.area(patch);
            g.lobe_density *= self.per_power;
        }
        let mut table = std::mem::take(&mut self.table);
        table.fill(scene.patches().map(|patch| {
            let out = self.outgoing(scene, glossy, patch);
            scene.area(patch) * (PI * out.cosine_density + out.lobe_density)
        }));
        self.table = table;
    }

    /// Luminance of the power that all patches send out, W.
    pub fn power(&self) -> f64 {
        self.power
    }

    /// The largest deposit that one ray can leave: radiance over the smallest density beside it.
    ///
    /// A channel is at most 1/0.0722 of the luminance; a lobe's radiance may exceed its stand-in by the ratio of
    /// Fresnel terms, at most about 1/0.02.
    pub fn largest_deposit(&self, scene: &PatchScene) -> f64 {
        let channel = 14.0;
        let lobes = if self.directional.is_empty() { 1.0 } else { 64.0 };
        let by_power = if self.per_power > 0.0 { channel * lobes / self.per_power } else { 0.0 };
        let by_sky = match scene.environment() {
            Some(e) if self.environment_share > 0.0 => channel * e.power().luminance() / self.environment_share,
            _ => 0.0,
        };
        by_power.max(by_sky)
    }

    /// Outgoing light of a patch.
    #[inline]
    pub fn outgoing(&self, scene: &PatchScene, glossy: &GlossyPatches, patch: PatchId) -> Outgoing {
        let constant = Rgb::from_f32(self.constant[patch.index()]);
        match glossy.number_of(patch) {
            None => Outgoing {
                constant,
                directional: None,
                cosine_density: self.per_power * constant.luminance()
                    + self.gather[0]
                    + self.gather[1] / scene.area(patch),
                lobe_density: 0.0,
            },
            Some(k) => {
                let g = &self.directional[k];
                Outgoing {
                    constant,
                    directional: g.directional,
                    cosine_density: g.cosine_density,
                    lobe_density: g.lobe_density,
                }
            }
        }
    }

    /// The share of a patch's radiance that is its own emission, per channel, while it shines in this state.
    #[inline]
    pub fn emitted_share(&self, scene: &PatchScene, patch: PatchId, radiance: Rgb) -> Rgb {
        if !self.emits {
            return Rgb::BLACK;
        }
        let emitted = scene.emission(patch);
        let share = |e: f64, l: f64| if e > 0.0 && l > 0.0 { e / l } else { 0.0 };
        Rgb::new(share(emitted.r, radiance.r), share(emitted.g, radiance.g), share(emitted.b, radiance.b))
    }

    /// What the environment brings to a ray that leaves the scene in `towards`; black if it does not shine now.
    #[inline]
    pub fn sky(&self, scene: &PatchScene, towards: DVec3) -> Endpoint {
        match scene.environment() {
            Some(e) if self.environment_share > 0.0 => {
                Endpoint { radiance: e.radiance(towards), density: self.environment_share * e.pdf_line(towards) }
            }
            _ => Endpoint { radiance: Rgb::BLACK, density: 0.0 },
        }
    }

    /// Where a ray starts, for uniform `u`: a patch, or `None` for the environment.
    #[inline]
    pub fn select(&self, u: f64) -> Option<PatchId> {
        if u < self.environment_share {
            return None;
        }
        let rest = (u - self.environment_share) / (1.0 - self.environment_share);
        Some(PatchId(self.table.select(rest.min(1.0 - f64::EPSILON)) as u32))
    }
}
