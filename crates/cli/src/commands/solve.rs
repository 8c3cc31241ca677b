//! `twinray solve`: solve a scene, keep the light of its patches.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use serde_json::json;
use twinray::format::{self, Method, Provenance, SolutionFile};

use crate::args::SolutionArgs;
use crate::commands::{self, solving};
use crate::failure::Ending;
use crate::output::{Output, extension};
use crate::{input, interrupt};

/// Runs the command.
pub fn run(args: &SolutionArgs) -> anyhow::Result<Ending> {
    let path = args.output.clone().unwrap_or_else(|| default_output(&args.load.scene));
    if extension(&path) != "twin" {
        bail!("{}: expected a name that ends in .twin", path.display());
    }
    commands::set_threads(args.load.threads);
    interrupt::install();
    let start = Instant::now();
    let loaded = input::load(&args.load, None)?;
    let output = Output::open(&path)?;
    commands::print_warnings(&loaded.warnings, args.load.quiet);
    if !args.load.quiet {
        eprintln!("{}: {} triangles, {} patches", loaded.name, loaded.patches.triangle_count(), loaded.patches.len());
    }
    let loading = start.elapsed().as_secs_f64();

    let solved = solving::solve(&args.solve, &args.load.scene, &loaded, None, args.load.quiet)?;
    let solution = &solved.solution;
    // The same settings give the same bytes: no date, no path, no thread count.
    let provenance = Provenance {
        software: concat!("twinray ", env!("CARGO_PKG_VERSION")).to_owned(),
        method: Method::Solve,
        scene: loaded.name.clone(),
        fingerprint: loaded.patches.fingerprint(),
        rays: solution.rays(),
        seed: args.solve.seed,
        settings: solving::settings(&args.solve, &loaded),
        relative_error: solution.relative_error() as f32,
    };
    let light = solution.patch_light(&loaded.patches);
    let fingerprint = format!("{:016x}", provenance.fingerprint);
    output.write(&format::write_solution(&SolutionFile { provenance, light }))?;

    let balance = solution.balance();
    let mut warnings = loaded.warnings.clone();
    let loss = commands::loss_warning(&balance).map(|w| format!("{}: {w}", args.load.scene));
    commands::print_warnings(loss.as_slice(), args.load.quiet);
    warnings.extend(loss);
    if !args.load.quiet {
        eprintln!("{}", commands::balance_line(&balance));
        eprintln!(
            "{}: {} rays in {:.1} s ({:.2} M/s), estimated error {:.2} %, seed {}, fingerprint {fingerprint}",
            path.display(),
            solution.rays(),
            solved.seconds,
            solved.rate() * 1e-6,
            100.0 * solution.relative_error(),
            args.solve.seed,
        );
    }
    if args.load.json {
        let report = json!({
            "output": path.display().to_string(),
            "scene": loaded.name, "fingerprint": fingerprint,
            "triangles": loaded.patches.triangle_count(), "patches": loaded.patches.len(),
            "rays": solution.rays(), "seed": args.solve.seed, "interrupted": solved.interrupted,
            "seconds": { "load": loading, "solve": solved.seconds },
            "rays_per_second": solved.rate(),
            "relative_error": solution.relative_error(),
            "invalid_deposits": solution.invalid_deposits(),
            "power": commands::balance_json(&balance),
            "warnings": warnings,
        });
        println!("{report:#}");
    }
    Ok(if solved.interrupted { Ending::Interrupted } else { Ending::Done })
}

fn default_output(scene: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    PathBuf::from(format!("{stem}.twin"))
}
