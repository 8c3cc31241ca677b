//! Where the nanoseconds of one iteration go.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use serde_json::{Value, json};
use twinray::solve::{Params, Stage};

use super::kernel::SCENES;
use super::{Effort, Outcome, Part};
use crate::document::{Section, table};
use crate::measure::{median, pool, timed};
use crate::results::Reader;
use crate::solving::{scene, start};

/// The part.
pub const PART: Part = Part { name: "stages", what: "nanoseconds of one iteration, stage by stage", measure, describe };

const RAYS: u64 = 5_000_000;
const TURNS: usize = 3;

/// In the order of the table.
const STAGES: [(Stage, &str, &str); 7] = [
    (Stage::Freeze, "freeze", "powers, stand-ins, the sums behind the choice"),
    (Stage::Order, "order", "rays in order of their first number"),
    (Stage::Shoot, "shoot", "choice of the patch, point, direction"),
    (Stage::Trace, "trace", "closest hit, and the cell that was hit"),
    (Stage::Estimate, "estimate", "light and densities at both ends, deposits by buckets"),
    (Stage::Deposit, "deposit", "sums of buckets, entered into the state"),
    (Stage::Wait, "wait", "a second thread's part of freeze and deposit, and its waiting"),
];

thread_local! {
    static LAST: Cell<Option<Instant>> = const { Cell::new(None) };
}

fn measure(effort: Effort) -> Result<Outcome, String> {
    let mut scenes = Vec::new();
    for name in SCENES {
        let scene = scene(name, effort.scene_patches())?;
        for threads in [1, 2] {
            let mut turns = Vec::new();
            for turn in 1..=effort.turns(TURNS) {
                eprintln!("  {name}, {threads} threads, turn {turn}");
                turns.push(pool(threads)?.install(|| stages(&scene, effort.rays(RAYS), threads))?);
            }
            scenes.push(json!({"scene": name, "threads": threads, "turns": turns}));
        }
    }
    Ok(Outcome::Measured(json!({"rays": effort.rays(RAYS), "scenes": scenes})))
}

/// Thread-nanoseconds a ray of the waves after the warm start, by stage, and of all together.
fn stages(scene: &twinray::scene::PatchScene, rays: u64, threads: usize) -> Result<Value, String> {
    let (mut solver, warm) = start(scene, Params::default_preset(1))?;
    let first = solver.rays();
    let sums: [AtomicU64; STAGES.len()] = Default::default();
    let lap = |stage: Stage| {
        let now = Instant::now();
        let before = LAST.replace(Some(now));
        let place = STAGES.iter().position(|(s, ..)| *s == stage);
        if let (Some(before), Some(place)) = (before, place) {
            sums[place].fetch_add((now - before).as_nanos() as u64, Ordering::Relaxed);
        }
    };
    LAST.set(None);
    let ((), seconds) = timed(|| {
        while solver.rays() < rays.max(first + 1) {
            solver.advance_in_stages(rays, &lap);
        }
    });
    let shot = (solver.rays() - first) as f64;
    let each: Vec<f64> = sums.iter().map(|s| s.load(Ordering::Relaxed) as f64 / shot).collect();
    Ok(json!({"warm_start_seconds": warm, "all": seconds * 1e9 * threads as f64 / shot, "stages": each}))
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let mut columns = Vec::new();
    for item in top.get("scenes")?.items()? {
        let turns = item.get("turns")?.items()?;
        let middle = |value: &dyn Fn(&Reader) -> Result<f64, String>| {
            Ok::<f64, String>(median(&turns.iter().map(value).collect::<Result<Vec<f64>, String>>()?))
        };
        let mut column = Vec::new();
        for k in 0..STAGES.len() {
            column.push(middle(&|turn: &Reader| {
                turn.get("stages")?.items()?.get(k).ok_or("a stage is missing".to_owned())?.number()
            })?);
        }
        column.push(middle(&|turn: &Reader| turn.get("all")?.number())?);
        let (name, threads) = (item.get("scene")?.text()?, item.get("threads")?.number()?);
        columns.push((format!("{name}, {threads} thr."), column));
    }
    let names: Vec<(&str, &str)> =
        STAGES.iter().map(|(_, name, what)| (*name, *what)).chain([("all", "by the clock on the wall")]).collect();
    let rows: Vec<Vec<String>> = (names.iter().enumerate())
        .map(|(k, (name, what))| {
            let figures = columns.iter().map(|(_, column)| format!("{:.0}", column[k]));
            [(*name).to_owned(), (*what).to_owned()].into_iter().chain(figures).collect()
        })
        .collect();
    let mut head = vec!["stage", "what it does"];
    head.extend(columns.iter().map(|(name, _)| name.as_str()));
    let text = format!(
        "Thread-nanoseconds a ray of the waves up to {} rays (warm start left out), default preset; the solver tells the end of each \
         stage of every task, the benchmark reads the clock. Medians.\n\n{}\n\n\
         Before rays were shot in order, in stages, and summed by buckets, the same run took 885 ns a ray on one thread in `hall-diffuse` \
         and 1250 in `hall`. A sampling profile of `hall-diffuse` then read: closest hit 330, choice, point and direction about 210, atomic \
         deposits and their material look-ups 150, light at both ends 60, cells of hits 40, freezing and closing of waves 50. So the \
         deposits and the light at both ends cost 2.5 times what they cost now, and the rays themselves a quarter more.",
        top.get("rays")?.number()?,
        table(&head, &rows),
    );
    Ok(Section { title: "Where the nanoseconds go", text, figures: Vec::new(), targets: Vec::new() })
}
