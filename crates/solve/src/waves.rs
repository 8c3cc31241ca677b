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

mod record;

use std::f64::consts::PI;

use twinray_scene::sample::{Sobol, Stream};
use twinray_scene::{PatchScene, Rgb};

use crate::fixed::Units;
use crate::frozen::{Frozen, FrozenTables, Start};
use crate::glossy::GlossyPatches;
use crate::params::{Estimator, Params};
use crate::peers::Among;
use crate::solution::PowerBalance;
use crate::source::{PackedRepresentative, Source};
use crate::stage::{Lap, Stage};
use crate::strategies::{Fit, Known, Shares};
use crate::tally::Tally;
use crate::wave::{Closing, OutputState, SourceState, Update, Wave, WaveContext};

const STREAM_WARM: u64 = 4;
const STREAM_WAVE: u64 = 6;

/// Waves below this size would be all overhead.
const SMALLEST_WAVE: u64 = 1024;
/// Waves above this size gain nothing and make stopping slow.
const LARGEST_WAVE: u64 = 1 << 19;
/// The warm start's smallest planned number of rays: its noise (.24 % of the total power at 8000 rays and
/// albedo .95) is what tiny scenes would otherwise remember.
const SMALLEST_WARM_START: u64 = 1 << 15;

/// Memory that waves take turns to use.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    tables: FrozenTables,
    wave: Wave,
}

/// Shares are fitted anew whenever the rays have grown by one part in so many.
const EPOCH: u64 = 4;

/// What all waves of all runs share.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub scene: &'a PatchScene,
    pub glossy: &'a GlossyPatches,
    pub params: &'a Params,
    pub among: Among<'a>,
    pub lap: Lap<'a>,
}

/// Steps of the warm start's pilot after the first; what would follow is taken for a geometric series.
const PILOT_STEPS: u64 = 4;
/// All light over its first step at which the warm start stops: a contraction of ρ shoots 1/(1 − ρ) of it, so only
/// closed scenes of an albedo above 0.9995 come here, and without a bound one of albedo 1 would never end.
const MOST_RETURNS: f64 = 2000.0;

/// State of the default schedule.
#[derive(Debug)]
pub(crate) struct Waves {
    seed: u64,
    /// +1 or −1: which of two replicas this is.
    sign: f64,
    /// n: planned rays of the warm start and rays of the waves.
    n: u64,
    wave: u64,
    sobol: Sobol,
    /// Exponent q of the source weights.
    forgetting: f64,
    total_area: f64,
    /// 𝓛 of the power that patches emit, W.
    lamp_power: f64,
    /// 𝓛 of the power of lights without area, W.
    light_power: f64,
    shares: Shares,
    /// Witnesses of this epoch, and the n at which it ends.
    fit: Fit,
    epoch: u64,
    known: Known,
    source_weight: f64,
    output_weight: f64,
    source: SourceState,
    tally: Tally,
}

impl Waves {
    /// A run that has shot nothing.
    fn begin(around: Surroundings, seed: u64, sign: f64) -> Self {
        let scene = around.scene;
        // Bright scenes have longer memories: forget faster.
        let forgetting = if scene.mean_albedo().luminance() > 0.9 { 9.0 } else { 4.0 };
        let mut this = Self {
            seed,
            sign,
            n: 0,
            wave: 0,
            sobol: Sobol::new(seed),
            forgetting,
            total_area: scene.total_area(),
            lamp_power: scene.emitted_power().luminance(),
            light_power: scene.lights_power().luminance(),
            shares: around.params.shares.unwrap_or_else(|| {
                Shares::first(scene.environment().is_some(), scene.lights_power().luminance() > 0.0)
            }),
            fit: Fit::default(),
            epoch: 0,
            known: Known::default(),
            source_weight: 0.0,
            output_weight: 0.0,
            source: SourceState { sources: emitters(scene), representatives: Vec::new() },
            tally: Tally::default(),
        };
        this.forget_representatives(around.glossy);
        this
    }

    /// Starts a run; the warm start is shot here.
    pub(crate) fn new(
        around: Surroundings,
        seed: u64,
        sign: f64,
        output: &mut OutputState,
        workspace: &mut Workspace,
    ) -> Self {
        let mut this = Self::begin(around, seed, sign);
        if around.params.warm_start > 0.0 {
            this.warm_start(around, output, workspace);
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

    /// Where the light went, sums of weight [`Waves::weight`].
    pub(crate) fn tally(&self) -> &Tally {
        &self.tally
    }

    /// The glossy patches' remembered samples.
    pub(crate) fn representatives(&self) -> &[PackedRepresentative] {
        &self.source.representatives
    }

    /// True until the first wave.
    pub(crate) fn is_new(&self) -> bool {
        self.wave == 0
    }

    /// Begins the output anew: whoever owns it clears it.
    pub(crate) fn forget_output(&mut self) {
        self.tally = Tally::default();
        self.output_weight = 0.0;
    }

    /// One wave.
    pub(crate) fn advance(&mut self, around: Surroundings, output: &mut OutputState, workspace: &mut Workspace) {
        let size = wave_size(self.n, around.scene.len(), !self.source.representatives.is_empty());
        // The one-sided estimators divide by other densities than witnesses tell of.
        let fitted = around.params.shares.is_none() && around.params.estimator == Estimator::Balance;
        let weight = 2.0 * self.output_weight.max(1.0);
        if fitted && self.n >= self.epoch {
            self.shares = self.fit.step(self.shares);
            self.fit = Fit::default();
            self.epoch = self.n + self.n / EPOCH;
            self.known = Known::new(around.scene, &output.deposits, weight);
        }
        let witness = if fitted { self.known.witness(around.scene, &output.deposits, weight) } else { None };
        let Workspace { tables, wave } = workspace;
        let start = self.start(around, &self.source.sources, true);
        let frozen = Frozen::new(start, self.shares, tables);
        (around.lap)(Stage::Freeze);
        let units = Units::new(frozen.largest_deposit(), 2 * size);
        let context = self.context(around, self.seed);
        let (mut tally, fit) = context.shoot(&frozen, &self.sobol, self.n, size, witness.as_ref(), wave);

        let weight = libm::pow(self.n as f64 + 0.5 * size as f64, self.forgetting) * size as f64;
        self.source_weight += weight;
        let closing = Closing {
            units,
            rays: size,
            output: 1.0,
            sign: self.sign,
            seed: Stream::new(self.seed, STREAM_WAVE, self.wave).bits(),
            update: Update::Blend(weight / self.source_weight),
        };
        let closed = wave.close(&context, &closing, &mut self.source, &mut [], output);
        (around.lap)(Stage::Deposit);
        tally.arrived = closed.arrived;
        tally.absorbed += closed.arrived - closed.reflected;
        self.tally.add_weighted(&tally, 1.0);
        self.output_weight += size as f64;
        self.n += size;
        self.wave += 1;
        self.fit.add(&fit);
    }

    /// Shares of the strategies at this moment.
    pub(crate) fn shares(&self) -> Shares {
        self.shares
    }

    fn start<'a>(&'a self, around: Surroundings<'a>, sources: &'a [Source], emits: bool) -> Start<'a> {
        Start {
            scene: around.scene,
            glossy: around.glossy,
            sources,
            representatives: if self.n == 0 { &[] } else { &self.source.representatives },
            representation: around.params.representation,
            emits,
            lamp_power: self.lamp_power,
            light_power: self.light_power,
            total_area: self.total_area,
        }
    }

    fn context<'a>(&self, around: Surroundings<'a>, seed: u64) -> WaveContext<'a> {
        WaveContext {
            scene: around.scene,
            glossy: around.glossy,
            estimator: around.params.estimator,
            representation: around.params.representation,
            seed,
            among: around.among,
            lap: around.lap,
        }
    }

    fn forget_representatives(&mut self, glossy: &GlossyPatches) {
        self.source.representatives = vec![PackedRepresentative::default(); glossy.patches().len()];
    }

    /// Incremental shooting: unshot light U is sent once around, what it leaves becomes the next U, until chance
    /// ends it where less than one ray's worth is left. Counts follow from U alone and deposits are divided by the
    /// count that was planned with certainty, so the sum is unbiased.
    fn warm_start(&mut self, around: Surroundings, output: &mut OutputState, workspace: &mut Workspace) {
        let glossy = !around.glossy.patches().is_empty();
        let planned = warm_start_rays(around.params.warm_start, around.scene.len(), glossy);
        let pilot_rays = (planned / 32) as f64;
        // A pilot measures how much light there will be to shoot, and how much of the sky comes in; its result is
        // thrown away, so that the main run's counts do not depend on the main run's numbers.
        let pilot = self.shoot_around(around, output, workspace, Quantum::FirstStep(pilot_rays), 0, 0.0);
        self.source.sources = emitters(around.scene);
        self.forget_representatives(around.glossy);
        self.tally = Tally::default();

        // Enter the estimate D₀ as if `planned` rays had each left it: unbiased, and weighted like a first wave.
        let n0 = planned as f64;
        let quantum = Quantum::Power { sky: pilot.sky, quantum: pilot.total / n0 };
        let weight = n0 * power_shot_weight(around.scene);
        self.shoot_around(around, output, workspace, quantum, 1 << 32, weight);
        self.source_weight = libm::pow(n0, self.forgetting + 1.0) / (self.forgetting + 1.0);
        self.output_weight = weight;
        self.n = planned;
    }

    /// Share of lights without area in the first step of the warm start: that of their power among all that is known, so that
    /// every ray carries the whole of it; a part where the sky's is not.
    fn first_points(&self, scene: &PatchScene) -> f64 {
        let share = self.light_power / (self.light_power + self.lamp_power);
        if scene.environment().is_some() { 0.3 * share } else { share }
    }

    /// Adds one estimate of all light to the source, and `output_weight` times as much to the output and the tally.
    /// Returns the power that was shot in total, and what the sky gave.
    fn shoot_around(
        &mut self,
        around: Surroundings,
        output: &mut OutputState,
        workspace: &mut Workspace,
        quantum: Quantum,
        first_step: u64,
        output_weight: f64,
    ) -> Shot {
        let scene = around.scene;
        let Workspace { tables, wave } = workspace;
        let mut unshot = self.source.sources.clone();
        let mut chance = Stream::new(self.seed, STREAM_WARM, first_step);
        let mut total = 0.0;
        let mut sky = 0.0;
        let mut quantum_power = 0.0;
        let mut first = 0.0;
        let mut before = 0.0;
        for step in 0.. {
            let shares = match (step, scene.environment()) {
                (0, Some(_)) => Shares::even(0.3, 0.3),
                // The one-sided estimators find light only from where they start: start everywhere.
                _ if matches!(around.params.estimator, Estimator::Backward | Estimator::Equal) => {
                    Shares::even(0.5, 0.0)
                }
                // By power alone every ray carries the whole power, and the light of many bounces is sure.
                _ => Shares::POWER,
            };
            let lights = step == 0 && self.light_power > 0.0;
            let shares = if lights { shares.with_points(self.first_points(scene)) } else { shares };
            let frozen = Frozen::new(self.start(around, &unshot, step == 0), shares, tables);
            (around.lap)(Stage::Freeze);
            let mut power = frozen.power() + if lights { self.light_power } else { 0.0 };
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
            let units = Units::new(frozen.largest_deposit(), 2 * rays);
            let seed = Stream::new(self.seed, STREAM_WARM, first_step + 1 + step).bits();
            let context = self.context(around, seed);
            // A scramble of its own for every step: the state depends on the last step's points.
            let (mut tally, _) = context.shoot(&frozen, &self.sobol.rescrambled(seed), 0, rays, None, wave);
            if step == 0 {
                sky = tally.sky.luminance() / divisor;
                if let Quantum::FirstStep(_) = quantum {
                    power += sky;
                    quantum_power = power / divisor;
                }
            }
            total += power;
            let closing = Closing {
                units,
                rays,
                output: output_weight / divisor,
                sign: self.sign,
                seed,
                update: Update::Step(1.0 / divisor),
            };
            let closed = wave.close(&context, &closing, &mut self.source, &mut unshot, output);
            (around.lap)(Stage::Deposit);
            tally.arrived = closed.arrived;
            tally.absorbed += closed.arrived - closed.reflected;
            self.tally.add_weighted(&tally, closing.output);
            if step == 0 {
                first = power;
            }
            // A pilot need not follow what the first steps foretell.
            if step == PILOT_STEPS && matches!(quantum, Quantum::FirstStep(_)) && power < before {
                total += power * power / (before - power);
                break;
            }
            before = power;
            // A step without light (all absorbed) ends the light, and so does a scene that gives all of it back.
            if (tally.arrived.is_black() && step > 0) || total > MOST_RETURNS * first {
                break;
            }
        }
        Shot { total, sky }
    }
}

/// Rays of the next wave: a function of n and K alone, so that stopping and resuming change nothing.
pub(crate) fn wave_size(n: u64, patches: usize, glossy: bool) -> u64 {
    let half = (patches as u64 / 2).max(SMALLEST_WAVE);
    // A representative is one sample per wave, so a glossy scene needs many waves: 2 K rays each do no harm that could
    // be measured (Phong lobes of exponent 30 and 200, the hall), 8 K make 3 to 5 % more error (`docs/paper.md`).
    let (wanted, most) = if glossy { (n / 2, 2 * patches as u64) } else { (n / 8, LARGEST_WAVE) };
    wanted.clamp(half, most.min(LARGEST_WAVE).max(half))
}

/// Planned rays of the warm start, whose setting is in rays per patch of both replicas.
pub(crate) fn warm_start_rays(setting: f64, patches: usize, glossy: bool) -> u64 {
    // A glossy scene's output does not remember the start, so there it is the shorter the better forgotten.
    let smallest = if glossy { SMALLEST_WAVE } else { SMALLEST_WARM_START };
    ((0.5 * setting * patches as f64) as u64).max(smallest)
}

/// What a ray of the warm start counts for in the output against one of a wave. Shot by power alone, it finds patches in
/// proportion to their area, and mean squares of relative errors grow with the mean of A times that of 1/A; those of
/// fitted shares about with its root. The best weights are as one over the variances.
fn power_shot_weight(scene: &PatchScene) -> f64 {
    let inverse: f64 = scene.patches().map(|p| 1.0 / scene.area(p)).sum();
    let patches = scene.len() as f64;
    1.0 / (scene.total_area() * inverse).sqrt() * patches
}

/// Sources before any light was reflected.
fn emitters(scene: &PatchScene) -> Vec<Source> {
    let per_patch = 1.0 / (PI * scene.len() as f64);
    let source = |p| {
        let emitted = scene.emission(p);
        Source::new(emitted, per_patch / scene.area(p), !emitted.is_black())
    };
    scene.patches().map(source).collect()
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
