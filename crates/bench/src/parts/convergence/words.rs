//! The convergence part's section: tables of rays and seconds to an error, and plots.

use serde_json::Value;
use twinray_validate::plot::{Axis, Corner, Plot, Series, Style};
use twinray_validate::report::Figure;

use super::{ALBEDO, ROOM_TARGET, SCENES, TARGETS};
use crate::curve::{self, Crossing, Known, Point, crossing};
use crate::document::{Section, Target, decades, digits, millions, percent, seconds, share, table, times};
use crate::results::Reader;

/// The default preset needs so many times fewer rays than the paper's to this error; in other scenes never more.
const FEWER: f64 = 1.7;
const FEWER_SCENES: [&str; 2] = ["cornell", "doorway"];
const AT: f64 = 0.02;
/// Seconds of the default preset in the halls, to an error.
const HALL: [(f64, f64); 2] = [(0.05, 2.5), (0.02, 16.0)];

/// Seconds of other programs to 5 % and to 2 % of error, for the scenes that are called here what they were there: mean irradiance
/// of every triangle, two threads, set-up excluded; measured once, on another machine (a Xeon of the cloud). In order: particle
/// tracing scripted on Mitsuba 3.9 with Embree, and Blender 5.0's Cycles with one texel for each triangle.
const PEERS: [(&str, [f64; 2], [f64; 2]); 4] = [
    ("cornell", [1.1, 6.7], [12.8, 80.0]),
    ("doorway", [0.6, 3.7], [20.0, 123.0]),
    ("hall-diffuse", [7.4, 46.0], [106.0, 661.0]),
    ("hall", [8.3, 52.0], [243.0, 1517.0]),
];
const PEER_ERRORS: [f64; 2] = [0.05, 0.02];
/// How many times faster the default preset is to be.
const FASTER: [(&str, f64); 2] = [("particle tracing on Embree", 3.0), ("Cycles", 40.0)];

/// A scene's stored curves.
struct Curves<'a> {
    scene: &'a str,
    patches: f64,
    reference_rays: f64,
    reference_error: f64,
    kernel_rate: f64,
    presets: Vec<(&'a str, Vec<Point>)>,
}

impl<'a> Curves<'a> {
    fn read(item: &Reader<'a>) -> Result<Self, String> {
        let preset = |c: &Reader<'a>| Ok((c.get("preset")?.text()?, curve::read(&c.get("points")?)?));
        Ok(Self {
            scene: item.get("scene")?.text()?,
            patches: item.get("patches")?.number()?,
            reference_rays: item.get("reference_rays")?.number()?,
            reference_error: item.get("reference_error")?.number()?,
            kernel_rate: item.get("kernel_rate")?.number()?,
            presets: item.get("curves")?.items()?.iter().map(preset).collect::<Result<_, String>>()?,
        })
    }

    fn crossing(&self, preset: &str, target: f64) -> Option<Crossing> {
        let (_, points) = self.presets.iter().find(|(name, _)| *name == preset)?;
        crossing(points, target)
    }

    /// Rays of one preset over those of another, and whether both were measured.
    fn ratio(&self, preset: &str, other: &str, target: f64) -> Option<(f64, &'static str)> {
        let (a, b) = (self.crossing(preset, target)?, self.crossing(other, target)?);
        let note = if a.known == Known::Measured && b.known == Known::Measured { "" } else { "≈ " };
        Some((a.rays / b.rays, note))
    }
}

/// The section.
pub fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let scenes: Vec<Curves> = top.get("scenes")?.items()?.iter().map(Curves::read).collect::<Result<_, _>>()?;
    let room = top.get("room")?;
    let text = format!(
        "The error is the relative RMS error over patches, √(ΣA ΔE²/ΣA E²) of luminance, emitters left out, as everywhere in this project. \
         *Paper* is `--preset paper` (one thread by nature), *default* the default preset, *forward only* the default with the deposit on \
         the hit alone; all with one seed, on two threads. The reference is the mean of two default solves of together {} M rays with other seeds; its own \
         noise, known from their difference, is subtracted from the squares. Seconds are of the solver alone, from nothing, warm start \
         included; rays too. Values between two looks are interpolated in logarithms. **≈** marks what was not waited for: there the error is \
         carried on as rays^slope, with the slope of the last five looks, at the pace of the last two. ≤ marks errors that were reached \
         before the first look.\n\nRays, M:\n\n{}\n\nSeconds:\n\n{}\n\nHow many times more rays than the default, to {} (the measured \
         ratio scatters by some percent from seed to seed):\n\n{}\n\n{}\n\n{}",
        millions(scenes.first().map_or(0.0, |c| c.reference_rays)),
        reached(&scenes, |c| millions(c.rays)),
        reached(&scenes, |c| digits(c.seconds)),
        share(AT),
        ratios(&scenes),
        peers(&scenes),
        closed_room(&room)?,
    );
    let figures = SCENES.iter().filter_map(|(name, ..)| figure(scenes.iter().find(|c| c.scene == *name)?)).collect();
    Ok(Section { title: "Rays and seconds to a given error", text, figures, targets: targets(&scenes) })
}

fn targets(scenes: &[Curves]) -> Vec<Target> {
    let mut targets = Vec::new();
    for curves in scenes {
        let bound = if FEWER_SCENES.iter().any(|s| curves.scene.starts_with(s)) { FEWER } else { 1.0 };
        if let Some((ratio, note)) = curves.ratio("paper", "default", AT) {
            let what = format!("{}: rays of the paper preset over the default's, to {}", curves.scene, share(AT));
            targets.push(Target::at_least(what, bound, ratio, times).noted(note));
        }
    }
    for curves in scenes.iter().filter(|c| c.scene.starts_with("hall")) {
        for (error, bound) in HALL {
            if let Some(c) = curves.crossing("default", error) {
                let rate = millions(curves.kernel_rate);
                let what = format!(
                    "{}: default preset to {} (kernel alone in this run: {rate} Mray/s)",
                    curves.scene,
                    share(error)
                );
                targets.push(Target::at_most(what, bound, c.seconds, seconds).noted(mark(c.known)));
            }
        }
    }
    for (name, particles, cycles) in PEERS {
        let Some(curves) = scenes.iter().find(|c| c.scene == name) else { continue };
        for (k, error) in PEER_ERRORS.into_iter().enumerate() {
            let Some(ours) = curves.crossing("default", error) else { continue };
            for ((peer, bound), theirs) in FASTER.into_iter().zip([particles[k], cycles[k]]) {
                let what = format!("{name}: seconds of {peer} (other machine) over the default's, to {}", share(error));
                targets.push(Target::at_least(what, bound, theirs / ours.seconds, times).noted(mark(ours.known)));
            }
        }
    }
    targets
}

/// The bake of other programs beside ours.
fn peers(scenes: &[Curves]) -> String {
    let mut rows = Vec::new();
    for (name, particles, cycles) in PEERS {
        let Some(curves) = scenes.iter().find(|c| c.scene == name) else { continue };
        for (k, error) in PEER_ERRORS.into_iter().enumerate() {
            let Some(ours) = curves.crossing("default", error) else { continue };
            let ratio = |theirs: f64| format!("{} ({:.1}×)", digits(theirs), theirs / ours.seconds);
            rows.push(vec![
                name.to_owned(),
                share(error),
                format!("{}{}", mark(ours.known), digits(ours.seconds)),
                ratio(particles[k]),
                ratio(cycles[k]),
            ]);
        }
    }
    format!(
        "Beside other programs that bake the mean irradiance of every triangle of the same surfaces. Their seconds were measured once, with two \
         threads of another machine (a Xeon, on which the ray kernel of Embree took about twice the time that it takes here), so ratios say which of \
         them is faster, and not by how many percent. Particle tracing is scripted on Mitsuba 3.9 with Embree; Cycles is that of Blender 5.0, one \
         texel a triangle.\n\n{}",
        table(&["scene", "error", "default, s", "particle tracing, s", "Cycles, s"], &rows)
    )
}

fn mark(known: Known) -> &'static str {
    match known {
        Known::Measured => "",
        Known::AtMost => "≤ ",
        Known::Extrapolated => "≈ ",
    }
}

/// A table with a row for every scene and preset, and a column for every error.
fn reached(scenes: &[Curves], show: impl Fn(Crossing) -> String) -> String {
    let mut rows = Vec::new();
    for curves in scenes {
        for (preset, points) in &curves.presets {
            let cell = |target: &f64| {
                crossing(points, *target).map_or("–".to_owned(), |c| mark(c.known).to_owned() + &show(c))
            };
            let mut row = vec![curves.scene.to_owned(), format!("{}", curves.patches), (*preset).to_owned()];
            row.extend(TARGETS.iter().map(cell));
            rows.push(row);
        }
    }
    let mut head = vec!["scene".to_owned(), "patches".to_owned(), "preset".to_owned()];
    head.extend(TARGETS.iter().map(|t| format!("{:.0} %", 100.0 * t)));
    table(&head.iter().map(String::as_str).collect::<Vec<_>>(), &rows)
}

fn ratios(scenes: &[Curves]) -> String {
    let cell = |r: Option<(f64, &str)>| r.map_or("–".to_owned(), |(ratio, note)| note.to_owned() + &times(ratio));
    let row = |c: &Curves| {
        let of = |preset| cell(c.ratio(preset, "default", AT));
        vec![c.scene.to_owned(), of("paper"), of("forward only"), percent(c.reference_error)]
    };
    let rows: Vec<Vec<String>> = scenes.iter().map(row).collect();
    table(&["scene", "paper", "forward only", "the reference's own error"], &rows)
}

fn closed_room(room: &Reader) -> Result<String, String> {
    let number = |key: &str| room.get(key)?.number();
    let points = curve::read(&room.get("points")?)?;
    let mut cells = Vec::new();
    for target in TARGETS {
        if let Some(c) = crossing(&points, target) {
            let (note, rays) = (mark(c.known), millions(c.rays));
            cells.push(format!("{:.0} % at {note}{rays} M rays ({note}{})", 100.0 * target, seconds(c.seconds)));
        }
    }
    Ok(format!(
        "In a closed room of albedo {ALBEDO} (`furnace`, {} patches, whose light is known; all its surfaces emit, so none is left out) the \
         default reaches {}. The paper's average of equal weights lacks Γ(n+ρ)/(Γ(n+1)Γ(ρ)) ≈ n^−(1−ρ)/Γ(ρ) of the light after n \
         iterations, without any noise: {} of it only after {} iterations. Measured after {} M iterations: {} of the light are missing, \
         where the law says {}; the error over patches is {}.",
        number("patches")?,
        cells.join(", "),
        share(ROOM_TARGET),
        digits(number("law_rays")?),
        millions(number("paper_rays")?),
        percent(number("paper_missing")?),
        percent(number("law_missing")?),
        percent(number("paper_error")?),
    ))
}

fn figure(curves: &Curves) -> Option<Figure> {
    // Names of files are part of the program.
    let name = match curves.scene {
        "cornell" => "error-cornell",
        "doorway" => "error-doorway",
        "hall-diffuse" => "error-hall-diffuse",
        "hall" => "error-hall",
        _ => return None,
    };
    let all = || curves.presets.iter().flat_map(|(_, points)| points);
    let lines = curves.presets.iter().enumerate().map(|(look, (name, points))| Series {
        name: (*name).to_owned(),
        style: Style::Line,
        look,
        points: points.iter().filter(|p| p.error > 0.0).map(|p| (p.seconds, p.error)).collect(),
    });
    let plot = Plot {
        title: format!("{}: error of patch irradiance over time", curves.scene),
        x: Axis { label: "seconds, two threads", range: decades(all().map(|p| p.seconds)), logarithmic: true },
        y: Axis { label: "relative RMS error", range: decades(all().map(|p| p.error)), logarithmic: true },
        series: lines.collect(),
        legend: Corner::LowerLeft,
    };
    let caption = format!("`{}`, {} patches; the paper's preset uses one thread.", curves.scene, curves.patches);
    Some(Figure { name, caption, svg: plot.svg() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_stored_result_is_put_into_words() {
        let points = |factor: f64| {
            let at = |k: i32| {
                let rays = 1e5 * f64::from(1 << k);
                Point { rays, seconds: 1e-6 * rays, error: factor * 100.0 / rays.sqrt() }
            };
            curve::json(&(0..8).map(at).collect::<Vec<_>>())
        };
        // Twice the error is four times the rays; 2 % at 25 M and 100 M rays, of which 12.8 M were shot.
        let scene = json!({
            "scene": "cornell", "patches": 1000, "reference_rays": 1, "reference_error": 0.001, "kernel_rate": 5e6,
            "curves": [
                {"preset": "paper", "points": points(2.0)},
                {"preset": "forward only", "points": points(1.4)},
                {"preset": "default", "points": points(1.0)},
            ],
        });
        let room = json!({
            "patches": 10, "points": points(0.1), "paper_rays": 5e6, "paper_error": 0.3, "paper_missing": 0.2,
            "law_missing": 0.2, "law_rays": 5.5e16,
        });
        let section = describe(&json!({"scenes": [scene], "room": room})).unwrap();
        assert!(
            section.text.contains("| cornell | 1000 | default | 1.00 | 4.00 | ≈ 25.0 | ≈ 100 |"),
            "{}",
            section.text
        );
        assert!(section.text.contains("after 5.5e16 iterations"), "{}", section.text);
        let target =
            Target::at_least("cornell: rays of the paper preset over the default's, to 2 %".into(), 1.7, 4.0, times);
        let [first, peers @ ..] = section.targets.as_slice() else { panic!("no target") };
        assert_eq!(*first, target.noted("≈ "));
        // Two programs at two errors; 5 % take 4 s here.
        assert_eq!(peers.len(), 4);
        let particles =
            "cornell: seconds of particle tracing on Embree (other machine) over the default's, to 5 %".to_owned();
        assert_eq!(peers[0], Target::at_least(particles, 3.0, 1.1 / 4.0, times));
        assert!(section.text.contains("| cornell | 5 % | 4.00 | 1.10 (0.3×) | 12.8 (3.2×) |"), "{}", section.text);
        assert_eq!(section.figures.len(), 1);
    }
}
