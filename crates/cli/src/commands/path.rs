//! `twinray render --method path`: the picture by path tracing, in passes over all of its pixels.

use std::time::Instant;

use anyhow::bail;
use serde_json::json;
use twinray::render::reference::{PathPictureOptions, PixelTracer, Technique};
use twinray::scene::Camera;

use super::render::{Grade, default_output, encode};
use crate::args::{Preset, RenderArgs};
use crate::denoise::Denoiser;
use crate::display::{self, AovArg, Film};
use crate::failure::Ending;
use crate::input::Loaded;
use crate::interrupt;
use crate::output::Output;
use crate::progress::{Goal, Progress};

/// Paths per pixel where the user does not say how long.
pub(super) const DEFAULT_SAMPLES: u32 = 64;
/// Paths per pixel before an estimated error is believed.
pub(super) const FIRST_SAMPLES: u32 = 16;

/// Samples of a pixel beyond which its layers no longer change to speak of.
pub(super) const MOST_LAYER_SAMPLES: u32 = 64;

/// Refuses settings of the solver, which would be ignored.
pub(super) fn check(args: &RenderArgs) -> anyhow::Result<()> {
    let solver = [
        (args.solve.rays.is_some(), "--rays"),
        (args.solve.preset == Some(Preset::Paper), "--preset paper"),
        (args.flat, "--flat"),
        (args.lobes.is_some(), "--lobes"),
    ];
    match solver.iter().find(|(given, _)| *given) {
        Some((_, option)) => {
            bail!("{option} is for solves; with --method path, expected --samples, --time or --error")
        }
        None => Ok(()),
    }
}

/// Traces, writes and reports.
pub(super) fn run(
    args: &RenderArgs,
    loaded: &Loaded,
    camera: &Camera,
    film: Film,
    denoiser: Option<Denoiser>,
    output: Output,
    loading: f64,
) -> anyhow::Result<Ending> {
    let path = args.output.clone().unwrap_or_else(|| default_output(&args.load.scene));
    let Film { width, height, crop } = film;
    let pixels = u64::from(film.size().0) * u64::from(film.size().1);
    // With --samples beside --time or --error, whichever is reached first.
    let until = args.solve.time.map(Goal::Seconds).or(args.solve.error.map(Goal::Error));
    let most = args.path.samples.unwrap_or(if until.is_some() { u32::MAX } else { DEFAULT_SAMPLES });
    let goal = until.unwrap_or(Goal::Rays(u64::from(most) * pixels));
    let mut progress = Progress::new(goal, args.load.quiet).counting("paths");
    let seed = args.solve.seed.unwrap_or(1);
    let options = PathPictureOptions { width, height, crop, samples: most, seed, technique: Technique::Both };
    let mut tracer = PixelTracer::new(&loaded.patches, camera, &options);
    loop {
        tracer.advance(1);
        let paths = pixels * u64::from(tracer.samples());
        if progress.wants_update() {
            progress.update(paths, tracer.relative_error());
        }
        let error = || if tracer.samples() < FIRST_SAMPLES { f64::INFINITY } else { tracer.relative_error() };
        if progress.is_reached(paths, error) || tracer.samples() >= most || interrupt::requested() {
            break;
        }
    }
    let interrupted = interrupt::requested();
    progress.finish();
    let tracing = progress.seconds();

    let start = Instant::now();
    let mut picture = tracer.picture();
    let samples = tracer.samples().min(MOST_LAYER_SAMPLES);
    let mut layers = display::layers(args, loaded, camera, &film, samples);
    if args.display.wants(AovArg::Error) {
        layers.error = Some(tracer.variance().iter().map(|v| v.sqrt()).collect());
    }
    display::denoise(denoiser.as_ref(), &mut picture, loaded, camera, &film, samples)?;
    let grade = Grade::of(args, &picture);
    let denoised = if denoiser.is_some() { ", denoised" } else { "" };
    let how = format!("{} paths per pixel, seed {seed}{denoised}", tracer.samples());
    output.write(&encode(args, loaded, &mut picture, &layers, grade, &how, &path))?;
    let drawing = start.elapsed().as_secs_f64();

    let paths = pixels * u64::from(tracer.samples());
    let rate = paths as f64 / tracing.max(1e-9);
    let error = tracer.relative_error();
    if !args.load.quiet {
        crate::say!(
            "{}: {} paths per pixel in {tracing:.1} s ({:.2} M/s), estimated error of a pixel {:.2} %, seed {seed}; exposure {:+.2} EV",
            path.display(),
            tracer.samples(),
            rate * 1e-6,
            100.0 * error,
            grade.factor.log2(),
        );
    }
    if args.load.json {
        let report = json!({
            "output": path.display().to_string(), "method": "path",
            "scene": loaded.name, "camera": camera.name,
            "triangles": loaded.patches.triangle_count(), "patches": loaded.patches.len(),
            "paths_per_pixel": tracer.samples(), "paths": paths, "seed": seed, "interrupted": interrupted,
            "seconds": { "load": loading, "trace": tracing, "picture": drawing },
            "paths_per_second": rate,
            "relative_error": error,
            "invalid_paths": tracer.invalid(),
            "exposure_ev": grade.factor.log2(),
            "expected": loaded.expected.json(),
            "warnings": loaded.warnings,
        });
        println!("{report:#}");
    }
    Ok(if interrupted { Ending::Interrupted } else { Ending::Done })
}
