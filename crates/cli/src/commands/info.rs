//! `twinray info`: what is in a scene, before anything is paid for. Files of solutions: `solution`.

use anyhow::anyhow;
use serde_json::json;
use twinray::scene::CameraAnimation;
use twinray::solve::{Params, Solver, state_bytes};

use crate::args::InfoArgs;
use crate::commands::{self, solution};
use crate::estimate::{Rays, Work};
use crate::failure::Ending;
use crate::{input, stored};

/// Rays of the short solve behind the power balance, and of the test for closedness.
const PROBE_RAYS: u64 = 200_000;

/// Runs the command.
pub fn run(args: &InfoArgs) -> anyhow::Result<Ending> {
    if stored::is_solution(&args.load.scene) {
        return solution::describe(&args.load.scene, args.load.json);
    }
    commands::set_threads(args.load.threads);
    let solve = Some((Params::default_preset(1), Rays::Total(PROBE_RAYS)));
    let work = Work { solve, is_silent: true, ..Work::default() };
    let loaded = input::load(&args.load, None, &work)?;
    let patches = &loaded.patches;
    let closedness = patches.closedness(PROBE_RAYS);
    let mut solver =
        Solver::new(patches, Params::default_preset(1), None).map_err(|e| anyhow!("{}: {e}", args.load.scene))?;
    solver.run(PROBE_RAYS);
    let balance = solver.solution().balance();
    let mut warnings = loaded.warnings.clone();
    warnings.extend(commands::loss_warning(&balance).map(|w| format!("{}: {w}", args.load.scene)));

    let glossy = patches.patches().filter(|&p| patches.is_glossy(p)).count();
    let state = state_bytes(patches.len(), glossy, false);
    let [kernel, constants] = patches.bytes();
    let (low, high) = patches.bounding_box();
    let size = high - low;
    let power = patches.emitted_power();
    let albedo = patches.mean_albedo();
    let cameras: Vec<&str> = loaded.cameras.iter().map(|c| c.name.as_str()).collect();

    let animations: Vec<String> = loaded.animations.iter().map(|a| animation_line(a, &cameras)).collect();

    if args.load.json {
        let report = json!({
            "scene": loaded.name,
            "triangles": patches.triangle_count(),
            "patches": patches.len(), "glossy_patches": glossy, "emitting_patches": patches.emitter_count(),
            "area": patches.total_area(), "size": size.to_array(),
            "emitted_power_rgb": power.to_array(), "mean_albedo_rgb": albedo.to_array(),
            "environment": patches.environment().is_some(),
            "lights": patches.lights().len(), "lights_power_rgb": patches.lights_power().to_array(),
            "shared_edges": closedness.shared_edges, "escaping_rays": closedness.escaping_rays,
            "bytes": { "rays": kernel, "patches": constants, "solver": state },
            "power": commands::balance_json(&balance),
            "cameras": cameras, "animations": animations,
            "expected": loaded.expected.json(),
            "warnings": warnings,
        });
        println!("{report:#}");
        return Ok(Ending::Done);
    }
    commands::print_warnings(&warnings, args.load.quiet);
    let mb = |bytes: usize| format!("{:.1} MB", bytes as f64 * 1e-6);
    println!("scene      {}", loaded.name);
    println!("triangles  {}", patches.triangle_count());
    println!("patches    {} ({glossy} glossy, {} emitting)", patches.len(), patches.emitter_count());
    println!("size       {:.4} x {:.4} x {:.4} m, area {:.4} m²", size.x, size.y, size.z, patches.total_area());
    println!("emission   {:.6} {:.6} {:.6} W (R G B), Σ π A L", power.r, power.g, power.b);
    if !patches.lights().is_empty() {
        let (count, power) = (patches.lights().len(), patches.lights_power().luminance());
        println!("lights     {count} without area, {power:.6} lm or W (directional ones: through the scene's sphere)");
    }
    println!("sky        {}", if patches.environment().is_some() { "yes" } else { "none" });
    println!("albedo     {:.4} {:.4} {:.4} (area-weighted mean)", albedo.r, albedo.g, albedo.b);
    println!(
        "closed     {:.2} % of edges shared by two triangles; {:.3} % of rays escape",
        100.0 * closedness.shared_edges,
        100.0 * closedness.escaping_rays
    );
    println!(
        "memory     {} (rays {}, patches {}, solver {}: {})",
        mb(kernel + constants + state),
        mb(kernel),
        mb(constants),
        mb(state),
        bytes_of_a_patch(patches.len(), glossy)
    );
    println!("cameras    {}", cameras.join(", "));
    if !animations.is_empty() {
        println!("animations {}", animations.join(", "));
    }
    println!("{}", commands::balance_line(&balance));
    Ok(Ending::Done)
}

/// What an animation moves, and for how long.
fn animation_line(animation: &CameraAnimation, cameras: &[&str]) -> String {
    let [start, end] = animation.span();
    format!("{} (of {}, {:.1} s)", animation.name, cameras.get(animation.camera).unwrap_or(&"?"), end - start)
}

/// What a patch costs the solver, in words.
fn bytes_of_a_patch(patches: usize, glossy: usize) -> String {
    let diffuse = patches - glossy;
    if glossy == 0 {
        return format!("{} B a patch", state_bytes(patches, 0, false) / patches);
    }
    // All patches of a scene are numbered if one is glossy.
    let (of_glossy, of_camera) = (state_bytes(1, 1, false), state_bytes(1, 1, true) - state_bytes(1, 1, false));
    let of_diffuse = (state_bytes(patches, glossy, false) - glossy * of_glossy).checked_div(diffuse);
    let of_diffuse = of_diffuse.map_or(String::new(), |bytes| format!("{bytes} B a diffuse and "));
    format!("{of_diffuse}{of_glossy} B a glossy patch, {of_camera} more for a camera")
}
