//! A wave: many rays against one frozen state. Select → shoot → trace → estimate here; deposits in `close`.
//!
//! Everything is a pure function of the state and the ray's number. Rays are shot in tasks, each a range of the first
//! of their numbers (`order`), which ranks deal out among each other (`exchange`); a task runs one stage after the other over all of its rays, so that the processor
//! has many independent loads to wait for at a time, and leaves its deposits sorted by buckets of patches (`deposits`).

mod bucket;
pub(crate) mod close;
mod deposits;
mod exchange;
mod order;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::passing::{Arrival, End};
use twinray_scene::sample::{Sobol, Stream};
use twinray_scene::{PatchId, PatchScene, Rgb};

pub(crate) use close::{Closing, OutputState, SourceState, Update};

use crate::direction;
use crate::frozen::{Choice, Frozen};
use crate::glossy::GlossyPatches;
use crate::params::{Estimator, Representation};
use crate::peers::Among;
use crate::stage::{Lap, Stage};
use crate::strategies::{Fit, STRATEGIES, Witness};
use crate::tally::Tally;
use crate::transfer::{Endpoint, transfer};
use deposits::{Buckets, Deposit, Deposits};
use order::Order;

/// Rays of one task: few enough for its arrays to stay in a core's cache.
const TASK: u64 = 4096;
/// Small waves are shared out as well, so that no thread waits long for the last task: into so many tasks, of at least so many
/// rays.
const TASKS: u64 = 64;
const SMALLEST_TASK: u64 = 256;
/// One ray of so many is a witness for the shares of the strategies.
const WITNESS: usize = 8;

/// Purpose of the counter-based stream that finds another place where a patch has a hole.
const STREAM_HOLES: u64 = 1;
/// The same, that decides whether rays go on at mirrors and glass.
const STREAM_PASSING: u64 = 0x9A55;

/// What all waves of a solve share.
#[derive(Clone, Copy)]
pub(crate) struct WaveContext<'a> {
    pub scene: &'a PatchScene,
    pub glossy: &'a GlossyPatches,
    /// Combination of the two transfers.
    pub estimator: Estimator,
    /// Directional memory.
    pub representation: Representation,
    /// Seed of the streams.
    pub seed: u64,
    /// Who else shoots.
    pub among: Among<'a>,
    /// Told at the end of every stage.
    pub lap: Lap<'a>,
}

/// What a wave works with; memory that waves take turns to use.
#[derive(Debug, Default)]
pub(crate) struct Wave {
    tasks: Vec<Task>,
}

/// What a task leaves.
#[derive(Debug, Default)]
struct Task {
    deposits: Deposits,
    tally: Tally,
    fit: Fit,
}

/// What a thread works with, task after task.
#[derive(Debug, Default)]
struct Bench {
    lows: Vec<u32>,
    shots: Vec<Shot>,
    /// Per shot, in scenes where rays go on at some surfaces.
    passages: Vec<Passage>,
}

/// Where a ray started and what it met.
#[derive(Clone, Copy, Debug)]
struct Shot {
    /// Where it started: a patch, [`SKY`], or a light from [`LIGHTS`] on.
    shooter: u32,
    /// What it met: a patch, [`SKY`] or [`BACK`].
    far: u32,
    /// From the shooter to the far end, unit length.
    direction: DVec3,
    /// Where it started on the shooter; of rays from the sky, the origin.
    point: DVec3,
}

/// What a ray passed.
#[derive(Clone, Copy, Debug)]
struct Passage {
    /// Number of the ray.
    index: u64,
    /// Unit direction in which it arrived.
    direction: DVec3,
    /// Throughput over the probability of going on.
    factor: Rgb,
    /// Probability of having stopped at the far end, and of stopping at the shooter from the other end.
    stops: [f64; 2],
    /// Squared index of refraction at the shooter over that at the far end.
    index_ratio: f64,
}

/// The environment as an end of a ray.
const SKY: u32 = u32::MAX;
/// The absorbing back of a one-sided surface.
const BACK: u32 = u32::MAX - 1;
/// The first light without area: patches have 31 bits.
const LIGHTS: u32 = 1 << 31;

impl Shot {
    fn patch(end: u32) -> Option<PatchId> {
        (end < LIGHTS).then_some(PatchId(end))
    }

    /// The number of a light without area.
    fn light(end: u32) -> Option<usize> {
        (LIGHTS..BACK).contains(&end).then(|| (end - LIGHTS) as usize)
    }
}

impl WaveContext<'_> {
    /// Shoots rays `first .. first + count` of the sequence against `frozen`; what they leave stays in `wave`. Of ranks that
    /// share the wave each shoots every so manyth task. `witness` judges how much a deposit's square matters. Returns sums
    /// over all rays in their order.
    pub(crate) fn shoot(
        &self,
        frozen: &Frozen,
        sobol: &Sobol,
        first: u64,
        count: u64,
        witness: Option<&Witness>,
        wave: &mut Wave,
    ) -> (Tally, Fit) {
        // No rank may change the number of tasks: their sums are added up in floating point.
        let wished = (count / TASK).max((count / SMALLEST_TASK).min(TASKS)).max(1);
        let order = Order::new(sobol, first, count, wished.next_power_of_two() as usize);
        let peers = self.among.sharing(count, self.scene.len());
        let is_mine = |t: usize| peers.is_none_or(|p| t % p.count() == p.rank());
        let tasks = &mut wave.tasks;
        tasks.resize_with(order.tasks(), Task::default);
        tasks.par_iter_mut().enumerate().for_each_init(Bench::default, |bench, (t, task)| {
            (task.tally, task.fit) = Default::default();
            bench.shots.clear();
            bench.passages.clear();
            if is_mine(t) {
                (self.lap)(Stage::Wait);
                self.start(frozen, &order, t, bench, task);
                (self.lap)(Stage::Shoot);
                self.trace(bench);
                (self.lap)(Stage::Trace);
            }
            self.estimate(frozen, bench, witness, task);
            (self.lap)(Stage::Estimate);
        });
        if let Some(peers) = peers {
            exchange::gather(peers, tasks);
        }
        let mut totals = (Tally::default(), Fit::default());
        for task in tasks.iter() {
            totals.0.add_weighted(&task.tally, 1.0);
            totals.1.add(&task.fit);
        }
        totals
    }

    /// Selects patches and shoots: fills `shots` with where the rays of a task start and where they go.
    fn start(&self, frozen: &Frozen, order: &Order, t: usize, bench: &mut Bench, task: &mut Task) {
        let Bench { lows, shots, passages } = bench;
        let passes = self.scene.has_specular();
        order.fill(t, lows);
        (self.lap)(Stage::Order);
        let mut cursor = 0;
        order.each(lows, |index, block| {
            task.tally.rays += 1;
            let Some(shot) = self.shot(frozen, index, block.point(index as u32), &mut cursor) else { return };
            shots.push(shot);
            if passes {
                let direction = shot.direction;
                passages.push(Passage { index, direction, factor: Rgb::WHITE, stops: [1.0; 2], index_ratio: 1.0 });
            }
        });
    }

    /// The ray of point `u`; `None` if its direction fell below the horizon: it carries nothing.
    #[inline]
    fn shot(&self, frozen: &Frozen, index: u64, u: [f64; 5], cursor: &mut usize) -> Option<Shot> {
        let free = |shooter, (point, direction)| Some(Shot { shooter, far: SKY, direction, point });
        let shooter = match frozen.select(u[0], cursor) {
            Choice::Patch(patch) => patch,
            Choice::Sky => return free(SKY, self.scene.environment()?.sample_line([u[1], u[2]], [u[3], u[4]])),
            Choice::Light(k) => {
                let ray = self.scene.lights()[k].sample_ray([u[1], u[2]], [u[3], u[4]]);
                return free(LIGHTS + k as u32, ray);
            }
            Choice::Nothing => return None,
        };
        let n = self.scene.normal(shooter);
        let direction = frozen.sample(shooter, n, [u[3], u[4]])?;
        if n.dot(direction) <= 0.0 {
            return None;
        }
        let mut holes = None;
        let redraw = || holes.get_or_insert_with(|| Stream::new(self.seed, STREAM_HOLES, index)).uniform();
        let point = self.scene.sample_point(shooter, u[1], u[2], redraw);
        Some(Shot { shooter: shooter.0, far: SKY, direction, point })
    }

    fn trace(&self, bench: &mut Bench) {
        if !bench.passages.is_empty() {
            return self.trace_through(bench);
        }
        for shot in &mut bench.shots {
            let hit = match Shot::patch(shot.shooter) {
                Some(shooter) => self.scene.trace_from(shooter, shot.point, shot.direction),
                None => self.scene.trace(shot.point, shot.direction),
            };
            shot.far = match hit {
                Some(hit) => self.scene.patch_of(&hit).map_or(BACK, |p| p.0),
                None => SKY,
            };
        }
    }

    /// Follows rays to where they stop.
    fn trace_through(&self, bench: &mut Bench) {
        for (shot, passage) in bench.shots.iter_mut().zip(&mut bench.passages) {
            let mut random = Stream::new(self.seed, STREAM_PASSING, passage.index);
            let shooter = Shot::patch(shot.shooter);
            let arrival = self.scene.trace_through(shooter, shot.point, shot.direction, || random.uniform());
            let Arrival { end, direction, factor, stop, index_ratio } = arrival;
            shot.far = match end {
                End::Patch(patch) => patch.0,
                End::Back | End::Lost => BACK,
                End::Sky => SKY,
            };
            let other = match shooter {
                Some(shooter) if shot.far != BACK => self.scene.stop_chance(shooter, shot.direction),
                _ => 1.0,
            };
            *passage = Passage { direction, factor, stops: [stop, other], index_ratio, ..*passage };
        }
    }

    /// Turns rays into deposits.
    fn estimate(&self, frozen: &Frozen, bench: &Bench, witness: Option<&Witness>, task: &mut Task) {
        let Bench { shots, passages, .. } = bench;
        let buckets = Buckets::of(self.scene.len());
        let glossy = !self.glossy.patches().is_empty();
        // What part of a deposit is direct light matters only where a picture of a glossy patch is summed.
        let tells_direct = frozen.emits() && self.glossy.is_observed();
        let splits = |patch, far| {
            let lamp = tells_direct && self.glossy.number_of(patch).is_some();
            lamp && (Shot::light(far).is_some() || Shot::patch(far).is_some_and(|far| frozen.is_lamp(far)))
        };
        let targets = |count: &mut dyn FnMut(PatchId)| {
            for shot in shots.iter().filter(|shot| shot.far != BACK) {
                for (end, far) in [(shot.shooter, shot.far), (shot.far, shot.shooter)] {
                    let Some(patch) = Shot::patch(end) else { continue };
                    count(patch);
                    if splits(patch, far) {
                        count(patch);
                    }
                }
            }
        };
        task.deposits.prepare(buckets, glossy, targets);

        let Task { deposits, tally, fit } = task;
        let endpoint = |end: u32, direction: DVec3| match (Shot::patch(end), Shot::light(end)) {
            (Some(patch), _) => frozen.endpoint(patch, direction),
            (None, Some(light)) => frozen.light(light, direction),
            (None, None) => frozen.sky(-direction),
        };
        // From far away they meet outer faces and nothing at all, neither of which is a loss.
        let is_distant = |end: u32| end == SKY || Shot::light(end).is_some_and(|k| self.scene.lights()[k].is_distant());
        for (k, shot) in shots.iter().enumerate() {
            let (arrived, factor, [stop, other_stop], ratio) = match passages.get(k) {
                Some(passage) => (passage.direction, passage.factor, passage.stops, passage.index_ratio),
                None => (shot.direction, Rgb::WHITE, [1.0; 2], 1.0),
            };
            let here = endpoint(shot.shooter, shot.direction).stopping(stop);
            if shot.far == BACK {
                if !is_distant(shot.shooter) {
                    tally.lost += here.radiance * factor / here.density;
                }
                continue;
            }
            if is_distant(shot.shooter) && shot.far == SKY {
                continue;
            }
            let from_light = Shot::light(shot.shooter).is_some();
            let (there, estimator) = match from_light {
                // No ray comes back: whatever the estimator, all of it is the light's.
                true => (Endpoint { radiance: Rgb::BLACK, density: 0.0 }, Estimator::Forward),
                false => (endpoint(shot.far, -arrived).stopping(other_stop), self.estimator),
            };
            let d = transfer(estimator, &here, &there.seen_through(ratio));
            let (on_far, on_shooter) = match passages.is_empty() {
                true => (d.on_hit, d.on_shooter),
                false => (d.on_hit * factor, d.on_shooter * factor),
            };
            // What goes on at a pane is counted where it ends.
            let stays = |end: u32, wi: DVec3, power: Rgb| match Shot::patch(end) {
                Some(patch) if !passages.is_empty() => power * (Rgb::WHITE - self.scene.passed_share(patch, wi)),
                _ => power,
            };
            if shot.far == SKY {
                tally.sky += stays(shot.shooter, shot.direction, on_shooter);
                tally.escaped += on_far;
            } else if is_distant(shot.shooter) {
                tally.sky += stays(shot.far, -arrived, on_far);
                tally.escaped += on_shooter;
            }
            let ends = [
                (shot.far, on_far, shot.shooter, &here, -arrived),
                (shot.shooter, on_shooter, shot.far, &there, shot.direction),
            ];
            for (end, power, far, from, wi) in ends {
                let Some(patch) = Shot::patch(end) else { continue };
                let power = if power.is_finite() {
                    power
                } else {
                    tally.invalid += 1;
                    Rgb::BLACK
                };
                if !passages.is_empty() {
                    // What goes on is in nobody's albedo.
                    tally.absorbed += -(power * self.scene.passed_share(patch, wi));
                }
                let wi = (glossy && self.glossy.number_of(patch).is_some()).then(|| direction::pack(wi));
                deposits.push(buckets, Deposit::new(patch, power, false), wi);
                if splits(patch, far) {
                    let share =
                        Shot::patch(far).map_or(Rgb::WHITE, |far| emitted_share(self.scene, far, from.radiance));
                    let direct = power * share;
                    deposits.push(buckets, Deposit::new(patch, direct, true), wi);
                }
            }
            if let Some(witness) = witness.filter(|_| k % WITNESS == 0) {
                let parts = |end: u32, e: &Endpoint, stop: f64| match Shot::patch(end) {
                    _ if e.density == 0.0 => [0.0; STRATEGIES],
                    Some(patch) => frozen.parts(patch, e.density / stop).map(|p| p * stop),
                    None if Shot::light(end).is_some() => [0.0, 0.0, 0.0, 0.0, 0.0, e.density],
                    None => [0.0, 0.0, 0.0, 0.0, e.density, 0.0],
                };
                let squares = |end: u32, power: Rgb| Shot::patch(end).map_or([0.0; 2], |p| witness.squares(p, power));
                let [a, b] = [squares(shot.far, on_far), squares(shot.shooter, on_shooter)];
                let squares = [a[0] + b[0], a[1] + b[1]];
                fit.observe(
                    squares,
                    here.density + there.density,
                    parts(shot.shooter, &here, stop),
                    parts(shot.far, &there, other_stop),
                );
            }
        }
    }
}

/// The share of a lamp's radiance that is its own emission, per channel.
fn emitted_share(scene: &PatchScene, patch: PatchId, radiance: Rgb) -> Rgb {
    let emitted = scene.emission(patch);
    let share = |e: f64, l: f64| if e > 0.0 && l > 0.0 { e / l } else { 0.0 };
    Rgb::new(share(emitted.r, radiance.r), share(emitted.g, radiance.g), share(emitted.b, radiance.b))
}
