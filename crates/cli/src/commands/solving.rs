//! The solve that several verbs begin with: from arguments to a solution, with progress, and Ctrl-C that keeps it.

use anyhow::anyhow;
use clap::ValueEnum;
use twinray::solve::{Estimator, Observer, Params, Representation, Schedule, Solution, Solver};

use crate::args::{EstimatorArg, Preset, RepresentationArg, SolveArgs};
use crate::input::Loaded;
use crate::interrupt;
use crate::progress::{Goal, Progress};

/// Rays per patch where the user does not say.
const DEFAULT_RAYS_PER_PATCH: u64 = 400;

/// What a solve gave.
#[derive(Debug)]
pub struct Solved {
    /// The light.
    pub solution: Solution,
    /// Seconds it took.
    pub seconds: f64,
    /// True if Ctrl-C ended it.
    pub interrupted: bool,
}

impl Solved {
    /// Rays per second.
    pub fn rate(&self) -> f64 {
        self.solution.rays() as f64 / self.seconds.max(1e-9)
    }
}

/// Solves until the goal of `args` or Ctrl-C; `name` is what the user called the scene.
pub fn solve(
    args: &SolveArgs,
    name: &str,
    loaded: &Loaded,
    observer: Option<Observer>,
    quiet: bool,
) -> anyhow::Result<Solved> {
    let goal = goal(args, loaded.patches.len());
    let mut progress = Progress::new(goal, quiet);
    let mut solver = Solver::new(&loaded.patches, params(args), observer).map_err(|e| anyhow!("{name}: {e}"))?;
    let limit = if let Goal::Rays(n) = goal { n } else { u64::MAX };
    let at_start = solver.rays();
    // The warm start alone is too coarse to be judged: at least one wave is shot.
    let error = |solver: &Solver| if solver.rays() > at_start { solver.relative_error() } else { f64::INFINITY };
    while !progress.is_reached(solver.rays(), || error(&solver)) && !interrupt::requested() {
        solver.advance(limit);
        if progress.wants_update() {
            progress.update(solver.rays(), solver.relative_error());
        }
    }
    let interrupted = interrupt::requested();
    progress.finish();
    let seconds = progress.seconds();
    Ok(Solved { solution: solver.solution(), seconds, interrupted })
}

/// What decides a solution beside scene, rays and seed, in words: pairs for files.
pub fn settings(args: &SolveArgs, loaded: &Loaded) -> Vec<(String, String)> {
    let mut pairs = vec![
        ("preset", word(args.preset)),
        ("estimator", word(args.estimator)),
        ("representation", word(args.representation)),
    ];
    if args.preset == Preset::Paper {
        pairs.push(("batch", args.batch.to_string()));
    }
    pairs.push(("patches", loaded.patches.len().to_string()));
    pairs.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// An option's value as the user writes it.
fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
}

fn goal(args: &SolveArgs, patches: usize) -> Goal {
    match (args.rays, args.time, args.error) {
        (Some(n), ..) => Goal::Rays(n),
        (None, Some(s), _) => Goal::Seconds(s),
        (None, None, Some(e)) => Goal::Error(e),
        (None, None, None) => Goal::Rays(DEFAULT_RAYS_PER_PATCH * patches as u64),
    }
}

fn params(args: &SolveArgs) -> Params {
    let preset = match args.preset {
        Preset::Default => Params::default_preset(args.seed),
        Preset::Paper => Params { schedule: Schedule::Paper { batch: args.batch }, ..Params::paper_preset(args.seed) },
    };
    Params {
        estimator: match args.estimator {
            EstimatorArg::Forward => Estimator::Forward,
            EstimatorArg::Backward => Estimator::Backward,
            EstimatorArg::Equal => Estimator::Equal,
            EstimatorArg::Balance => Estimator::Balance,
        },
        representation: match args.representation {
            RepresentationArg::Main => Representation::Main,
            RepresentationArg::Sample => Representation::Sample,
            RepresentationArg::Both => Representation::Both,
            RepresentationArg::Last => Representation::Last,
        },
        ..preset
    }
}
