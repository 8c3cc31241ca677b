//! `twinray view`: a walk through a scene in a browser while it is solved, or through the light of a .twin file.

use std::io::Write;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use serde_json::{Value, json};
use twinray::render::walk::{Nodes, WalkLight};
use twinray::scene::PatchScene;
use twinray::solve::{Solution, Solver};
use twinray_view::feed::Feed;
use twinray_view::light::{self, Behind};
use twinray_view::package::{About, id, package};
use twinray_view::server::{self, Running, Site};

use crate::args::{ExportArgs, SolveArgs, ViewerArgs};
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
const FINISHED_ROUNDS: u32 = 8;
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
    let site = Site { name: loaded.name.clone(), scene: Arc::new(scene), feed: feed.clone() };
    let running = Running::start(site, args.port.unwrap_or(0), token)?;
    announce(args, &loaded, &running.url())?;
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

/// Says where the page is: one line, at once, since whoever reads it waits for it.
fn announce(args: &ViewerArgs, loaded: &Loaded, url: &str) -> anyhow::Result<()> {
    let line = match args.load.json {
        true => {
            let (patches, warnings) = (loaded.patches.len(), &loaded.warnings);
            json!({ "url": url, "scene": loaded.name, "patches": patches, "warnings": warnings }).to_string()
        }
        false => url.to_owned(),
    };
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).context("standard output, which is told the address")?;
    drop(out);
    if !args.load.quiet {
        crate::say!("{}: open this address in a browser on this machine; Ctrl-C ends", loaded.name);
    }
    if args.open
        && let Err(error) = webbrowser::open(url)
    {
        crate::say!("warning: no browser was opened ({error}); open the address yourself");
    }
    Ok(())
}

/// The light of a file.
fn show(args: &ViewerArgs, loaded: &Loaded, sender: &mut Sender) -> anyhow::Result<()> {
    let (solution, _) = solving::stored(&args.load.scene, loaded, &args.solve)?;
    sender.light(&solution, 1);
    sender.finished(&solution, Value::Null);
    Ok(())
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
    let solved = solving::solve(start, goal, &args.load.scene, loaded, args.load.quiet, |solver, progress| {
        sender.follow(solver, progress.seconds(), &told);
        while sender.feed.is_paused() && !interrupt::requested() {
            let start = Instant::now();
            sender.status("paused", solver.rays(), solver.relative_error(), progress.seconds(), told.clone());
            sender.feed.rest(REST);
            progress.rest(start.elapsed());
        }
    })?;
    let solver = &solved.solver;
    if let (Some(path), Some(output)) = (&args.output, output) {
        let mut keeper = Keeper::new(loaded, settings, path, Some(output));
        let error = keeper.keep(solver).map_err(|error| keeper.rescue(solver, error))?;
        if !args.load.quiet {
            crate::say!("{}: {} rays, estimated error {:.2} %", path.display(), solver.rays(), 100.0 * error);
        }
    } else if solved.interrupted && !args.load.quiet {
        crate::say!("{}: the light of {} rays was not kept: -o FILE.twin would keep it", loaded.name, solver.rays());
    }
    if !solved.interrupted {
        sender.seconds = solved.seconds;
        sender.finished(&solver.solution(), told);
    }
    Ok(())
}

/// Makes messages of solutions.
struct Sender<'a> {
    light: WalkLight<'a>,
    /// What it is of.
    id: String,
    feed: &'a Feed,
    /// Seconds of the solve, rests left out.
    seconds: f64,
    /// When, after how many rays, and at what cost in seconds, the last one went out.
    last_light: Option<(Instant, u64, f64)>,
    /// When, and at what cost in seconds.
    last_samples: (Instant, f64),
    last_status: Instant,
    glossy: bool,
}

impl<'a> Sender<'a> {
    fn new(scene: &'a PatchScene, nodes: &'a Nodes, feed: &'a Feed) -> Self {
        let now = Instant::now();
        let (light, id) = (WalkLight::new(scene, nodes), id(scene, nodes));
        let glossy = nodes.glossy_cells() > 0;
        Self { light, id, feed, seconds: 0.0, last_light: None, last_samples: (now, 0.0), last_status: now, glossy }
    }

    /// After a wave: whatever is due.
    fn follow(&mut self, solver: &Solver, seconds: f64, goal: &Value) {
        let (last_samples, cost_of_samples) = self.last_samples;
        let samples_due = last_samples.elapsed().as_secs_f64() >= SAMPLES_INTERVAL.max(cost_of_samples / SHARE);
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
        } else if self.glossy && samples_due {
            let start = Instant::now();
            let solution = solver.solution();
            let samples = light::samples(&self.light.samples(&solution), &self.behind(&solution));
            self.feed.send_samples(samples);
            self.last_samples = (Instant::now(), start.elapsed().as_secs_f64());
        }
        if due || self.last_status.elapsed().as_secs_f64() >= STATUS_INTERVAL {
            self.status("solving", rays, solver.relative_error(), seconds, goal.clone());
        }
    }

    /// The light of a solution that is final. It has no samples: one of each cell is noise, which only many average.
    fn finished(&mut self, solution: &Solution, goal: Value) {
        // There is nothing to pause any more, though the last gather takes its time.
        self.status("finished", solution.rays(), solution.relative_error(), self.seconds, goal);
        let light = self.light.of(solution, FINISHED_ROUNDS);
        self.feed.send_light(light::light(&light, &[], &Behind { is_final: true, ..self.behind(solution) }));
    }

    /// The light of a solution.
    fn light(&mut self, solution: &Solution, rounds: u32) {
        let start = Instant::now();
        let first = self.last_light.is_none();
        let light = if first { self.light.rough(solution) } else { self.light.of(solution, rounds) };
        let bytes = light::light(&light, &self.light.samples(solution), &self.behind(solution));
        self.feed.send_light(bytes);
        self.last_light = Some((Instant::now(), solution.rays(), start.elapsed().as_secs_f64()));
        self.last_samples.0 = Instant::now();
    }

    fn behind(&self, solution: &Solution) -> Behind {
        Behind { id: self.id.clone(), rays: solution.rays(), error: solution.relative_error(), is_final: false }
    }

    fn status(&mut self, state: &str, rays: u64, error: f64, seconds: f64, goal: Value) {
        self.feed.send_status(json!({
            "state": state, "rays": rays, "rate": rays as f64 / seconds.max(1e-9),
            "error": Some(error).filter(|e| e.is_finite()), "seconds": seconds, "goal": goal,
        }));
        self.last_status = Instant::now();
    }
}

/// A finished walk-through as one page.
pub(super) fn export(args: &ExportArgs, loaded: &Loaded) -> anyhow::Result<Vec<u8>> {
    let (solution, _) = solving::stored(&args.load.scene, loaded, &SolveArgs::default())?;
    let nodes = Nodes::new(&loaded.patches);
    let about = About {
        name: &loaded.name,
        cameras: &loaded.cameras,
        live: false,
        unit: args.unit_name.as_str(),
        texture_size: args.texture_size,
    };
    let scene = package(&loaded.patches, &nodes, &about);
    let mut walk = WalkLight::new(&loaded.patches, &nodes);
    let (rays, error) = (solution.rays(), solution.relative_error());
    let behind = Behind { id: id(&loaded.patches, &nodes), rays, error, is_final: true };
    // A single sample of each cell is noise, which only many solutions average.
    let light = light::light(&walk.of(&solution, FINISHED_ROUNDS), &[], &behind);
    Ok(twinray_view::page::alone(&loaded.name, &scene, &light).into_bytes())
}
