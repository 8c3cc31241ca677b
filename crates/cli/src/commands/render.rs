//! `twinray render`: solve a scene, take a picture, write it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use glam::DMat3;
use serde_json::json;
use twinray::format;
use twinray::render::{self, Aovs, Lobes, Picture, PictureOptions, WhiteBalance};
use twinray::scene::Camera;
use twinray::solve::{Observer, Solution};

use crate::args::{LobesArg, MethodArg, RenderArgs};
use crate::commands::{frames, gather, path, solving};
use crate::display::{self, DEFAULT_HEIGHT, Film};
use crate::estimate::{PictureWork, Work};
use crate::failure::Ending;
use crate::input::{self, Loaded};
use crate::output::{Output, extension};
use crate::progress::Goal;
use crate::settings::Settings;
use crate::{commands, interrupt, stored};

/// Camera rays per pixel where the user does not say.
pub(super) const DEFAULT_SAMPLES: u32 = 16;

/// Runs the command.
pub fn run(args: &RenderArgs) -> anyhow::Result<Ending> {
    if let Some(motion) = &args.motion.path {
        return frames::run(args, motion);
    }
    let path = args.output.clone().unwrap_or_else(|| default_output(&args.load.scene));
    if !matches!(extension(&path).as_str(), "png" | "exr") {
        bail!("{}: expected a name that ends in .png or .exr", path.display());
    }
    let method = args.method();
    args.display.check(method, &extension(&path))?;
    check(args)?;
    let denoiser = display::denoiser(args)?;
    commands::set_threads(args.load.threads);
    interrupt::install();
    let start = Instant::now();
    let loaded = input::load(&args.load, Some(&args.view), &work(args))?;
    let camera = &display::camera(args, &loaded, loaded.camera(args.view.camera.as_deref())?, None)?;
    let film = display::film(args, camera)?;
    let output = Output::open(&path)?;
    commands::print_warnings(&loaded.warnings, args.load.quiet);
    if !args.load.quiet {
        crate::say!("{}: {} triangles, {} patches", loaded.name, loaded.patches.triangle_count(), loaded.patches.len());
    }
    let loading = start.elapsed().as_secs_f64();

    match method {
        MethodArg::Path => return path::run(args, &loaded, camera, film, denoiser, output, loading),
        MethodArg::Gather => return gather::run(args, &loaded, camera, film, denoiser, output, loading),
        MethodArg::Patches => {}
    }
    let goal = solving::goal(&args.solve, loaded.patches.len(), None);
    let Light { solution, settings, seconds, rate, interrupted } = light(args, &loaded, Some(camera), goal)?;

    let start = Instant::now();
    let Film { width, height, crop } = film;
    let samples = args.path.samples.unwrap_or(DEFAULT_SAMPLES);
    let options = PictureOptions { width, height, crop, samples, flat: args.flat, lobes: lobes(args) };
    commands::print_warnings(matte_warning(args, &solution).as_slice(), args.load.quiet);
    let mut picture = render::render(&loaded.patches, &solution, camera, &options);
    let layers = display::layers(args, &loaded, camera, &film, samples);
    display::denoise(denoiser.as_ref(), &mut picture, &loaded, camera, &film, samples)?;
    let grade = Grade::of(args, &picture);
    let mut how = format!("{} rays, seed {}, preset {:?}", solution.rays(), settings.seed, settings.preset);
    how += if denoiser.is_some() { ", denoised" } else { "" };
    output.write(&encode(args, &loaded, &mut picture, &layers, grade, &how, &path))?;
    let drawing = start.elapsed().as_secs_f64();

    let balance = solution.balance();
    let mut warnings = loaded.warnings.clone();
    let loss = commands::loss_warning(&balance).map(|w| format!("{}: {w}", args.load.scene));
    commands::print_warnings(loss.as_slice(), args.load.quiet);
    warnings.extend(loss);
    if !args.load.quiet {
        crate::say!("{}", commands::balance_line(&balance));
        crate::say!(
            "{}: {} rays {} in {seconds:.1} s{}, estimated error {:.2} %, seed {}; picture in {drawing:.1} s, exposure {:+.2} EV",
            path.display(),
            solution.rays(),
            if loaded.stored.is_some() { "read" } else { "shot" },
            if rate > 0.0 { format!(" ({:.2} M/s)", rate * 1e-6) } else { String::new() },
            100.0 * solution.relative_error(),
            settings.seed,
            grade.factor.log2(),
        );
    }
    if args.load.json {
        let report = json!({
            "output": path.display().to_string(), "method": "patches",
            "scene": loaded.name, "camera": camera.name,
            "triangles": loaded.patches.triangle_count(), "patches": loaded.patches.len(),
            "rays": solution.rays(), "seed": settings.seed, "interrupted": interrupted,
            "seconds": { "load": loading, "solve": seconds, "picture": drawing },
            "rays_per_second": rate,
            "relative_error": solution.relative_error(),
            "invalid_deposits": solution.invalid_deposits(),
            "power": commands::balance_json(&balance),
            "exposure_ev": grade.factor.log2(),
            "expected": loaded.expected.json(),
            "warnings": warnings,
        });
        println!("{report:#}");
    }
    Ok(if interrupted { Ending::Interrupted } else { Ending::Done })
}

/// Refuses settings that the method would ignore.
pub(super) fn check(args: &RenderArgs) -> anyhow::Result<()> {
    match args.method() {
        MethodArg::Path => path::check(args),
        MethodArg::Gather => gather::check(args),
        MethodArg::Patches => Ok(()),
    }
}

/// How lobes are shown with --method patches.
pub(super) fn lobes(args: &RenderArgs) -> Lobes {
    match args.lobes {
        None | Some(LobesArg::Traced) => Lobes::Traced,
        Some(LobesArg::Patches) => Lobes::Patches,
    }
}

/// What a picture of patches misses that no camera observed.
pub(super) fn matte_warning(args: &RenderArgs, solution: &Solution) -> Option<String> {
    (!solution.is_observed() && (args.flat || matches!(lobes(args), Lobes::Patches))).then(|| {
        let reason = if args.motion.path.is_some() {
            "a path has no fixed camera: leave them out"
        } else {
            "a file knows no camera: render the scene itself"
        };
        format!("{}: glossy surfaces look matte with --flat and --lobes patches, since {reason}", args.load.scene)
    })
}

/// What makes radiance a picture for a screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grade {
    /// The exposure, on radiance.
    pub factor: f64,
    /// The white balance.
    pub white: DMat3,
}

impl Grade {
    /// As the options say, or as this picture asks.
    pub fn of(args: &RenderArgs, picture: &Picture) -> Self {
        Self { factor: args.display.exposure.factor(picture), white: args.display.white_balance.matrix(picture) }
    }
}

/// The light that the picture is taken of.
pub(super) struct Light {
    pub solution: Solution,
    pub settings: Settings,
    /// Seconds that it took here, and rays per second.
    pub seconds: f64,
    pub rate: f64,
    pub interrupted: bool,
}

impl Light {
    /// Says how the light is, and what is to be warned of: that, and `more`.
    pub(super) fn tell(&self, args: &RenderArgs, loaded: &Loaded, more: Option<String>) -> Vec<String> {
        let Self { solution, settings, seconds, rate, .. } = self;
        let (name, balance) = (&args.load.scene, solution.balance());
        let of_scene =
            [commands::loss_warning(&balance), commands::invalid_warning(solution.invalid_deposits(), "deposits")];
        let remarks: Vec<String> = of_scene.into_iter().flatten().map(|w| format!("{name}: {w}")).chain(more).collect();
        commands::print_warnings(&remarks, args.load.quiet);
        if !args.load.quiet {
            crate::say!("{}", commands::balance_line(&balance));
            crate::say!(
                "{}: {} rays {} in {seconds:.1} s{}, estimated error {:.2} %, seed {}",
                loaded.name,
                solution.rays(),
                if loaded.stored.is_some() { "read" } else { "shot" },
                if *rate > 0.0 { format!(" ({:.2} M/s)", rate * 1e-6) } else { String::new() },
                100.0 * solution.relative_error(),
                settings.seed,
            );
        }
        remarks
    }
}

/// Solves the scene, or takes the light of the solution file that stands for it. A camera is told to the solver where its
/// picture is to be of what patches remember.
pub(super) fn light(args: &RenderArgs, loaded: &Loaded, camera: Option<&Camera>, goal: Goal) -> anyhow::Result<Light> {
    let name = &args.load.scene;
    if loaded.stored.is_none() {
        let settings = Settings::new(&args.solve, None);
        let observer = camera.map(|camera| Observer::new(&loaded.patches, camera));
        let start = solving::Start { settings: &settings, stored: None, observer, peers: None };
        let solved = solving::solve(start, goal, name, loaded, args.load.quiet, |_, _| ())?;
        let (seconds, rate, interrupted) = (solved.seconds, solved.rate(), solved.interrupted);
        return Ok(Light { solution: solved.solver.solution(), settings, seconds, rate, interrupted });
    }
    let is_gather = args.method() == MethodArg::Gather;
    if args.solve.rays.is_some() || (!is_gather && (args.solve.time.is_some() || args.solve.error.is_some())) {
        let those = if is_gather { "--rays is" } else { "--rays, --time and --error are" };
        bail!(
            "{name}: is solved already, so {those} not for it: `twinray solve {name}` makes it better, and pictures then take what is there"
        );
    }
    let start = Instant::now();
    let (solution, settings) = solving::stored(name, loaded, &args.solve)?;
    Ok(Light { solution, settings, seconds: start.elapsed().as_secs_f64(), rate: 0.0, interrupted: false })
}

/// What is to be done, for the estimate.
pub(super) fn work(args: &RenderArgs) -> Work {
    let (is_traced, is_gathered) = (args.method() == MethodArg::Path, args.method() == MethodArg::Gather);
    let samples = args.path.samples.unwrap_or(DEFAULT_SAMPLES);
    let solve = match is_traced || stored::is_solution(&args.load.scene) {
        true => Work::default(),
        false if is_gathered => solving::work_for_gather(&args.solve),
        false => solving::work(&args.solve, None),
    };
    let has_layers = args.display.denoise || !args.display.aov.is_empty();
    let size = args.display.expected_size(args.size);
    Work { picture: Some(PictureWork { size, samples, is_traced, is_gathered, has_layers }), ..solve }
}

pub(super) fn default_output(scene: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    PathBuf::from(format!("{stem}.png"))
}

/// Size of a picture where the user does not say.
pub fn default_size(camera: &Camera) -> (u32, u32) {
    let aspect = camera.aspect.filter(|a| (0.05..=20.0).contains(a)).unwrap_or(4.0 / 3.0);
    ((f64::from(DEFAULT_HEIGHT) * aspect).round() as u32, DEFAULT_HEIGHT)
}

/// The bytes of the picture file; `how` says in words how the picture was made. Light for a screen is balanced in place.
pub(super) fn encode(
    args: &RenderArgs,
    loaded: &Loaded,
    picture: &mut Picture,
    layers: &Aovs,
    grade: Grade,
    how: &str,
    path: &Path,
) -> Vec<u8> {
    let software = concat!("twinray ", env!("CARGO_PKG_VERSION"));
    // The same settings give the same bytes: no date, no path, no thread count.
    let comment = format!("scene {}, {} patches, {how}", loaded.name, loaded.patches.len());
    let text = [("Software", software), ("Comment", comment.as_str())];
    if extension(path) == "exr" {
        let (image, white) = (&picture.image, args.display.white_luminance());
        return format::write_exr_aovs(image.width, image.height, &image.pixels, layers, white, &text);
    }
    WhiteBalance::adapt(grade.white, picture);
    let bytes = render::display::to_srgb8(picture, grade.factor, args.display.curve());
    format::write_png(picture.image.width, picture.image.height, &bytes, &text)
}
