//! Every knob of the solver, with its default and its place in the paper; the presets.

use twinray_scene::sample::Stream;

use crate::record::RecordError;
use crate::strategies::Shares;

const STREAM_PART: u64 = 7;

/// How a ray's two transfers are estimated (paper §1 and §2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// Only from the shooter to the hit: L(y)/p(y→x).
    Forward,
    /// Only from the hit back to the shooter: L(x)/p(y→x).
    Backward,
    /// Both, each with half the weight.
    Equal,
    /// Both, each divided by p(y→x) + p(x→y): the balance heuristic of Veach and Guibas.
    Balance,
}

/// What a glossy patch remembers of its directional light (paper §2.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Representation {
    /// The direction-independent main part alone: glossy reflection is lost.
    Main,
    /// One accepted (irradiance, direction) sample alone, reflected by the whole BRDF.
    Sample,
    /// The main part, and one accepted sample reflected by the difference BRDF.
    Both,
    /// As `Both`, but every sample is accepted: the naive baseline, biased.
    Last,
}

/// How iterations are grouped and averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Schedule {
    /// The paper's: `batch` rays against one state, every iteration of equal weight (1/n averages), from the
    /// emission alone. The batch of 1 is the paper itself.
    Paper {
        /// Rays per iteration.
        batch: u64,
    },
    /// Warm start by incremental shooting, then growing waves against a frozen state; the state that rays start
    /// from forgets early waves as n^−q, the output forgets nothing (Polyak-Ruppert averaging).
    Waves,
}

/// Settings of a solve. Results depend on these, the scene and nothing else.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Seed of every random number.
    pub seed: u64,
    /// Combination of the two transfers.
    pub estimator: Estimator,
    /// Directional memory.
    pub representation: Representation,
    /// Grouping and averaging.
    pub schedule: Schedule,
    /// Shares of the strategies by which rays find their starts (waves only); `None` fits them to the scene, epoch by
    /// epoch.
    pub shares: Option<Shares>,
    /// Rays per patch of the warm start (waves only); 0 starts from the emission alone.
    pub warm_start: f64,
}

impl Params {
    /// Our default: asymptotically unbiased in bright closed rooms, where 1/n averages are not.
    pub fn default_preset(seed: u64) -> Self {
        Self {
            seed,
            estimator: Estimator::Balance,
            representation: Representation::Both,
            schedule: Schedule::Waves,
            shares: None,
            warm_start: 4.0,
        }
    }

    /// A seed for part `k` of `n` of a solve with this seed, so that all parts have random numbers of their own.
    pub fn seed_of_part(seed: u64, k: u32, n: u32) -> u64 {
        Stream::new(seed, STREAM_PART, u64::from(n) << 32 | u64::from(k)).bits()
    }

    /// The paper, corrected as `docs/paper.md` explains: one ray per iteration, chosen by power alone.
    pub fn paper_preset(seed: u64) -> Self {
        Self {
            schedule: Schedule::Paper { batch: 1 },
            shares: Some(Shares::POWER),
            warm_start: 0.0,
            ..Self::default_preset(seed)
        }
    }
}

/// Why a solver cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Nothing emits, neither a patch nor a light nor the environment: every picture is black.
    #[error("the scene has no light: expected an emitting material, a light or an environment")]
    NoLight,
    /// A setting out of its range.
    #[error("{name} is {value}; expected {expected}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// What was written down cannot be used.
    #[error("{0}")]
    Record(#[from] RecordError),
    /// The paper's schedule knows no environment.
    #[error(
        "the paper preset selects patches only and cannot shoot from an environment: use the default preset, or light the scene with emitting surfaces"
    )]
    PaperEnvironment,
    /// The paper's schedule knows no lights without area.
    #[error(
        "the paper preset selects patches only and cannot shoot from point, spot and directional lights: use the default preset, or light the scene with emitting surfaces"
    )]
    PaperLights,
    /// Shares that leave lights out, which nothing else finds.
    #[error("the share of lights without area is 0, and the scene has some: expected more than 0")]
    NoShareOfLights,
    /// The paper's schedule goes ray by ray: there is nothing to share out.
    #[error(
        "the paper preset shoots one ray after the other and cannot be shared by processes: use the default preset, or one process"
    )]
    PaperPeers,
    /// Ranks were given different work, and would wait for each other or mix up their light.
    #[error(
        "the processes of this solve differ in their scenes or settings: give all of them the same files and options"
    )]
    PeersDiffer,
}
