//! The default schedule: warm start, then growing waves on two time scales.
//!
//! The 1/n average of the paper forgets the light that it has not yet seen too slowly: an eigenmode λ of the
//! transport decays as n^−(1−λ), and a bright room stays dark. Here every wave of B rays starts from a state that
//! forgets: wave weights v = (n + B/2)^q, while the output keeps every deposit with equal weight (Polyak and
//! Ruppert). The warm start solves the scene coarsely, but without bias, so the output is unbiased at any n
//! (in diffuse scenes; glossy light starts out diffuse and that is forgotten as 1/n).
//!
//! Every wave has two halves, from independently scrambled sequences and, in glossy scenes, with representatives of
//! their own: what differs between them is noise (`error_bars`).

use rayon::prelude::*;
use std::f64::consts::PI;

use twinray_scene::sample::{Sobol, Stream};
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::error_bars::{ErrorBars, Evidence, error_bars, relative_error};
use crate::fixed::Units;
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
const STREAM_HALF: u64 = 5;

/// Waves below this size would be all overhead.
const SMALLEST_WAVE: u64 = 1024;
/// Waves above this size gain nothing and make stopping slow.
const LARGEST_WAVE: u64 = 1 << 21;
/// The warm start's smallest planned number of rays: its noise (.24 % of the total power at 8000 rays and
/// albedo .95) is what tiny scenes would otherwise remember.
const SMALLEST_WARM_START: u64 = 1 << 16;

/// Source, output, evidence, a wave's sums, frozen radiance and selection table.
pub(crate) const BYTES_PER_PATCH: usize = 24 + 8 + 24 + size_of::<Evidence>() + 64 + 12 + 4 + 8 + 4;
/// Beside that: the numbering and the second frozen state (over all patches, counted here), sums, state and frozen
/// light of glossy patches.
pub(crate) const BYTES_PER_GLOSSY_PATCH: usize =
    4 + 28 + 4 + 24 + 4 * 24 + size_of::<GlossyState>() + 2 * crate::frozen::BYTES_PER_GLOSSY_PATCH;

/// The two halves of the rays: their sign in the noise field.
const SIGNS: [f64; 2] = [1.0, -1.0];

/// State of the default schedule.
#[derive(Debug)]
pub(crate) struct Waves {
    /// n: planned rays of the warm start and rays of the waves.
    n: u64,
    wave: u64,
    sobol: [Sobol; 2],
    /// Exponent q of the source weights.
    forgetting: f64,
    total_area: f64,
    emitted: Rgb,
    source_weight: f64,
    output_weight: f64,
    /// Σ v·deposits (albedo-weighted on glossy patches), per patch.
    source: Vec<[f64; 3]>,
    /// The same of the noise field, luminance.
    source_noise: Vec<f64>,
    /// Σ deposits, per patch.
    output: Vec<[f64; 3]>,
    evidence: Vec<Evidence>,
    glossy: Vec<GlossyState>,
    tally: Tally,
    /// One state for both halves in diffuse scenes, one each in glossy ones.
    frozen: [Frozen; 2],
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
    /// One for each half of the rays: what differs between the halves has to be all the noise there is.
    representative: [Representative; 2],
}

impl Waves {
    pub(crate) fn new(scene: &PatchScene, glossy: &GlossyPatches, params: &Params) -> Self {
        let patches = scene.len();
        // Bright scenes have longer memories: forget faster.
        let forgetting = if scene.mean_albedo().luminance() > 0.9 { 9.0 } else { 4.0 };
        let mut this = Self {
            n: 0,
            wave: 0,
            sobol: halves(params.seed),
            forgetting,
            total_area: scene.total_area(),
            emitted: scene.emitted_power(),
            source_weight: 0.0,
            output_weight: 0.0,
            source: vec![[0.0; 3]; patches],
            source_noise: vec![0.0; patches],
            output: vec![[0.0; 3]; patches],
            evidence: vec![Evidence::default(); patches],
            glossy: vec![GlossyState::default(); glossy.patches().len()],
            tally: Tally::default(),
            frozen: Default::default(),
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

    /// Rays of the next wave, an even number: a function of n and K alone, so that stopping and resuming change
    /// nothing.
    fn wave_size(&self, patches: usize) -> u64 {
        let half = (patches as u64 / 2).max(SMALLEST_WAVE);
        // A representative is one sample per wave and half: a glossy scene's waves stay short to have many of them.
        let size = match self.glossy.is_empty() {
            true => (self.n / 8).clamp(half, LARGEST_WAVE.max(half)),
            false => (2 * half).min(LARGEST_WAVE),
        };
        size.next_multiple_of(2)
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
        let states = if self.glossy.is_empty() { 1 } else { 2 };
        for (half, state) in frozen.iter_mut().enumerate().take(states) {
            state.fill(scene, glossy, self.total_area, shares, |p| self.light(scene, glossy, params, p, half));
        }
        let frozen_of = |half: usize| &frozen[half.min(states - 1)];
        let largest = frozen[..states].iter().map(|f| f.largest_deposit(scene)).fold(0.0, f64::max);
        // Two deposits a ray; the noise field's may be twice as large.
        let units = Units::new(largest, 4 * size);
        for half in 0..2 {
            let context = context(scene, glossy, params, half_seed(params.seed, half), half);
            let result = context.run(frozen_of(half), &self.sobol[half], self.n / 2, size / 2, &self.sums, units);
            self.offer(&best_candidates(result.candidates, glossy), size / 2, params, half);
            self.tally.add_weighted(&result.tally, 1.0);
        }
        self.frozen = frozen;

        let weight = libm::pow(self.n as f64 + 0.5 * size as f64, self.forgetting);
        self.close(scene, glossy, units, weight, 1.0);
        self.source_weight += weight * size as f64;
        self.output_weight += size as f64;
        self.n += size;
        self.wave += 1;
    }

    /// Adds the wave's deposits to the sums and empties them: `weight` for the source, `share` for the output.
    fn close(&mut self, scene: &PatchScene, glossy: &GlossyPatches, units: Units, weight: f64, share: f64) {
        let sums = &self.sums;
        let reflected: Vec<Rgb> = (0..self.glossy.len()).map(|k| sums.reflected.take(k, units.deposit)).collect();
        let sources = self.source.par_iter_mut().zip(&mut self.source_noise);
        let outputs = self.output.par_iter_mut().zip(&mut self.evidence);
        sources.zip(outputs).enumerate().with_min_len(4096).for_each(
            |(i, ((source, source_noise), (output, evidence)))| {
                let arrived = sums.arrived.take(i, units);
                let returned = match glossy.number_of(PatchId(i as u32)) {
                    Some(k) => reflected[k],
                    None => arrived.deposits * scene.brdf(PatchId(i as u32)).mean_albedo(),
                };
                *source = (Rgb::from_array(*source) + returned * weight).to_array();
                *output = (Rgb::from_array(*output) + arrived.deposits * share).to_array();
                // The noise field has no colour: it is reflected as the wave's light on the patch was.
                let light = arrived.deposits.luminance();
                let albedo = if light > 0.0 { returned.luminance() / light } else { 0.0 };
                *source_noise += arrived.noise * albedo * weight;
                evidence.noise += arrived.noise * share;
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

    /// One acceptance or rejection per patch, wave and half, on the half wave's total: the chain runs over waves, and
    /// no thread can change it.
    fn offer(&mut self, best: &[Option<(Candidate, f64)>], size: u64, params: &Params, half: usize) {
        for (k, candidate) in best.iter().enumerate() {
            let Some((c, total)) = candidate else { continue };
            let u = match params.representation {
                Representation::Last => 0.0,
                _ => Stream::new(half_seed(params.seed, half) ^ self.wave, STREAM_ACCEPT, k as u64).uniform(),
            };
            self.glossy[k].representative[half].offer(c.irradiance, c.wi, c.importance, total / size as f64, u);
        }
    }

    /// What a patch sends out, from the source sums.
    fn light(&self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params, patch: PatchId, half: usize) -> Light {
        let emitted = scene.emission(patch);
        if self.source_weight == 0.0 {
            return Light { emitted, main_part: Rgb::BLACK, directional: None, noise: 0.0 };
        }
        let area = scene.area(patch);
        let per_weight = 1.0 / (PI * area * self.source_weight);
        let main_part = Rgb::from_array(self.source[patch.index()]) * per_weight;
        let directional = glossy.number_of(patch).and_then(|k| self.directional(scene, params, patch, k, half));
        let main_part = if directional.is_some() && params.representation == Representation::Sample {
            Rgb::BLACK
        } else {
            main_part
        };
        Light { emitted, main_part, directional, noise: self.source_noise[patch.index()] * per_weight }
    }

    fn directional(
        &self,
        scene: &PatchScene,
        params: &Params,
        patch: PatchId,
        k: usize,
        half: usize,
    ) -> Option<Directional> {
        let state = &self.glossy[k];
        let representative = &state.representative[half];
        if representative.importance <= 0.0 || params.representation == Representation::Main {
            return None;
        }
        let mean_importance = state.importance / (self.source_weight * scene.area(patch));
        let brdf = scene.brdf(patch);
        let wi = representative.wi;
        let main_reflectance = match params.representation {
            Representation::Sample => Rgb::BLACK,
            _ => brdf.albedo(scene.normal(patch).dot(wi)) / PI,
        };
        Some(Directional { irradiance: representative.scaled(mean_importance), wi, brdf, main_reflectance })
    }

    /// Incremental shooting: unshot light U is sent once around, what it leaves becomes the next U, until chance
    /// ends it where less than one ray's worth is left. Counts follow from U alone and deposits are divided by the
    /// count that was planned with certainty, so the sum is unbiased.
    fn warm_start(&mut self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params) {
        let planned = ((params.warm_start * scene.len() as f64) as u64).max(SMALLEST_WARM_START).next_multiple_of(2);
        let pilot_rays = (planned / 32) as f64;
        let mut frozen = Frozen::default();
        // A pilot measures how much light there will be to shoot, and how much of the sky comes in; its result is
        // thrown away, so that the main run's counts do not depend on the main run's numbers.
        let pilot = self.shoot_around(scene, glossy, params, &mut frozen, Quantum::FirstStep(pilot_rays), 0);
        self.clear();
        let quantum = Quantum::Power { sky: pilot.sky, quantum: pilot.total / planned as f64 };
        self.shoot_around(scene, glossy, params, &mut frozen, quantum, 1 << 32);

        // Enter the estimate D₀ as if `planned` rays had each left it: unbiased, and weighted like a first wave.
        let n0 = planned as f64;
        let source = libm::pow(n0, self.forgetting + 1.0) / (self.forgetting + 1.0);
        let scale = |sums: &mut [[f64; 3]], s: f64| sums.iter_mut().flatten().for_each(|x| *x *= s);
        scale(&mut self.source, source);
        scale(&mut self.output, n0);
        self.source_noise.iter_mut().for_each(|x| *x *= source);
        for e in &mut self.evidence {
            e.noise *= n0;
            e.squares *= n0 * n0;
        }
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
        self.source_noise.fill(0.0);
        self.output.fill([0.0; 3]);
        self.evidence.fill(Evidence::default());
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
        let mut unshot_noise: Vec<f64> = Vec::new();
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
                0 => Light { emitted: scene.emission(p), main_part: Rgb::BLACK, directional: None, noise: 0.0 },
                _ => Light {
                    emitted: Rgb::BLACK,
                    main_part: Rgb::from_array(unshot[p.index()]) / (PI * scene.area(p)),
                    directional: None,
                    noise: unshot_noise[p.index()] / (PI * scene.area(p)),
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
            let units = Units::new(frozen.largest_deposit(scene), 4 * rays);
            // A scramble of its own for every step: the state depends on the last step's points.
            let seed = Stream::new(params.seed, STREAM_WARM, first_step + 1 + step).bits();
            let mut tally = Tally::default();
            // A single ray belongs to either half by chance.
            let odd = (seed & 1) * (rays & 1);
            for half in 0..2 {
                let count = if half == 0 { rays / 2 + odd } else { rays - rays / 2 - odd };
                let context = context(scene, glossy, params, half_seed(seed, half), half);
                let sobol = self.sobol[half].rescrambled(half_seed(seed, half));
                let result = context.run(frozen, &sobol, 0, count, &self.sums, units);
                self.offer(&best_candidates(result.candidates, glossy), count, params, half);
                tally.add_weighted(&result.tally, 1.0);
            }
            if step == 0 {
                sky = tally.sky.luminance() / divisor;
                if let Quantum::FirstStep(_) = quantum {
                    power += sky;
                    quantum_power = power / divisor;
                }
            }
            total += power;
            let light = std::mem::replace(&mut self.source, vec![[0.0; 3]; scene.len()]);
            let noise = std::mem::replace(&mut self.source_noise, vec![0.0; scene.len()]);
            self.close(scene, glossy, units, 1.0 / divisor, 1.0 / divisor);
            unshot = std::mem::replace(&mut self.source, light);
            unshot_noise = std::mem::replace(&mut self.source_noise, noise);
            let pairs = self.source.iter_mut().flatten().zip(unshot.iter().flatten());
            pairs.chain(self.source_noise.iter_mut().zip(&unshot_noise)).for_each(|(s, d)| *s += d);
            self.tally.add_weighted(&tally, 1.0 / divisor);
            // A step without light (all absorbed) ends the light.
            if tally.arrived.is_black() && step > 0 {
                break;
            }
        }
        Shot { total, sky }
    }

    pub(crate) fn relative_error(&self, scene: &PatchScene) -> f64 {
        let w = self.output_weight.max(f64::MIN_POSITIVE);
        relative_error(scene, w, |p| self.irradiance(scene, p).luminance(), |p| self.evidence[p.index()])
    }

    fn error_bars(&self, scene: &PatchScene) -> ErrorBars {
        let w = self.output_weight.max(f64::MIN_POSITIVE);
        error_bars(scene, w, |p| self.irradiance(scene, p).luminance(), |p| self.evidence[p.index()])
    }

    fn irradiance(&self, scene: &PatchScene, patch: PatchId) -> Rgb {
        let w = self.output_weight.max(f64::MIN_POSITIVE);
        Rgb::from_array(self.output[patch.index()]) / (w * scene.area(patch))
    }

    pub(crate) fn solution(&self, scene: &PatchScene, glossy: &GlossyPatches, params: &Params) -> Solution {
        let w = self.output_weight.max(f64::MIN_POSITIVE);
        let irradiance: Vec<[f32; 3]> = scene.patches().map(|p| self.irradiance(scene, p).to_f32()).collect();
        let glossy_light = glossy.patches().iter().enumerate().map(|(k, &p)| {
            let per_area = 1.0 / (w * scene.area(p));
            let observed = glossy.to_eye(k).filter(|_| params.representation != Representation::Main);
            GlossySolution {
                main_part: self.glossy[k].reflected * per_area / PI,
                directional: self.directional(scene, params, p, k, 0),
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
            error_bars: self.error_bars(scene),
            hits: self.evidence.iter().map(|e| e.hits).collect(),
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

/// The seed of one half of the rays.
fn half_seed(seed: u64, half: usize) -> u64 {
    Stream::new(seed, STREAM_HALF, half as u64).bits()
}

/// The sequences of both halves.
fn halves(seed: u64) -> [Sobol; 2] {
    let first = Sobol::new(half_seed(seed, 0));
    let second = first.rescrambled(half_seed(seed, 1));
    [first, second]
}

fn context<'a>(
    scene: &'a PatchScene,
    glossy: &'a GlossyPatches,
    params: &Params,
    seed: u64,
    half: usize,
) -> WaveContext<'a> {
    let (estimator, representation) = (params.estimator, params.representation);
    WaveContext { scene, glossy, estimator, representation, seed, sign: SIGNS[half] }
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
