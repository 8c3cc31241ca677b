//! Bakes irradiance volumes from a script: the light that objects would have in the middle of a room, and all files.
//!
//! `cargo run --release -p twinray --example probes [FOLDER]`

use std::path::Path;

use twinray::bake::{ProbeOptions, ProbeVolume, bake_probes};
use twinray::format::{ProbeArrays, ProbeLattice, write_bevy_volume, write_probes_exr, write_probes_json};
use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Params, Solver};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for name in ["cornell", "doorway"] {
        let scene = builtin::by_name(name).ok_or("no such scene")?;
        let budget = PatchBudget::Count(10_000);
        let patches = PatchScene::new(&scene, PatchOptions { budget, ..PatchOptions::default() })?;
        let mut solver = Solver::new(&patches, Params::default_preset(1), None)?;
        solver.run(100 * patches.len() as u64);
        let volume = bake_probes(
            &patches,
            &solver.solution(),
            &ProbeOptions { rays: 128, ..ProbeOptions::default() },
            &mut |_, _| Ok(()),
        )?;

        let valid = volume.validity.iter().filter(|v| **v > 0.0).count();
        println!(
            "{name}: {:?} probes, {valid} in the open; irradiance (luminance) upwards and downwards:",
            volume.grid.counts
        );
        let [nx, ny, nz] = volume.grid.counts.map(|n| n as usize);
        for i in 0..nx {
            let probe = i + nx * (ny / 2 + ny * (nz / 2));
            let up = volume.grid.point(probe).with_x(0.0).with_y(1.0).with_z(0.0);
            let [above, below] = [up, -up].map(|n| volume.radiance[probe].irradiance(n).luminance());
            println!("  x = {:5.2} m: {above:8.3} {below:8.3}", volume.grid.point(probe).x);
        }
        write(&volume, name)?;
    }
    Ok(())
}

fn write(volume: &ProbeVolume, name: &str) -> Result<(), Box<dyn std::error::Error>> {
    let lattice = ProbeLattice { low: volume.grid.low, cell: volume.grid.cell, counts: volume.grid.counts };
    let radiance: Vec<[[f32; 3]; 9]> = volume.radiance.iter().map(|h| h.0).collect();
    let arrays = ProbeArrays {
        lattice,
        radiance: &radiance,
        validity: &volume.validity,
        offset: &volume.offset,
        nearness: &volume.nearness,
    };
    let about = [("scene", name)];
    let files = [
        ("json", write_probes_json(&arrays, "nit", &about).into_bytes()),
        ("exr", write_probes_exr(&arrays, Some(1.0), &about)),
        ("ktx2", write_bevy_volume(&lattice, &volume.ambient_cubes(), "twinray example")?),
    ];
    // Tests run examples in folders of their own; nothing is written unless asked for.
    if let Some(folder) = std::env::args().nth(1) {
        for (extension, bytes) in &files {
            std::fs::write(Path::new(&folder).join(format!("{name}-probes.{extension}")), bytes)?;
        }
    }
    Ok(())
}
