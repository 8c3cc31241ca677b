//! What is asked for: refused before anything is done where it makes no sense, and what is meant where it says nothing.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use twinray::bake::{ProbeGrid, ProbeSpacing};
use twinray::scene::Scene;
use twinray::scene::complete::Addition;

use super::{document, probes};
use crate::args::{BakeArgs, CarrierArg, EngineArg, LoadArgs, QualityArg};
use crate::input::{self, Loaded};
use crate::output::extension;
use crate::stored;

/// Patches that a density may ask for by itself.
const MOST_CELLS: f64 = 1e6;
/// The most texels that a density may ask for: 32 pages of 2048 × 2048, some 7 GB while they are filled.
const MOST_TEXELS: f64 = 134_217_728.0;

/// What cannot be asked for, before anything is done.
pub fn check(args: &BakeArgs, carrier: CarrierArg, path: &Path) -> anyhow::Result<()> {
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
    let engine = args.engine;
    if carrier == CarrierArg::Vertex && engine == Some(EngineArg::Unlit) {
        bail!("--to vertex --for unlit: colours as they look need textures: leave one of the two out");
    }
    if carrier == CarrierArg::Probes && engine == Some(EngineArg::Unlit) {
        bail!("--to probes --for unlit: probes light what has no light of its own: leave one of the two out");
    }
    let for_bevy = extension(path) == "ktx2";
    if carrier == CarrierArg::Probes && engine.is_some_and(|e| (e == EngineArg::Bevy) != for_bevy) {
        bail!("{}: probes for Bevy, and those alone, are in files that end in .ktx2", path.display());
    }
    // An option that would change nothing is a misunderstanding.
    let is_high = args.quality == Some(QualityArg::High) && carrier != CarrierArg::Probes;
    let [is_map, is_grid] = [CarrierArg::Lightmap, CarrierArg::Probes].map(|c| c == carrier);
    for (option, is_given, fits, whose) in [
        ("--density", args.density.is_some(), !is_grid, "for lightmaps: leave it or --to probes out"),
        ("--page-size", args.page_size.is_some(), is_map, "for lightmaps: leave it or --to out"),
        ("--padding", args.padding.is_some(), is_map, "for lightmaps: leave it or --to out"),
        ("--unwrap", args.unwrap, is_map, "for lightmaps: leave it or --to out"),
        ("--no-stitch", args.no_stitch, is_map, "for lightmaps: leave it or --to out"),
        (
            "--quality",
            args.quality.is_some(),
            !is_grid,
            "for light on surfaces: --probe-rays says how well probes look",
        ),
        ("--texel-rays", args.texel_rays.is_some(), is_high, "for --quality high: add it"),
        ("--spacing", args.spacing.is_some(), is_grid, "for probes: add --to probes"),
        ("--probe-rays", args.probe_rays.is_some(), is_grid, "for probes: add --to probes"),
    ] {
        if is_given && !fits {
            bail!("{option} is {whose}");
        }
    }
    if args.exposure.is_some() && args.engine != Some(EngineArg::Unlit) {
        bail!("--exposure is for --for unlit: lightmaps hold light in the units of the scene");
    }
    Ok(())
}

/// What only the scene tells.
pub fn check_scene(args: &BakeArgs, loaded: &Loaded, path: &Path) -> anyhow::Result<()> {
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
    if loaded.additions.contains(&Addition::Lamp) {
        bail!("{file}: has no light, and none from outside can enter: expected lamps, or materials that emit");
    }
    if args.to == Some(CarrierArg::Probes) {
        let spacing = args.spacing.map_or(ProbeSpacing::Default, ProbeSpacing::Metres);
        ProbeGrid::new(&loaded.patches, spacing).map_err(|e| anyhow!("{file}: {e}"))?;
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

/// SCENE-lit.glb in this folder, or SCENE-probes with the ending that the engine reads.
pub fn default_output(scene: &str, carrier: CarrierArg, engine: Option<EngineArg>) -> PathBuf {
    let stem = Path::new(scene).file_stem().map_or_else(|| scene.to_owned(), |s| s.to_string_lossy().into_owned());
    // Light that was kept has the name of what it is for.
    let stem = ["-lit", "-probes"]
        .iter()
        .find_map(|end| stem.strip_suffix(end).filter(|_| stored::is_solution(scene)))
        .unwrap_or(&stem);
    PathBuf::from(match carrier {
        CarrierArg::Probes => format!("{stem}-probes.{}", probes::kind_for(engine)),
        _ => format!("{stem}-lit.glb"),
    })
}

/// How the scene is loaded where a density says how fine cells are to be and nothing else does: as fine as texels.
pub fn with_cells(args: &BakeArgs) -> anyhow::Result<Option<LoadArgs>> {
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
