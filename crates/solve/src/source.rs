//! What rays start from: every patch's outgoing light, packed. One replica's memory of the light so far.
//!
//! Sixteen bytes a patch and sixteen more on glossy ones, since every ray reads two of them from anywhere. The stored
//! single-precision value *is* the state: densities and radiances are both computed from it, so nothing disagrees.

use std::f64::consts::PI;

use bytemuck::{Pod, Zeroable};
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::direction;
use crate::params::Representation;
use crate::patch_radiance::Directional;

/// Outgoing light of a patch.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct Source {
    /// Emission + main part of the reflected radiance, W·sr⁻¹·m⁻².
    pub constant: [f32; 3],
    /// w/(πA), the density of the per-patch gather, sr⁻¹·m⁻²; negative if the patch emits.
    gather: f32,
}

impl Source {
    /// A patch that sends out `constant`; `gather` is its density w/(πA).
    pub(crate) fn new(constant: Rgb, gather: f64, emits: bool) -> Self {
        let gather = gather as f32;
        Self { constant: constant.to_f32(), gather: if emits { -gather } else { gather } }
    }

    /// Emission + main part.
    #[inline]
    pub(crate) fn radiance(&self) -> Rgb {
        Rgb::from_f32(self.constant)
    }

    /// Density of the per-patch gather, sr⁻¹·m⁻².
    #[inline]
    pub(crate) fn gather(&self) -> f64 {
        f64::from(self.gather.abs())
    }

    /// True if the patch itself emits.
    #[inline]
    pub(crate) fn emits(&self) -> bool {
        self.gather.is_sign_negative()
    }
}

/// The one remembered sample of a glossy patch's incoming light (paper §2.1), as `representative` explains.
///
/// Of the stored irradiance only its colour counts, since its size is made C by scaling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PackedRepresentative {
    /// Colour, its largest channel ±32767; zero before the first sample.
    colour: [i16; 3],
    /// Upper half of the bits of the l that a rival has to meet: 0.4 % fine, rounded for both rivals alike.
    rival: u16,
    /// Direction it came from.
    wi: u32,
    /// C, the mean of l over all rays, W·m⁻².
    pub(crate) importance: f32,
}

impl PackedRepresentative {
    /// False of what no solve gives.
    pub(crate) fn is_sound(&self) -> bool {
        self.importance.is_finite() && self.importance >= 0.0 && f32::from_bits(u32::from(self.rival) << 16) >= 0.0
    }

    /// True once there is a sample.
    #[inline]
    pub(crate) fn is_there(&self) -> bool {
        self.colour != [0; 3]
    }

    /// Accepts or rejects the best candidate of a wave, whose candidates together have the importance `rival` per ray;
    /// `u` is uniform in [0, 1).
    pub(crate) fn offer(&mut self, irradiance: Rgb, wi: u32, rival: f64, u: f64) {
        let rival = (rival as f32).to_bits() >> 16;
        let value = |bits: u32| f64::from(f32::from_bits(bits << 16));
        if rival == 0 || (self.is_there() && u * value(u32::from(self.rival)) >= value(rival)) {
            return;
        }
        let largest = irradiance.map(f64::abs).max_channel();
        self.colour = irradiance.to_array().map(|c| (c / largest * 32_767.0).round() as i16);
        self.rival = rival as u16;
        self.wi = wi;
    }

    /// The directional part that it stands for.
    #[inline]
    pub(crate) fn directional(
        &self,
        scene: &PatchScene,
        patch: PatchId,
        representation: Representation,
    ) -> Option<Directional> {
        if !self.is_there() || representation == Representation::Main {
            return None;
        }
        let brdf = scene.brdf(patch);
        let wi = direction::unpack(self.wi);
        let cosine = scene.normal(patch).dot(wi);
        let albedo = brdf.albedo(cosine);
        let (weight, main_reflectance) = match representation {
            Representation::Sample => (albedo, Rgb::BLACK),
            _ => (brdf.lobe_albedo(cosine), albedo / PI),
        };
        let colour = Rgb::from_array(self.colour.map(f64::from));
        let importance = (colour * weight).luminance();
        if importance <= 0.0 {
            return None;
        }
        Some(Directional { irradiance: colour * (f64::from(self.importance) / importance), wi, brdf, main_reflectance })
    }
}
