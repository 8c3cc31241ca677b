//! `twinray render --method gather`: solve, then trace the last bounce, in passes until the picture is good enough.

use std::time::Instant;

use anyhow::bail;
use serde_json::json;
use twinray::render::{Aovs, Gather, GatherOptions};
use twinray::scene::Camera;

use super::path::MOST_LAYER_SAMPLES;
use super::render::{Grade, Light, default_output, encode, light};
use crate::args::RenderArgs;
use crate::commands::{self, solving};
use crate::denoise::Denoiser;
use crate::display::{self, AovArg, Film};
use crate::failure::Ending;
use crate::input::Loaded;
use crate::interrupt;
use crate::output::Output;
use crate::progress::{Goal, Progress};

/// Camera rays per pixel where the user does not say how long.
pub(super) const DEFAULT_SAMPLES: u32 = 64;
/// Camera rays per pixel of the first pass, and before an estimated error is believed.
const FIRST_SAMPLES: f64 = 8.0;
/// By what each pass makes the number of rays grow: plans are made anew, and signals and clocks are heeded, in between.
const GROWTH: f64 = 1.25;
/// Of the time that the user gives, what a solve may take at most.
const SOLVE_SHARE: f64 = 0.3;

/// Refuses settings that would be ignored.
pub(super) fn check(args: &RenderArgs) -> anyhow::Result<()> {
    let patches = [(args.flat, "--flat"), (args.lobes.is_some(), "--lobes")];
    match patches.iter().find(|(given, _)| *given) {
        Some((_, option)) => bail!("{option} is for --method patches"),
        None => Ok(()),
    }
}

/// Solves, gathers, writes and reports.
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
    // --time and --error are the picture's: its solve is as long as it would be without, or a part of the time.
    let patches = loaded.patches.len();
    let goal = match (args.solve.rays, args.solve.time) {
        (None, Some(seconds)) => Goal::First(solving::rays_for_gather(patches), SOLVE_SHARE * seconds),
        (Some(rays), _) => Goal::Rays(rays),
        (None, None) => Goal::Rays(solving::rays_for_gather(patches)),
    };
    let light = light(args, loaded, None, goal)?;
    let mut warnings = loaded.warnings.clone();
    warnings.extend(light.tell(args, loaded, None));
    let Light { solution, settings, seconds, rate, interrupted } = light;
    let balance = solution.balance();

    let Film { width, height, crop } = film;
    let pixels = u64::from(film.size().0) * u64::from(film.size().1);
    // With --samples beside --time or --error, whichever is reached first.
    let left = args.solve.time.map(|s| Goal::Seconds((s - seconds).max(0.0)));
    let until = left.or(args.solve.error.map(Goal::Error));
    let most = args.path.samples.unwrap_or(if until.is_some() { u32::MAX } else { DEFAULT_SAMPLES });
    let goal = until.unwrap_or(Goal::Rays(u64::from(most) * pixels));
    let mut progress = Progress::new(goal, args.load.quiet).counting("camera rays");
    let options = GatherOptions { width, height, crop, seed: settings.seed, adaptive: true };
    let mut gather = Gather::new(&loaded.patches, &solution, camera, &options);
    advance(&mut gather, most, |gather| {
        if progress.wants_update() {
            progress.update(gather.rays(), gather.relative_error());
        }
        progress.is_reached(gather.rays(), || believed_error(gather))
    });
    let interrupted = interrupted || interrupt::requested();
    progress.finish();
    let gathering = progress.seconds();

    let start = Instant::now();
    let mut picture = gather.picture();
    let layers = layers(args, loaded, camera, &film, &gather);
    let samples = (gather.samples().ceil() as u32).min(MOST_LAYER_SAMPLES);
    display::denoise(denoiser.as_ref(), &mut picture, loaded, camera, &film, samples)?;
    let grade = Grade::of(args, &picture);
    let how = format!(
        "{} rays, {:.1} camera rays per pixel, seed {}, preset {:?}{}",
        solution.rays(),
        gather.samples(),
        settings.seed,
        settings.preset,
        if denoiser.is_some() { ", denoised" } else { "" }
    );
    output.write(&encode(args, loaded, &mut picture, &layers, grade, &how, &path))?;
    let drawing = start.elapsed().as_secs_f64();
    let dropped = commands::invalid_warning(gather.invalid(), "camera rays");
    let dropped: Vec<String> = dropped.map(|w| format!("{}: {w}", args.load.scene)).into_iter().collect();
    commands::print_warnings(&dropped, args.load.quiet);
    warnings.extend(dropped);
    let error = gather.relative_error();
    let camera_rate = gather.rays() as f64 / gathering.max(1e-9);
    if !args.load.quiet {
        crate::say!(
            "{}: {:.1} camera rays per pixel in {gathering:.1} s ({:.2} M/s), estimated noise of a pixel {}; exposure {:+.2} EV",
            path.display(),
            gather.samples(),
            camera_rate * 1e-6,
            if error.is_finite() { format!("{:.2} %", 100.0 * error) } else { "unknown".to_owned() },
            grade.factor.log2(),
        );
    }
    if args.load.json {
        let report = json!({
            "output": path.display().to_string(), "method": "gather",
            "scene": loaded.name, "camera": camera.name,
            "triangles": loaded.patches.triangle_count(), "patches": patches,
            "rays": solution.rays(), "seed": settings.seed, "interrupted": interrupted,
            "seconds": { "load": loading, "solve": seconds, "gather": gathering, "picture": drawing },
            "rays_per_second": rate,
            "relative_error": solution.relative_error(),
            "camera_rays_per_pixel": gather.samples(), "camera_rays": gather.rays(),
            "camera_rays_per_second": camera_rate,
            "picture_error": error,
            "invalid_deposits": solution.invalid_deposits(), "invalid_camera_rays": gather.invalid(),
            "power": commands::balance_json(&balance),
            "exposure_ev": grade.factor.log2(),
            "expected": loaded.expected.json(),
            "warnings": warnings,
        });
        println!("{report:#}");
    }
    Ok(if interrupted { Ending::Interrupted } else { Ending::Done })
}

/// Passes until there are `most` camera rays per pixel, it is enough, or a signal ends it.
pub(super) fn advance(gather: &mut Gather, most: u32, mut is_enough: impl FnMut(&Gather) -> bool) {
    loop {
        let next = (gather.samples() * GROWTH).max(FIRST_SAMPLES).min(f64::from(most));
        gather.advance_to(next);
        let is_full = gather.samples() >= f64::from(most) * (1.0 - 1e-9);
        if is_enough(gather) || is_full || interrupt::requested() {
            return;
        }
    }
}

/// The estimated error, once it can be believed.
pub(super) fn believed_error(gather: &Gather) -> f64 {
    if gather.samples() < FIRST_SAMPLES { f64::INFINITY } else { gather.relative_error() }
}

/// The layers that are wanted. Direct light holds what emits and is seen itself, so that it and indirect light add up to
/// the picture.
pub(super) fn layers(args: &RenderArgs, loaded: &Loaded, camera: &Camera, film: &Film, gather: &Gather) -> Aovs {
    let wants = |layer| args.display.wants(layer);
    let samples = (gather.samples().ceil() as u32).min(MOST_LAYER_SAMPLES);
    let mut layers = display::layers(args, loaded, camera, film, samples);
    if wants(AovArg::Direct) {
        layers.direct = Some(gather.direct());
    }
    if wants(AovArg::Indirect) {
        layers.indirect = Some(gather.indirect());
    }
    if wants(AovArg::Error) {
        layers.error = Some(gather.variance().iter().map(|v| v.sqrt()).collect());
    }
    layers
}
