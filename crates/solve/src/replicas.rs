//! Two replicas of the default schedule: half of the rays each, with random numbers and states of their own.
//!
//! Their mean is the solution. Their difference is its noise, whatever makes it: stratification, light that was noisy
//! before it was sent on, the one remembered sample of a glossy patch. Independence costs a few percent of error,
//! since each half is stratified alone (`docs/paper.md`); nothing else tells a stratified solve's error from within.

use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene};

use crate::error_bars::{Evidence, Noise, PatchNoise};
use crate::glossy::GlossyPatches;
use crate::params::{Params, Representation};
use crate::solution::{GlossySolution, Solution};
use crate::tally::Tally;
use crate::waves::{Waves, Workspace, balance};

const STREAM_REPLICA: u64 = 5;

/// The state of both.
#[derive(Debug)]
pub(crate) struct Replicas {
    runs: [Waves; 2],
    workspace: Workspace,
}

impl Replicas {
    pub(crate) fn new(scene: &PatchScene, glossy: &GlossyPatches, params: &Params) -> Self {
        let mut workspace = Workspace::new(scene.len(), glossy.patches().len());
        let runs = [0, 1].map(|k| {
            let seed = Stream::new(params.seed, STREAM_REPLICA, k).bits();
            Waves::new(scene, glossy, &Params { seed, ..params.clone() }, &mut workspace)
        });
        Self { runs, workspace }
    }

    /// Rays of both.
    pub(crate) fn rays(&self) -> u64 {
        self.runs.iter().map(Waves::rays).sum()
    }

    /// One wave each.
    pub(crate) fn advance(&mut self, scene: &PatchScene, glossy: &GlossyPatches) {
        self.runs.iter_mut().for_each(|run| run.advance(scene, glossy, &mut self.workspace));
    }

    pub(crate) fn relative_error(&self, scene: &PatchScene) -> f64 {
        self.noise(scene).relative_error(scene)
    }

    fn noise<'a>(&'a self, scene: &'a PatchScene) -> Noise<impl Fn(PatchId) -> PatchNoise + use<'a>> {
        let [a, b] = &self.runs;
        let of = move |p| {
            let [first, second] = [a, b].map(|run| run.irradiance(scene, p).luminance());
            let (x, y) = (a.evidence(p), b.evidence(p));
            PatchNoise {
                irradiance: 0.5 * (first + second),
                evidence: Evidence { squares: x.squares + y.squares, hits: x.hits.saturating_add(y.hits) },
                half_difference: Some(0.5 * (first - second)),
            }
        };
        Noise { rays: a.weight() + b.weight(), of }
    }

    pub(crate) fn solution(&self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params) -> Solution {
        let [a, b] = &self.runs;
        let irradiance = |p| (a.irradiance(scene, p) + b.irradiance(scene, p)) * 0.5;
        let glossy_light = glossy.patches().iter().enumerate().map(|(k, &p)| {
            let (a, b) = (a.glossy_light(scene, glossy, p, k), b.glossy_light(scene, glossy, p, k));
            let observed = a.observed_lobe.zip(b.observed_lobe);
            GlossySolution {
                main_part: (a.main_part + b.main_part) * 0.5,
                // A representative is one sample whoever remembers it; its average over solutions is what converges.
                directional: a.directional,
                observed_lobe: observed.map(|(a, b)| [0, 1].map(|i| (a[i] + b[i]) * 0.5)),
            }
        });
        let glossy_light = glossy_light.collect();
        let mut tally = Tally::default();
        self.runs.iter().for_each(|run| tally.add_weighted(run.tally(), 1.0));
        let noise = self.noise(scene);
        Solution {
            rays: self.rays(),
            irradiance: scene.patches().map(|p| irradiance(p).to_f32()).collect(),
            standard_error: noise.standard_errors(scene),
            hits: scene.patches().map(|p| (noise.of)(p).evidence.hits).collect(),
            glossy: glossy.clone(),
            glossy_light,
            balance: balance(&tally, scene.emitted_power(), noise.rays),
            relative_error: noise.relative_error(scene),
            tally,
            splits_direct_light: params.representation != Representation::Main,
        }
    }
}
