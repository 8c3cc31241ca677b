//! The ray kernel alone, and how near the whole solver comes to it.

use rayon::ThreadPool;
use serde_json::{Value, json};
use twinray::scene::PatchScene;
use twinray::solve::Params;
use twinray_rays::{Bvh, Ray};

use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, millions, table, times};
use crate::measure::{Race, pool, timed};
use crate::rays::{self, SORT_BLOCK};
use crate::results::Reader;
use crate::solving::{pace, scene};

/// The part.
pub const PART: Part =
    Part { name: "kernel", what: "the ray kernel alone, and the whole solver over it", measure, describe };

/// Rays of a turn of the kernel: what lies in no cache.
pub const RAYS: u64 = 1 << 21;
/// Rays of a turn of the solver.
pub const SOLVER_RAYS: u64 = 10_000_000;
/// Turns of every contestant.
const TURNS: usize = 5;
/// Scenes of the same triangles: the one with a polished floor, the other matte.
pub const SCENES: [&str; 2] = ["hall", "hall-diffuse"];

const SORTED_TARGET: f64 = 0.6;

/// The kernel over a scene's triangles, with rays in both orders.
struct Range {
    bvh: Bvh,
    unsorted: Vec<Ray>,
    sorted: Vec<Ray>,
    sort_seconds: f64,
}

impl Range {
    fn new(scene: &PatchScene, count: u64, threads: &ThreadPool) -> Self {
        let unsorted = rays::incoherent(scene, count as usize, 1);
        let (sorted, sort_seconds) = timed(|| threads.install(|| rays::sorted(&unsorted)));
        Self { bvh: Bvh::build(&rays::triangles(scene)), unsorted, sorted, sort_seconds }
    }

    fn turn(&self, threads: &ThreadPool, race: &mut Race) {
        for (name, rays) in [("unsorted", &self.unsorted), ("sorted", &self.sorted)] {
            race.add(name, rate(threads, rays, |ray| self.bvh.closest_hit(ray).is_some()));
        }
    }
}

/// Rays a second of one way to trace.
pub fn rate(threads: &ThreadPool, rays: &[Ray], meets: impl Fn(&Ray) -> bool + Sync) -> f64 {
    let (hits, seconds) = timed(|| threads.install(|| rays::hits(rays, &meets)));
    // The hits must be wanted, or the work may be left out.
    assert!(hits > rays.len() / 2, "most rays of a closed hall meet something");
    rays.len() as f64 / seconds
}

fn measure(effort: Effort) -> Result<Outcome, String> {
    let [one, two] = [pool(1)?, pool(2)?];
    let mut scenes = Vec::new();
    let mut single = Race::default();
    let mut sort_rate = 0.0;
    for name in SCENES {
        let scene = scene(name, effort.scene_patches())?;
        let range = Range::new(&scene, effort.rays(RAYS), &two);
        let mut race = Race::default();
        for turn in 0..effort.turns(TURNS) {
            eprintln!("  {name}, turn {}", turn + 1);
            range.turn(&two, &mut race);
            let pace = two.install(|| pace(&scene, Params::default_preset(1), effort.rays(SOLVER_RAYS)))?;
            race.add("solver", pace.whole);
            race.add("waves", pace.later);
            if name == SCENES[0] {
                range.turn(&one, &mut single);
            }
        }
        sort_rate = range.unsorted.len() as f64 / range.sort_seconds;
        scenes.push(json!({
            "scene": name,
            "triangles": scene.triangle_count(),
            "patches": scene.len(),
            "rates": race.json(),
        }));
    }
    Ok(Outcome::Measured(json!({
        "rays": effort.rays(RAYS),
        "solver_rays": effort.rays(SOLVER_RAYS),
        "sort_rate": sort_rate,
        "one_thread": single.json(),
        "scenes": scenes,
    })))
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let number = |key: &str| top.get(key)?.number();
    let one = Race::read(top.get("one_thread")?)?;
    let (mut raw, mut whole, mut targets) = (Vec::new(), Vec::new(), Vec::new());
    let mut turns = 0;
    for item in top.get("scenes")?.items()? {
        let name = item.get("scene")?.text()?;
        let race = Race::read(item.get("rates")?)?;
        turns = race.turns();
        if raw.is_empty() {
            for (threads, race) in [("1", &one), ("2", &race)] {
                let (unsorted, sorted) = (race.median("unsorted")?, race.median("sorted")?);
                let gain = times(race.ratio("sorted", "unsorted")?);
                raw.push(vec![threads.to_owned(), millions(unsorted), millions(sorted), gain]);
            }
        }
        let (over_unsorted, over_sorted) = (race.ratio("solver", "unsorted")?, race.ratio("solver", "sorted")?);
        whole.push(vec![
            name.to_owned(),
            format!("{}", item.get("triangles")?.number()?),
            format!("{}", item.get("patches")?.number()?),
            millions(race.median("solver")?),
            millions(race.median("waves")?),
            times(over_unsorted),
            times(over_sorted),
            times(race.ratio("waves", "sorted")?),
        ]);
        let what = format!("{name}: whole solver over the kernel alone, rays sorted");
        targets.push(Target::at_least(what, SORTED_TARGET, over_sorted, times));
    }
    let text = format!(
        "How fast rays find their nearest hit, and what of it is left when light is computed with them. The kernel runs alone over \
         the triangles of the scene with {} rays a turn: uniform points on the surfaces by area, cosine-distributed directions on the \
         front. *Sorted* rays are in blocks of {SORT_BLOCK} by direction octant, then along the Morton curve of their origins; the \
         time to sort them is not counted, which makes the comparison harder for the solver, since whatever it sorts it pays for (sorting alone: \
         {} Mray/s on two threads). The *whole solver* is the default preset from nothing to {} rays, warm start, selection, \
         deposits and all; *after a fifth* counts only what comes after the first fifth of the rays, when set-up and warm \
         start are over. Kernel and solver take turns ({turns} each, two threads); rates are medians, ratios medians of the ratios \
         within a turn.\n\nThe kernel alone, hall, Mray/s:\n\n{}\n\nThe solver, Mray/s, and over the kernel alone:\n\n{}",
        number("rays")?,
        millions(number("sort_rate")?),
        number("solver_rays")?,
        table(&["threads", "unsorted", "sorted", "sorted / unsorted"], &raw),
        table(
            &[
                "scene",
                "triangles",
                "patches",
                "whole solver",
                "after a fifth",
                "whole / unsorted",
                "whole / sorted",
                "after a fifth / sorted"
            ],
            &whole
        ),
    );
    Ok(Section { title: "The ray kernel, and the solver over it", text, figures: Vec::new(), targets })
}
