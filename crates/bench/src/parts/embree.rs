//! The same rays through Embree, where it is installed.

use serde_json::{Value, json};
use twinray::scene::PatchScene;
use twinray::solve::Params;
use twinray_rays::{Bvh, Ray};

use super::kernel::{RAYS, SCENES, SOLVER_RAYS, rate};
use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, millions, share, table, times};
use crate::embree::{Embree, MANNERS, Scene};
use crate::measure::{Race, pool};
use crate::rays;
use crate::results::Reader;
use crate::solving::{pace, scene};

/// The part.
pub const PART: Part =
    Part { name: "embree", what: "the same rays through Embree, where it is installed", measure, describe };

const TURNS: usize = 3;
/// Hits nearer together than this, relative to their distance, are one point of two triangles that meet there.
const SAME_PLACE: f32 = 1e-4;

fn measure(effort: Effort) -> Result<Outcome, String> {
    let embree = match Embree::open() {
        Ok(embree) => embree,
        Err(why) => return Ok(Outcome::Skipped(why)),
    };
    eprintln!("  Embree {}", embree.version());
    let [one, two] = [pool(1)?, pool(2)?];
    let solved: Vec<PatchScene> =
        SCENES.iter().map(|name| scene(name, effort.scene_patches())).collect::<Result<_, String>>()?;
    // The scenes have the same triangles.
    let triangles = rays::triangles(&solved[0]);
    let rays = rays::incoherent(&solved[0], effort.rays(RAYS) as usize, 1);
    let bvh = Bvh::build(&triangles);
    let theirs: Vec<(&str, Scene)> = MANNERS
        .iter()
        .map(|(name, manner)| Ok((*name, embree.scene(&triangles, *manner)?)))
        .collect::<Result<_, String>>()?;

    let [mut single, mut double] = [Race::default(), Race::default()];
    for turn in 0..effort.turns(TURNS) {
        eprintln!("  turn {}", turn + 1);
        for (threads, race) in [(&one, &mut single), (&two, &mut double)] {
            race.add("twinray", rate(threads, &rays, |ray| bvh.closest_hit(ray).is_some()));
            for (name, scene) in &theirs {
                race.add(name, rate(threads, &rays, |ray| scene.closest(ray).is_some()));
            }
        }
        for (name, scene) in SCENES.iter().zip(&solved) {
            let pace = two.install(|| pace(scene, Params::default_preset(1), effort.rays(SOLVER_RAYS)))?;
            double.add(name, pace.whole);
        }
    }
    let differences: Vec<Value> = theirs.iter().map(|(name, scene)| differences(name, &rays, &bvh, scene)).collect();
    Ok(Outcome::Measured(json!({
        "version": embree.version(),
        "rays": rays.len(),
        "solver_rays": effort.rays(SOLVER_RAYS),
        "one_thread": single.json(),
        "two_threads": double.json(),
        "differences": differences,
    })))
}

/// Rays that meet another triangle in Embree than in our kernel: in the same place, and elsewhere.
fn differences(name: &str, rays: &[Ray], bvh: &Bvh, theirs: &Scene) -> Value {
    let (mut same_place, mut elsewhere) = (0, 0);
    for ray in rays {
        match (bvh.closest_hit(ray), theirs.closest(ray)) {
            (Some(hit), Some((triangle, t))) if hit.triangle != triangle => {
                let near = (hit.t - t).abs() <= SAME_PLACE * hit.t.max(t);
                *(if near { &mut same_place } else { &mut elsewhere }) += 1;
            }
            (Some(_), None) | (None, Some(_)) => elsewhere += 1,
            _ => {}
        }
    }
    json!({"manner": name, "same_place": same_place, "elsewhere": elsewhere})
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let rays = top.get("rays")?.number()?;
    let one = Race::read(top.get("one_thread")?)?;
    let two = Race::read(top.get("two_threads")?)?;
    // The opponent is the faster of both robust trees.
    let robust = [MANNERS[0].0, MANNERS[1].0];
    let faster = if two.median(robust[0])? >= two.median(robust[1])? { robust[0] } else { robust[1] };

    let mut rows = Vec::new();
    for name in std::iter::once("twinray").chain(MANNERS.map(|m| m.0)) {
        let shown = if name == "twinray" { "twinray, watertight".to_owned() } else { format!("Embree, {name}") };
        let ratio = |race: &Race| race.ratio("twinray", name).map(times);
        rows.push(vec![shown, millions(one.median(name)?), millions(two.median(name)?), ratio(&one)?, ratio(&two)?]);
    }
    let mut differences = Vec::new();
    for item in top.get("differences")?.items()? {
        let per_million = |key: &str| Ok::<_, String>(format!("{:.1}", item.get(key)?.number()? / rays * 1e6));
        let name = format!("Embree, {}", item.get("manner")?.text()?);
        differences.push(vec![name, per_million("same_place")?, per_million("elsewhere")?]);
    }
    let (mut solver, mut targets) = (Vec::new(), Vec::new());
    for name in SCENES {
        let ratio = two.ratio(name, faster)?;
        solver.push(format!("{name} {} Mray/s = {} of it", millions(two.median(name)?), share(ratio)));
        let what = format!("{name}: whole solver over Embree's robust single rays, unsorted");
        targets.push(Target::at_least(what, 1.0, ratio, times));
    }
    let text = format!(
        "The rays of the last section, unsorted ({rays:.0} a turn), through Embree {}, one ray a call, found at run time. *Robust* is \
         the scene flag that closes gaps between triangles, as our kernel does; *high quality* builds with spatial splits. \
         Contestants take turns \
         ({} each). Embree's manual advises to flush denormal numbers to zero, which is not done here.\n\nMray/s:\n\n{}\n\nThe whole solver on two threads, to {} rays, in the same turns, against the faster of both robust \
         trees ({faster}): {}.\n\nDo both find the same? Rays, per million, that meet another triangle in Embree: in the same place (an edge \
         that triangles share), and elsewhere, which would be a fault of one of the two. Embree knows no triangle to skip; rays start a \
         millionth above theirs, as the solver's do.\n\n{}",
        top.get("version")?.text()?,
        two.turns(),
        table(&["", "1 thread", "2 threads", "twinray over it, 1 thread", "2 threads"], &rows),
        top.get("solver_rays")?.number()?,
        solver.join(", "),
        table(&["", "same place", "elsewhere"], &differences),
    );
    Ok(Section { title: "Beside Embree", text, figures: Vec::new(), targets })
}
