//! `twinray render --path`: many pictures of one solution, along the way of a camera.
//!
//! One light, one exposure, one white balance; noise of its own in every frame, or it would stand still like dirt on the
//! lens. The first frame is the picture that `render` takes from there, to the bit.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use glam::DMat3;
use serde_json::json;
use twinray::render::reference::{PathPictureOptions, PixelTracer, Technique};
use twinray::render::{self, Aovs, Exposure, Gather, GatherOptions, Image, Picture, PictureOptions, WhiteBalance};
use twinray::scene::Camera;
use twinray::scene::sample::Stream;
use twinray::solve::Solution;

use super::render::{Grade, Light, encode, light, lobes, matte_warning, work};
use super::{gather, path, solving};
use crate::args::{FrameRange, MethodArg, Preset, RenderArgs};
use crate::commands;
use crate::denoise::Denoiser;
use crate::display::{self, AovArg, Film};
use crate::failure::Ending;
use crate::input::{self, Loaded};
use crate::interrupt;
use crate::motion::{Motion, Source};
use crate::numbered::Numbered;
use crate::output::{Output, extension};
use crate::progress::{FrameProgress, Goal};
use crate::settings::Settings;
use crate::video::{self, Video};

/// Small pictures along the path that decide exposure and white balance for all of it.
const PROBES: usize = 9;
/// Longer side of such a picture, pixels: automatic exposure takes means over 4×4 of them.
const PROBE_SIDE: u32 = 96;
/// Camera rays per pixel of such a picture.
const PROBE_SAMPLES: u32 = 8;
/// What streams of seeds are for.
const SEEDS: u64 = 0x6672_616d_6573;

/// Runs the command.
pub(super) fn run(args: &RenderArgs, motion: &str) -> anyhow::Result<Ending> {
    let name = args.output.clone().unwrap_or_else(|| default_output(&args.load.scene));
    let is_film = video::is_film(&name);
    if !is_film && !matches!(extension(&name).as_str(), "png" | "exr") {
        bail!(
            "{}: expected frames, such as frames/%04d.png or .exr, or a film that ends in .mp4, .webm or .webp",
            name.display()
        );
    }
    let frame_extension = if is_film { "png".to_owned() } else { extension(&name) };
    let method = args.method();
    args.display.check(method, &frame_extension)?;
    super::render::check(args)?;
    let source = Source::new(motion)?;
    let place = if is_film { Place::Film(Video::open(&name)?) } else { Place::Frames(Numbered::parse(&name)?) };
    let denoiser = display::denoiser(args)?;
    commands::set_threads(args.load.threads);
    interrupt::install();
    let start = Instant::now();
    let view = source.first_view(&args.view);
    let loaded = input::load(&args.load, Some(&view), &work(args))?;
    let motion = Motion::new(args, &loaded, &source)?;
    let range = range(args.motion.frames, motion.count)?;
    let first_camera = motion.camera(args, &loaded, 0)?;
    let film = display::film(args, &first_camera)?;
    // Found writable before the long work starts.
    if let Place::Frames(numbered) = &place {
        drop(Output::open(&numbered.path(range.start))?);
    }
    commands::print_warnings(&loaded.warnings, args.load.quiet);
    if !args.load.quiet {
        crate::say!(
            "{}: {} triangles, {} patches, {} frames at {} per second{}",
            loaded.name,
            loaded.patches.triangle_count(),
            loaded.patches.len(),
            motion.count,
            motion.fps,
            if range.len() < motion.count {
                format!(", of which {} to {}", range.start, range.end - 1)
            } else {
                String::new()
            }
        );
    }
    let loading = start.elapsed().as_secs_f64();

    let Lit { light, seed, preset, how, mut warnings, stopped } = lit(args, &loaded)?;
    let (solving, rate) = light.as_ref().map_or((0.0, 0.0), |l| (l.seconds, l.rate));
    let studio = Studio { args, loaded: &loaded, film, solution: light.as_ref().map(|l| &l.solution), seed, denoiser };
    let start = Instant::now();
    let is_linear = frame_extension == "exr";
    // Half a solve is not the light of the other frames.
    let grade = if stopped { None } else { studio.grade(&motion, is_linear)? };
    let probing = start.elapsed().as_secs_f64();

    let mut progress = FrameProgress::new(range.len(), args.load.quiet);
    let (mut files, mut samples, mut invalid, mut worst) = (Vec::new(), 0.0, 0, 0.0_f64);
    if let Some(grade) = grade {
        for frame in range.clone() {
            let camera = motion.camera(args, &loaded, frame)?;
            let Some(mut shot) = studio.shoot(&camera, frame, |share| progress.update(share))? else { break };
            let how = format!("{how}{}", shot.how(args, preset));
            let (file, output) = place.open(frame)?;
            let bytes = encode(args, &loaded, &mut shot.picture, &shot.layers, grade, &how, &file);
            match output {
                Some(output) => output.write(&bytes)?,
                None => std::fs::write(&file, &bytes)?,
            }
            (samples, invalid, worst) = (samples + shot.samples, invalid + shot.invalid, worst.max(shot.error));
            files.push(file);
            progress.advance();
            if interrupt::requested() {
                break;
            }
        }
    }
    progress.finish();
    let drawing = progress.seconds();
    let start = Instant::now();
    let done = files.len();
    if let Place::Film(video) = place {
        files.clear();
        if done > 0 {
            video.finish(range.start, motion.fps)?;
            files.push(name.clone());
        }
    }
    let filming = start.elapsed().as_secs_f64();

    let dropped = commands::invalid_warning(invalid, "camera rays").map(|w| format!("{}: {w}", args.load.scene));
    commands::print_warnings(dropped.as_slice(), args.load.quiet);
    warnings.extend(dropped);
    let interrupted = done < range.len();
    let mean_samples = samples / done.max(1) as f64;
    let exposure = grade.filter(|_| !is_linear).map(|grade| grade.factor.log2());
    if !args.load.quiet {
        let names = match files.as_slice() {
            [] => name.display().to_string(),
            [file] => file.display().to_string(),
            [first, .., last] => format!("{} to {}", first.display(), last.display()),
        };
        crate::say!(
            "{names}: {done} frame{} in {drawing:.1} s, {mean_samples:.1} camera rays per pixel, seed {seed}{}",
            if done == 1 { "" } else { "s" },
            exposure.map_or_else(String::new, |ev| format!(", exposure {ev:+.2} EV")),
        );
    }
    if interrupted {
        // Said even where all else is silent: without it nobody knows how to go on.
        crate::say!(
            "{done} of {} frames are done; --frames {}..{} makes the rest",
            range.len(),
            range.start + done,
            range.end
        );
    }
    if args.load.json {
        let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        let report = json!({
            "output": name.display().to_string(), "method": word(method), "path": args.motion.path,
            "scene": loaded.name, "camera": first_camera.name,
            "triangles": loaded.patches.triangle_count(), "patches": loaded.patches.len(),
            "frames": { "count": motion.count, "first": range.start, "done": done },
            "fps": motion.fps, "size": [film.size().0, film.size().1], "files": files,
            "rays": light.as_ref().map(|l| l.solution.rays()), "seed": seed, "interrupted": interrupted,
            "seconds": { "load": loading, "solve": solving, "probes": probing, "frames": drawing, "film": filming },
            "rays_per_second": rate,
            "relative_error": light.as_ref().map(|l| l.solution.relative_error()),
            "camera_rays_per_pixel": mean_samples, "largest_picture_error": worst,
            "invalid_camera_rays": invalid,
            "exposure_ev": exposure,
            "expected": loaded.expected.json(),
            "warnings": warnings,
        });
        println!("{report:#}");
    }
    Ok(if interrupted { Ending::Interrupted } else { Ending::Done })
}

/// Where frames go.
enum Place {
    Frames(Numbered),
    Film(Video),
}

impl Place {
    /// The file of a frame, and its way there; frames of a film are written straight into a folder that goes away.
    fn open(&self, frame: usize) -> anyhow::Result<(PathBuf, Option<Output>)> {
        match self {
            Self::Frames(numbered) => {
                let file = numbered.path(frame);
                let output = Output::open(&file)?;
                Ok((file, Some(output)))
            }
            Self::Film(video) => Ok((video.frame(frame), None)),
        }
    }
}

fn default_output(scene: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem().map(|s| s.to_string_lossy().replace('%', "%%")).unwrap_or_default();
    PathBuf::from(format!("{stem}-%04d.png"))
}

fn word(method: MethodArg) -> &'static str {
    match method {
        MethodArg::Gather => "gather",
        MethodArg::Patches => "patches",
        MethodArg::Path => "path",
    }
}

/// The frames that are wanted of those that there are.
fn range(wish: Option<FrameRange>, count: usize) -> anyhow::Result<std::ops::Range<usize>> {
    let FrameRange(from, to) = wish.unwrap_or(FrameRange(0, None));
    let to = to.unwrap_or(count);
    if from >= count || to > count {
        bail!("--frames {from}..{to}: the path has {count} frames; expected a part of 0..{count}");
    }
    Ok(from..to)
}

/// The light of all frames.
struct Lit {
    /// None for paths, which need none.
    light: Option<Light>,
    seed: u64,
    preset: Preset,
    /// How it was made, in words for files.
    how: String,
    warnings: Vec<String>,
    /// Whether a signal ended the solve.
    stopped: bool,
}

fn lit(args: &RenderArgs, loaded: &Loaded) -> anyhow::Result<Lit> {
    let mut warnings = loaded.warnings.clone();
    let patches = loaded.patches.len();
    let goal = match args.method() {
        MethodArg::Path => {
            let seed = args.solve.seed.unwrap_or(1);
            let preset = args.solve.preset.unwrap_or_default();
            return Ok(Lit { light: None, seed, preset, how: String::new(), warnings, stopped: false });
        }
        MethodArg::Gather => Goal::Rays(args.solve.rays.unwrap_or_else(|| solving::rays_for_gather(patches))),
        MethodArg::Patches => solving::goal(&args.solve, patches, None),
    };
    let light = light(args, loaded, None, goal)?;
    let Light { solution, settings, interrupted, .. } = &light;
    warnings.extend(light.tell(args, loaded, matte_warning(args, solution)));
    let Settings { seed, preset, .. } = *settings;
    let how = format!("{} rays, ", solution.rays());
    let stopped = *interrupted;
    Ok(Lit { light: Some(light), seed, preset, how, warnings, stopped })
}

/// All that frames have in common.
struct Studio<'a> {
    args: &'a RenderArgs,
    loaded: &'a Loaded,
    film: Film,
    solution: Option<&'a Solution>,
    seed: u64,
    denoiser: Option<Denoiser>,
}

/// A frame.
struct Shot {
    picture: Picture,
    layers: Aovs,
    /// Camera rays per pixel.
    samples: f64,
    /// Relative error of its pixels, where it is known.
    error: f64,
    invalid: u64,
    seed: u64,
}

impl Shot {
    /// How it was made, in the words that a single picture has.
    fn how(&self, args: &RenderArgs, preset: Preset) -> String {
        let denoised = if args.display.denoise { ", denoised" } else { "" };
        let Self { samples, seed, .. } = self;
        match args.method() {
            MethodArg::Gather => {
                format!("{samples:.1} camera rays per pixel, seed {seed}, preset {preset:?}{denoised}")
            }
            MethodArg::Patches => format!("seed {seed}, preset {preset:?}{denoised}"),
            MethodArg::Path => format!("{samples:.0} paths per pixel, seed {seed}{denoised}"),
        }
    }
}

impl Studio<'_> {
    /// The seed of a frame: that of a single picture for the first one.
    fn seed_of(&self, frame: usize) -> u64 {
        if frame == 0 { self.seed } else { Stream::new(self.seed, SEEDS, frame as u64).bits() }
    }

    /// Takes a frame; `tell` hears how much of it is done. `None` if a signal ended it.
    fn shoot(&self, camera: &Camera, frame: usize, mut tell: impl FnMut(f64)) -> anyhow::Result<Option<Shot>> {
        let (args, loaded, film) = (self.args, self.loaded, &self.film);
        let Film { width, height, crop } = *film;
        let seed = match args.method() {
            MethodArg::Patches => self.seed,
            _ => self.seed_of(frame),
        };
        let wish = args.path.samples;
        let limit = |default: u32| wish.unwrap_or(if args.solve.error.is_some() { u32::MAX } else { default });
        let is_enough = |error: f64| args.solve.error.is_some_and(|limit| error <= limit);
        let mut shot = match (args.method(), self.solution) {
            (MethodArg::Gather, Some(solution)) => {
                let most = limit(gather::DEFAULT_SAMPLES);
                let options = GatherOptions { width, height, crop, seed, adaptive: true };
                let mut gather = Gather::new(&loaded.patches, solution, camera, &options);
                let mut is_done = false;
                gather::advance(&mut gather, most, |gather| {
                    is_done = args.solve.error.is_some() && is_enough(gather::believed_error(gather));
                    tell(if args.solve.error.is_some() { 0.0 } else { gather.samples() / f64::from(most) });
                    is_done
                });
                if !is_done && gather.samples() < f64::from(most) * (1.0 - 1e-9) {
                    return Ok(None);
                }
                let layers = gather::layers(args, loaded, camera, film, &gather);
                let (samples, error, invalid) = (gather.samples(), gather.relative_error(), gather.invalid());
                Shot { picture: gather.picture(), layers, samples, error, invalid, seed }
            }
            (MethodArg::Patches, Some(solution)) => {
                let samples = wish.unwrap_or(super::render::DEFAULT_SAMPLES);
                let options = PictureOptions { width, height, crop, samples, flat: args.flat, lobes: lobes(args) };
                let picture = render::render(&loaded.patches, solution, camera, &options);
                let layers = display::layers(args, loaded, camera, film, samples);
                Shot { picture, layers, samples: f64::from(samples), error: 0.0, invalid: 0, seed }
            }
            _ => {
                let most = limit(path::DEFAULT_SAMPLES);
                let technique = Technique::Both;
                let options = PathPictureOptions { width, height, crop, samples: most, seed, technique };
                let mut tracer = PixelTracer::new(&loaded.patches, camera, &options);
                loop {
                    tracer.advance(1);
                    tell(if args.solve.error.is_some() { 0.0 } else { f64::from(tracer.samples()) / f64::from(most) });
                    let is_told = tracer.samples() >= path::FIRST_SAMPLES;
                    if tracer.samples() >= most || (is_told && is_enough(tracer.relative_error())) {
                        break;
                    }
                    if interrupt::requested() {
                        return Ok(None);
                    }
                }
                let samples = tracer.samples().min(path::MOST_LAYER_SAMPLES);
                let mut layers = display::layers(args, loaded, camera, film, samples);
                if args.display.wants(AovArg::Error) {
                    layers.error = Some(tracer.variance().iter().map(|v| v.sqrt()).collect());
                }
                let (samples, error) = (f64::from(tracer.samples()), tracer.relative_error());
                Shot { picture: tracer.picture(), layers, samples, error, invalid: tracer.invalid(), seed }
            }
        };
        let samples = (shot.samples.ceil() as u32).min(path::MOST_LAYER_SAMPLES);
        display::denoise(self.denoiser.as_ref(), &mut shot.picture, loaded, camera, film, samples)?;
        Ok(Some(shot))
    }

    /// Exposure and white balance of all frames: as the options say, or as small pictures along the whole path ask, whichever
    /// part of it is wanted, so that parts fit together. `None` if a signal ended it.
    fn grade(&self, motion: &Motion, is_linear: bool) -> anyhow::Result<Option<Grade>> {
        let display = &self.args.display;
        let mut all = Picture {
            image: Image { width: 0, height: 1, pixels: Vec::new() },
            lights: Vec::new(),
            log2_luminance: None,
            empty: 0.0,
        };
        let is_asked = display.exposure == Exposure::Auto || display.white_balance == WhiteBalance::Auto;
        if is_linear {
            return Ok(Some(Grade { factor: 1.0, white: DMat3::IDENTITY }));
        }
        if !is_asked {
            return Ok(Some(Grade::of(self.args, &all)));
        }
        let count = PROBES.min(motion.count);
        let mut logs = Vec::new();
        for probe in 0..count {
            // The middles of equal parts: ends are often where a path is least like itself.
            let frame = (2 * probe + 1) * motion.count / (2 * count);
            let camera = motion.camera(self.args, self.loaded, frame)?;
            let picture = self.probe(&camera, self.seed_of(frame));
            all.image.pixels.extend(picture.image.pixels);
            all.lights.extend(picture.lights);
            logs.extend(picture.log2_luminance);
            if interrupt::requested() {
                return Ok(None);
            }
        }
        all.image.width = all.image.pixels.len() as u32;
        all.log2_luminance = (!logs.is_empty()).then(|| logs.iter().sum::<f64>() / logs.len() as f64);
        let grade = Grade::of(self.args, &all);
        if !self.args.load.quiet {
            crate::say!(
                "exposure {:+.2} EV for all frames, by {count} small pictures along the path",
                grade.factor.log2()
            );
        }
        Ok(Some(grade))
    }

    /// A small picture.
    fn probe(&self, camera: &Camera, seed: u64) -> Picture {
        let longer = f64::from(self.film.width.max(self.film.height));
        let side = |pixels: u32| ((f64::from(pixels) * f64::from(PROBE_SIDE) / longer).round() as u32).max(1);
        let (width, height, crop) = (side(self.film.width), side(self.film.height), None);
        let patches = &self.loaded.patches;
        match (self.args.method(), self.solution) {
            (MethodArg::Gather, Some(solution)) => {
                let options = GatherOptions { width, height, crop, seed, adaptive: true };
                let mut gather = Gather::new(patches, solution, camera, &options);
                gather.advance_to(f64::from(PROBE_SAMPLES));
                gather.picture()
            }
            (_, Some(solution)) => {
                let (samples, flat, lobes) = (PROBE_SAMPLES, self.args.flat, lobes(self.args));
                render::render(patches, solution, camera, &PictureOptions { width, height, crop, samples, flat, lobes })
            }
            (_, None) => {
                let (samples, technique) = (PROBE_SAMPLES, Technique::Both);
                let options = PathPictureOptions { width, height, crop, samples, seed, technique };
                let mut tracer = PixelTracer::new(patches, camera, &options);
                tracer.advance(samples);
                tracer.picture()
            }
        }
    }
}
