//! The default schedule: warm start, then growing waves on two time scales.
//!
//! The 1/n average of the paper forgets the light that it has not yet seen too slowly: an eigenmode λ of the
//! transport decays as n^−(1−λ), and a bright room stays dark. Here every wave of B rays starts from a state that
//! forgets: wave weights v = (n + B/2)^q, while the output keeps every deposit with equal weight (Polyak and
//! Ruppert). The warm start solves the scene coarsely, but without bias, so the output is unbiased at any n
//! (in diffuse scenes; glossy light starts out diffuse and that is forgotten as 1/n).

use rayon::prelude::*;
use std::f64::consts::PI;

use twinray_scene::sample::{Sobol, Stream};
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::fixed::Unit;
use crate::frozen::{Frozen, Light, Shares};
use crate::glossy::GlossyPatches;
use crate::params::{Estimator, Params, Representation};
use crate::patch_radiance::Directional;
use crate::representative::Representative;
use crate::solution::{GlossySolution, PowerBalance, Solution};
use crate::tally::Tally;
use crate::wave::{Candidate, WaveContext, WaveSums};

const STREAM_ACCEPT: u64 = 3;
const STREAM_WARM: u64 = 4;

/// Waves below this size would be all overhead.
const SMALLEST_WAVE: u64 = 1024;
/// Waves above this size gain nothing and make stopping slow.
const LARGEST_WAVE: u64 = 1 << 21;
/// The warm start's smallest planned number of rays: its noise (.24 % of the total power at 8000 rays and
/// albedo .95) is what tiny scenes would otherwise remember.
const SMALLEST_WARM_START: u64 = 1 << 16;

/// Sums, frozen radiance and selection table.
pub(crate) const BYTES_PER_PATCH: usize = 24 + 24 + 24 + 12 + 8 + 4;
/// Beside that: the numbering (over all patches, counted here), sums, state and frozen light of glossy patches.
pub(crate) const BYTES_PER_GLOSSY_PATCH: usize =
    4 + 4 + 24 + 4 * 24 + size_of::<GlossyState>() + crate::frozen::BYTES_PER_GLOSSY_PATCH;

/// State of the default schedule.
#[derive(Debug)]
pub(crate) struct Waves {
    /// n: planned rays of the warm start and rays of the waves.
    n: u64,
    wave: u64,
    sobol: Sobol,
    /// Exponent q of the source weights.
    forgetting: f64,
    total_area: f64,
    emitted: Rgb,
    source_weight: f64,
    output_weight: f64,
    /// Σ v·deposits (albedo-weighted on glossy patches), per patch.
    source: Vec<[f64; 3]>,
    /// Σ deposits, per patch.
    output: Vec<[f64; 3]>,
    glossy: Vec<GlossyState>,
    tally: Tally,
    frozen: Frozen,
    sums: WaveSums,
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
    pub(crate) fn new(scene: &PatchScene, glossy: &GlossyPatches, params: &Params) -> Self {
        let patches = scene.len();
        // Bright scenes have longer memories: forget faster.
        let forgetting = if scene.mean_albedo().luminance() > 0.9 { 9.0 } else { 4.0 };
        let mut this = Self {
            n: 0,
            wave: 0,
            sobol: Sobol::new(params.seed),
            forgetting,
            total_area: scene.total_area(),
            emitted: scene.emitted_power(),
            source_weight: 0.0,
            output_weight: 0.0,
            source: vec![[0.0; 3]; patches],
            output: vec![[0.0; 3]; patches],
            glossy: vec![GlossyState::default(); glossy.patches().len()],
            tally: Tally::default(),
            frozen: Frozen::default(),
            sums: WaveSums::new(patches, glossy.patches().len()),
        };
        if params.warm_start > 0.0 {
            this.warm_start(scene, glossy, params);
        }
        this
    }

    pub(crate) fn rays(&self) -> u64 {
        self.n
    }

    /// Rays of the next wave: a function of n and K alone, so that stopping and resuming change nothing.
    fn wave_size(&self, patches: usize) -> u64 {
        let half = (patches as u64 / 2).max(SMALLEST_WAVE);
        // A representative is one sample per wave: waves of a glossy scene stay short to have many of them.
        if self.glossy.is_empty() { (self.n / 8).clamp(half, LARGEST_WAVE.max(half)) } else { half.min(LARGEST_WAVE) }
    }

    /// One wave.
    pub(crate) fn advance(&mut self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params) {
        let size = self.wave_size(scene.len());
        let mut frozen = std::mem::take(&mut self.frozen);
        // Under a sky most power is on roofs that send it back: more rays start where they are needed instead.
        let gather = match scene.environment() {
            Some(_) => params.gather_share.max(0.35),
            None => params.gather_share,
        };
        let shares = Shares { gather, environment: params.environment_share };
        frozen.fill(scene, glossy, self.total_area, shares, |p| self.light(scene, glossy, params, p));
        let unit = Unit::new(frozen.largest_deposit(scene), 2 * size);
        let context = context(scene, glossy, params, params.seed);
        let result = context.run(&frozen, &self.sobol, self.n, size, &self.sums, unit);
        self.frozen = frozen;

        let weight = libm::pow(self.n as f64 + 0.5 * size as f64, self.forgetting);
        self.offer(&best_candidates(result.candidates, glossy), size, params);
        self.close(scene, glossy, unit, weight, 1.0);
        self.tally.add_weighted(&result.tally, 1.0);
        self.source_weight += weight * size as f64;
        self.output_weight += size as f64;
        self.n += size;
        self.wave += 1;
    }

    /// Adds the wave's deposits to the sums and empties them: `weight` for the source, `share` for the output.
    fn close(&mut self, scene: &PatchScene, glossy: &GlossyPatches, unit: Unit, weight: f64, share: f64) {
        let sums = &self.sums;
        let reflected: Vec<Rgb> = (0..self.glossy.len()).map(|k| sums.reflected.take(k, unit)).collect();
        self.source.par_iter_mut().zip(&mut self.output).enumerate().with_min_len(4096).for_each(
            |(i, (source, output))| {
                let arrived = sums.arrived.take(i, unit);
                let returned = match glossy.number_of(PatchId(i as u32)) {
                    Some(k) => reflected[k],
                    None => arrived * scene.brdf(PatchId(i as u32)).mean_albedo(),
                };
                *source = (Rgb::from_array(*source) + returned * weight).to_array();
                *output = (Rgb::from_array(*output) + arrived * share).to_array();
            },
        );
        for (k, state) in self.glossy.iter_mut().enumerate() {
            state.reflected += reflected[k] * share;
            for (sum, part) in state.observed.iter_mut().zip(&sums.observed) {
                *sum += part.take(k, unit) * share;
            }
            state.importance += sums.importance.take(k, unit).r * weight;
        }
    }

    /// One acceptance or rejection per patch and wave, on the wave's total: the chain runs over waves, and no
    /// thread can change it.
    fn offer(&mut self, best: &[Option<(Candidate, f64)>], size: u64, params: &Params) {
        for (k, candidate) in best.iter().enumerate() {
            let Some((c, total)) = candidate else { continue };
            let u = match params.representation {
                Representation::Last => 0.0,
                _ => Stream::new(params.seed ^ self.wave, STREAM_ACCEPT, k as u64).uniform(),
            };
            self.glossy[k].representative.offer(c.irradiance, c.wi, c.importance, total / size as f64, u);
        }
    }

    /// What a patch sends out, from the source sums.
    fn light(&self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params, patch: PatchId) -> Light {
        let emitted = scene.emission(patch);
        if self.source_weight == 0.0 {
            return Light { emitted, main_part: Rgb::BLACK, directional: None };
        }
        let area = scene.area(patch);
        let main_part = Rgb::from_array(self.source[patch.index()]) / (PI * area * self.source_weight);
        let directional = glossy.number_of(patch).and_then(|k| self.directional(scene, params, patch, k));
        let main_part = if directional.is_some() && params.representation == Representation::Sample {
            Rgb::BLACK
        } else {
            main_part
        };
        Light { emitted, main_part, directional }
    }

    fn directional(&self, scene: &PatchScene, params: &Params, patch: PatchId, k: usize) -> Option<Directional> {
        let state = &self.glossy[k];
        if state.representative.importance <= 0.0 || params.representation == Representation::Main {
            return None;
        }
        let mean_importance = state.importance / (self.source_weight * scene.area(patch));
        let brdf = scene.brdf(patch);
        let wi = state.representative.wi;
        let main_reflectance = match params.representation {
            Representation::Sample => Rgb::BLACK,
            _ => brdf.albedo(scene.normal(patch).dot(wi)) / PI,
        };
        Some(Directional { irradiance: state.representative.scaled(mean_importance), wi, brdf, main_reflectance })
    }

    /// Incremental shooting: unshot light U is sent once around, what it leaves becomes the next U, until chance
    /// ends it where less than one ray's worth is left. Counts follow from U alone and deposits are divided by the
    /// count that was planned with certainty, so the sum is unbiased.
    fn warm_start(&mut self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params) {
        let planned = ((params.warm_start * scene.len() as f64) as u64).max(SMALLEST_WARM_START);
        let pilot_rays = (planned / 32) as f64;
        let mut frozen = std::mem::take(&mut self.frozen);
        // A pilot measures how much light there will be to shoot, and how much of the sky comes in; its result is
        // thrown away, so that the main run's counts do not depend on the main run's numbers.
        let pilot = self.shoot_around(scene, glossy, params, &mut frozen, Quantum::FirstStep(pilot_rays), 0);
        self.clear();
        let quantum = Quantum::Power { sky: pilot.sky, quantum: pilot.total / planned as f64 };
        self.shoot_around(scene, glossy, params, &mut frozen, quantum, 1 << 32);
        self.frozen = frozen;

        // Enter the estimate D₀ as if `planned` rays had each left it: unbiased, and weighted like a first wave.
        let n0 = planned as f64;
        let source = libm::pow(n0, self.forgetting + 1.0) / (self.forgetting + 1.0);
        let scale = |sums: &mut [[f64; 3]], s: f64| sums.iter_mut().flatten().for_each(|x| *x *= s);
        scale(&mut self.source, source);
        scale(&mut self.output, n0);
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
        self.source.fill([0.0; 3]);
        self.output.fill([0.0; 3]);
        self.glossy.fill(GlossyState::default());
        self.tally = Tally::default();
    }

    /// Adds one estimate of all light to the sums (weights 1). Returns the power that was shot in total, and what
    /// the sky gave.
    fn shoot_around(
        &mut self,
        scene: &PatchScene,
        glossy: &GlossyPatches,
        params: &Params,
        frozen: &mut Frozen,
        quantum: Quantum,
        first_step: u64,
    ) -> Shot {
        let mut unshot: Vec<[f64; 3]> = Vec::new();
        let mut chance = Stream::new(params.seed, STREAM_WARM, first_step);
        let mut total = 0.0;
        let mut sky = 0.0;
        let mut quantum_power = 0.0;
        // Bounces of a contraction die out; the bound only stops what a closed scene of albedo 1 would do for ever.
        for step in 0..100_000u64 {
            let shares = match (step, scene.environment()) {
                (0, Some(_)) => Shares { gather: 0.3, environment: 0.3 },
                // The one-sided estimators find light only from where they start: start everywhere.
                _ if matches!(params.estimator, Estimator::Backward | Estimator::Equal) => {
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
            let unit = Unit::new(frozen.largest_deposit(scene), 2 * rays);
            let seed = Stream::new(params.seed, STREAM_WARM, first_step + 1 + step).bits();
            let context = context(scene, glossy, params, seed);
            // A scramble of its own for every step: the state depends on the last step's points.
            let result = context.run(frozen, &self.sobol.rescrambled(seed), 0, rays, &self.sums, unit);
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
            self.offer(&best_candidates(result.candidates, glossy), rays, params);
            self.close(scene, glossy, unit, 1.0 / divisor, 1.0 / divisor);
            unshot = std::mem::replace(&mut self.source, before);
            for (s, d) in self.source.iter_mut().flatten().zip(unshot.iter().flatten()) {
                *s += d;
            }
            self.tally.add_weighted(&result.tally, 1.0 / divisor);
            // A step without light (all absorbed) ends the light.
            if result.tally.arrived.is_black() && step > 0 {
                break;
            }
        }
        Shot { total, sky }
    }

    pub(crate) fn relative_error(&self, scene: &PatchScene) -> f64 {
        let w = self.output_weight.max(f64::MIN_POSITIVE);
        let luminance = |p: PatchId| Rgb::from_array(self.output[p.index()]).luminance() / (w * scene.area(p));
        self.tally.relative_error(scene, w, luminance)
    }

    pub(crate) fn solution(&self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params) -> Solution {
        let w = self.output_weight.max(f64::MIN_POSITIVE);
        let irradiance: Vec<[f32; 3]> =
            scene.patches().map(|p| (Rgb::from_array(self.output[p.index()]) / (w * scene.area(p))).to_f32()).collect();
        let glossy_light = glossy.patches().iter().enumerate().map(|(k, &p)| {
            let per_area = 1.0 / (w * scene.area(p));
            let observed = glossy.to_eye(k).filter(|_| params.representation != Representation::Main);
            GlossySolution {
                main_part: self.glossy[k].reflected * per_area / PI,
                directional: self.directional(scene, params, p, k),
                observed_lobe: observed.map(|_| self.glossy[k].observed.map(|o| o * per_area)),
            }
        });
        let glossy_light = glossy_light.collect();
        Solution {
            rays: self.n,
            irradiance,
            glossy: glossy.clone(),
            glossy_light,
            balance: balance(&self.tally, self.emitted, w),
            relative_error: self.relative_error(scene),
            tally: self.tally,
            splits_direct_light: params.representation != Representation::Main,
        }
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
