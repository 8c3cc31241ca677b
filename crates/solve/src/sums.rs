//! What all rays of the default schedule have brought, whoever holds it: a running solve, a file, several files
//! together. From sums to irradiance, error bars and solutions.

use std::f64::consts::PI;

use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::error_bars::{Evidence, Noise, PatchEvidence, PatchNoise};
use crate::glossy::GlossyPatches;
use crate::params::Representation;
use crate::solution::{GlossySolution, Solution};
use crate::source::PackedRepresentative;
use crate::tally::Tally;
use crate::waves::balance;

/// Sums over rays; arrays are `[patches]` or, where they say so, `[glossy patches]`.
#[derive(Clone, Copy)]
pub(crate) struct Sums<'a> {
    pub rays: u64,
    /// Weight of the sums: rays, but for what was forgotten.
    pub weight: f64,
    pub tally: Tally,
    /// W: of differences; squares are in its square.
    pub unit: f64,
    /// Σ deposits, W.
    pub deposits: &'a [[f64; 3]],
    pub evidence: PatchEvidences<'a>,
    /// `[glossy patches]`: Σ deposit · albedo(ω_in), W.
    pub reflected: &'a [[f32; 3]],
    /// `[glossy patches]`, or empty: what an observer was sent.
    pub observed: &'a [[[f32; 3]; 2]],
    /// `[glossy patches]`.
    pub representatives: &'a [PackedRepresentative],
}

/// The evidence of all patches, as whoever holds it keeps it.
#[derive(Clone, Copy)]
pub(crate) enum PatchEvidences<'a> {
    /// Patch by patch, as a solver does.
    Together(&'a [PatchEvidence]),
    /// Apart: squares, differences, hits, as in a record.
    Apart(&'a [f32], &'a [f32], &'a [u32]),
}

impl PatchEvidences<'_> {
    #[inline]
    pub(crate) fn of(&self, patch: PatchId) -> PatchEvidence {
        let k = patch.index();
        match self {
            Self::Together(evidence) => evidence[k],
            Self::Apart(squares, difference, hits) => {
                PatchEvidence { squares: squares[k], difference: difference[k], hits: hits[k] }
            }
        }
    }
}

impl<'a> Sums<'a> {
    /// Incoming irradiance of a patch of this area, W·m⁻².
    #[inline]
    pub(crate) fn irradiance(&self, patch: PatchId, area: f64) -> Rgb {
        Rgb::from_array(self.deposits[patch.index()]) / (self.weight * area)
    }

    /// The noise, of patches of which `cell` tells the area and whether they emit.
    pub(crate) fn noise<C: Fn(PatchId) -> (f64, bool) + 'a>(
        self,
        cell: C,
    ) -> Noise<impl Fn(PatchId) -> PatchNoise + use<'a, C>> {
        let of = move |p: PatchId| {
            let (area, emits) = cell(p);
            let evidence = self.evidence.of(p);
            PatchNoise {
                area,
                emits,
                irradiance: self.irradiance(p, area).luminance(),
                evidence: Evidence {
                    squares: f64::from(evidence.squares) * self.unit * self.unit,
                    hits: evidence.hits,
                },
                // Both replicas have half of the weight.
                half_difference: Some(f64::from(evidence.difference) * self.unit / (self.weight * area)),
            }
        };
        Noise { rays: self.weight, patches: self.deposits.len(), of }
    }

    pub(crate) fn relative_error(self, scene: &PatchScene) -> f64 {
        self.noise(|p| cell(scene, p)).relative_error()
    }

    pub(crate) fn solution(
        self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        representation: Representation,
    ) -> Solution {
        let glossy_light = glossy.patches().iter().enumerate().map(|(k, &p)| {
            let per_area = 1.0 / (self.weight * scene.area(p));
            let observed = self.observed.get(k).filter(|_| glossy.to_eye(k).is_some());
            let observed = observed.filter(|_| representation != Representation::Main);
            GlossySolution {
                main_part: Rgb::from_f32(self.reflected[k]) * (per_area / PI),
                // A representative is one sample whoever remembers it; its average over solutions is what converges.
                directional: self.representatives[k].directional(scene, p, representation),
                observed_lobe: observed.map(|parts| parts.map(|part| Rgb::from_f32(part) * per_area)),
            }
        });
        let glossy_light = glossy_light.collect();
        let noise = self.noise(|p| cell(scene, p));
        Solution {
            rays: self.rays,
            irradiance: scene.patches().map(|p| self.irradiance(p, scene.area(p)).to_f32()).collect(),
            standard_error: noise.standard_errors(),
            hits: scene.patches().map(|p| self.evidence.of(p).hits).collect(),
            glossy: glossy.clone(),
            glossy_light,
            balance: balance(&self.tally, scene.emitted_power() + scene.near_lights_power(), noise.rays),
            relative_error: noise.relative_error(),
            tally: self.tally,
            splits_direct_light: representation != Representation::Main,
        }
    }
}

/// What an error bar asks of a patch: its area, and whether it emits.
pub(crate) fn cell(scene: &PatchScene, patch: PatchId) -> (f64, bool) {
    (scene.area(patch), !scene.emission(patch).is_black())
}
