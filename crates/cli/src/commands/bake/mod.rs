//! `twinray bake`: from a scene to the same scene with its light in it.

mod asked;
mod document;
mod flavours;
mod kept;
mod probes;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::anyhow;
use serde_json::{Value, json};
use twinray::bake::{
    self, AtlasError, AtlasOptions, Cancelled, Layout, Lightmap, LightmapOptions, Part, Quality, Stage, TexelDensity,
    VertexLight, Watch,
};
use twinray::format::{Lit, LitGlb, LitPage, LitSurface, LitVertex};
use twinray::render::{Exposure, PictureOptions, render};
use twinray::scene::{Rgb, Scene, Side};
use twinray::solve::Solution;

use self::document::Document;
use crate::args::{BakeArgs, CarrierArg, EngineArg, QualityArg};
use crate::commands::{self, solving};
use crate::estimate::Work;
use crate::failure::Ending;
use crate::input::{self, Loaded};
use crate::output::Output;
use crate::progress::FrameProgress;
use crate::settings::Settings;
use crate::{interrupt, stored};

/// The error of the light beyond which the user is warned.
const TOLERATED_ERROR: f64 = 0.1;
/// Rays of a texel, and texels around a chart, where the user does not say.
const TEXEL_RAYS: u32 = 256;
const PADDING: u32 = 2;
/// The share of a page that is used below which the user is warned.
const LITTLE: f64 = 0.1;
/// How far light at vertices may be off before the user is warned.
const COARSE: f64 = 0.25;
/// Side of a page where the user does not say, with a density and without.
const PAGE: [u32; 2] = [2048, 1024];

/// Runs the command.
pub fn run(args: &BakeArgs) -> anyhow::Result<Ending> {
    let name = args.load.scene.as_str();
    let quiet = args.load.quiet;
    let carrier = args.to.unwrap_or_default();
    let path = args.output.clone().unwrap_or_else(|| asked::default_output(name, carrier, args.engine));
    asked::check(args, carrier, &path)?;
    commands::set_threads(args.load.threads);
    interrupt::install();
    let start = Instant::now();
    let is_stored = stored::is_solution(name);
    let work = if is_stored { Work::default() } else { solving::work(&args.solve, None) };
    let load = asked::with_cells(args)?;
    let mut loaded = input::load(load.as_ref().unwrap_or(&args.load), None, &Work { keeps_scene: true, ..work })?;
    let Some(scene) = loaded.scene.take() else { unreachable!("it was asked for") };
    asked::check_scene(args, &loaded, &path)?;
    let mut output = Output::open(&path)?;
    if let Some(first) =
        flavours::first_beside(args.engine.unwrap_or_default(), &path).filter(|_| carrier == CarrierArg::Lightmap)
    {
        drop(Output::open(&first)?);
    }
    let mut warnings = loaded.warnings.clone();
    let mut warn = |new: Vec<String>| {
        commands::print_warnings(&new, quiet);
        warnings.extend(new);
    };
    commands::print_warnings(&loaded.warnings, quiet);
    if carrier == CarrierArg::Vertex && matches!(args.engine, Some(EngineArg::Bevy | EngineArg::Godot)) {
        warn(vec!["--for makes no difference to light at vertices: all engines get the same".to_owned()]);
    }
    let document = match carrier {
        CarrierArg::Probes => None,
        _ => Some(Document::of(&loaded, &scene, &args.load.read)?),
    };

    let mut light = None;
    let (solution, settings) = if is_stored {
        solving::stored(name, &loaded, &args.solve)?
    } else {
        let settings = Settings::new(&args.solve, None);
        let goal = solving::goal(&args.solve, loaded.patches.len(), None);
        let from = solving::Start { settings: &settings, stored: None, observer: None, peers: None };
        let solved = solving::solve(from, goal, name, &loaded, quiet, |_, _| {})?;
        (light.insert(kept::Light { solved, settings }).solved.solver.solution(), settings)
    };
    warn(commands::loss_warning(&solution.balance()).map(|w| format!("{name}: {w}")).into_iter().collect());
    let error = solution.relative_error();
    if error > TOLERATED_ERROR {
        let better =
            if is_stored { format!("`twinray solve {name}` makes it") } else { "--rays or --error asks for".into() };
        warn(vec![format!("{name}: the light is known to {:.0} % only: {better} better", 100.0 * error)]);
    }
    let solving_seconds = start.elapsed().as_secs_f64();
    let interrupted = light.as_ref().is_some_and(|l| l.solved.interrupted);
    if interrupted {
        interrupt::answered();
    }
    interrupt::say_instead(Some(kept::SAYS[usize::from(is_stored)]));
    if interrupted && !quiet {
        crate::say!("baking what there is; the next signal keeps the light in a .twin file instead");
    }

    let seed = settings.seed;
    let job = Job { args, carrier, loaded: &loaded, scene: &scene, solution: &solution, document, seed, path: &path };
    let mut progress = FrameProgress::new(1, quiet).counting("baking");
    let mut watch = |stage: Stage, share: f64| {
        if !matches!(stage, Stage::Atlas | Stage::Seams) {
            progress.update(share);
        }
        if interrupt::requested() { Err(Cancelled) } else { Ok(()) }
    };
    let finished = job.bake(&mut watch).and_then(|finished| {
        // All places are there before the first is filled.
        let places = finished.files.iter().map(|(path, _)| Output::open(path)).collect::<anyhow::Result<Vec<_>>>()?;
        for (place, (_, bytes)) in places.into_iter().zip(&finished.files) {
            place.write(bytes)?;
        }
        output.put(|out| out.write_all(&finished.bytes))?;
        Ok(finished)
    });
    progress.finish();
    let Finished { bytes, files, about, words, warnings: new } = match finished {
        Ok(finished) => finished,
        Err(reason) => {
            drop(output);
            return kept::end(reason, light.as_ref(), &loaded, &path, &args.load);
        }
    };
    warn(new);
    if carrier == CarrierArg::Lightmap {
        warn(flavours::left_over(&path, &files).into_iter().collect());
    }
    if interrupt::requested() {
        crate::say!("it was done before it could be stopped, and is written");
    }

    if !quiet {
        words.iter().for_each(|line| crate::say!("{line}"));
        let beside = match files.len() {
            0 => String::new(),
            1 => " and a file beside it".to_owned(),
            n => format!(" and {n} files beside it"),
        };
        crate::say!(
            "{}: {:.2} MB{beside}, {} rays, estimated error {:.2} %, {:.1} s to solve and {:.1} s to bake",
            path.display(),
            bytes.len() as f64 * 1e-6,
            solution.rays(),
            100.0 * error,
            solving_seconds,
            start.elapsed().as_secs_f64() - solving_seconds
        );
    }
    if args.load.json {
        let files: Vec<String> = files.iter().map(|(p, _)| p.display().to_string()).collect();
        let report = json!({
            "output": path.display().to_string(), "bytes": bytes.len(), "files": files,
            "patches": loaded.patches.len(), "interrupted": interrupted,
            "seconds": { "solve": solving_seconds, "all": start.elapsed().as_secs_f64() },
            "bake": about, "warnings": warnings,
        });
        println!("{report:#}");
    }
    Ok(if interrupted { Ending::Interrupted } else { Ending::Done })
}

/// What goes into the document, and beside it.
struct Baked {
    surfaces: Vec<LitSurface>,
    pages: Vec<LitPage>,
    files: Vec<(PathBuf, Vec<u8>)>,
    /// For the report.
    facts: Value,
    words: Vec<String>,
    warnings: Vec<String>,
}

/// What is baked into what.
struct Job<'a> {
    args: &'a BakeArgs,
    carrier: CarrierArg,
    loaded: &'a Loaded,
    scene: &'a Scene,
    solution: &'a Solution,
    /// `None` for probes.
    document: Option<Document>,
    /// Of the solve.
    seed: u64,
    path: &'a Path,
}

/// All that is to be written and said.
struct Finished {
    bytes: Vec<u8>,
    files: Vec<(PathBuf, Vec<u8>)>,
    about: Value,
    words: Vec<String>,
    warnings: Vec<String>,
}

impl Job<'_> {
    fn bake(&self, watch: &mut Watch<'_>) -> anyhow::Result<Finished> {
        let Self { args, loaded, solution, path, .. } = *self;
        let Some(document) = &self.document else {
            let (bytes, facts, line) = probes::bake(args, loaded, solution, self.seed, path, watch)?;
            let about = self.about(&facts);
            return Ok(Finished { bytes, files: Vec::new(), about, words: vec![line], warnings: Vec::new() });
        };
        let baked = self.surfaces(watch).map_err(|e| match e {
            AtlasError::Cancelled(stopped) => anyhow::Error::new(stopped),
            other => anyhow!("{}: {other}", args.load.scene),
        })?;
        let Baked { surfaces, pages, files, facts, words, warnings: mut told } = baked;
        let about = self.about(&facts);
        let lit = Lit { surfaces, pages, drop_lights: !args.keep_lights, about: about.clone() };
        let LitGlb { bytes, warnings } = document.lit(&lit, &args.load.read)?;
        told.extend(warnings.iter().map(ToString::to_string));
        Ok(Finished { bytes, files, about, words, warnings: told })
    }

    fn surfaces(&self, watch: &mut Watch<'_>) -> Result<Baked, AtlasError> {
        let Self { args, loaded, scene, solution, .. } = *self;
        let quality = match args.quality.unwrap_or_default() {
            QualityArg::Cells => Quality::Cells,
            QualityArg::Smooth => Quality::Smooth,
            QualityArg::High => Quality::Gathered(args.texel_rays.unwrap_or(TEXEL_RAYS)),
        };
        if self.carrier == CarrierArg::Vertex {
            return Ok(of_vertices(&bake::bake_vertices(scene, &loaded.patches, solution, quality, self.seed, watch)?));
        }
        let density = args.density.map_or(TexelDensity::OnePage, TexelDensity::PerMetre);
        let page_size = args.page_size.unwrap_or(PAGE[usize::from(args.density.is_none())]);
        let padding = args.padding.unwrap_or(PADDING);
        let atlas = AtlasOptions { density, page_size, padding, keep_authored: !args.unwrap };
        let options = LightmapOptions { atlas, quality, stitch: !args.no_stitch, seed: self.seed };
        let map = bake::bake(scene, &loaded.patches, solution, &options, watch)?;
        let mut baked = of_lightmap(&map);
        match args.engine.unwrap_or_default() {
            EngineArg::Unlit => {
                let colours = bake::colours(&loaded.patches, &map, padding, watch)?;
                baked.pages = flavours::unlit(&colours, exposure(args, loaded, solution));
            }
            engine => {
                let dressed = flavours::lightmaps(&map, engine, self.path);
                (baked.pages, baked.files) = (dressed.pages, dressed.files);
            }
        }
        Ok(baked)
    }

    /// What the document is told of its light.
    fn about(&self, layout: &Value) -> Value {
        let Self { loaded, scene, solution, seed, .. } = *self;
        let emitters: Vec<&str> =
            scene.materials.iter().filter(|m| m.emission != Rgb::BLACK).map(|m| m.name.as_str()).collect();
        let lights: Vec<&str> = scene.lights.iter().map(|l| l.name.as_str()).collect();
        json!({
            "generator": concat!("twinray ", env!("CARGO_PKG_VERSION")),
            "quantity": "irradiance", "unit": "as the scene has it: lux where its radiance is in nit",
            "lights": { "materials": emitters, "punctual": lights, "sky": scene.environment.is_some() },
            "rays": solution.rays(), "relative_error": Some(solution.relative_error()).filter(|e| e.is_finite()),
            "seed": seed, "fingerprint": format!("{:016x}", loaded.patches.fingerprint()),
            "layout": layout,
        })
    }
}

/// The factor of pictures: what `--exposure` says, or that of a picture from the scene's first camera.
fn exposure(args: &BakeArgs, loaded: &Loaded, solution: &Solution) -> f64 {
    let exposure = args.exposure.map_or(Exposure::Auto, Exposure::Stops);
    let options = PictureOptions { width: 64, height: 48, ..PictureOptions::default() };
    let seen = loaded.cameras.first().map(|camera| render(&loaded.patches, solution, camera, &options));
    seen.map_or(1.0, |picture| exposure.factor(&picture))
}

fn of_lightmap(map: &Lightmap) -> Baked {
    let mut surfaces = Vec::new();
    for (part, laid) in map.parts.iter().zip(&map.atlas.parts) {
        // One surface for each page that it lies on.
        let mut pages: Vec<u32> = laid.pages.clone();
        pages.sort_unstable();
        pages.dedup();
        for page in pages {
            let mut number = vec![u32::MAX; laid.vertices.len()];
            let mut surface = of_part(part, Some(page as usize));
            for (corners, _) in laid.triangles.iter().zip(&laid.pages).filter(|(_, p)| **p == page) {
                let triangle = corners.map(|k| {
                    let slot = &mut number[k as usize];
                    if *slot == u32::MAX {
                        *slot = surface.vertices.len() as u32;
                        let v = laid.vertices[k as usize];
                        surface.vertices.push(LitVertex { source: v.source, texcoord: Some(v.uv), irradiance: None });
                    }
                    *slot
                });
                surface.triangles.push(part.drawn(triangle));
            }
            surfaces.push(surface);
        }
    }
    let atlas = &map.atlas;
    let mut warnings = Vec::new();
    if atlas.utilization < LITTLE {
        warnings.push(format!(
            "{:.0} % of the page carries light, since charts keep their distance: --density, a larger --page-size or fewer charts make it sharper",
            100.0 * atlas.utilization
        ));
    }
    let (source, mut words) = match &atlas.layout {
        Layout::Authored => ("authored", vec!["texture coordinates: the second set of the scene, as it is".to_owned()]),
        Layout::Unwrapped { kept, fault } => {
            let why = fault.map_or(String::new(), |f| format!(": of the second set of the scene {f}"));
            let kept = if *kept > 0 { format!(", {kept} meshes with the author's charts") } else { String::new() };
            ("unwrapped", vec![format!("texture coordinates: laid out anew{kept}{why}")])
        }
    };
    let [before, after] = map.seams;
    let seams = match after.length > 0.0 {
        true => format!(
            "; {:.1} m of seams jump by {:.2} % (before stitching {:.2} %)",
            after.length,
            100.0 * after.rms,
            100.0 * before.rms
        ),
        false => String::new(),
    };
    let pages =
        if map.pages.len() == 1 { "a page of".to_owned() } else { format!("{} pages of up to", map.pages.len()) };
    words.push(format!(
        "{pages} {}x{} texels, {:.1} texels per metre, {:.0} % of them used{seams}",
        atlas.pages[0][0],
        atlas.pages[0][1],
        atlas.texels_per_metre,
        100.0 * atlas.utilization,
    ));
    let facts = json!({
        "carrier": "lightmap", "texcoords": source, "pages": atlas.pages, "texels_per_metre": atlas.texels_per_metre,
        "charts": atlas.charts, "utilization": atlas.utilization,
        "seams": { "metres": after.length, "rms": after.rms, "p99": after.p99, "rms_before": before.rms },
    });
    Baked { surfaces, pages: Vec::new(), files: Vec::new(), facts, words, warnings }
}

fn of_vertices(light: &VertexLight) -> Baked {
    let surface = |(part, values): (&Part, &Vec<[f32; 3]>)| {
        let mut number = vec![u32::MAX; values.len()];
        let mut surface = of_part(part, None);
        for face in &part.faces {
            let triangle = face.corners.map(|k| {
                let slot = &mut number[k as usize];
                if *slot == u32::MAX {
                    *slot = surface.vertices.len() as u32;
                    let irradiance = Some(values[k as usize]);
                    surface.vertices.push(LitVertex { source: k, texcoord: None, irradiance });
                }
                *slot
            });
            surface.triangles.push(part.drawn(triangle));
        }
        surface
    };
    let surfaces: Vec<LitSurface> = light.parts.iter().zip(&light.irradiance).map(surface).collect();
    let vertices: usize = surfaces.iter().map(|s| s.vertices.len()).sum();
    let words = vec![format!(
        "light at {vertices} vertices; interpolated between them it is off by {:.1} % (RMS)",
        100.0 * light.off
    )];
    let facts = json!({ "carrier": "vertex", "vertices": vertices, "off": light.off });
    let coarse = format!("light at vertices is off by {:.0} %: expected finer meshes, or lightmaps", 100.0 * light.off);
    let warnings = if light.off > COARSE { vec![coarse] } else { Vec::new() };
    Baked { surfaces, pages: Vec::new(), files: Vec::new(), facts, words, warnings }
}

fn of_part(part: &Part, page: Option<usize>) -> LitSurface {
    let (instance, back, one_sided) = (part.instance, part.side == Side::Back, part.one_sided);
    LitSurface { instance, page, back, one_sided, ..LitSurface::default() }
}
