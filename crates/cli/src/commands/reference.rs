//! `twinray reference`: the irradiance of every patch by path tracing, to compare solutions with.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use serde_json::json;
use twinray::format::{self, Method, Provenance, SolutionFile};
use twinray::render::reference::{PatchTracer, Technique};

use crate::args::ReferenceArgs;
use crate::estimate::Work;
use crate::failure::Ending;
use crate::input::{self, Loaded};
use crate::output::{Output, extension};
use crate::progress::{Goal, Progress};
use crate::{commands, interrupt};

/// Paths per patch where the user does not say how long.
const DEFAULT_PATHS: u32 = 256;
/// Paths per patch before an estimated error is believed.
const FIRST_PATHS: u32 = 16;

/// Runs the command.
pub fn run(args: &ReferenceArgs) -> anyhow::Result<Ending> {
    let path = args.output.clone().unwrap_or_else(|| default_output(&args.load.scene));
    if extension(&path) != "twin" {
        bail!("{}: expected a name that ends in .twin", path.display());
    }
    commands::set_threads(args.load.threads);
    interrupt::install();
    let start = Instant::now();
    let loaded = input::load(&args.load, None, &work(args))?;
    let mut output = Output::open(&path)?;
    commands::print_warnings(&loaded.warnings, args.load.quiet);
    if !args.load.quiet {
        crate::say!("{}: {} triangles, {} patches", loaded.name, loaded.patches.triangle_count(), loaded.patches.len());
    }
    let loading = start.elapsed().as_secs_f64();

    let mut tracer = PatchTracer::new(&loaded.patches, args.seed, Technique::Both);
    let (interrupted, tracing) = trace(args, &mut tracer, loaded.patches.len() as u64);
    let solution = solution(args, &loaded, &tracer, path.parent().unwrap_or(Path::new("")));
    output.put(|out| format::write_solution(&solution, out))?;
    report(args, &loaded, &tracer, &path, &solution.provenance, [loading, tracing], interrupted);
    Ok(if interrupted { Ending::Interrupted } else { Ending::Done })
}

/// What is to be done, for the estimate.
fn work(args: &ReferenceArgs) -> Work {
    let ends_by_paths = args.time.is_none() && args.error.is_none();
    let paths = ends_by_paths.then(|| u64::from(args.paths.unwrap_or(DEFAULT_PATHS)));
    Work { trace: Some(paths), writes_solution: true, ..Work::default() }
}

/// Traces, one path per patch at a time, until the goal is reached; says if it was interrupted, and the seconds.
fn trace(args: &ReferenceArgs, tracer: &mut PatchTracer, patches: u64) -> (bool, f64) {
    let goal = match (args.time, args.error) {
        (Some(s), _) => Goal::Seconds(s),
        (_, Some(target)) => Goal::Error(target),
        (None, None) => Goal::Rays(patches * u64::from(args.paths.unwrap_or(DEFAULT_PATHS))),
    };
    let mut progress = Progress::new(goal, args.load.quiet).counting("paths");
    loop {
        tracer.advance(1);
        let n = tracer.paths_per_patch();
        let paths = patches * u64::from(n);
        if progress.wants_update() {
            progress.update(paths, tracer.relative_error());
        }
        let error = || if n < FIRST_PATHS { f64::INFINITY } else { tracer.relative_error() };
        if progress.is_reached(paths, error) || n == u32::MAX || interrupt::requested() {
            break;
        }
    }
    progress.finish();
    (interrupt::requested(), progress.seconds())
}

fn solution(args: &ReferenceArgs, loaded: &Loaded, tracer: &PatchTracer, folder: &Path) -> SolutionFile<'static> {
    SolutionFile {
        provenance: Provenance {
            software: concat!("twinray ", env!("CARGO_PKG_VERSION")).to_owned(),
            method: Method::Reference,
            scene: loaded.name.clone(),
            source: loaded.source_seen_from(folder),
            fingerprint: loaded.patches.fingerprint(),
            rays: loaded.patches.len() as u64 * u64::from(tracer.paths_per_patch()),
            seed: args.seed,
            part: None,
            seeds: vec![args.seed],
            settings: vec![("paths_per_patch".to_owned(), tracer.paths_per_patch().to_string())],
            relative_error: tracer.relative_error() as f32,
        },
        light: tracer.light(),
        record: None,
    }
}

fn report(
    args: &ReferenceArgs,
    loaded: &Loaded,
    tracer: &PatchTracer,
    path: &Path,
    provenance: &Provenance,
    [loading, tracing]: [f64; 2],
    interrupted: bool,
) {
    let (paths, error) = (provenance.rays, tracer.relative_error());
    let fingerprint = format!("{:016x}", provenance.fingerprint);
    let rate = paths as f64 / tracing.max(1e-9);
    if !args.load.quiet {
        crate::say!(
            "{}: {} paths per patch in {tracing:.1} s ({:.2} M/s), estimated error {:.2} %, seed {}, fingerprint {fingerprint}",
            path.display(),
            tracer.paths_per_patch(),
            rate * 1e-6,
            100.0 * error,
            args.seed,
        );
    }
    if args.load.json {
        let report = json!({
            "output": path.display().to_string(),
            "scene": loaded.name, "fingerprint": fingerprint,
            "triangles": loaded.patches.triangle_count(), "patches": loaded.patches.len(),
            "paths_per_patch": tracer.paths_per_patch(), "paths": paths, "seed": args.seed, "interrupted": interrupted,
            "seconds": { "load": loading, "trace": tracing },
            "paths_per_second": rate,
            "relative_error": error,
            "invalid_paths": tracer.invalid(),
            "expected": loaded.expected.json(),
            "warnings": loaded.warnings,
        });
        println!("{report:#}");
    }
}

fn default_output(scene: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    PathBuf::from(format!("{stem}-reference.twin"))
}
