//! The paper's headline: five million iterations in a hall of 78 443 patches.

use serde_json::{Value, json};
use twinray::solve::Params;

use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, millions, percent, seconds, table};
use crate::measure::{Race, pool, timed};
use crate::results::Reader;
use crate::solving::{Reference, scene, start};

/// The part.
pub const PART: Part =
    Part { name: "headline", what: "the paper's run: 5 million iterations in the hall", measure, describe };

const RAYS: u64 = 5_000_000;
const REFERENCE_RAYS: u64 = 15_000_000;
const TURNS: usize = 3;
/// Seconds of the paper's preset and of the default.
const TARGETS: [f64; 2] = [4.0, 1.0];
const PRESETS: [&str; 2] = ["paper", "default"];

fn measure(effort: Effort) -> Result<Outcome, String> {
    let two = pool(2)?;
    let scene = scene("hall", effort.scene_patches())?;
    eprintln!("  reference");
    let reference = two.install(|| Reference::new(&scene, effort.rays(REFERENCE_RAYS)))?;
    let mut race = Race::default();
    let mut presets = Vec::new();
    let turns = effort.turns(TURNS);
    for turn in 1..=turns {
        eprintln!("  turn {turn}");
        for (name, params) in PRESETS.iter().zip([Params::paper_preset(1), Params::default_preset(1)]) {
            let (solution, rays) = two.install(|| {
                let (mut solver, before) = start(&scene, params)?;
                let ((), after) = timed(|| solver.run(effort.rays(RAYS)));
                race.add(name, before + after);
                Ok::<_, String>((solver.solution(), solver.rays()))
            })?;
            // Every turn gives the same light.
            if turn == turns {
                let power = solution.arriving_power(&scene).luminance() / reference.power - 1.0;
                let error = reference.error(&scene, &solution);
                presets.push(json!({"preset": name, "rays": rays, "error": error, "power": power}));
            }
        }
    }
    Ok(Outcome::Measured(json!({
        "patches": scene.len(),
        "reference_rays": reference.rays,
        "reference_error": reference.noise.sqrt(),
        "seconds": race.json(),
        "presets": presets,
    })))
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let number = |key: &str| top.get(key)?.number();
    let race = Race::read(top.get("seconds")?)?;
    let (mut rows, mut targets) = (Vec::new(), Vec::new());
    for (item, bound) in top.get("presets")?.items()?.iter().zip(TARGETS) {
        let name = item.get("preset")?.text()?;
        let number = |key: &str| item.get(key)?.number();
        let time = race.median(name)?;
        rows.push(vec![
            name.to_owned(),
            millions(number("rays")?),
            seconds(time),
            percent(number("error")?),
            format!("{:+.2} %", 100.0 * number("power")?),
        ]);
        targets.push(Target::below(format!("hall: {name} preset, 5 million iterations"), bound, time, seconds));
    }
    let text = format!(
        "The paper's own run: five million iterations in a hall, here of {} patches. The paper's preset is sequential by nature: every \
         ray sees what the last one left, so it uses one thread; the default preset uses two, and rounds up to whole waves. Seconds \
         are of the solver alone, medians of {} turns. Errors are relative RMS errors of patch irradiance against two solves of together \
         {} M rays, whose own noise of {} is subtracted; *power* is the deviation of the arriving power.\n\n{}",
        number("patches")?,
        race.turns(),
        millions(number("reference_rays")?),
        percent(number("reference_error")?),
        table(&["preset", "rays, M", "time", "error", "power"], &rows),
    );
    Ok(Section { title: "The paper's headline run", text, figures: Vec::new(), targets })
}
