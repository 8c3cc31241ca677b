//! The solve that several verbs begin with: from settings to a solver that has reached its goal, with progress, and signals
//! that keep what there is.

use anyhow::anyhow;
use twinray::solve::{Observer, Peers, Solver};

use crate::args::SolveArgs;
use crate::estimate::{Rays, Work};
use crate::input::Loaded;
use crate::interrupt;
use crate::progress::{Goal, Progress};
use crate::settings::Settings;

/// Rays per patch where the user does not say.
const DEFAULT_RAYS_PER_PATCH: u64 = 400;

/// A solver that has gone as far as it should.
pub struct Solved<'a> {
    /// It.
    pub solver: Solver<'a>,
    /// Rays that were there before.
    pub before: u64,
    /// Seconds it took.
    pub seconds: f64,
    /// True if a signal ended it.
    pub interrupted: bool,
}

impl Solved<'_> {
    /// Rays per second.
    pub fn rate(&self) -> f64 {
        (self.solver.rays() - self.before) as f64 / self.seconds.max(1e-9)
    }
}

/// Solves until the goal or a signal; `name` is what the user called the scene. A record is gone on from. `look` is called
/// after every wave. With peers, all of whom do the same, a wave's rays are shared.
pub fn solve<'a>(
    (settings, goal): (&Settings, Goal),
    name: &str,
    loaded: &'a Loaded,
    observer: Option<Observer>,
    quiet: bool,
    peers: Option<&'a dyn Peers>,
    mut look: impl FnMut(&Solver, &Progress),
) -> anyhow::Result<Solved<'a>> {
    let mut progress = Progress::new(goal, quiet);
    let mut solver = match &loaded.stored {
        None => {
            Solver::among(&loaded.patches, settings.params(), observer, peers).map_err(|e| anyhow!("{name}: {e}"))?
        }
        Some(stored) => {
            let record = stored.read()?.record().map_err(|e| anyhow!("{e}"))?;
            let record = record.ok_or_else(|| anyhow!("{name}: is a reference; expected a solve to go on with"))?;
            Solver::resume_among(&loaded.patches, settings.params(), &record, peers)
                .map_err(|e| anyhow!("{name}: {e}"))?
        }
    };
    let before = if loaded.stored.is_some() { solver.rays() } else { 0 };
    progress = progress.after(before);
    let limit = if let Goal::Rays(n) = goal { n } else { u64::MAX };
    // The warm start alone is too coarse to be judged: at least one wave is shot.
    let error = |solver: &Solver| if solver.is_new() { f64::INFINITY } else { solver.relative_error() };
    // Clocks and signals may say other things elsewhere: nobody stops alone.
    let any = |yes: bool| peers.map_or(yes, |p| p.any(yes));
    while !any(progress.is_reached(solver.rays(), || error(&solver)) || interrupt::requested()) {
        solver.advance(limit);
        if progress.wants_update() {
            progress.update(solver.rays(), solver.relative_error());
        }
        look(&solver, &progress);
    }
    let interrupted = any(interrupt::requested());
    progress.finish();
    let seconds = progress.seconds();
    Ok(Solved { solver, before, seconds, interrupted })
}

/// What is to be done, for the estimate.
pub fn work(args: &SolveArgs, part: Option<[u32; 2]>) -> Work {
    let parts = part.map_or(1, |[_, n]| u64::from(n));
    let rays = match (args.rays, args.time, args.error) {
        (Some(n), ..) => Rays::Total(n.div_ceil(parts)),
        (None, None, None) => Rays::PerPatch(DEFAULT_RAYS_PER_PATCH.div_ceil(parts)),
        _ => Rays::Unknown,
    };
    Work { solve: Some((Settings::new(args, part).params(), rays)), ..Work::default() }
}

/// How far to go: as the user says, or some rays per patch. A part of several shoots its share of the rays, and leaves its share
/// of the error.
pub fn goal(args: &SolveArgs, patches: usize, part: Option<[u32; 2]>) -> Goal {
    let parts = part.map_or(1, |[_, n]| n);
    match (args.rays, args.time, args.error) {
        (Some(n), ..) => Goal::Rays(n.div_ceil(parts.into())),
        (None, Some(s), _) => Goal::Seconds(s),
        (None, None, Some(e)) => Goal::Error(e * f64::from(parts).sqrt()),
        (None, None, None) => Goal::Rays((DEFAULT_RAYS_PER_PATCH * patches as u64).div_ceil(parts.into())),
    }
}
