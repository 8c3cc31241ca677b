//! Two replicas of the default schedule: half of the rays each, with random numbers and states of their own.
//!
//! Their mean is the solution. Their difference is its noise, whatever makes it: stratification, light that was noisy
//! before it was sent on, the one remembered sample of a glossy patch. Independence costs a few percent of error,
//! since each half is stratified alone (`docs/paper.md`); nothing else tells a stratified solve's error from within.

use std::borrow::Cow;

use twinray_scene::PatchScene;
use twinray_scene::sample::Stream;

use crate::glossy::GlossyPatches;
use crate::record::{RecordError, RunRecord, WavesRecord};
use crate::solution::Solution;
use crate::strategies::Shares;
use crate::sums::{PatchEvidences, Sums};
use crate::tally::Tally;
use crate::wave::OutputState;
use crate::waves::{Surroundings, Waves, Workspace};

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
        let mut output = OutputState::new(around.scene, around.glossy);
        let runs = [0, 1].map(|k| {
            let (seed, sign) = Self::replica(around, k);
            Waves::new(around, seed, sign, &mut output, &mut workspace)
        });
        Self { runs, output, workspace }
    }

    /// Goes on from what was written down, whose arrays are checked and of this scene.
    pub(crate) fn resume(around: Surroundings, record: &WavesRecord) -> Result<Self, RecordError> {
        let [first, second] = record.runs.as_ref().ok_or(RecordError::Merged)?;
        let run = |k: usize, record: &RunRecord, representatives: &[_]| {
            let (seed, sign) = Self::replica(around, k);
            Waves::resume(around, seed, sign, record, representatives)
        };
        let runs = [run(0, first, &record.representatives)?, run(1, second, &second.representatives)?];
        let mut output = OutputState::new(around.scene, around.glossy);
        if output.unit != record.unit {
            let expected = "the power of two below the power of the scene, W";
            return Err(RecordError::Value { array: "totals", index: Some(1), expected });
        }
        output.deposits.copy_from_slice(&record.deposits);
        let evidence = record.sums().evidence;
        (output.evidence.iter_mut().zip(around.scene.patches())).for_each(|(e, p)| *e = evidence.of(p));
        output.reflected.copy_from_slice(&record.reflected);
        Ok(Self { runs, output, workspace: Workspace::default() })
    }

    /// Seed and sign of a replica.
    fn replica(around: Surroundings, k: usize) -> (u64, f64) {
        (Stream::new(around.params.seed, STREAM_REPLICA, k as u64).bits(), [1.0, -1.0][k])
    }

    /// Writes everything down but what an observer was sent.
    pub(crate) fn record(&self, glossy: &GlossyPatches) -> WavesRecord<'_> {
        let sums = self.sums();
        let [first, mut second] = [0, 1].map(|k| self.runs[k].record());
        second.representatives = Cow::Borrowed(self.runs[1].representatives());
        WavesRecord {
            rays: sums.rays,
            weight: sums.weight,
            tally: sums.tally,
            unit: sums.unit,
            deposits: Cow::Borrowed(sums.deposits),
            squares: self.output.evidence.iter().map(|e| e.squares).collect(),
            difference: self.output.evidence.iter().map(|e| e.difference).collect(),
            hits: self.output.evidence.iter().map(|e| e.hits).collect(),
            glossy: glossy.patches().iter().map(|p| p.0).collect(),
            reflected: Cow::Borrowed(sums.reflected),
            representatives: Cow::Borrowed(sums.representatives),
            runs: Some([first, second]),
        }
    }

    /// True until the first wave of both.
    pub(crate) fn is_new(&self) -> bool {
        self.runs.iter().all(Waves::is_new)
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
        if !around.glossy.patches().is_empty() && self.is_new() {
            self.output.clear();
            self.runs.iter_mut().for_each(Waves::forget_output);
        }
        self.runs.iter_mut().for_each(|run| run.advance(around, &mut self.output, &mut self.workspace));
    }

    pub(crate) fn relative_error(&self, scene: &PatchScene) -> f64 {
        self.sums().relative_error(scene)
    }

    /// The sums of both.
    pub(crate) fn sums(&self) -> Sums<'_> {
        let mut tally = Tally::default();
        self.runs.iter().for_each(|run| tally.add_weighted(run.tally(), 1.0));
        Sums {
            rays: self.rays(),
            weight: self.runs.iter().map(Waves::weight).sum(),
            tally,
            unit: self.output.unit,
            deposits: &self.output.deposits,
            evidence: PatchEvidences::Together(&self.output.evidence),
            reflected: &self.output.reflected,
            observed: &self.output.observed,
            representatives: self.runs[0].representatives(),
        }
    }

    pub(crate) fn solution(&self, around: Surroundings) -> Solution {
        self.sums().solution(around.scene, around.glossy, around.params.representation)
    }
}
