//! Built-in scenes against the path tracer of `twinray-render`, which shares no transport with the solver; and whether
//! the solver's error bars tell the truth.

use rayon::prelude::*;
use twinray::render::reference::{self, IrradianceOptions};
use twinray::scene::{PatchBudget, PatchId, PatchOptions, PatchScene, Scene, builtin};
use twinray::solve::{Params, PatchLight, Solver};

use crate::case::{Case, Effort, Row};
use crate::report::Section;
use crate::rig::{REPLICAS, replicas};

/// Materials of a smaller share of the area are one group.
const LEAST_SHARE: f64 = 0.02;
/// Name, patches of the coarser cut (the finer has four times as many), paths per patch of the finer.
const SCENES: [(&str, usize, u32); 5] = [
    ("cornell", 2000, 512),
    ("cornell-closed", 2000, 512),
    ("doorway", 2000, 384),
    ("hall-diffuse", 10_000, 64),
    ("hall", 10_000, 64),
];
const RAYS: u64 = 1 << 19;

/// Both cases.
pub fn section(effort: Effort) -> Section {
    let mut text = String::from(
        "| scene | patches | paths per patch | mean, solved / traced | relative RMS beyond noise | groups: \\|z\\| < 1 | \\|z\\| < 2 |\n\
         |---|---|---|---|---|---|---|\n",
    );
    let mut rows = Vec::new();
    for (name, coarse, paths) in SCENES {
        let outcome = compare(name, coarse, (u64::from(paths) / effort.divide) as u32, effort);
        text += &outcome.line;
        rows.extend(outcome.rows);
    }
    let groups = Case {
        title: "Mean irradiance by material",
        story: "Area-weighted over the patches of each material that does not emit; materials of less than 2 % of the area are \
                *others*. Expected is the path tracer, measured the default preset, 16 solves of 2¹⁹ rays; error is both of theirs, and t that of the normal \
                distribution (4.42) for the path tracer's part. The \
                solver's patches have constant light and the path tracer's have not: allowed beside noise is what the solver's mean \
                changes when patches are four times as many, since what is left is less than that."
            .to_owned(),
        quantity: "irradiance",
        rows,
    };
    Section {
        title: "Against a path tracer",
        text: format!(
            "The path tracer (`reference::irradiance` of `twinray-render`) shares scene, materials and rays with the solver, but no \
             transport: it follows light backwards, with next-event estimation and exact standard errors. *Relative RMS beyond \
             noise* is √(ΣA (ΔE² − its expected noise)/ΣA E²) over patches without emitters: what patches differ by that noise does \
             not explain, such as light that changes within a patch; in brackets, what noise alone may leave of it (two standard errors). z-scores are those of the groups in the table below.\n\n{text}"
        ),
        cases: vec![groups, coverage(effort)],
        figures: Vec::new(),
    }
}

struct Outcome {
    line: String,
    rows: Vec<Row>,
}

fn compare(name: &str, coarse: usize, paths: u32, effort: Effort) -> Outcome {
    let authored = builtin::by_name(name).expect("a built-in scene");
    let (few, scene) = (cut(&authored, coarse), cut(&authored, 4 * coarse));
    let options = IrradianceOptions { paths_per_patch: paths.max(2), ..IrradianceOptions::default() };
    let traced = reference::irradiance(&scene, &options);
    let solve = |scene: &PatchScene| {
        replicas(scene, &Params::default_preset(2000), effort.rays(RAYS), REPLICAS, |s| s.patch_light(scene).irradiance)
    };
    let (coarse, fine) = (solve(&few), solve(&scene));

    let mut rows = Vec::new();
    let mut names: Vec<String> = vec!["all".to_owned()];
    names.extend(large_materials(&scene));
    if names.len() < scene_materials(&scene).len() + 1 {
        names.push("others".to_owned());
    }
    let in_group = |scene: &PatchScene, p: PatchId, group: &str| {
        let material = &scene.material(p).name;
        let alone = names.iter().any(|n| n == material);
        scene.emission(p).is_black() && (group == "all" || if alone { group == material } else { group == "others" })
    };
    let mean = |scene: &PatchScene, light: &[[f32; 3]], group: &str| {
        let chosen = scene.patches().filter(|&p| in_group(scene, p, group));
        let (power, area) = chosen.fold((0.0, 0.0), |(power, area), p| {
            (power + scene.area(p) * luminance(light[p.index()]), area + scene.area(p))
        });
        power / area
    };
    let mut z = Vec::new();
    for group in &names {
        let expected = mean(&scene, &traced.irradiance, group);
        let samples: Vec<f64> = fine.iter().map(|light| mean(&scene, light, group)).collect();
        let before = coarse.iter().map(|light| mean(&few, light, group)).sum::<f64>() / coarse.len() as f64;
        let after = samples.iter().sum::<f64>() / samples.len() as f64;
        let its_error = mean_error(&scene, &traced, |p| in_group(&scene, p, group));
        let row = Row::compared(
            format!("{name}: {group}"),
            (expected, its_error),
            &samples,
            (after - before).abs(),
            effort.resolution(0.06),
        );
        z.push((row.measured - row.expected) / row.error);
        rows.push(row);
    }
    let within = |bars: f64| z[1..].iter().filter(|z| z.abs() < bars).count();
    let [beyond, floor] = beyond_noise(&scene, &fine, &traced);
    let line = format!(
        "| {name} | {} | {paths} | {:.4} ± {:.4} | {:.1} % (noise {:.1} %) | {} of {} | {} of {} |\n",
        scene.len(),
        rows[0].measured / rows[0].expected,
        rows[0].error / rows[0].expected,
        100.0 * beyond,
        100.0 * floor,
        within(1.0),
        z.len() - 1,
        within(2.0),
        z.len() - 1,
    );
    Outcome { line, rows }
}

fn cut(authored: &Scene, patches: usize) -> PatchScene {
    let options = PatchOptions { budget: PatchBudget::Count(patches), two_sided: false };
    PatchScene::new(authored, options).expect("a built-in scene")
}

fn luminance(irradiance: [f32; 3]) -> f64 {
    twinray::scene::Rgb::from_f32(irradiance).luminance()
}

/// Standard error of an area-weighted mean of independent patches.
fn mean_error(scene: &PatchScene, light: &PatchLight, which: impl Fn(PatchId) -> bool) -> f64 {
    let chosen = scene.patches().filter(|&p| which(p));
    let (variance, area) = chosen.fold((0.0, 0.0), |(variance, area), p| {
        let weighted = scene.area(p) * f64::from(light.standard_error[p.index()]);
        (variance + weighted * weighted, area + scene.area(p))
    });
    variance.sqrt() / area
}

fn scene_materials(scene: &PatchScene) -> Vec<(String, f64)> {
    let mut areas: Vec<(String, f64)> = Vec::new();
    for p in scene.patches().filter(|&p| scene.emission(p).is_black()) {
        let name = &scene.material(p).name;
        match areas.iter_mut().find(|(n, _)| n == name) {
            Some((_, area)) => *area += scene.area(p),
            None => areas.push((name.clone(), scene.area(p))),
        }
    }
    areas
}

fn large_materials(scene: &PatchScene) -> Vec<String> {
    let areas = scene_materials(scene);
    let total: f64 = areas.iter().map(|a| a.1).sum();
    areas.into_iter().filter(|a| a.1 > LEAST_SHARE * total).map(|a| a.0).collect()
}

/// RMS difference of patches, of the mean of all solves, less the noise of both; and what noise alone may leave of
/// it, the root of two standard errors of the mean square.
fn beyond_noise(scene: &PatchScene, solves: &[Vec<[f32; 3]>], traced: &PatchLight) -> [f64; 2] {
    let count = solves.len() as f64;
    let (mut difference, mut square, mut energy) = (0.0, 0.0, 0.0);
    for p in scene.patches().filter(|&p| scene.emission(p).is_black()) {
        let samples: Vec<f64> = solves.iter().map(|s| luminance(s[p.index()])).collect();
        let mean = samples.iter().sum::<f64>() / count;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count * (count - 1.0));
        let expected = luminance(traced.irradiance[p.index()]);
        let noise = variance + f64::from(traced.standard_error[p.index()]).powi(2);
        let excess = scene.area(p) * ((mean - expected).powi(2) - noise);
        difference += excess;
        square += excess * excess;
        energy += scene.area(p) * mean * mean;
    }
    [difference.max(0.0) / energy, 2.0 * square.sqrt() / energy].map(f64::sqrt)
}

/// Shares of patches whose true error is within one and two of their own error bars.
pub fn coverage(effort: Effort) -> Case {
    let seeds = (64 / effort.divide).max(16);
    let rows = ["cornell", "cornell-closed", "doorway"].into_iter().flat_map(|name| {
        let scene = cut(&builtin::by_name(name).expect("a built-in scene"), 500);
        let mut long = Solver::new(&scene, Params::default_preset(9100), None).expect("a built-in scene has light");
        long.run(6_000_000);
        let long = long.solution();
        let z: Vec<f64> = (0..seeds)
            .into_par_iter()
            .flat_map_iter(|seed| {
                let mut solver = Solver::new(&scene, Params::default_preset(seed), None).expect("the same scene");
                solver.run(150_000);
                let solution = solver.solution();
                let score = |p: PatchId| {
                    let error = solution.irradiance(p).luminance() - long.irradiance(p).luminance();
                    error / solution.standard_error(p).hypot(long.standard_error(p))
                };
                // With fewer hits a patch's own variance is too uncertain for a normal distribution.
                scene.patches().filter(|&p| solution.hits(p) >= 100).map(score).collect::<Vec<f64>>()
            })
            .collect();
        let within = |bars: f64| z.iter().filter(|z| z.abs() < bars).count() as f64 / z.len() as f64;
        // Noise is shared by neighbours and by all bounces of a seed, so shares scatter more than independent ones.
        let wide = if effort == Effort::DOCUMENT { 1.0 } else { 1.5 };
        [
            Row::fixed(
                format!("{name}: within one bar ({seeds} seeds, {} values)", z.len()),
                0.6827,
                within(1.0),
                0.05 * wide,
            ),
            Row::fixed(format!("{name}: within two bars"), 0.9545, within(2.0), 0.03 * wide),
        ]
    });
    Case {
        title: "Do the error bars tell the truth?",
        story: "About 500 patches, 150 000 rays, default preset, many seeds: how often the irradiance of a patch with at least 100 hits \
                is within one and two of its own standard errors (`Solution::standard_error`) of a solve of 6 · 10⁶ rays, whose bars \
                are added. A normal distribution has 68.3 % and 95.4 %; five and three percentage points are allowed."
            .to_owned(),
        quantity: "share of patches",
        rows: rows.collect(),
    }
}
