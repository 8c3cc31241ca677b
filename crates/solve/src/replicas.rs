//! Two replicas of the default schedule: half of the rays each, with random numbers and states of their own.
//!
//! Their mean is the solution. Their difference is its noise, whatever makes it: stratification, light that was noisy
//! before it was sent on, the one remembered sample of a glossy patch. Independence costs a few percent of error,
//! since each half is stratified alone (`docs/paper.md`); nothing else tells a stratified solve's error from within.

use std::f64::consts::PI;

use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::error_bars::{Evidence, Noise, PatchNoise};
use crate::params::Representation;
use crate::solution::{GlossySolution, Solution};
use crate::strategies::Shares;
use crate::tally::Tally;
use crate::wave::OutputState;
use crate::waves::{Surroundings, Waves, Workspace, balance};

const STREAM_REPLICA: u64 = 5;

/// The state of both.
#[derive(Debug)]
pub(crate) struct Replicas {
    runs: [Waves; 2],
    /// Sums of both, and their difference where that is told apart.
    output: OutputState,
    workspace: Workspace,
}

impl Replicas {
    pub(crate) fn new(around: Surroundings) -> Self {
        let mut workspace = Workspace::default();
        let mut output = OutputState::new(around.scene.len(), around.glossy);
        let runs = [(0, 1.0), (1, -1.0)].map(|(k, sign)| {
            let seed = Stream::new(around.params.seed, STREAM_REPLICA, k).bits();
            Waves::new(around, seed, sign, &mut output, &mut workspace)
        });
        Self { runs, output, workspace }
    }

    /// Rays of both.
    pub(crate) fn rays(&self) -> u64 {
        self.runs.iter().map(Waves::rays).sum()
    }

    /// Shares of the first one's strategies.
    pub(crate) fn shares(&self) -> Shares {
        self.runs[0].shares()
    }

    /// One wave each.
    pub(crate) fn advance(&mut self, around: Surroundings) {
        // In a glossy scene the warm start takes lobes for diffuse: that is good enough to start from, but kept in the
        // output it would be a bias that fades as 1/n only.
        if !around.glossy.patches().is_empty() && self.runs.iter().all(Waves::is_new) {
            self.output.clear();
            self.runs.iter_mut().for_each(Waves::forget_output);
        }
        self.runs.iter_mut().for_each(|run| run.advance(around, &mut self.output, &mut self.workspace));
    }

    pub(crate) fn relative_error(&self, scene: &PatchScene) -> f64 {
        self.noise(scene).relative_error(scene)
    }

    /// Weight of the sums: rays, but for what was forgotten.
    fn weight(&self) -> f64 {
        self.runs.iter().map(Waves::weight).sum()
    }

    fn irradiance(&self, scene: &PatchScene, patch: PatchId) -> Rgb {
        Rgb::from_array(self.output.deposits[patch.index()]) / (self.weight() * scene.area(patch))
    }

    fn noise<'a>(&'a self, scene: &'a PatchScene) -> Noise<impl Fn(PatchId) -> PatchNoise + use<'a>> {
        let of = move |p: PatchId| {
            let evidence = self.output.evidence[p.index()];
            PatchNoise {
                irradiance: self.irradiance(scene, p).luminance(),
                evidence: Evidence { squares: f64::from(evidence.squares), hits: evidence.hits },
                // Both have half of the weight.
                half_difference: Some(f64::from(evidence.difference) / (self.weight() * scene.area(p))),
            }
        };
        Noise { rays: self.weight(), of }
    }

    pub(crate) fn solution(&self, around: Surroundings) -> Solution {
        let Surroundings { scene, glossy, params, .. } = around;
        let glossy_light = glossy.patches().iter().enumerate().map(|(k, &p)| {
            let per_area = 1.0 / (self.weight() * scene.area(p));
            let observed = self.output.observed.get(k).filter(|_| glossy.to_eye(k).is_some());
            let observed = observed.filter(|_| params.representation != Representation::Main);
            GlossySolution {
                main_part: Rgb::from_f32(self.output.reflected[k]) * (per_area / PI),
                // A representative is one sample whoever remembers it; its average over solutions is what converges.
                directional: self.runs[0].representatives()[k].directional(scene, p, params.representation),
                observed_lobe: observed.map(|parts| parts.map(|part| Rgb::from_f32(part) * per_area)),
            }
        });
        let glossy_light = glossy_light.collect();
        let mut tally = Tally::default();
        self.runs.iter().for_each(|run| tally.add_weighted(run.tally(), 1.0));
        let noise = self.noise(scene);
        Solution {
            rays: self.rays(),
            irradiance: scene.patches().map(|p| self.irradiance(scene, p).to_f32()).collect(),
            standard_error: noise.standard_errors(scene),
            hits: self.output.evidence.iter().map(|e| e.hits).collect(),
            glossy: glossy.clone(),
            glossy_light,
            balance: balance(&tally, scene.emitted_power(), noise.rays),
            relative_error: noise.relative_error(scene),
            tally,
            splits_direct_light: params.representation != Representation::Main,
        }
    }
}
