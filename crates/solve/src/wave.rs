//! A wave: many rays against one frozen state, deposited into sums that no thread order changes.
//!
//! Select → shoot → trace → estimate → deposit, as in the paper; the first four are pure functions of the state
//! and the ray's number. Deposits are integers; statistics are summed in fixed chunks in order; the candidate for
//! a patch's representative is the one of the smallest key, which no order changes either.

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::sample::stream::{mix, to_unit};
use twinray_scene::sample::{Sobol, Stream};
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::fixed::{DepositSums, FixedSums, Units};
use crate::frozen::Frozen;
use crate::glossy::GlossyPatches;
use crate::params::{Estimator, Representation};
use crate::shoot::{Far, shoot};
use crate::tally::Tally;
use crate::transfer::{Endpoint, transfer};

/// Rays of one task: enough to make scheduling free, few enough to share out a small wave.
const CHUNK: u64 = 2048;

/// Purposes of the counter-based streams.
const STREAM_HOLES: u64 = 1;
const STREAM_KEYS: u64 = 2;

/// Deposits of a wave, per patch and per glossy patch. All are A·irradiance, W, or what comes of it.
#[derive(Debug)]
pub struct WaveSums {
    /// Per patch: Σ deposits, their squares, their number.
    pub arrived: DepositSums,
    /// Per glossy patch: Σ deposit · albedo(ω_in).
    pub reflected: FixedSums,
    /// Per glossy patch: Σ deposit · lobe(ω_in, ω_eye), of light straight from emitting patches and of all other.
    pub observed: [FixedSums; 2],
    /// Per glossy patch, first channel: Σ 𝓛(deposit · Δa).
    pub importance: FixedSums,
}

impl WaveSums {
    /// Empty sums.
    pub fn new(patches: usize, glossy: usize) -> Self {
        let sums = FixedSums::new;
        Self {
            arrived: DepositSums::new(patches),
            reflected: sums(glossy),
            observed: [sums(glossy), sums(glossy)],
            importance: sums(glossy),
        }
    }
}

/// A candidate for a glossy patch's representative.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Number of the glossy patch.
    pub glossy: u32,
    /// Exponential variate over importance: the smallest of a wave is drawn in proportion to importance.
    key: f64,
    /// Number of the ray and end, against ties.
    tie: u64,
    /// Deposit over area, W·m⁻².
    pub irradiance: Rgb,
    /// Direction it came from.
    pub wi: DVec3,
    /// 𝓛(irradiance · Δa).
    pub importance: f64,
}

impl Candidate {
    /// Order by key, then by ray.
    pub fn before(&self, other: &Candidate) -> bool {
        (self.key, self.tie) < (other.key, other.tie)
    }
}

/// What all waves of a solve share.
#[derive(Debug)]
pub struct WaveContext<'a> {
    /// The scene.
    pub scene: &'a PatchScene,
    /// Its glossy patches.
    pub glossy: &'a GlossyPatches,
    /// Combination of the two transfers.
    pub estimator: Estimator,
    /// Directional memory.
    pub representation: Representation,
    /// Seed of the streams.
    pub seed: u64,
}

/// Statistics of a wave, and the candidates of its glossy patches (not yet reduced).
#[derive(Debug, Default)]
pub struct WaveResult {
    /// Sums over the wave's rays.
    pub tally: Tally,
    /// In order of rays.
    pub candidates: Vec<Candidate>,
}

impl WaveContext<'_> {
    /// Shoots rays `first .. first + count` of the sequence against `frozen`.
    pub fn run(
        &self,
        frozen: &Frozen,
        sobol: &Sobol,
        first: u64,
        count: u64,
        sums: &WaveSums,
        units: Units,
    ) -> WaveResult {
        let chunks: Vec<WaveResult> = (0..count.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut result = WaveResult::default();
                let start = first + chunk * CHUNK;
                for index in start..(start + CHUNK).min(first + count) {
                    self.ray(frozen, index, sobol.point(index), sums, units, &mut result);
                }
                result
            })
            .collect();
        let mut total = WaveResult::default();
        for chunk in chunks {
            total.tally.add_weighted(&chunk.tally, 1.0);
            total.candidates.extend(chunk.candidates);
        }
        total
    }

    fn ray(&self, frozen: &Frozen, index: u64, u: [f64; 5], sums: &WaveSums, units: Units, result: &mut WaveResult) {
        result.tally.rays += 1;
        let Some(shooter) = frozen.select(u[0]) else {
            return self.sky_ray(frozen, index, u, sums, units, result);
        };
        let outgoing = frozen.outgoing(self.scene, self.glossy, shooter);
        let mut holes = Stream::new(self.seed, STREAM_HOLES, index);
        let Some((direction, far)) =
            shoot(self.scene, shooter, &outgoing, [u[1], u[2]], [u[3], u[4]], || holes.uniform())
        else {
            return;
        };
        let here = outgoing.endpoint(self.scene.normal(shooter), direction);
        match far {
            Far::Patch(hit) => {
                let there = frozen.outgoing(self.scene, self.glossy, hit).endpoint(self.scene.normal(hit), -direction);
                let deposits = transfer(self.estimator, &here, &there);
                let direct = frozen.emitted_share(self.scene, shooter, here.radiance);
                self.deposit(
                    hit,
                    deposits.on_hit,
                    deposits.on_hit * direct,
                    -direction,
                    2 * index,
                    sums,
                    units,
                    result,
                );
                let direct = frozen.emitted_share(self.scene, hit, there.radiance);
                let d = deposits.on_shooter;
                self.deposit(shooter, d, d * direct, direction, 2 * index + 1, sums, units, result);
            }
            Far::Back => result.tally.lost += here.radiance / here.density,
            Far::Sky => {
                let sky = frozen.sky(self.scene, direction);
                let deposits = transfer(self.estimator, &here, &sky);
                result.tally.escaped += deposits.on_hit;
                result.tally.sky += deposits.on_shooter;
                let d = deposits.on_shooter;
                self.deposit(shooter, d, Rgb::BLACK, direction, 2 * index + 1, sums, units, result);
            }
        }
    }

    /// A ray from the environment: what it meets may be an outer face, whose back absorbs without being a loss.
    fn sky_ray(
        &self,
        frozen: &Frozen,
        index: u64,
        u: [f64; 5],
        sums: &WaveSums,
        units: Units,
        result: &mut WaveResult,
    ) {
        let Some(environment) = self.scene.environment() else { return };
        let (origin, direction) = environment.sample_line([u[1], u[2]], [u[3], u[4]]);
        let Some(hit) = self.scene.trace(origin, direction).and_then(|hit| self.scene.patch_of(&hit)) else { return };
        let sky: Endpoint = frozen.sky(self.scene, -direction);
        let there = frozen.outgoing(self.scene, self.glossy, hit).endpoint(self.scene.normal(hit), -direction);
        let deposits = transfer(self.estimator, &sky, &there);
        result.tally.sky += deposits.on_hit;
        result.tally.escaped += deposits.on_shooter;
        self.deposit(hit, deposits.on_hit, Rgb::BLACK, -direction, 2 * index, sums, units, result);
    }

    /// Adds a deposit to all sums of a patch; `direct` is the part of it that comes straight from emission.
    fn deposit(
        &self,
        patch: PatchId,
        deposit: Rgb,
        direct: Rgb,
        wi: DVec3,
        end: u64,
        sums: &WaveSums,
        units: Units,
        result: &mut WaveResult,
    ) {
        if deposit.is_black() {
            return;
        }
        if !deposit.is_finite() {
            result.tally.invalid += 1;
            return;
        }
        sums.arrived.add(patch.index(), deposit, to_unit(mix(self.seed ^ end)), units);
        let area = self.scene.area(patch);
        let n = self.scene.normal(patch);
        let brdf = self.scene.brdf(patch);
        let albedo = brdf.albedo(n.dot(wi));
        result.tally.arrived += deposit;
        result.tally.absorbed += deposit * (Rgb::WHITE - albedo);
        let Some(k) = self.glossy.number_of(patch) else { return };
        sums.reflected.add(k, deposit * albedo, units.deposit);
        if self.representation == Representation::Main {
            return;
        }
        if let Some(eye) = self.glossy.to_eye(k) {
            let lobe = brdf.lobe_eval(n, wi, eye);
            sums.observed[0].add(k, direct * lobe, units.deposit);
            sums.observed[1].add(k, (deposit - direct) * lobe, units.deposit);
        }
        let weight = if self.representation == Representation::Sample { albedo } else { brdf.lobe_albedo(n.dot(wi)) };
        let importance = (deposit * weight).luminance();
        if importance > 0.0 {
            sums.importance.add(k, Rgb::new(importance, 0.0, 0.0), units.deposit);
            let uniform = Stream::new(self.seed, STREAM_KEYS, end).uniform();
            let key = -libm::log(1.0 - uniform) / importance;
            result.candidates.push(Candidate {
                glossy: k as u32,
                key,
                tie: end,
                irradiance: deposit / area,
                wi,
                importance: importance / area,
            });
        }
    }
}
