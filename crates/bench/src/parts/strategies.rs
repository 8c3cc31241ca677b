//! What the mixture of strategies saves, on uneven meshes and on even ones.

use rayon::prelude::*;
use serde_json::{Value, json};
use twinray::scene::PatchScene;
use twinray::solve::{Params, Shares, Solution};

use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, percent, table, times};
use crate::measure::pool;
use crate::results::Reader;
use crate::solving::{luminances, scene, square_error, start};

/// The part.
pub const PART: Part =
    Part { name: "strategies", what: "the mixture of strategies against shooting by power alone", measure, describe };

const RAYS: u64 = 1_000_000;
const REFERENCE_RAYS: u64 = 30_000_000;
const SEEDS: u64 = 8;
/// Scenes, their patches (1: those of the mesh), and how many times fewer rays are aimed at.
const CASES: [(&str, usize, f64); 4] =
    [("uneven", 1, 5.0), ("uneven-glowing", 1, 20.0), ("cornell", 2000, 0.97), ("doorway", 2000, 0.97)];

/// What is compared, the first with the last.
fn mixtures() -> [(&'static str, Option<Shares>); 3] {
    [("power alone", Some(Shares::POWER)), ("a tenth evenly", Some(Shares::even(0.1, 0.0))), ("fitted", None)]
}

fn measure(effort: Effort) -> Result<Outcome, String> {
    pool(2)?.install(|| {
        let mut cases = Vec::new();
        for (name, patches, aim) in CASES {
            let scene = scene(name, Some(patches))?;
            eprintln!("  {name}: reference");
            let known = Shares { power: 0.4, lamps: 0.2, patches: 0.4, ..Shares::even(0.0, 0.0) };
            let truth = solve(&scene, 9001, Some(known), effort.rays(REFERENCE_RAYS))?.0;
            let truth = luminances(&scene, &truth);
            let mut results = Vec::new();
            for (mixture, shares) in mixtures() {
                eprintln!("  {name}: {mixture}");
                let runs: Result<Vec<_>, String> = (0..SEEDS)
                    .into_par_iter()
                    .map(|k| {
                        let (solution, shares) = solve(&scene, 50 + k, shares, effort.rays(RAYS))?;
                        let light = luminances(&scene, &solution);
                        Ok((square_error(&scene, &light, &truth), patch_error(&scene, &light, &truth), shares))
                    })
                    .collect();
                let runs = runs?;
                let mean = |part: fn(&(f64, f64, Shares)) -> f64| runs.iter().map(part).sum::<f64>() / SEEDS as f64;
                results.push(json!({
                    "mixture": mixture, "area": mean(|r| r.0).sqrt(), "patches": mean(|r| r.1).sqrt(),
                    "shares": runs[0].2.to_array(),
                }));
            }
            cases.push(json!({"scene": name, "count": scene.len(), "aim": aim, "results": results}));
        }
        Ok(Outcome::Measured(json!({"rays": effort.rays(RAYS), "seeds": SEEDS, "cases": cases})))
    })
}

fn solve(scene: &PatchScene, seed: u64, shares: Option<Shares>, rays: u64) -> Result<(Solution, Shares), String> {
    let (mut solver, _) = start(scene, Params { shares, ..Params::default_preset(seed) })?;
    solver.run(rays);
    Ok((solver.solution(), solver.shares().unwrap_or(Shares::POWER)))
}

/// Mean over patches of (ΔE/E)², without emitters unless there is nothing else.
fn patch_error(scene: &PatchScene, light: &[f64], truth: &[f64]) -> f64 {
    let only_emitters = scene.patches().all(|p| !scene.emission(p).is_black());
    let counted = || scene.patches().filter(|&p| only_emitters || scene.emission(p).is_black());
    counted().map(|p| (light[p.index()] / truth[p.index()] - 1.0).powi(2)).sum::<f64>() / counted().count() as f64
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let (mut rows, mut targets) = (Vec::new(), Vec::new());
    for case in top.get("cases")?.items()? {
        let (name, count) = (case.get("scene")?.text()?, case.get("count")?.number()?);
        let mut first = None;
        let mut gain = f64::NAN;
        for result in case.get("results")?.items()? {
            let (area, patches) = (result.get("area")?.number()?, result.get("patches")?.number()?);
            gain = (*first.get_or_insert(patches) / patches).powi(2);
            let shares: Result<Vec<f64>, String> = result.get("shares")?.items()?.iter().map(Reader::number).collect();
            let shares: Vec<String> = shares?.iter().take(4).map(|s| format!("{:.0}", 100.0 * s)).collect();
            rows.push(vec![
                format!("{name}, {count} patches"),
                result.get("mixture")?.text()?.to_owned(),
                percent(area),
                percent(patches),
                times(gain),
                shares.join(" / "),
            ]);
        }
        let aim = case.get("aim")?.number()?;
        targets.push(Target::at_least(
            format!("{name}: rays by power alone over fitted, mean of (ΔE/E)²"),
            aim,
            gain,
            times,
        ));
    }
    let text = format!(
        "Relative errors after {} rays, {} seeds: over area as everywhere, √(ΣA ΔE²/ΣA E²), and over patches, √(mean (ΔE/E)²). \
         *Fewer rays* is the ratio of the latter's squares to those of shooting by power alone: how many times fewer rays the same error \
         needs. In `uneven` the logarithms of areas scatter by 2; `uneven-glowing` is the same room whose walls glow, light as walls send it \
         on. Shares in percent of the rays at the end: by power, by the lamps, over area, over patches.\n\n{}",
        top.get("rays")?.number()?,
        top.get("seeds")?.number()?,
        table(&["scene", "mixture", "over area", "over patches", "fewer rays", "shares"], &rows),
    );
    Ok(Section { title: "Strategies", text, figures: Vec::new(), targets })
}
