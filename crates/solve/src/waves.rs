//! The default schedule: warm start, then growing waves on two time scales.
//!
//! The 1/n average of the paper forgets the light that it has not yet seen too slowly: an eigenmode λ of the
//! transport decays as n^−(1−λ), and a bright room stays dark. Here every wave of B rays starts from a state that
//! forgets: wave weights v = (n + B/2)^q, while the output keeps every deposit with equal weight (Polyak and
//! Ruppert). The warm start solves the scene coarsely, but without bias, so the output has hardly any bias at any n (in
//! diffuse scenes; glossy light starts out diffuse, so there the output begins after the warm start, and the state that
//! rays start from forgets). What there is of it comes from one low-discrepancy sequence for all waves, 1e-4 in bright
//! rooms: `docs/paper.md`.
//!
//! A solve has two of these (`replicas`), so sizes here are for half of its rays.

use rayon::prelude::*;
use std::f64::consts::PI;

use twinray_scene::sample::{Sobol, Stream};
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::error_bars::Evidence;
use crate::fixed::Units;
use crate::frozen::{Frozen, Light, Shares};
use crate::glossy::GlossyPatches;
use crate::params::{Estimator, Params, Representation};
use crate::patch_radiance::Directional;
use crate::representative::Representative;
use crate::solution::{GlossySolution, PowerBalance};
use crate::tally::Tally;
use crate::wave::{Candidate, WaveContext, WaveSums};

const STREAM_ACCEPT: u64 = 3;
const STREAM_WARM: u64 = 4;

/// Waves below this size would be all overhead.
const SMALLEST_WAVE: u64 = 1024;
/// Waves above this size gain nothing and make stopping slow.
const LARGEST_WAVE: u64 = 1 << 20;
/// The warm start's smallest planned number of rays: its noise (.24 % of the total power at 8000 rays and
/// albedo .95) is what tiny scenes would otherwise remember.
const SMALLEST_WARM_START: u64 = 1 << 15;

/// Of two replicas source, output and evidence; a wave's sums, frozen radiance and selection table.
pub(crate) const BYTES_PER_PATCH: usize =
    2 * (24 + 24 + size_of::<Evidence>()) + crate::fixed::BYTES_PER_PATCH + 12 + 8 + 4;
/// Beside that: the numbering (over all patches, counted here), sums, states and frozen light of glossy patches.
pub(crate) const BYTES_PER_GLOSSY_PATCH: usize =
    4 + 4 + 24 + 4 * 24 + 2 * size_of::<GlossyState>() + crate::frozen::BYTES_PER_GLOSSY_PATCH;

/// What a wave needs while it is shot, shared by runs that take turns.
#[derive(Debug)]
pub(crate) struct Workspace {
    frozen: Frozen,
    sums: WaveSums,
}

impl Workspace {
    pub(crate) fn new(patches: usize, glossy: usize) -> Self {
        Self { frozen: Frozen::default(), sums: WaveSums::new(patches, glossy) }
    }
}

/// All light over its first step at which the warm start stops: a contraction of ρ shoots 1/(1 − ρ) of it, so only
/// closed scenes of an albedo above 0.9995 come here, and without a bound one of albedo 1 would never end.
const MOST_RETURNS: f64 = 2000.0;

/// State of the default schedule.
#[derive(Debug)]
pub(crate) struct Waves {
    params: Params,
    /// n: planned rays of the warm start and rays of the waves.
    n: u64,
    wave: u64,
    sobol: Sobol,
    /// Exponent q of the source weights.
    forgetting: f64,
    total_area: f64,
    source_weight: f64,
    output_weight: f64,
    /// Σ v·deposits (albedo-weighted on glossy patches), per patch.
    source: Vec<[f64; 3]>,
    /// Σ deposits, per patch.
    output: Vec<[f64; 3]>,
    evidence: Vec<Evidence>,
    glossy: Vec<GlossyState>,
    tally: Tally,
}

/// Directional state of a glossy patch.
#[derive(Clone, Debug, Default)]
struct GlossyState {
    /// Σ deposit · albedo, equal weights.
    reflected: Rgb,
    /// Σ deposit · lobe towards the eye, equal weights: direct light, other light.
    observed: [Rgb; 2],
    /// Σ v·𝓛(deposit · Δa).
    importance: f64,
    representative: Representative,
}

impl Waves {
    /// Starts a run; the warm start is shot here.
    pub(crate) fn new(scene: &PatchScene, glossy: &GlossyPatches, params: &Params, workspace: &mut Workspace) -> Self {
        let patches = scene.len();
        // Bright scenes have longer memories: forget faster.
        let forgetting = if scene.mean_albedo().luminance() > 0.9 { 9.0 } else { 4.0 };
        let mut this = Self {
            params: params.clone(),
            n: 0,
            wave: 0,
            sobol: Sobol::new(params.seed),
            forgetting,
            total_area: scene.total_area(),
            source_weight: 0.0,
            output_weight: 0.0,
            source: vec![[0.0; 3]; patches],
            output: vec![[0.0; 3]; patches],
            evidence: vec![Evidence::default(); patches],
            glossy: vec![GlossyState::default(); glossy.patches().len()],
            tally: Tally::default(),
        };
        if params.warm_start > 0.0 {
            this.warm_start(scene, glossy, workspace);
        }
        this
    }

    /// Rays so far, planned ones of the warm start included.
    pub(crate) fn rays(&self) -> u64 {
        self.n
    }

    /// Weight of the output: rays, unless nothing has been shot.
    pub(crate) fn weight(&self) -> f64 {
        self.output_weight.max(f64::MIN_POSITIVE)
    }

    /// Irradiance of a patch so far, W·m⁻².
    #[inline]
    pub(crate) fn irradiance(&self, scene: &PatchScene, patch: PatchId) -> Rgb {
        Rgb::from_array(self.output[patch.index()]) / (self.weight() * scene.area(patch))
    }

    /// What a patch's deposits say of its noise.
    #[inline]
    pub(crate) fn evidence(&self, patch: PatchId) -> Evidence {
        self.evidence[patch.index()]
    }

    /// Where the light went, sums of weight [`Waves::weight`].
    pub(crate) fn tally(&self) -> &Tally {
        &self.tally
    }

    /// What glossy patch number `k` knows beside its irradiance.
    pub(crate) fn glossy_light(
        &self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        patch: PatchId,
        k: usize,
    ) -> GlossySolution {
        let per_area = 1.0 / (self.weight() * scene.area(patch));
        let observed = glossy.to_eye(k).filter(|_| self.params.representation != Representation::Main);
        GlossySolution {
            main_part: self.glossy[k].reflected * per_area / PI,
            directional: self.directional(scene, patch, k),
            observed_lobe: observed.map(|_| self.glossy[k].observed.map(|o| o * per_area)),
        }
    }

    /// Rays of the next wave: a function of n and K alone, so that stopping and resuming change nothing.
    fn wave_size(&self, patches: usize) -> u64 {
        let half = (patches as u64 / 2).max(SMALLEST_WAVE);
        // A representative is one sample per wave: waves of a glossy scene stay short to have many of them.
        if self.glossy.is_empty() { (self.n / 8).clamp(half, LARGEST_WAVE.max(half)) } else { half.min(LARGEST_WAVE) }
    }

    /// One wave.
    pub(crate) fn advance(&mut self, scene: &PatchScene, glossy: &GlossyPatches, workspace: &mut Workspace) {
        let size = self.wave_size(scene.len());
        if self.wave == 0 && !self.glossy.is_empty() {
            self.forget_output();
        }
        let Workspace { frozen, sums } = workspace;
        // Under a sky most power is on roofs that send it back: more rays start where they are needed instead.
        let gather = match scene.environment() {
            Some(_) => self.params.gather_share.max(0.35),
            None => self.params.gather_share,
        };
        let shares = Shares { gather, environment: self.params.environment_share };
        frozen.fill(scene, glossy, self.total_area, shares, |p| self.light(scene, glossy, p));
        let units = Units::new(frozen.largest_deposit(scene), 2 * size);
        let context = context(scene, glossy, &self.params, self.params.seed);
        let result = context.run(frozen, &self.sobol, self.n, size, sums, units);

        let weight = libm::pow(self.n as f64 + 0.5 * size as f64, self.forgetting);
        self.offer(&best_candidates(result.candidates, glossy), size);
        self.close(scene, glossy, sums, units, weight, 1.0);
        self.tally.add_weighted(&result.tally, 1.0);
        self.source_weight += weight * size as f64;
        self.output_weight += size as f64;
        self.n += size;
        self.wave += 1;
    }

    /// Adds the wave's deposits to the sums and empties them: `weight` for the source, `share` for the output.
    fn close(
        &mut self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        sums: &WaveSums,
        units: Units,
        weight: f64,
        share: f64,
    ) {
        let reflected: Vec<Rgb> = (0..self.glossy.len()).map(|k| sums.reflected.take(k, units.deposit)).collect();
        let outputs = self.output.par_iter_mut().zip(&mut self.evidence);
        self.source.par_iter_mut().zip(outputs).enumerate().with_min_len(4096).for_each(
            |(i, (source, (output, evidence)))| {
                let arrived = sums.arrived.take(i, units);
                let returned = match glossy.number_of(PatchId(i as u32)) {
                    Some(k) => reflected[k],
                    None => arrived.deposits * scene.brdf(PatchId(i as u32)).mean_albedo(),
                };
                *source = (Rgb::from_array(*source) + returned * weight).to_array();
                *output = (Rgb::from_array(*output) + arrived.deposits * share).to_array();
                evidence.squares += arrived.squares * share * share;
                evidence.hits = evidence.hits.saturating_add(arrived.hits);
            },
        );
        for (k, state) in self.glossy.iter_mut().enumerate() {
            state.reflected += reflected[k] * share;
            for (sum, part) in state.observed.iter_mut().zip(&sums.observed) {
                *sum += part.take(k, units.deposit) * share;
            }
            state.importance += sums.importance.take(k, units.deposit).r * weight;
        }
    }

    /// One acceptance or rejection per patch and wave, on the wave's total: the chain runs over waves, and no
    /// thread can change it.
    fn offer(&mut self, best: &[Option<(Candidate, f64)>], size: u64) {
        for (k, candidate) in best.iter().enumerate() {
            let Some((c, total)) = candidate else { continue };
            let u = match self.params.representation {
                Representation::Last => 0.0,
                _ => Stream::new(self.params.seed ^ self.wave, STREAM_ACCEPT, k as u64).uniform(),
            };
            self.glossy[k].representative.offer(c.irradiance, c.wi, c.importance, total / size as f64, u);
        }
    }

    /// What a patch sends out, from the source sums.
    fn light(&self, scene: &PatchScene, glossy: &GlossyPatches, patch: PatchId) -> Light {
        let emitted = scene.emission(patch);
        if self.source_weight == 0.0 {
            return Light { emitted, main_part: Rgb::BLACK, directional: None };
        }
        let area = scene.area(patch);
        let main_part = Rgb::from_array(self.source[patch.index()]) / (PI * area * self.source_weight);
        let directional = glossy.number_of(patch).and_then(|k| self.directional(scene, patch, k));
        let main_part = if directional.is_some() && self.params.representation == Representation::Sample {
            Rgb::BLACK
        } else {
            main_part
        };
        Light { emitted, main_part, directional }
    }

    fn directional(&self, scene: &PatchScene, patch: PatchId, k: usize) -> Option<Directional> {
        let state = &self.glossy[k];
        if state.representative.importance <= 0.0 || self.params.representation == Representation::Main {
            return None;
        }
        let mean_importance = state.importance / (self.source_weight * scene.area(patch));
        let brdf = scene.brdf(patch);
        let wi = state.representative.wi;
        let main_reflectance = match self.params.representation {
            Representation::Sample => Rgb::BLACK,
            _ => brdf.albedo(scene.normal(patch).dot(wi)) / PI,
        };
        Some(Directional { irradiance: state.representative.scaled(mean_importance), wi, brdf, main_reflectance })
    }

    /// Incremental shooting: unshot light U is sent once around, what it leaves becomes the next U, until chance
    /// ends it where less than one ray's worth is left. Counts follow from U alone and deposits are divided by the
    /// count that was planned with certainty, so the sum is unbiased.
    fn warm_start(&mut self, scene: &PatchScene, glossy: &GlossyPatches, workspace: &mut Workspace) {
        // A glossy scene's output does not remember the start, so there it is the shorter the better forgotten.
        let smallest = if self.glossy.is_empty() { SMALLEST_WARM_START } else { SMALLEST_WAVE };
        let planned = ((0.5 * self.params.warm_start * scene.len() as f64) as u64).max(smallest);
        let pilot_rays = (planned / 32) as f64;
        // A pilot measures how much light there will be to shoot, and how much of the sky comes in; its result is
        // thrown away, so that the main run's counts do not depend on the main run's numbers.
        let pilot = self.shoot_around(scene, glossy, workspace, Quantum::FirstStep(pilot_rays), 0);
        self.clear();
        let quantum = Quantum::Power { sky: pilot.sky, quantum: pilot.total / planned as f64 };
        self.shoot_around(scene, glossy, workspace, quantum, 1 << 32);

        // Enter the estimate D₀ as if `planned` rays had each left it: unbiased, and weighted like a first wave.
        let n0 = planned as f64;
        let source = libm::pow(n0, self.forgetting + 1.0) / (self.forgetting + 1.0);
        let scale = |sums: &mut [[f64; 3]], s: f64| sums.iter_mut().flatten().for_each(|x| *x *= s);
        scale(&mut self.source, source);
        scale(&mut self.output, n0);
        self.evidence.iter_mut().for_each(|e| e.squares *= n0 * n0);
        for g in &mut self.glossy {
            g.reflected *= n0;
            g.observed = g.observed.map(|o| o * n0);
            g.importance *= source;
        }
        let tally = std::mem::take(&mut self.tally);
        self.tally.add_weighted(&tally, n0);
        self.source_weight = source;
        self.output_weight = n0;
        self.n = planned;
    }

    fn clear(&mut self) {
        self.forget_output();
        self.source.fill([0.0; 3]);
        self.glossy.fill(GlossyState::default());
    }

    /// Begins the output anew. In a glossy scene the warm start takes lobes for diffuse: that is good enough to start
    /// from, but kept in the output it would be a bias that fades as 1/n only.
    fn forget_output(&mut self) {
        self.output.fill([0.0; 3]);
        self.evidence.fill(Evidence::default());
        self.tally = Tally::default();
        self.output_weight = 0.0;
        for state in &mut self.glossy {
            (state.reflected, state.observed) = Default::default();
        }
    }

    /// Adds one estimate of all light to the sums (weights 1). Returns the power that was shot in total, and what
    /// the sky gave.
    fn shoot_around(
        &mut self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        workspace: &mut Workspace,
        quantum: Quantum,
        first_step: u64,
    ) -> Shot {
        let Workspace { frozen, sums } = workspace;
        let mut unshot: Vec<[f64; 3]> = Vec::new();
        let mut chance = Stream::new(self.params.seed, STREAM_WARM, first_step);
        let mut total = 0.0;
        let mut sky = 0.0;
        let mut quantum_power = 0.0;
        let mut first = 0.0;
        for step in 0.. {
            let shares = match (step, scene.environment()) {
                (0, Some(_)) => Shares { gather: 0.3, environment: 0.3 },
                // The one-sided estimators find light only from where they start: start everywhere.
                _ if matches!(self.params.estimator, Estimator::Backward | Estimator::Equal) => {
                    Shares { gather: 0.5, environment: 0.0 }
                }
                _ => Shares { gather: 0.0, environment: 0.0 },
            };
            let light = |p: PatchId| match step {
                0 => Light { emitted: scene.emission(p), main_part: Rgb::BLACK, directional: None },
                _ => Light {
                    emitted: Rgb::BLACK,
                    main_part: Rgb::from_array(unshot[p.index()]) / (PI * scene.area(p)),
                    directional: None,
                },
            };
            frozen.fill(scene, glossy, self.total_area, shares, light);
            let mut power = frozen.power();
            if step == 0 {
                match quantum {
                    Quantum::FirstStep(_) => {}
                    Quantum::Power { sky, quantum } => {
                        power += sky;
                        quantum_power = quantum;
                    }
                }
            }
            let first_power = step == 0 && scene.environment().is_some();
            if power <= 0.0 && !first_power {
                break;
            }
            let wanted = match quantum {
                Quantum::FirstStep(rays) if step == 0 => rays,
                _ => power / quantum_power,
            };
            let (rays, divisor) = if wanted >= 1.0 {
                let rays = wanted.round() as u64;
                (rays, rays as f64)
            } else if chance.uniform() < wanted {
                (1, wanted)
            } else {
                break;
            };
            let units = Units::new(frozen.largest_deposit(scene), 2 * rays);
            let seed = Stream::new(self.params.seed, STREAM_WARM, first_step + 1 + step).bits();
            let context = context(scene, glossy, &self.params, seed);
            // A scramble of its own for every step: the state depends on the last step's points.
            let result = context.run(frozen, &self.sobol.rescrambled(seed), 0, rays, sums, units);
            if step == 0 {
                sky = result.tally.sky.luminance() / divisor;
                if let Quantum::FirstStep(_) = quantum {
                    power += sky;
                    quantum_power = power / divisor;
                }
            }
            total += power;
            let before = std::mem::take(&mut self.source);
            self.source = vec![[0.0; 3]; before.len()];
            self.offer(&best_candidates(result.candidates, glossy), rays);
            self.close(scene, glossy, sums, units, 1.0 / divisor, 1.0 / divisor);
            unshot = std::mem::replace(&mut self.source, before);
            for (s, d) in self.source.iter_mut().flatten().zip(unshot.iter().flatten()) {
                *s += d;
            }
            self.tally.add_weighted(&result.tally, 1.0 / divisor);
            if step == 0 {
                first = power;
            }
            // A step without light (all absorbed) ends the light, and so does a scene that gives all of it back.
            if (result.tally.arrived.is_black() && step > 0) || total > MOST_RETURNS * first {
                break;
            }
        }
        Shot { total, sky }
    }
}

/// How many rays a step of the warm start gets.
#[derive(Clone, Copy, Debug)]
enum Quantum {
    /// The first step gets so many, later ones as many per power.
    FirstStep(f64),
    /// One ray for each `quantum` of power; the first step also shoots the given power of the sky.
    Power { sky: f64, quantum: f64 },
}

struct Shot {
    total: f64,
    sky: f64,
}

/// Means over rays as a balance.
pub(crate) fn balance(tally: &Tally, emitted: Rgb, rays: f64) -> PowerBalance {
    PowerBalance {
        emitted: emitted.luminance(),
        sky: tally.sky.luminance() / rays,
        absorbed: tally.absorbed.luminance() / rays,
        escaped: tally.escaped.luminance() / rays,
        lost: tally.lost.luminance() / rays,
    }
}

fn context<'a>(scene: &'a PatchScene, glossy: &'a GlossyPatches, params: &Params, seed: u64) -> WaveContext<'a> {
    WaveContext { scene, glossy, estimator: params.estimator, representation: params.representation, seed }
}

/// The candidate of the smallest key per glossy patch, with the importance of all its candidates.
fn best_candidates(candidates: Vec<Candidate>, glossy: &GlossyPatches) -> Vec<Option<(Candidate, f64)>> {
    if candidates.is_empty() {
        return Vec::new();
    }
    let mut best: Vec<Option<(Candidate, f64)>> = vec![None; glossy.patches().len()];
    for c in candidates {
        let entry = &mut best[c.glossy as usize];
        *entry = Some(match *entry {
            None => (c, c.importance),
            Some((b, total)) => (if c.before(&b) { c } else { b }, total + c.importance),
        });
    }
    best
}
