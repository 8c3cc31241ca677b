//! What a second thread gives.

use serde_json::{Value, json};
use twinray::solve::Params;
use twinray_rays::Bvh;

use super::kernel::{RAYS, SCENES, rate};
use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, millions, table, times};
use crate::measure::{Race, pool};
use crate::rays;
use crate::results::Reader;
use crate::solving::{pace, scene};

/// The part.
pub const PART: Part = Part { name: "threads", what: "one thread and two", measure, describe };

const SOLVER_RAYS: u64 = 5_000_000;
const TURNS: usize = 4;
const TARGET: f64 = 1.85;

fn measure(effort: Effort) -> Result<Outcome, String> {
    let pools = [("1", pool(1)?), ("2", pool(2)?)];
    let mut scenes = Vec::new();
    for name in SCENES {
        let scene = scene(name, effort.scene_patches())?;
        let bvh = Bvh::build(&rays::triangles(&scene));
        let rays = rays::incoherent(&scene, effort.rays(RAYS) as usize, 1);
        let mut race = Race::default();
        for turn in 0..effort.turns(TURNS) {
            eprintln!("  {name}, turn {}", turn + 1);
            for (threads, pool) in &pools {
                race.add(&format!("kernel {threads}"), rate(pool, &rays, |ray| bvh.closest_hit(ray).is_some()));
            }
            for (threads, pool) in &pools {
                let pace = pool.install(|| pace(&scene, Params::default_preset(1), effort.rays(SOLVER_RAYS)))?;
                race.add(&format!("solver {threads}"), pace.whole);
            }
        }
        scenes.push(json!({"scene": name, "rates": race.json()}));
    }
    Ok(Outcome::Measured(json!({"solver_rays": effort.rays(SOLVER_RAYS), "scenes": scenes})))
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let (mut rows, mut targets, mut turns) = (Vec::new(), Vec::new(), 0);
    for item in top.get("scenes")?.items()? {
        let name = item.get("scene")?.text()?;
        let race = Race::read(item.get("rates")?)?;
        turns = race.turns();
        let ratio = race.ratio("solver 2", "solver 1")?;
        rows.push(vec![
            name.to_owned(),
            millions(race.median("solver 1")?),
            millions(race.median("solver 2")?),
            times(ratio),
            times(race.ratio("kernel 2", "kernel 1")?),
        ]);
        targets.push(Target::at_least(format!("{name}: two threads over one, whole solver"), TARGET, ratio, times));
    }
    let text = format!(
        "The whole solver from nothing to {} rays (default preset), Mray/s, on one thread and on two, in turns ({turns} each), medians. \
         The last column is the ray kernel alone on unsorted rays: what the machine itself gives.\n\n{}",
        top.get("solver_rays")?.number()?,
        table(&["scene", "1 thread", "2 threads", "gain", "kernel alone"], &rows),
    );
    Ok(Section { title: "Threads", text, figures: Vec::new(), targets })
}
