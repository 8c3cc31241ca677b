//! Memory: what the structures say of themselves, and what the process really takes.

use std::process::Command;

use serde_json::{Value, json};
use twinray::solve::{Params, state_bytes};
use twinray_rays::Bvh;

use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, table};
use crate::origin::status_bytes;
use crate::rays;
use crate::results::Reader;
use crate::solving::{scene, start};

/// The part.
pub const PART: Part = Part { name: "memory", what: "bytes a patch and a triangle", measure, describe };

/// First argument of this program as its own child, which measures itself: `CHILD SCENE PATCHES`.
pub const CHILD: &str = "--resident";

/// Drawn with few triangles, so that drawing it is not the peak.
const SCENE: &str = "cornell";
/// The difference of two runs is free of what does not grow with patches.
const PATCHES: [usize; 2] = [1_000_000, 4_000_000];
/// Most bytes of a triangle in the kernel, and of the solver's state of a diffuse and of a glossy patch.
const TARGETS: [(&str, &str, f64); 3] = [
    ("ray kernel: bytes a triangle", "bytes_per_triangle", 100.0),
    ("solver's state: bytes a diffuse patch", "state_per_patch", 96.0),
    ("solver's state: bytes a glossy patch", "state_per_glossy_patch", 136.0),
];

const STAGES: [&str; 3] = ["scene", "solver", "solution"];

fn measure(effort: Effort) -> Result<Outcome, String> {
    if status_bytes("VmHWM").is_none() {
        return Ok(Outcome::Skipped("peak memory is read from /proc/self/status, which is not there".to_owned()));
    }
    let hall = scene("hall", None)?;
    let kernel = Bvh::build(&rays::triangles(&hall)).bytes() as f64 / hall.triangle_count() as f64;
    let mut children = Vec::new();
    for patches in PATCHES.map(|p| effort.patches(p).max(20_000)) {
        eprintln!("  a child with {patches} patches");
        children.push(spawn(patches)?);
    }
    let scene = scene(SCENE, Some(100_000))?;
    // Constants of patches, with those of the triangles taken out.
    let larger = self::scene(SCENE, Some(200_000))?;
    let constants = (larger.bytes()[1] - scene.bytes()[1]) as f64 / (larger.len() - scene.len()) as f64;
    Ok(Outcome::Measured(json!({
        "scene": SCENE,
        "bytes_per_triangle": kernel,
        "constants_per_patch": constants,
        "state_per_patch": state_bytes(1, 0, false),
        "state_per_glossy_patch": state_bytes(1, 1, false),
        "state_per_observed_patch": state_bytes(1, 1, true),
        "runs": children,
    })))
}

/// Runs this program anew, so that nothing else has grown its peak.
fn spawn(patches: usize) -> Result<Value, String> {
    let program = std::env::current_exe().map_err(|e| format!("this program's place: {e}"))?;
    let output = Command::new(program).args([CHILD, SCENE, &patches.to_string()]).output();
    let output = output.map_err(|e| format!("the child could not be started: {e}"))?;
    if !output.status.success() {
        return Err(format!("the child failed: {}", String::from_utf8_lossy(&output.stderr)));
    }
    serde_json::from_slice(&output.stdout).map_err(|e| format!("the child's answer: {e}"))
}

/// The child: peak memory after each stage of a solve, as JSON on standard output.
pub fn child(arguments: &[String]) -> Result<(), String> {
    let [name, patches] = arguments else { return Err(format!("{CHILD} SCENE PATCHES")) };
    let patches = patches.parse().map_err(|e| format!("{patches}: {e}"))?;
    let peak = || status_bytes("VmHWM").ok_or_else(|| "no /proc/self/status".to_owned());
    let before = peak()?;
    let scene = scene(name, Some(patches))?;
    let built = peak()?;
    // A short warm start allocates what a long one does.
    let params = Params { warm_start: 0.1, ..Params::default_preset(1) };
    let (mut solver, _) = start(&scene, params)?;
    solver.run(solver.rays() + 2);
    let solved = peak()?;
    let solution = solver.solution();
    let shown = peak()?;
    // Both are wanted to here.
    let rays = solution.rays().max(solver.rays());
    println!(
        "{}",
        json!({"patches": scene.len(), "rays": rays, "before": before, "scene": built, "solver": solved, "solution": shown})
    );
    Ok(())
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let number = |key: &str| top.get(key)?.number();
    let runs = top.get("runs")?.items()?;
    let [small, large] = runs.as_slice() else { return Err("expected two runs: measure this part anew".to_owned()) };
    let difference = |key: &str| Ok::<_, String>(large.get(key)?.number()? - small.get(key)?.number()?);
    let per_patch = |stage: &str| Ok::<_, String>(difference(stage)? / difference("patches")?);
    let peaks: Result<Vec<f64>, String> = STAGES.iter().map(|stage| per_patch(stage)).collect();
    let peaks = peaks?;
    let row = |what: &str, bytes: f64| vec![what.to_owned(), format!("{bytes:.0}")];
    let said = [
        row("ray kernel, a triangle (hall)", number("bytes_per_triangle")?),
        row("constants of the scene, a patch", number("constants_per_patch")?),
        row("state of the solver, a diffuse patch", number("state_per_patch")?),
        row("state of the solver, a glossy patch", number("state_per_glossy_patch")?),
        row("the same with a fixed camera", number("state_per_observed_patch")?),
    ];
    let found =
        [row("scene built", peaks[0]), row("and solved", peaks[1]), row("and a snapshot of the light taken", peaks[2])];
    let text = format!(
        "What the structures say of themselves (`twinray info` adds these up for a scene; the lists of the rays of a \
         wave are beside them), bytes:\n\n{}\n\nWhat the process really took: its \
         peak resident memory (`VmHWM`), measured in a child process on {} of {} and of {} patches, the difference over the difference \
         of the numbers of patches. Scratch memory that is already given back counts too. Bytes a patch:\n\n{}",
        table(&["", "bytes"], &said),
        top.get("scene")?.text()?,
        small.get("patches")?.number()?,
        large.get("patches")?.number()?,
        table(&["peak after", "bytes a patch"], &found),
    );
    let target = |(what, key, bound): (&str, &str, f64)| {
        Ok::<_, String>(Target::at_most(what.to_owned(), bound, number(key)?, |b| format!("{b:.0} B")))
    };
    let targets = TARGETS.into_iter().map(target).collect::<Result<_, _>>()?;
    Ok(Section { title: "Memory", text, figures: Vec::new(), targets })
}
