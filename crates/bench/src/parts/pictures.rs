//! Seconds to a picture of a given error: the final gather, its solve included, against the path tracer.

use std::path::Path;

use serde_json::{Value, json};
use twinray::format;
use twinray::render::reference::{PathPictureOptions, PixelTracer, Technique};
use twinray::render::{Gather, GatherOptions, Picture};
use twinray::scene::{PatchBudget, PatchOptions, PatchScene, Rgb, Scene, builtin};
use twinray::solve::{Params, Solver};

use super::{Effort, Outcome, Part};
use crate::document::{Section, Target, percent, seconds, table, times};
use crate::measure::{pool, timed};
use crate::results::Reader;

/// The part.
pub const PART: Part = Part {
    name: "pictures",
    what: "seconds to a picture of a given error, against the path tracer",
    measure,
    describe,
};

const WIDTH: u32 = 512;
const HEIGHT: u32 = 384;
/// Rays of the solve per patch: those of `twinray render`.
const RAYS_PER_PATCH: u64 = 100;
/// Mean squared relative errors whose time is told.
const ERRORS: [f64; 3] = [0.01, 0.001, 0.0003];
/// Of the mean luminance, what is added to a pixel's own where errors are relative: the dark must not decide all.
const DARK: f64 = 0.1;
/// Pixels to each side over which the reference is smoothed where something is divided by it.
const REACH: usize = 4;
/// Camera rays per pixel of the gather at its checkpoints.
const CHECKPOINTS: [f64; 6] = [4.0, 8.0, 16.0, 32.0, 64.0, 128.0];
/// Where files of scenes are looked for that are too large to be built in.
const SCENES: &str = "TWINRAY_SCENES";

/// Scenes, the paths per pixel of their reference, and how many times faster is aimed at.
const CASES: [(&str, u32, f64); 4] = [
    ("cornell", 384, 3.0),
    ("hall", 96, 3.0),
    ("modern-hall/modern-hall.glb", 96, 3.0),
    ("veach-ajar/veach-ajar.glb", 160, 10.0),
];

fn measure(effort: Effort) -> Result<Outcome, String> {
    pool(2)?.install(|| {
        let (mut cases, mut missing) = (Vec::new(), Vec::new());
        for (name, paths, aim) in CASES {
            let Some(authored) = authored(name)? else {
                missing.push(name);
                continue;
            };
            let mut case = case(&authored, effort, paths).map_err(|e| format!("{name}: {e}"))?;
            case["scene"] = json!(name.rsplit('/').next().unwrap_or(name).trim_end_matches(".glb"));
            case["aim"] = json!(aim);
            cases.push(case);
        }
        if !missing.is_empty() {
            eprintln!("  left out, since {SCENES} names no folder with them: {}", missing.join(", "));
        }
        Ok(Outcome::Measured(
            json!({ "width": WIDTH, "height": HEIGHT, "rays_per_patch": RAYS_PER_PATCH, "cases": cases }),
        ))
    })
}

/// A built-in scene, or that of a file; `None` if there is no such file.
fn authored(name: &str) -> Result<Option<Scene>, String> {
    if !name.contains('/') {
        return builtin::by_name(name).map(Some).ok_or_else(|| format!("no built-in scene {name}"));
    }
    let Some(folder) = std::env::var_os(SCENES) else { return Ok(None) };
    let path = Path::new(&folder).join(name);
    let Ok(bytes) = std::fs::read(&path) else { return Ok(None) };
    let mut nothing_else = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let reading = format::read_scene(name, &bytes, &mut nothing_else, &Default::default());
    reading.map(|r| Some(r.scene)).map_err(|e| e.to_string())
}

fn case(authored: &Scene, effort: Effort, paths: u32) -> Result<Value, String> {
    let count = effort.scene_patches().or(authored.suggested_patches).unwrap_or(100_000);
    let options = PatchOptions { budget: PatchBudget::Count(count), two_sided: false };
    let scene = PatchScene::new(authored, options).map_err(|e| e.to_string())?;
    let camera = authored.cameras.first().ok_or("no camera")?;
    let (width, height) = if effort == Effort::FULL { (WIDTH, HEIGHT) } else { (WIDTH / 8, HEIGHT / 8) };
    eprintln!("  {}: {} patches, paths", authored.name, scene.len());
    let path_options =
        PathPictureOptions { width, height, crop: None, samples: paths, seed: 77, technique: Technique::Both };
    let mut tracer = PixelTracer::new(&scene, camera, &path_options);
    let paths = if effort == Effort::FULL { paths } else { 8 };
    let ((), path_seconds) = timed(|| tracer.advance(paths));
    let reference = Reference::new(&tracer);

    eprintln!("  {}: solve and gather", authored.name);
    let (solver, starting) = timed(|| Solver::new(&scene, Params::default_preset(1), None));
    let mut solver = solver.map_err(|e| e.to_string())?;
    let ((), solving) = timed(|| solver.run(RAYS_PER_PATCH * scene.len() as u64));
    let solve_seconds = starting + solving;
    let (solution, snapshot) = timed(|| solver.solution());
    let gather_options = GatherOptions { width, height, crop: None, seed: 1, adaptive: true };
    let (mut gather, mut gather_seconds) = timed(|| Gather::new(&scene, &solution, camera, &gather_options));
    gather_seconds += snapshot;
    let mut curve = Vec::new();
    for samples in CHECKPOINTS {
        let ((), more) = timed(|| {
            while gather.samples() < 0.999 * samples {
                let next = (1.25 * gather.samples()).clamp(4.0, samples);
                gather.advance_to(next);
            }
        });
        gather_seconds += more;
        let error = reference.relative_square_error(&gather.picture());
        curve.push(json!({ "samples": gather.samples(), "seconds": gather_seconds, "error": error }));
        // Beyond the smallest error nothing is asked, nor where the reference itself ends.
        if error < 0.8 * ERRORS[2] || effort != Effort::FULL && samples >= 16.0 {
            break;
        }
    }
    // Another view of the same light: what a second camera costs.
    let (second, second_seconds) = timed(|| {
        let mut gather = Gather::new(&scene, &solution, camera, &gather_options);
        gather.advance_to(8.0);
        gather.advance_to(16.0);
        gather
    });
    let bias = reference.bias(&gather.picture());
    Ok(json!({
        "patches": scene.len(), "rays": solver.rays(), "solve": solve_seconds, "curve": curve,
        "paths": paths, "path_seconds": path_seconds, "path_error": reference.own_error(),
        "bias": bias[0], "bias_error": bias[1],
        "second_samples": second.samples(), "second_seconds": second_seconds,
    }))
}

/// A picture by paths, with its variance.
struct Reference {
    luminance: Vec<f64>,
    variance: Vec<f64>,
    /// Pixels that no light covers.
    plain: Vec<bool>,
    /// What squared differences are divided by: R² + (0.1 R̄)², R smoothed, since dividing by single noisy pixels would count
    /// those most that happen to be dark.
    scale: Vec<f64>,
}

impl Reference {
    fn new(tracer: &PixelTracer) -> Self {
        let picture = tracer.picture();
        let luminance = luminances(&picture);
        let plain: Vec<bool> = picture.lights.iter().map(|(_, covered)| *covered == 0.0).collect();
        let count = plain.iter().filter(|p| **p).count().max(1) as f64;
        let mean = luminance.iter().zip(&plain).filter(|(_, p)| **p).map(|(l, _)| l).sum::<f64>() / count;
        let variance = tracer.variance().iter().map(|v| f64::from(*v)).collect();
        let scale =
            smoothed(&luminance, picture.image.width as usize).iter().map(|l| l * l + (DARK * mean).powi(2)).collect();
        Self { luminance, variance, plain, scale }
    }

    /// Mean over pixels without lights.
    fn mean(&self, of: impl Fn(usize) -> f64) -> f64 {
        let pixels = || (0..self.plain.len()).filter(|&i| self.plain[i]);
        pixels().map(&of).sum::<f64>() / pixels().count().max(1) as f64
    }

    /// relMSE of another picture, the reference's own variance subtracted.
    fn relative_square_error(&self, picture: &Picture) -> f64 {
        let other = luminances(picture);
        self.mean(|i| ((other[i] - self.luminance[i]).powi(2) - self.variance[i]) / self.scale[i]).max(0.0)
    }

    /// relMSE of the reference itself.
    fn own_error(&self) -> f64 {
        self.mean(|i| self.variance[i] / self.scale[i])
    }

    /// Relative difference of the means, and what the reference's noise makes of it.
    fn bias(&self, picture: &Picture) -> [f64; 2] {
        let other = luminances(picture);
        let (mean, theirs) = (self.mean(|i| self.luminance[i]), self.mean(|i| other[i]));
        let count = self.plain.iter().filter(|p| **p).count().max(1) as f64;
        [theirs / mean - 1.0, (self.mean(|i| self.variance[i]) / count).sqrt() / mean]
    }
}

/// Means over squares of 2·REACH + 1 pixels a side.
fn smoothed(luminance: &[f64], width: usize) -> Vec<f64> {
    let height = luminance.len() / width.max(1);
    let around = |at: usize, end: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(end);
    let mean = |i: usize| {
        let rows = around(i / width, height);
        let pixels = rows.flat_map(|y| around(i % width, width).map(move |x| luminance[y * width + x]));
        let (sum, count) = pixels.fold((0.0, 0.0), |(s, n), l| (s + l, n + 1.0));
        sum / count
    };
    (0..luminance.len()).map(mean).collect()
}

fn luminances(picture: &Picture) -> Vec<f64> {
    picture.image.pixels.iter().map(|p| Rgb::from_f32(*p).luminance()).collect()
}

/// Seconds at which a curve of (seconds, error) falls to `error`, interpolated in logarithms; `None` if it does not.
fn when(curve: &[[f64; 2]], error: f64) -> Option<f64> {
    let reached = curve.iter().position(|c| c[1] <= error)?;
    if reached == 0 {
        return Some(curve[0][0]);
    }
    let ([t0, e0], [t1, e1]) = (curve[reached - 1], curve[reached]);
    let share = if e1 > 0.0 { (error / e0).ln() / (e1 / e0).ln() } else { 1.0 };
    Some(t0 * (t1 / t0).powf(share))
}

fn describe(result: &Value) -> Result<Section, String> {
    let top = Reader::new(result);
    let (mut rows, mut others, mut targets) = (Vec::new(), Vec::new(), Vec::new());
    for case in top.get("cases")?.items()? {
        let number = |key: &str| case.get(key)?.number();
        let name = case.get("scene")?.text()?;
        let solve = number("solve")?;
        let curve: Result<Vec<[f64; 2]>, String> = case
            .get("curve")?
            .items()?
            .iter()
            .map(|c| Ok([solve + c.get("seconds")?.number()?, c.get("error")?.number()?]))
            .collect();
        let curve = curve?;
        let by_paths = |error: f64| Ok::<_, String>(number("path_seconds")? * number("path_error")? / error);
        let mut row = vec![name.to_owned(), seconds(solve)];
        for error in ERRORS {
            let ours = when(&curve, error);
            row.push(ours.map_or("not reached".to_owned(), seconds));
            row.push(seconds(by_paths(error)?));
        }
        let gain = when(&curve, ERRORS[0]).map_or(0.0, |t| by_paths(ERRORS[0]).unwrap_or(0.0) / t);
        row.push(times(gain));
        rows.push(row);
        let bias = number("bias")?;
        others.push(vec![
            name.to_owned(),
            number("patches")?.to_string(),
            format!("{:+.2} % ± {:.2} %", 100.0 * bias, 100.0 * number("bias_error")?),
            curve.last().map_or(String::new(), |c| format!("{:.5}", c[1])),
            format!("{} for {:.0} samples", seconds(number("second_seconds")?), number("second_samples")?),
        ]);
        let aim = number("aim")?;
        targets.push(Target::at_least(
            format!("{name}: path tracer over gather, seconds to relMSE .01"),
            aim,
            gain,
            times,
        ));
        targets.push(Target::below(format!("{name}: bias of the picture's mean"), 0.01, bias.abs(), percent));
    }
    let text = format!(
        "Seconds on two threads to a picture of {}×{} pixels whose mean squared relative error (relMSE: mean of (L − R)²/(R̃² + (0.1 R̄)²) \
         over pixels that show no light, R̃ being R over 9×9 pixels and R̄ over all) falls below a bound, against a reference by paths, whose own variance is subtracted. \
         *Gather* is `twinray render`: the solve of {} rays per patch is in its seconds, reading and cutting the scene in neither's. *Paths* \
         are those of `--method path`, whose time is that of the reference scaled by its error, since its variance falls as 1/n. There is no \
         denoiser anywhere. *Bias* is the difference of the pictures' means and the reference's standard error of it; *floor* the last \
         error measured, patches' share included; a second camera needs no second solve. Scenes of files are looked for in the folder that \
         {SCENES} names.\n\n{}\n\n{}",
        top.get("width")?.number()?,
        top.get("height")?.number()?,
        top.get("rays_per_patch")?.number()?,
        table(
            &[
                "scene",
                "solve",
                "gather to .01",
                "paths",
                "gather to .001",
                "paths",
                "gather to .0003",
                "paths",
                "gain at .01"
            ],
            &rows
        ),
        table(&["scene", "patches", "bias", "floor", "a second camera"], &others),
    );
    Ok(Section { title: "Pictures", text, figures: Vec::new(), targets })
}

#[cfg(test)]
mod tests {
    use super::when;

    #[test]
    fn times_are_interpolated() {
        let curve = [[1.0, 0.04], [2.0, 0.02], [4.0, 0.01], [8.0, 0.01]];
        assert_eq!(when(&curve, 0.05), Some(1.0));
        assert!((when(&curve, 0.02).unwrap() - 2.0).abs() < 1e-12);
        assert!((when(&curve, 0.015).unwrap() - 2.667).abs() < 0.001);
        assert_eq!(when(&curve, 0.005), None);
    }
}
