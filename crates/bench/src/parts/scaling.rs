//! Cost of a ray from thousands of patches to ten million, on the same triangles.

use serde_json::{Value, json};
use twinray::solve::Params;
use twinray_validate::plot::{Axis, Corner, Plot, Series, Style};
use twinray_validate::report::Figure;

use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, decades, millions, table, times};
use crate::measure::{median, pool, timed};
use crate::results::Reader;
use crate::solving::{scene, start};

/// The part.
pub const PART: Part = Part { name: "scaling", what: "cost of a ray from 10^3 to 10^7 patches", measure, describe };

const SCENES: [&str; 2] = ["hall-diffuse", "cornell"];
const PATCHES: [usize; 5] = [1_000, 10_000, 100_000, 1_000_000, 10_000_000];
/// Rays that are timed: at least so many, and at least so many a patch.
const RAYS: u64 = 2_000_000;
const RAYS_PER_PATCH: u64 = 2;
/// Rays a patch before the clock runs, instead of the warm start: its many small steps would take most of the time of this part,
/// and where rays start depends little on it after a wave.
const BEFORE: f64 = 0.5;
const TURNS: usize = 3;
const TARGET: f64 = 2.0;

fn measure(effort: Effort) -> Result<Outcome, String> {
    let two = pool(2)?;
    let mut scenes = Vec::new();
    for name in SCENES {
        let mut points = Vec::new();
        for patches in PATCHES.map(|p| effort.patches(p)) {
            let (scene, building) = timed(|| two.install(|| scene(name, Some(patches))));
            let scene = scene?;
            if scene.triangle_count() > patches {
                continue; // no fewer patches than triangles
            }
            let rays = effort.rays(RAYS).max(RAYS_PER_PATCH * scene.len() as u64);
            // Of the largest a turn is long, and what disturbs it averages out.
            let turns = if patches > 2_000_000 { 1 } else { effort.turns(TURNS) };
            let cost = |_| {
                let params = Params { warm_start: 0.0, ..Params::default_preset(1) };
                let (mut solver, _) = start(&scene, params)?;
                solver.run((BEFORE * scene.len() as f64) as u64 + 1);
                let first = solver.rays();
                let ((), seconds) = timed(|| solver.run(first + rays));
                Ok::<f64, String>(1e9 * seconds / (solver.rays() - first) as f64)
            };
            let costs: Vec<f64> = (0..turns).map(|turn| two.install(|| cost(turn))).collect::<Result<_, String>>()?;
            eprintln!("  {name}, {} patches: {:.0} ns", scene.len(), median(&costs));
            points.push(json!({
                "patches": scene.len(),
                "rays": rays,
                "nanoseconds": median(&costs),
                "building_seconds": building,
            }));
        }
        scenes.push(json!({"scene": name, "points": points}));
    }
    Ok(Outcome::Measured(json!({"scenes": scenes})))
}

fn describe(result: &Value) -> Result<Section, String> {
    let (mut rows, mut series, mut targets) = (Vec::new(), Vec::new(), Vec::new());
    for (look, item) in Reader::new(result).get("scenes")?.items()?.iter().enumerate() {
        let name = item.get("scene")?.text()?;
        let mut points = Vec::new();
        for point in item.get("points")?.items()? {
            let number = |key: &str| point.get(key)?.number();
            let (patches, cost) = (number("patches")?, number("nanoseconds")?);
            points.push((patches, cost));
            let building = format!("{:.2}", number("building_seconds")?);
            rows.push(vec![
                name.to_owned(),
                patches.to_string(),
                millions(number("rays")?),
                format!("{cost:.0}"),
                building,
            ]);
        }
        let nearest = |wish: f64| {
            let distance = |p: &(f64, f64)| (p.0 / wish).ln().abs();
            points.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        if let (Some(small), Some(large)) = (nearest(1e4), nearest(1e7)) {
            let what = format!("{name}: cost of a ray at 10⁷ patches over that at 10⁴");
            targets.push(Target::at_most(what, TARGET, large.1 / small.1, times));
        }
        series.push(Series { name: name.to_owned(), style: Style::Line, look, points });
    }
    let all = || series.iter().flat_map(|s| &s.points);
    let highest = all().map(|p| p.1).fold(0.0, f64::max);
    let plot = Plot {
        title: "cost of a ray by number of patches".into(),
        x: Axis { label: "patches", range: decades(all().map(|p| p.0)), logarithmic: true },
        y: Axis {
            label: "ns a ray, two threads",
            range: [0.0, (highest / 250.0).ceil().max(1.0) * 250.0],
            logarithmic: false,
        },
        series,
        legend: Corner::UpperLeft,
    };
    let text = format!(
        "Rays see the author's triangles, and patches are cells of these found by arithmetic, so what grows with the number of patches is \
         memory: choosing the patch, adding to it, and going over all of them once a wave. Default preset on two threads, without the warm start, whose \
         many small steps would take most of the time here; instead, a wave is shot before the clock runs. At least {} M rays and {RAYS_PER_PATCH} a \
         patch are timed, median of {TURNS} (the largest once). *Building* is what cutting the scene into patches and its ray kernel take.\n\n{}",
        millions(RAYS as f64),
        table(&["scene", "patches", "rays, M", "ns a ray", "building, s"], &rows),
    );
    let caption = "Wall-clock time of a run over its rays, two threads.".into();
    let figures = vec![Figure { name: "scaling", caption, svg: plot.svg() }];
    Ok(Section { title: "More patches", text, figures, targets })
}
