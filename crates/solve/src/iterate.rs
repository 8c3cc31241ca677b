//! The solver: a scene and settings in, solutions out, a wave or a batch of iterations at a time.
//!
//! After [`Solver::new`] succeeds nothing can fail: no file, no clock, no terminal. The caller decides when to
//! stop; where it stops never changes what a given number of rays gives.

use twinray_scene::PatchScene;

use crate::glossy::GlossyPatches;
use crate::observer::Observer;
use crate::params::{Params, Schedule, SolveError};
use crate::peers::{Among, Peers, digest};
use crate::record::{Record, RecordError};
use crate::replicas::Replicas;
use crate::sequential::Sequential;
use crate::solution::Solution;
use crate::stage::Stage;
use crate::strategies::Shares;
use crate::waves::Surroundings;

/// Rays of the paper's schedule between two looks at the clock.
const SEQUENTIAL_STEP: u64 = 1 << 17;

/// A solve in progress.
#[derive(Debug)]
pub struct Solver<'a> {
    scene: &'a PatchScene,
    params: Params,
    glossy: GlossyPatches,
    among: Among<'a>,
    state: State,
}

#[derive(Debug)]
enum State {
    Sequential(Box<Sequential>, u64),
    Waves(Box<Replicas>),
}

impl<'a> Solver<'a> {
    /// Starts a solve; the default schedule's warm start runs here. `observer` is the fixed camera of pictures to
    /// come, if there is one: it changes nothing but what glossy patches remember for it.
    ///
    /// # Errors
    /// If nothing emits, or a setting is out of range.
    pub fn new(scene: &'a PatchScene, params: Params, observer: Option<Observer>) -> Result<Self, SolveError> {
        Self::among(scene, params, observer, None)
    }

    /// Starts a solve that is shared with other processes. Each of them does this with the same scene, settings and observer,
    /// and from then on calls the same methods with the same arguments. All get the bits that one process alone would get.
    ///
    /// # Errors
    /// As [`Solver::new`]; and if the peers were given other work, or the schedule is the paper's, which goes ray by ray.
    pub fn among(
        scene: &'a PatchScene,
        params: Params,
        observer: Option<Observer>,
        peers: Option<&'a dyn Peers>,
    ) -> Result<Self, SolveError> {
        let among = meet(scene, &params, &format!("{observer:?}"), peers)?;
        check(scene, &params)?;
        let glossy = GlossyPatches::new(scene, observer.as_ref());
        let state = match params.schedule {
            Schedule::Paper { batch } => State::Sequential(Box::new(Sequential::new(scene, &glossy)), batch.max(1)),
            Schedule::Waves => {
                let around = Surroundings { scene, glossy: &glossy, params: &params, among, lap: &|_| () };
                State::Waves(Box::new(Replicas::new(around)))
            }
        };
        Ok(Self { scene, params, glossy, among, state })
    }

    /// Goes on from what [`Solver::record`] gave: the same scene and settings then give the same bits as if nothing had come
    /// between, the number of threads being free.
    ///
    /// # Errors
    /// As [`Solver::new`]; and if the record is of another scene or schedule, has no state to go on from, or holds what no
    /// solve gives.
    pub fn resume(scene: &'a PatchScene, params: Params, record: &Record) -> Result<Self, SolveError> {
        Self::resume_among(scene, params, record, None)
    }

    /// [`Solver::resume`] among other processes, all of which go on from the same record. Neither their number nor that of
    /// those who made the record matters.
    ///
    /// # Errors
    /// As [`Solver::resume`] and [`Solver::among`].
    pub fn resume_among(
        scene: &'a PatchScene,
        params: Params,
        record: &Record,
        peers: Option<&'a dyn Peers>,
    ) -> Result<Self, SolveError> {
        let among = meet(scene, &params, &format!("{:016x}", record.digest()), peers)?;
        check(scene, &params)?;
        record.check()?;
        let glossy = GlossyPatches::new(scene, None);
        record.check_belongs(scene, &glossy)?;
        let state = match (params.schedule, record) {
            (Schedule::Waves, Record::Waves(waves)) => {
                let around = Surroundings { scene, glossy: &glossy, params: &params, among, lap: &|_| () };
                State::Waves(Box::new(Replicas::resume(around, waves)?))
            }
            (Schedule::Paper { batch }, Record::Sequential(sequential)) => {
                State::Sequential(Box::new(Sequential::resume(scene, &glossy, sequential)?), batch.max(1))
            }
            (Schedule::Waves, _) => return Err(RecordError::Schedule { expected: "waves" }.into()),
            (Schedule::Paper { .. }, _) => return Err(RecordError::Schedule { expected: "the paper's" }.into()),
        };
        Ok(Self { scene, params, glossy, among, state })
    }

    /// Everything that decides how the solve goes on, but for what an observer was sent. O(K).
    pub fn record(&self) -> Record<'_> {
        match &self.state {
            State::Sequential(s, _) => Record::Sequential(s.record(&self.glossy)),
            State::Waves(w) => Record::Waves(w.record(&self.glossy)),
        }
    }

    /// True before the first wave or iteration: what a warm start alone gives is too coarse to be judged.
    pub fn is_new(&self) -> bool {
        match &self.state {
            State::Sequential(s, _) => s.rays() == 0,
            State::Waves(w) => w.is_new(),
        }
    }

    /// Rays so far, n.
    pub fn rays(&self) -> u64 {
        match &self.state {
            State::Sequential(s, _) => s.rays(),
            State::Waves(w) => w.rays(),
        }
    }

    /// A wave in each replica, or at most `limit − rays()` iterations of the paper's schedule (whole batches).
    pub fn advance(&mut self, limit: u64) {
        self.advance_in_stages(limit, &|_| ());
    }

    /// [`Solver::advance`], told of the end of every stage of a wave on the thread that did it.
    pub fn advance_in_stages(&mut self, limit: u64, lap: &(dyn Fn(Stage) + Sync)) {
        match &mut self.state {
            State::Sequential(s, batch) => {
                let rays = limit.saturating_sub(s.rays()).clamp(1, SEQUENTIAL_STEP.max(*batch));
                s.advance(self.scene, &self.glossy, &self.params, rays, *batch);
            }
            State::Waves(w) => {
                let (scene, glossy, params) = (self.scene, &self.glossy, &self.params);
                w.advance(Surroundings { scene, glossy, params, among: self.among, lap });
            }
        }
    }

    /// Goes on until at least `rays` are shot: waves are whole, so there may be more.
    pub fn run(&mut self, rays: u64) {
        while self.rays() < rays {
            self.advance(rays);
        }
    }

    /// Emitted + reflected power as the paper's tree has it at this iteration, W; `None` for waves.
    pub fn tree_power(&self) -> Option<f64> {
        match &self.state {
            State::Sequential(s, _) => Some(s.power()),
            State::Waves(_) => None,
        }
    }

    /// Shares of the strategies by which rays find their starts at this moment, of the first replica; `None` for the
    /// paper's schedule, which knows one strategy.
    pub fn shares(&self) -> Option<Shares> {
        match &self.state {
            State::Sequential(..) => None,
            State::Waves(w) => Some(w.shares()),
        }
    }

    /// The estimated relative error of the solution so far, as [`Solution::relative_error`]. O(K).
    pub fn relative_error(&self) -> f64 {
        match &self.state {
            State::Sequential(s, _) => s.relative_error(self.scene),
            State::Waves(w) => w.relative_error(self.scene),
        }
    }

    /// A snapshot of the light. O(K).
    pub fn solution(&self) -> Solution {
        match &self.state {
            State::Sequential(s, _) => s.solution(self.scene, &self.glossy, &self.params),
            State::Waves(w) => {
                let (scene, glossy, params) = (self.scene, &self.glossy, &self.params);
                w.solution(Surroundings { scene, glossy, params, among: self.among, lap: &|_| () })
            }
        }
    }
}

/// Makes sure that all peers do the same, and something that can be shared. Done first: whoever failed alone would leave
/// the others waiting.
fn meet<'a>(
    scene: &PatchScene,
    params: &Params,
    start: &str,
    peers: Option<&'a dyn Peers>,
) -> Result<Among<'a>, SolveError> {
    let among = Among::new(peers);
    if among.is_alone() {
        return Ok(among);
    }
    if !among.agree(digest(scene.fingerprint(), &format!("{params:?} {start}"))) {
        return Err(SolveError::PeersDiffer);
    }
    match params.schedule {
        Schedule::Paper { .. } => Err(SolveError::PaperPeers),
        Schedule::Waves => Ok(among),
    }
}

/// What can be wrong with settings, alone or with this scene.
fn check(scene: &PatchScene, params: &Params) -> Result<(), SolveError> {
    if let Some(shares) = params.shares {
        let expected = "at least 0, and all of them 1 together";
        let sum: f64 = shares.to_array().iter().sum();
        if let Some(value) = shares.to_array().into_iter().find(|s| !(0.0..=1.0).contains(s)) {
            return Err(SolveError::Setting { name: "share of a strategy", value, expected });
        }
        if (sum - 1.0).abs() > 1e-9 {
            return Err(SolveError::Setting { name: "sum of the shares", value: sum, expected });
        }
    }
    if !(0.0..=1e6).contains(&params.warm_start) {
        let expected = "0 to 1000000 rays per patch";
        return Err(SolveError::Setting { name: "warm start", value: params.warm_start, expected });
    }
    let sky = scene.environment().is_some_and(|e| e.power().luminance() > 0.0);
    let lights = scene.lights_power().luminance() > 0.0;
    if scene.emitted_power().luminance() <= 0.0 && !sky && !lights {
        return Err(SolveError::NoLight);
    }
    match params.schedule {
        Schedule::Paper { .. } if sky => Err(SolveError::PaperEnvironment),
        Schedule::Paper { .. } if lights => Err(SolveError::PaperLights),
        Schedule::Waves if lights && params.shares.is_some_and(|s| s.points <= 0.0) => Err(SolveError::NoShareOfLights),
        _ => Ok(()),
    }
}
