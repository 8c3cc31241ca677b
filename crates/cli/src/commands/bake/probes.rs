//! `bake --to probes`: an irradiance volume in the kind of file that a name asks for.

use std::path::Path;

use anyhow::{anyhow, bail};
use serde_json::{Value, json};
use twinray::bake::{ProbeError, ProbeOptions, ProbeSpacing, Watch, bake_probes};
use twinray::format::{ProbeArrays, ProbeLattice, write_bevy_volume, write_probes_exr, write_probes_json};
use twinray::solve::Solution;

use crate::args::{BakeArgs, EngineArg};
use crate::input::Loaded;
use crate::output::extension;

const GENERATOR: &str = concat!("twinray ", env!("CARGO_PKG_VERSION"));
/// Rays of each where the user does not say.
const RAYS: u32 = 512;

/// True if a file of this name can hold probes.
pub fn can_be(path: &Path) -> bool {
    matches!(extension(path).as_str(), "json" | "exr" | "ktx2")
}

/// How the name of a file ends that an engine reads.
pub fn kind_for(engine: Option<EngineArg>) -> &'static str {
    match engine {
        Some(EngineArg::Bevy) => "ktx2",
        Some(EngineArg::Godot) => "exr",
        Some(EngineArg::Three | EngineArg::Unlit) | None => "json",
    }
}

/// The file's bytes, facts about them, and a line.
pub fn bake(
    args: &BakeArgs,
    loaded: &Loaded,
    solution: &Solution,
    seed: u64,
    path: &Path,
    watch: &mut Watch<'_>,
) -> anyhow::Result<(Vec<u8>, Value, String)> {
    let name = &args.load.scene;
    let options = ProbeOptions {
        spacing: args.spacing.map_or(ProbeSpacing::Default, ProbeSpacing::Metres),
        rays: args.probe_rays.unwrap_or(RAYS),
        punctual: !args.keep_lights,
        seed,
    };
    let volume = bake_probes(&loaded.patches, solution, &options, watch).map_err(|e| match e {
        ProbeError::Cancelled(stopped) => anyhow::Error::new(stopped),
        other => anyhow!("{name}: {other}"),
    })?;
    let lattice = ProbeLattice { low: volume.grid.low, cell: volume.grid.cell, counts: volume.grid.counts };
    let radiance: Vec<[[f32; 3]; 9]> = volume.radiance.iter().map(|h| h.0).collect();
    let arrays = ProbeArrays {
        lattice,
        radiance: &radiance,
        validity: &volume.validity,
        offset: &volume.offset,
        nearness: &volume.nearness,
    };
    let about = [("scene", loaded.name.as_str()), ("software", GENERATOR)];
    let bytes = match extension(path).as_str() {
        "json" => {
            write_probes_json(&arrays, "as the scene has it: nit where its lights are photometric", &about).into_bytes()
        }
        "exr" => write_probes_exr(&arrays, Some(1.0), &about),
        "ktx2" => write_bevy_volume(&lattice, &volume.ambient_cubes(), GENERATOR)
            .map_err(|e| anyhow!("{}: {e}", path.display()))?,
        _ => bail!("{}: expected a name that ends in .json, .exr or .ktx2", path.display()),
    };
    let open = volume.validity.iter().filter(|v| **v > 0.0).count();
    let [nx, ny, nz] = lattice.counts;
    let line = format!(
        "{nx} x {ny} x {nz} probes, {:.2} m apart at most, {open} of {} in the open",
        lattice.cell.iter().copied().fold(0.0, f64::max),
        lattice.len()
    );
    let facts = json!({
        "carrier": "probes", "low": lattice.low, "cell": lattice.cell, "counts": lattice.counts, "open": open,
    });
    Ok((bytes, facts, line))
}
