//! `twinray view`: a walk through a scene in a browser while it is solved, or through the light of a .twin file.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{anyhow, bail};
use serde_json::{Value, json};
use twinray::render::walk::{Nodes, WalkLight};
use twinray::scene::PatchScene;
use twinray::solve::{Solution, Solver};
use twinray_view::feed::Feed;
use twinray_view::light::{self, Behind};
use twinray_view::package::{About, package};
use twinray_view::server::{self, Running, Site};

use crate::args::{SolveArgs, ViewerArgs};
use crate::commands::solve::Keeper;
use crate::commands::{self, solving};
use crate::failure::Ending;
use crate::input::{self, Loaded};
use crate::output::{Output, extension};
use crate::progress::Goal;
use crate::settings::Settings;
use crate::{interrupt, stored};

/// By what rays grow between two lights, and of the time how much they may take: pages are brought what can be seen.
const GROWTH: f64 = 1.15;
const SHARE: f64 = 0.2;
/// Seconds between two lights, and between two messages of samples, at least.
const LIGHT_INTERVAL: f64 = 0.6;
const SAMPLES_INTERVAL: f64 = 0.25;
/// Seconds between two messages of how far the solve is.
const STATUS_INTERVAL: f64 = 0.25;
/// Gathers for the directions of light at glossy places where the light is finished.
pub(super) const FINISHED_ROUNDS: u32 = 8;
/// How long the solver rests before it looks for signals, and the end of all work too.
const REST: Duration = Duration::from_millis(200);

/// Runs the command.
pub fn run(args: &ViewerArgs) -> anyhow::Result<Ending> {
    if let Some(path) = &args.output
        && extension(path) != "twin"
    {
        bail!("{}: expected a name that ends in .twin", path.display());
    }
    let token = match &args.token {
        Some(token) if token.len() < 16 || !token.chars().all(|c| c.is_ascii_alphanumeric()) => {
            bail!("--token {token}: expected at least 16 letters and digits, which nobody guesses")
        }
        Some(token) => token.clone(),
        None => server::token()?,
    };
    commands::set_threads(args.load.threads);
    interrupt::install();
    if args.output.is_none() {
        // What would be written is nothing.
        interrupt::expect();
    }
    let is_stored = stored::is_solution(&args.load.scene);
    if is_stored && (args.solve.rays.is_some() || args.solve.time.is_some() || args.solve.error.is_some()) {
        let name = &args.load.scene;
        bail!(
            "{name}: is solved already, so --rays, --time and --error are not for it: `twinray solve {name}` makes it better"
        );
    }
    if is_stored && args.output.is_some() {
        bail!("{}: is kept already; leave -o out", args.load.scene);
    }
    let work = if is_stored { Default::default() } else { solving::work(&args.solve, None) };
    let loaded = input::load(&args.load, None, &work)?;
    let output = args.output.as_deref().map(Output::open).transpose()?;
    commands::print_warnings(&loaded.warnings, args.load.quiet);
    let nodes = Nodes::new(&loaded.patches);
    let feed = Arc::new(Feed::default());
    let about = About {
        name: &loaded.name,
        cameras: &loaded.cameras,
        live: true,
        unit: args.unit_name.as_str(),
        texture_size: args.texture_size,
    };
    let scene = package(&loaded.patches, &nodes, &about);
    let site = Site { name: loaded.name.clone(), scene, feed: feed.clone() };
    let running = Running::start(site, args.port.unwrap_or(0), token)?;
    announce(args, &loaded, &running.url());
    let mut sender = Sender::new(&loaded.patches, &nodes, &feed);
    match is_stored {
        true => show(args, &loaded, &mut sender)?,
        false => solve(args, &loaded, &mut sender, output)?,
    }
    interrupt::expect();
    while !interrupt::requested() {
        std::thread::sleep(REST);
    }
    Ok(Ending::Done)
}

fn announce(args: &ViewerArgs, loaded: &Loaded, url: &str) {
    if args.load.json {
        // One line, at once: whoever reads it waits for it.
        println!(
            "{}",
            json!({ "url": url, "scene": loaded.name, "patches": loaded.patches.len(), "warnings": loaded.warnings })
        );
    } else {
        println!("{url}");
    }
    if !args.load.quiet {
        crate::say!("{}: open this address in a browser on this machine; Ctrl-C ends", loaded.name);
    }
    if args.open
        && let Err(error) = webbrowser::open(url)
    {
        crate::say!("warning: no browser was opened ({error}); open the address yourself");
    }
}

/// The light of a file.
fn show(args: &ViewerArgs, loaded: &Loaded, sender: &mut Sender) -> anyhow::Result<()> {
    let solution = stored_solution(&args.load.scene, loaded)?;
    sender.light(&solution, 1);
    sender.status("finished", solution.rays(), solution.relative_error(), Value::Null);
    sender.finished(&solution);
    Ok(())
}

/// The solution of a .twin file that was loaded.
pub(super) fn stored_solution(name: &str, loaded: &Loaded) -> anyhow::Result<Solution> {
    let stored = loaded.stored.as_ref().ok_or_else(|| anyhow!("{name}: is no solution"))?;
    let file = stored.read()?;
    let record = file.record().map_err(|e| anyhow!("{e}"))?;
    let record = record.ok_or_else(|| {
        anyhow!("{name}: is a reference, which knows no reflections; expected a solve, as `twinray solve` writes it")
    })?;
    let settings = Settings::stored(name, file.provenance(), &SolveArgs::default())?;
    record.solution(&loaded.patches, &settings.params()).map_err(|e| anyhow!("{name}: {e}"))
}

/// Solves, with light on the way.
fn solve(args: &ViewerArgs, loaded: &Loaded, sender: &mut Sender, output: Option<Output>) -> anyhow::Result<()> {
    let settings = Settings::new(&args.solve, None);
    let goal = solving::goal(&args.solve, loaded.patches.len(), None);
    let told = match goal {
        Goal::Rays(n) => json!({ "rays": n }),
        Goal::Error(e) => json!({ "error": e }),
        Goal::Seconds(s) => json!({ "seconds": s }),
        Goal::First(n, _) => json!({ "rays": n }),
    };
    let start = solving::Start { settings: &settings, stored: None, observer: None, peers: None };
    let solved = solving::solve(start, goal, &args.load.scene, loaded, args.load.quiet, |solver, _| {
        sender.follow(solver, &told);
        while sender.feed.is_paused() && !interrupt::requested() {
            sender.rest(solver, &told);
        }
    })?;
    let solver = &solved.solver;
    if let (Some(path), Some(output)) = (&args.output, output) {
        let mut keeper = Keeper::new(loaded, settings, path, Some(output));
        let error = keeper.keep(solver).map_err(|error| keeper.rescue(solver, error))?;
        crate::say!("{}: {} rays, estimated error {:.2} %", path.display(), solver.rays(), 100.0 * error);
    } else if solved.interrupted && !args.load.quiet {
        crate::say!("{}: the light of {} rays was not kept: -o FILE.twin would keep it", loaded.name, solver.rays());
    }
    if !solved.interrupted {
        let solution = solver.solution();
        sender.finished(&solution);
        sender.status("finished", solver.rays(), solution.relative_error(), told);
    }
    Ok(())
}

/// Makes messages of solutions.
struct Sender<'a> {
    light: WalkLight<'a>,
    feed: &'a Feed,
    start: Instant,
    /// When, after how many rays, and at what cost in seconds, the last one went out.
    last_light: Option<(Instant, u64, f64)>,
    last_samples: Instant,
    last_status: Instant,
    glossy: bool,
    /// Seconds in which the solver rested.
    rested: f64,
}

impl<'a> Sender<'a> {
    fn new(scene: &'a PatchScene, nodes: &'a Nodes, feed: &'a Feed) -> Self {
        let now = Instant::now();
        let light = WalkLight::new(scene, nodes);
        let glossy = nodes.glossy_cells() > 0;
        Self { light, feed, start: now, last_light: None, last_samples: now, last_status: now, glossy, rested: 0.0 }
    }

    /// After a wave: whatever is due.
    fn follow(&mut self, solver: &Solver, goal: &Value) {
        let rays = solver.rays();
        let due = match self.last_light {
            None => true,
            Some((when, before, cost)) => {
                let passed = when.elapsed().as_secs_f64();
                rays as f64 >= GROWTH * before as f64 && passed >= LIGHT_INTERVAL.max(cost / SHARE)
            }
        };
        if due {
            self.light(&solver.solution(), 1);
        } else if self.glossy && self.last_samples.elapsed().as_secs_f64() >= SAMPLES_INTERVAL {
            let solution = solver.solution();
            let behind = Behind { rays, error: solution.relative_error() };
            self.feed.send_samples(light::samples(&self.light.samples(&solution), behind));
            self.last_samples = Instant::now();
        }
        if due || self.last_status.elapsed().as_secs_f64() >= STATUS_INTERVAL {
            self.status("solving", rays, solver.relative_error(), goal.clone());
        }
    }

    /// While a page wants the solver to rest.
    fn rest(&mut self, solver: &Solver, goal: &Value) {
        self.status("paused", solver.rays(), solver.relative_error(), goal.clone());
        let start = Instant::now();
        self.feed.rest(REST);
        self.rested += start.elapsed().as_secs_f64();
    }

    /// The light of a solution that is final. It has no samples: one of each cell is noise, which only many average.
    fn finished(&mut self, solution: &Solution) {
        let light = self.light.of(solution, FINISHED_ROUNDS);
        let behind = Behind { rays: solution.rays(), error: solution.relative_error() };
        self.feed.send_light(light::light(&light, &[], behind));
    }

    /// The light of a solution.
    fn light(&mut self, solution: &Solution, rounds: u32) {
        let start = Instant::now();
        let first = self.last_light.is_none();
        let light = if first { self.light.rough(solution) } else { self.light.of(solution, rounds) };
        let behind = Behind { rays: solution.rays(), error: solution.relative_error() };
        self.feed.send_light(light::light(&light, &self.light.samples(solution), behind));
        self.last_light = Some((Instant::now(), solution.rays(), start.elapsed().as_secs_f64()));
        self.last_samples = Instant::now();
    }

    fn status(&mut self, state: &str, rays: u64, error: f64, goal: Value) {
        let seconds = self.start.elapsed().as_secs_f64() - self.rested;
        self.feed.send_status(json!({
            "state": state, "rays": rays, "rate": rays as f64 / seconds.max(1e-9),
            "error": Some(error).filter(|e| e.is_finite()), "seconds": seconds, "goal": goal,
        }));
        self.last_status = Instant::now();
    }
}

/// Writes a finished walk-through.
pub(super) fn export(
    name: &str,
    path: &Path,
    loaded: &Loaded,
    texture_size: u32,
    unit: &str,
) -> anyhow::Result<Vec<u8>> {
    let solution = stored_solution(name, loaded)?;
    let nodes = Nodes::new(&loaded.patches);
    let about = About { name: &loaded.name, cameras: &loaded.cameras, live: false, unit, texture_size };
    let scene = package(&loaded.patches, &nodes, &about);
    let mut walk = WalkLight::new(&loaded.patches, &nodes);
    let behind = Behind { rays: solution.rays(), error: solution.relative_error() };
    // A single sample of each cell is noise, which only many solutions average.
    let light = light::light(&walk.of(&solution, FINISHED_ROUNDS), &[], behind);
    debug_assert!(path.extension().is_some());
    Ok(twinray_view::page::alone(&loaded.name, &scene, &light).into_bytes())
}
