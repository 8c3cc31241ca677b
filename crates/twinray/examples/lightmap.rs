//! Bakes a lightmap from a script: pages of irradiance as EXR, and how well charts meet.
//!
//! `cargo run --release -p twinray --example lightmap [SCENE.glb] [TEXELS_PER_METRE]`

use std::collections::BTreeMap;
use std::path::Path;

use twinray::bake::{AtlasOptions, LightmapOptions, Quality, TexelDensity, bake};
use twinray::format::{Limits, read_scene, write_exr};
use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Params, Solver};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "cornell".into());
    let density: f64 = args.next().map_or(Ok(30.0), |d| d.parse())?;
    let scene = match builtin::by_name(&name) {
        Some(scene) => scene,
        None => {
            let path = Path::new(&name);
            let folder = path.parent().unwrap_or(Path::new("."));
            let mut resolver = |file: &str| std::fs::read(folder.join(file));
            read_scene(&name, &std::fs::read(path)?, &mut resolver, &Limits::default())?.scene
        }
    };
    // Cells as large as texels, within reason.
    let budget = PatchBudget::Size(1.0 / density);
    let patches = PatchScene::new(&scene, PatchOptions { budget, ..PatchOptions::default() })?;
    let mut solver = Solver::new(&patches, Params::default_preset(1), None)?;
    solver.run(100 * patches.len() as u64);
    let solution = solver.solution();

    let atlas = AtlasOptions { density: TexelDensity::PerMetre(density), page_size: 1024, ..AtlasOptions::default() };
    let options = LightmapOptions { atlas, quality: Quality::Smooth, stitch: true, seed: 1 };
    let map = bake(&scene, &patches, &solution, &options, &mut |_, _| Ok(()))?;

    println!("{name}: {} patches, error ≈ {:.1} %", patches.len(), 100.0 * solution.relative_error());
    println!(
        "{} parts in {} charts on {} pages, {:.0} % of them used, {:.1} texels per metre",
        map.parts.len(),
        map.atlas.charts.unwrap_or_default(),
        map.pages.len(),
        100.0 * map.atlas.utilization,
        map.atlas.texels_per_metre,
    );
    let [before, after] = map.seams;
    println!(
        "{:.1} m of seams jump by {:.2} %, stitched by {:.2} %",
        before.length,
        100.0 * before.rms,
        100.0 * after.rms
    );
    let mut files = BTreeMap::new();
    for (k, page) in map.pages.iter().enumerate() {
        files.insert(format!("lightmap-{k}.exr"), write_exr(page.width, page.height, &page.irradiance, None, &[]));
    }
    // Tests run examples in folders of their own; nothing is written unless asked for.
    if let Some(folder) = std::env::args().nth(3) {
        for (file, bytes) in &files {
            std::fs::write(Path::new(&folder).join(file), bytes)?;
        }
    }
    println!("{:.0} kB of EXR", files.values().map(|b| b.len() as f64).sum::<f64>() / 1e3);
    Ok(())
}
