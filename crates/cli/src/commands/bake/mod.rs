//! `twinray bake`: from a scene to the same scene with its light in it.

mod document;
mod flavours;
mod probes;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{anyhow, bail};
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
use crate::output::{Output, extension};
use crate::progress::FrameProgress;
use crate::settings::Settings;
use crate::{interrupt, stored};

/// Patches that a density may ask for by itself.
const MOST_CELLS: f64 = 1e6;
/// The most texels that a density may ask for: 32 pages of 2048 × 2048, some 7 GB while they are filled.
const MOST_TEXELS: f64 = 134_217_728.0;
/// Side of a page where the user does not say, with a density and without.
const PAGE: [u32; 2] = [2048, 1024];

/// Runs the command.
pub fn run(args: &BakeArgs) -> anyhow::Result<Ending> {
    let name = args.load.scene.as_str();
    let carrier = args.to.unwrap_or_default();
    let path = args.output.clone().unwrap_or_else(|| default_output(name, carrier));
    check(args, carrier, &path)?;
    commands::set_threads(args.load.threads);
    interrupt::install();
    let start = Instant::now();
    let is_stored = stored::is_solution(name);
    let work = if is_stored { Work::default() } else { solving::work(&args.solve, None) };
    let load = with_cells(args)?;
    let mut loaded = input::load(load.as_ref().unwrap_or(&args.load), None, &Work { keeps_scene: true, ..work })?;
    let Some(scene) = loaded.scene.take() else { unreachable!("it was asked for") };
    check_scene(args, &loaded, &path)?;
    let mut output = Output::open(&path)?;
    commands::print_warnings(&loaded.warnings, args.load.quiet);
    let document = match carrier {
        CarrierArg::Probes => None,
        _ => Some(Document::of(&loaded, &scene, &args.load.read)?),
    };

    let mut interrupted = false;
    let mut settings = None;
    let solution = if is_stored {
        solving::stored(name, &loaded, &args.solve)?.0
    } else {
        let chosen = Settings::new(&args.solve, None);
        let goal = solving::goal(&args.solve, loaded.patches.len(), None);
        let from = solving::Start { settings: &chosen, stored: None, observer: None, peers: None };
        let solved = solving::solve(from, goal, name, &loaded, args.load.quiet, |_, _| {})?;
        interrupted = solved.interrupted;
        settings = Some(chosen.seed);
        solved.solver.solution()
    };
    let loss = commands::loss_warning(&solution.balance()).map(|w| format!("{name}: {w}"));
    commands::print_warnings(loss.as_slice(), args.load.quiet);
    loaded.warnings.extend(loss);
    let solving_seconds = start.elapsed().as_secs_f64();

    let mut progress = FrameProgress::new(1, args.load.quiet).counting("baking");
    let mut watch = |stage: Stage, share: f64| {
        if !matches!(stage, Stage::Atlas | Stage::Seams) {
            progress.update(share);
        }
        // What a signal stopped already is finished with what there is; the next one ends it.
        if interrupt::requested() && !interrupted { Err(Cancelled) } else { Ok(()) }
    };
    let mut baked = match carrier {
        CarrierArg::Probes => Baked::default(),
        _ => bake(args, carrier, &loaded, &scene, &solution, &path, &mut watch).map_err(|e| match e {
            AtlasError::Cancelled(_) => stopped(name),
            other => anyhow!("{name}: {other}"),
        })?,
    };
    let (bytes, about) = match &document {
        None => {
            let (bytes, facts, line) = probes::bake(args, &loaded, &solution, &path, &mut watch)?;
            (baked.facts, baked.words) = (facts, vec![line]);
            (bytes, about(&scene, &loaded, &solution, settings, &baked))
        }
        Some(document) => {
            let about = about(&scene, &loaded, &solution, settings, &baked);
            let (surfaces, pages) = (std::mem::take(&mut baked.surfaces), std::mem::take(&mut baked.pages));
            let lit = Lit { surfaces, pages, drop_lights: !args.keep_lights, about: about.clone() };
            let LitGlb { bytes, warnings } = document.lit(&lit, &args.load.read)?;
            let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
            commands::print_warnings(&warnings, args.load.quiet);
            loaded.warnings.extend(warnings);
            (bytes, about)
        }
    };
    progress.finish();
    for (path, bytes) in &baked.files {
        Output::open(path)?.write(bytes)?;
    }
    output.put(|out| out.write_all(&bytes))?;

    if !args.load.quiet {
        baked.words.iter().for_each(|line| crate::say!("{line}"));
        let beside =
            if baked.files.is_empty() { String::new() } else { format!(" and {} files beside it", baked.files.len()) };
        crate::say!(
            "{}: {:.2} MB{beside}, {} rays, estimated error {:.2} %, {:.1} s to solve and {:.1} s to bake",
            path.display(),
            bytes.len() as f64 * 1e-6,
            solution.rays(),
            100.0 * solution.relative_error(),
            solving_seconds,
            start.elapsed().as_secs_f64() - solving_seconds
        );
    }
    if args.load.json {
        let files: Vec<String> = baked.files.iter().map(|(p, _)| p.display().to_string()).collect();
        let report = json!({
            "output": path.display().to_string(), "bytes": bytes.len(), "files": files,
            "patches": loaded.patches.len(), "interrupted": interrupted,
            "seconds": { "solve": solving_seconds, "all": start.elapsed().as_secs_f64() },
            "bake": about, "warnings": loaded.warnings,
        });
        println!("{report:#}");
    }
    Ok(if interrupted { Ending::Interrupted } else { Ending::Done })
}

/// What cannot be asked for, before anything is done.
fn check(args: &BakeArgs, carrier: CarrierArg, path: &Path) -> anyhow::Result<()> {
    let name = &args.load.scene;
    match carrier {
        CarrierArg::Probes if !probes::can_be(path) => {
            bail!("{}: expected a name that ends in .json, .exr or .ktx2", path.display())
        }
        CarrierArg::Lightmap | CarrierArg::Vertex if extension(path) != "glb" => {
            bail!("{}: expected a name that ends in .glb", path.display())
        }
        _ => {}
    }
    if stored::is_solution(name)
        && (args.solve.rays.is_some() || args.solve.time.is_some() || args.solve.error.is_some())
    {
        bail!(
            "{name}: is solved already, so --rays, --time and --error are not for it: `twinray solve {name}` makes it better"
        );
    }
    if carrier == CarrierArg::Vertex && args.engine == Some(EngineArg::Unlit) {
        bail!("--to vertex --for unlit: colours as they look need textures: leave one of the two out");
    }
    if carrier != CarrierArg::Lightmap {
        let given =
            [("--page-size", args.page_size.is_some()), ("--unwrap", args.unwrap), ("--no-stitch", args.no_stitch)];
        if let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) {
            bail!("{option} is for lightmaps: leave it or --to out");
        }
    }
    if carrier != CarrierArg::Probes && args.spacing.is_some() {
        bail!("--spacing is for probes: add --to probes");
    }
    if args.exposure.is_some() && args.engine != Some(EngineArg::Unlit) {
        bail!("--exposure is for --for unlit: lightmaps hold light in the units of the scene");
    }
    Ok(())
}

/// What only the scene tells.
fn check_scene(args: &BakeArgs, loaded: &Loaded, path: &Path) -> anyhow::Result<()> {
    let file = loaded.scene_file();
    let real = |p: &Path| std::fs::canonicalize(p).ok();
    if real(path).is_some_and(|p| Some(p) == real(Path::new(file))) {
        bail!("{}: is the scene itself, which would be lost: give another name to -o", path.display());
    }
    if document::has_lost_lights(Path::new(file), input::limits(&args.load.read).max_file_bytes) {
        bail!(
            "{file}: was baked already, and the lights that were are no longer in it: bake the scene that it was made from, or that with --keep-lights"
        );
    }
    if let Some(density) = args.density {
        let area = loaded.patches.total_area();
        if area * density * density > MOST_TEXELS {
            bail!(
                "--density {density}: {:.3e} texels for {area:.3} m² of surface: expected at most {:.3} texels per metre here",
                area * density * density,
                (MOST_TEXELS / area).sqrt()
            );
        }
    }
    Ok(())
}

/// SCENE-lit.glb in this folder, or SCENE-probes.json.
fn default_output(scene: &str, carrier: CarrierArg) -> PathBuf {
    let stem = Path::new(scene).file_stem().map_or_else(|| scene.to_owned(), |s| s.to_string_lossy().into_owned());
    PathBuf::from(match carrier {
        CarrierArg::Probes => format!("{stem}-probes.json"),
        _ => format!("{stem}-lit.glb"),
    })
}

/// How the scene is loaded where a density says how fine cells are to be and nothing else does: as fine as texels.
fn with_cells(args: &BakeArgs) -> anyhow::Result<Option<crate::args::LoadArgs>> {
    let load = &args.load;
    let Some(density) = args.density else { return Ok(None) };
    if load.patches.is_some() || load.patch_size.is_some() || stored::is_solution(&load.scene) {
        return Ok(None);
    }
    let (scene, _) = input::read(&load.scene, &load.read)?;
    let metres = load.unit.unwrap_or_default().metres();
    let cells = area(&scene) * metres * metres * density * density;
    let mut load = load.clone();
    match cells > MOST_CELLS {
        true => load.patches = Some(MOST_CELLS as u64),
        false => load.patch_size = Some(1.0 / density),
    }
    Ok(Some(load))
}

fn area(scene: &Scene) -> f64 {
    let placed = scene.instances.iter().map(|instance| {
        let mesh = &scene.meshes[instance.mesh];
        let point =
            |k: u32| instance.transform.transform_point3(glam::Vec3::from(mesh.positions[k as usize]).as_dvec3());
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(point);
            0.5 * (b - a).cross(c - a).length()
        };
        mesh.triangles.iter().map(area).filter(|a| a.is_finite()).sum::<f64>()
    });
    placed.sum()
}

/// What goes into the document.
#[derive(Default)]
struct Baked {
    surfaces: Vec<LitSurface>,
    pages: Vec<LitPage>,
    files: Vec<(PathBuf, Vec<u8>)>,
    /// For the report.
    facts: Value,
    words: Vec<String>,
}

fn bake(
    args: &BakeArgs,
    carrier: CarrierArg,
    loaded: &Loaded,
    scene: &Scene,
    solution: &Solution,
    path: &Path,
    watch: &mut Watch<'_>,
) -> Result<Baked, AtlasError> {
    let quality = match args.quality.unwrap_or_default() {
        QualityArg::Cells => Quality::Cells,
        QualityArg::Smooth => Quality::Smooth,
        QualityArg::High => Quality::Gathered(args.texel_rays),
    };
    let seed = args.solve.seed.unwrap_or(1);
    let engine = args.engine.unwrap_or_default();
    Ok(match carrier {
        CarrierArg::Vertex => {
            let light = bake::bake_vertices(scene, &loaded.patches, solution, quality, seed, watch)?;
            of_vertices(&light)
        }
        // Probes have no document.
        CarrierArg::Lightmap | CarrierArg::Probes => {
            let density = args.density.map_or(TexelDensity::OnePage, TexelDensity::PerMetre);
            let page_size = args.page_size.unwrap_or(PAGE[usize::from(args.density.is_none())]);
            let atlas = AtlasOptions { density, page_size, padding: args.padding, keep_authored: !args.unwrap };
            let options = LightmapOptions { atlas, quality, stitch: !args.no_stitch, seed };
            let map = bake::bake(scene, &loaded.patches, solution, &options, watch)?;
            let mut baked = of_lightmap(&map);
            if engine == EngineArg::Unlit {
                let colours = bake::colours(&loaded.patches, &map, args.padding, watch)?;
                baked.pages = flavours::unlit(&colours, exposure(args, loaded, solution));
            } else {
                let dressed = flavours::lightmaps(&map, engine, path);
                (baked.pages, baked.files) = (dressed.pages, dressed.files);
            }
            baked
        }
    })
}

/// What a second signal, or one after the solve, leaves to be said.
fn stopped(name: &str) -> anyhow::Error {
    anyhow!(
        "{name}: stopped before anything could be written (`twinray solve` keeps the light in a .twin file, which `bake` takes)"
    )
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
    let (source, mut words) = match &atlas.layout {
        Layout::Authored => ("authored", vec!["texture coordinates: the second set of the scene, as it is".to_owned()]),
        Layout::Unwrapped { kept, fault } => {
            let why = fault.map_or(String::new(), |f| format!(": of the second set of the scene {f}"));
            let kept = if *kept > 0 { format!(", {kept} meshes with the author's charts") } else { String::new() };
            ("unwrapped", vec![format!("texture coordinates: laid out anew{kept}{why}")])
        }
    };
    let [before, after] = map.seams;
    words.push(format!(
        "{} pages of up to {}x{} texels, {:.1} texels per metre, {:.0} % of them used; {:.0} m of seams jump by {:.2} % (before stitching {:.2} %)",
        map.pages.len(),
        atlas.pages[0][0],
        atlas.pages[0][1],
        atlas.texels_per_metre,
        100.0 * atlas.utilization,
        after.length,
        100.0 * after.rms,
        100.0 * before.rms
    ));
    let facts = json!({
        "carrier": "lightmap", "texcoords": source, "pages": atlas.pages, "texels_per_metre": atlas.texels_per_metre,
        "charts": atlas.charts, "utilization": atlas.utilization,
        "seams": { "metres": after.length, "rms": after.rms, "p99": after.p99, "rms_before": before.rms },
    });
    Baked { surfaces, pages: Vec::new(), files: Vec::new(), facts, words }
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
    let words = vec![format!("light at {vertices} vertices")];
    let facts = json!({ "carrier": "vertex", "vertices": vertices });
    Baked { surfaces, pages: Vec::new(), files: Vec::new(), facts, words }
}

fn of_part(part: &Part, page: Option<usize>) -> LitSurface {
    let (instance, back, one_sided) = (part.instance, part.side == Side::Back, part.one_sided);
    LitSurface { instance, page, back, one_sided, ..LitSurface::default() }
}

/// What the document is told of its light.
fn about(scene: &Scene, loaded: &Loaded, solution: &Solution, seed: Option<u64>, baked: &Baked) -> Value {
    let emitters: Vec<&str> =
        scene.materials.iter().filter(|m| m.emission != Rgb::BLACK).map(|m| m.name.as_str()).collect();
    let lights: Vec<&str> = scene.lights.iter().map(|l| l.name.as_str()).collect();
    json!({
        "generator": concat!("twinray ", env!("CARGO_PKG_VERSION")),
        "quantity": "irradiance", "unit": "as the scene has it: lux where its radiance is in nit",
        "lights": { "materials": emitters, "punctual": lights, "sky": scene.environment.is_some() },
        "rays": solution.rays(), "relative_error": Some(solution.relative_error()).filter(|e| e.is_finite()),
        "seed": seed, "fingerprint": format!("{:016x}", loaded.patches.fingerprint()),
        "layout": baked.facts,
    })
}
