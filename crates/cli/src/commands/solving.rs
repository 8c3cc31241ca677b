//! The solve that several verbs begin with: from settings to a solver that has reached its goal, with progress, and signals
//! that keep what there is.

use anyhow::anyhow;
use twinray::solve::{Observer, Peers, Solution, Solver};

use crate::args::SolveArgs;
use crate::estimate::{Rays, Work};
use crate::input::Loaded;
use crate::interrupt;
use crate::progress::{Goal, Progress};
use crate::settings::Settings;
use crate::stored::Stored;

/// Rays per patch where the user does not say.
const DEFAULT_RAYS_PER_PATCH: u64 = 400;

/// The same where the picture gathers once more.
const RAYS_PER_GATHERED_PATCH: u64 = 100;

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

/// What a solve starts from.
pub struct Start<'a, 's> {
    /// Its settings.
    pub settings: &'s Settings,
    /// The file to go on with.
    pub stored: Option<Stored>,
    /// A fixed camera.
    pub observer: Option<Observer>,
    /// Other processes, all of whom do the same and share a wave's rays.
    pub peers: Option<&'a dyn Peers>,
}

/// Solves until the goal or a signal; `name` is what the user called the scene. `look` is called after every wave.
pub fn solve<'a>(
    start: Start<'a, '_>,
    goal: Goal,
    name: &str,
    loaded: &'a Loaded,
    quiet: bool,
    mut look: impl FnMut(&Solver, &mut Progress),
) -> anyhow::Result<Solved<'a>> {
    let Start { settings, stored, observer, peers } = start;
    let mut progress = Progress::new(goal, quiet);
    let mut solver = match &stored {
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
    let before = if stored.is_some() { solver.rays() } else { 0 };
    // Its room on the disk is free once it is replaced.
    drop(stored);
    progress = progress.after(before);
    let limit = if let Goal::Rays(n) | Goal::First(n, _) = goal { n } else { u64::MAX };
    // Clocks and signals may say other things elsewhere: nobody stops alone.
    let any = |yes: bool| peers.map_or(yes, |p| p.any(yes));
    // The warm start alone is too coarse to be judged or kept: at least one wave is shot.
    let done = |solver: &Solver, progress: &Progress| {
        !solver.is_new() && progress.is_reached(solver.rays(), || solver.relative_error())
    };
    while !any(done(&solver, &progress) || interrupt::requested()) {
        solver.advance(limit);
        if progress.wants_update() {
            progress.update(solver.rays(), solver.relative_error());
        }
        look(&solver, &mut progress);
    }
    let interrupted = any(interrupt::requested());
    progress.finish();
    let seconds = progress.seconds();
    Ok(Solved { solver, before, seconds, interrupted })
}

/// The solution of the .twin file that stands for the scene, with the settings that it was made with. `args` may only repeat
/// them.
pub fn stored(name: &str, loaded: &Loaded, args: &SolveArgs) -> anyhow::Result<(Solution, Settings)> {
    let stored = loaded.stored.as_ref().ok_or_else(|| anyhow!("{name}: is no solution; expected a .twin file"))?;
    let file = stored.read()?;
    let record = file.record().map_err(|e| anyhow!("{e}"))?;
    let record = record.ok_or_else(|| {
        anyhow!("{name}: is a reference, which knows no reflections; expected a solve, as `twinray solve` writes it")
    })?;
    let settings = Settings::stored(name, file.provenance(), args)?;
    let solution = record.solution(&loaded.patches, &settings.params()).map_err(|e| anyhow!("{name}: {e}"))?;
    Ok((solution, settings))
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

/// Rays before a final gather where the user does not say: it averages over so many patches that more would not show.
pub fn rays_for_gather(patches: usize) -> u64 {
    RAYS_PER_GATHERED_PATCH * patches as u64
}

/// What is to be done before a final gather, for the estimate.
pub fn work_for_gather(args: &SolveArgs) -> Work {
    let rays = match (args.rays, args.time) {
        (Some(n), _) => Rays::Total(n),
        (None, None) => Rays::PerPatch(RAYS_PER_GATHERED_PATCH),
        _ => Rays::Unknown,
    };
    Work { solve: Some((Settings::new(args, None).params(), rays)), ..Work::default() }
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
