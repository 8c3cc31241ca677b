//! `twinray solve`: solve a scene, or go on with a solution file, and keep the light of its patches.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use serde_json::json;
use twinray::format::{self, Method, Provenance, SolutionFile};
use twinray::solve::{Peers, Solver};

use crate::args::SolutionArgs;
use crate::commands::{self, solving};
use crate::estimate::Work;
use crate::failure::Ending;
use crate::input::Loaded;
use crate::output::{Output, extension};
use crate::settings::Settings;
use crate::stored::Stored;
use crate::{input, interrupt, stored};

/// Runs the command.
pub fn run(args: &SolutionArgs, peers: Option<&dyn Peers>) -> anyhow::Result<Ending> {
    // Of several processes the first writes and speaks.
    let leads = peers.is_none_or(|p| p.rank() == 0);
    let (quiet, as_json) = (args.load.quiet || !leads, args.load.json && leads);
    let path = args.output.clone().unwrap_or_else(|| default_output(&args.load.scene));
    if extension(&path) != "twin" {
        bail!("{}: expected a name that ends in .twin", path.display());
    }
    commands::set_threads(args.load.threads);
    interrupt::install();
    let start = Instant::now();
    let work = Work { writes_solution: true, is_silent: !leads, ..solving::work(&args.solve, args.part) };
    let mut loaded = input::load(&args.load, None, &work)?;
    let settings = settings(args, &loaded)?;
    let output = leads.then(|| Output::open(&path)).transpose()?;
    if !args.overwrite {
        spare(&path, &loaded)?;
    }
    let stored = loaded.stored.take();
    commands::print_warnings(&loaded.warnings, quiet);
    if !quiet {
        crate::say!("{}: {} triangles, {} patches", loaded.name, loaded.patches.triangle_count(), loaded.patches.len());
    }
    let loading = start.elapsed().as_secs_f64();

    let mut keeper = Keeper::new(&loaded, settings, &path, output);
    let goal = solving::goal(&args.solve, loaded.patches.len(), settings.part);
    let mut last = Instant::now();
    let mut warnings = loaded.warnings.clone();
    let (mut checkpoints, mut failed) = (0, 0);
    let start_from = solving::Start { settings: &settings, stored, observer: None, peers };
    let solved = solving::solve(start_from, goal, &args.load.scene, &loaded, quiet, |solver, log| {
        if !leads || args.checkpoint.0.is_none_or(|interval| last.elapsed().as_secs_f64() < interval) {
            return;
        }
        match keeper.keep(solver) {
            Ok(error) => {
                checkpoints += 1;
                log.say(&format!("kept {} rays, error ≈ {:.2} %, in {}", solver.rays(), 100.0 * error, path.display()));
            }
            // A full disk may have room again by the end, and what is known is in memory.
            Err(error) => {
                if failed == 0 {
                    warnings.push(format!("no checkpoint: {error:#}"));
                    commands::print_warnings(&warnings[warnings.len() - 1..], quiet);
                }
                failed += 1;
            }
        }
        last = Instant::now();
    })?;
    let solver = &solved.solver;
    let idle = solved.before > 0 && solver.rays() == solved.before;
    let error = keeper.keep(solver).map_err(|error| keeper.rescue(solver, error))?;

    let solution = solver.solution();
    let balance = solution.balance();
    let loss = commands::loss_warning(&balance).map(|w| format!("{}: {w}", args.load.scene));
    commands::print_warnings(loss.as_slice(), quiet);
    warnings.extend(loss);
    let fingerprint = format!("{:016x}", keeper.provenance.fingerprint);
    if !quiet {
        crate::say!("{}", commands::balance_line(&balance));
        if idle && !solved.interrupted {
            crate::say!(
                "{}: had {} rays already and is as good as asked for; --rays, --time or --error says how far to go on",
                args.load.scene,
                solved.before
            );
        }
        let resumed = if solved.before > 0 { format!(", {} before", solved.before) } else { String::new() };
        crate::say!(
            "{}: {} rays{resumed} in {:.1} s ({:.2} M/s), estimated error {:.2} %, seed {}{}, fingerprint {fingerprint}",
            path.display(),
            solver.rays(),
            solved.seconds,
            solved.rate() * 1e-6,
            100.0 * error,
            settings.seed,
            settings.part.map_or(String::new(), |[k, n]| format!(" part {k}/{n}")),
        );
    }
    if as_json {
        let report = json!({
            "output": path.display().to_string(),
            "scene": loaded.name, "fingerprint": fingerprint,
            "triangles": loaded.patches.triangle_count(), "patches": loaded.patches.len(),
            "rays": solver.rays(), "rays_before": solved.before, "seed": settings.seed, "part": settings.part,
            "interrupted": solved.interrupted,
            "checkpoints": checkpoints, "failed_checkpoints": failed,
            "seconds": { "load": loading, "solve": solved.seconds },
            "rays_per_second": solved.rate(),
            "relative_error": error,
            "invalid_deposits": solution.invalid_deposits(),
            "power": commands::balance_json(&balance),
            "expected": loaded.expected.json(),
            "warnings": warnings,
        });
        println!("{report:#}");
    }
    Ok(if solved.interrupted { Ending::Interrupted } else { Ending::Done })
}

/// The settings of the command line, or of the file that is gone on with.
fn settings(args: &SolutionArgs, loaded: &Loaded) -> anyhow::Result<Settings> {
    let Some(stored) = &loaded.stored else { return Ok(Settings::new(&args.solve, args.part)) };
    let name = &args.load.scene;
    let file = stored.read()?;
    if file.provenance().method == Method::Reference {
        bail!("{name}: is a reference, traced by paths; expected a solve to go on with, as `twinray solve` writes it");
    }
    if !file.can_go_on() {
        bail!(
            "{name}: is several solves added up and has no state to go on from: go on with one of them, or solve the scene with another --seed, and merge again"
        );
    }
    if args.part.is_some_and(|part| Some(part) != file.provenance().part) {
        bail!("{name}: was solved with another --part: leave it out to go on");
    }
    Settings::stored(name, file.provenance(), &args.solve)
}

/// Refuses to replace light of the same scene that may have taken long, unless it is what is gone on with.
fn spare(path: &Path, loaded: &Loaded) -> anyhow::Result<()> {
    let same = |a: &Path| std::fs::canonicalize(a).ok();
    let input = loaded.stored.as_ref().and_then(|stored| same(Path::new(stored.name())));
    if !path.is_file() || input.is_some() && input == same(path) {
        return Ok(());
    }
    let name = path.display().to_string();
    // What cannot be read is not worth keeping.
    let Ok(there) = Stored::open(&name) else { return Ok(()) };
    let Ok(file) = there.read() else { return Ok(()) };
    if file.provenance().fingerprint != loaded.patches.fingerprint() {
        return Ok(());
    }
    let rays = file.provenance().rays;
    let go_on = if file.can_go_on() { format!("`twinray solve {name}` goes on with it, ") } else { String::new() };
    bail!("{name}: holds {rays} rays of this scene already: {go_on}-o names another file, --overwrite begins anew")
}

/// Keeps what a solver has in a file.
pub(super) struct Keeper<'a> {
    /// `None` where another process writes.
    output: Option<Output>,
    loaded: &'a Loaded,
    provenance: Provenance,
}

impl<'a> Keeper<'a> {
    pub(super) fn new(loaded: &'a Loaded, settings: Settings, path: &Path, output: Option<Output>) -> Self {
        // A link to a file stays one, and its scene is seen from where the file is.
        let real = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let folder = real.parent().unwrap_or(Path::new("")).to_owned();
        // The same settings give the same bytes: no date, no thread count, no goal.
        let provenance = Provenance {
            software: concat!("twinray ", env!("CARGO_PKG_VERSION")).to_owned(),
            method: Method::Solve,
            scene: loaded.name.clone(),
            source: loaded.source_seen_from(&folder),
            fingerprint: loaded.patches.fingerprint(),
            rays: 0,
            seed: settings.seed,
            part: settings.part,
            seeds: vec![settings.effective_seed()],
            settings: settings.words(),
            relative_error: f32::INFINITY,
        };
        Self { output, loaded, provenance }
    }

    /// Writes it, and says how large the error is.
    pub(super) fn keep(&mut self, solver: &Solver) -> anyhow::Result<f64> {
        let patches = &self.loaded.patches;
        let record = solver.record();
        let area = patches.patches().map(|p| patches.area(p)).collect();
        let emits = patches.patches().map(|p| !patches.emission(p).is_black()).collect();
        let (light, error) = record.light(area, emits);
        // A file that nobody can read must not take the place of a good one.
        let finite = light.irradiance.iter().flatten().all(|x| x.is_finite()) && !error.is_nan();
        let sound = record.check().map_err(|e| e.to_string());
        if let Err(reason) = sound.and(if finite { Ok(()) } else { Err("irradiance beyond all numbers".to_owned()) }) {
            bail!(
                "the solve has come to numbers that a file cannot hold ({reason}): is the scene's light in the unit that it should be?"
            );
        }
        let relative_error = error as f32;
        let provenance = Provenance { rays: record.rays(), relative_error, ..self.provenance.clone() };
        let file = SolutionFile { provenance, light, record: Some(record) };
        if let Some(output) = &mut self.output {
            output.put(|out| format::write_solution(&file, out))?;
        }
        Ok(error)
    }

    /// Keeps what has no room in its own place in the folder for temporary files instead; `error` is why, and is told with
    /// the place.
    pub(super) fn rescue(&mut self, solver: &Solver, error: anyhow::Error) -> anyhow::Error {
        let Some(output) = &self.output else { return error };
        let name = Path::new(output.name()).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let path = std::env::temp_dir().join(format!("{}-{name}", std::process::id()));
        let kept = Output::open(&path).and_then(|output| {
            self.output = Some(output);
            self.keep(solver)
        });
        match kept {
            Ok(_) => error.context(format!("the result is in {} instead; move it where it belongs", path.display())),
            Err(_) => error,
        }
    }
}

fn default_output(scene: &str) -> PathBuf {
    if stored::is_solution(scene) {
        return PathBuf::from(scene);
    }
    let stem = Path::new(scene).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    PathBuf::from(format!("{stem}.twin"))
}
