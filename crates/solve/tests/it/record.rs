//! A solve written down and taken up again goes on as if nothing had been; several added up are as good as they say.

use twinray_scene::{PatchScene, Rgb, Scene, Surface, Texel, builtin};
use twinray_solve::record::WavesRecord;
use twinray_solve::{Params, PatchLight, Record, RecordError, Representation, Schedule, SolveError, Solver, merge};

use super::{cut, glossy_cornell};

fn sky(mut scene: Scene) -> Scene {
    scene.environment = Some(twinray_scene::Environment::Uniform(Rgb::WHITE));
    scene
}

fn waves(record: Record) -> WavesRecord {
    match record {
        Record::Waves(waves) => waves,
        Record::Sequential(_) => panic!("the paper's schedule"),
    }
}

/// Stopped at any wave, on other threads, by either schedule, diffuse or glossy, under a sky or not.
#[test]
fn a_resumed_solve_is_the_unbroken_one() {
    let waves = Params::default_preset(3);
    let paper = Params { schedule: Schedule::Paper { batch: 100 }, ..Params::paper_preset(3) };
    let sample = Params { representation: Representation::Sample, ..Params::default_preset(4) };
    let cases = [
        ("diffuse", builtin::cornell(false), waves.clone()),
        ("glossy", glossy_cornell(), waves.clone()),
        ("sample alone", glossy_cornell(), sample),
        ("sky", sky(builtin::doorway()), waves),
        ("paper", glossy_cornell(), paper),
    ];
    for (name, authored, params) in cases {
        let scene = cut(&authored, 1500);
        let mut unbroken = Solver::new(&scene, params.clone(), None).unwrap();
        let mut broken = Solver::new(&scene, params.clone(), None).unwrap();
        let mut stops = 0;
        while unbroken.rays() < 400_000 {
            unbroken.advance(u64::MAX);
            let record = broken.record().into_owned();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1 + stops % 3).build().unwrap();
            broken = pool.install(|| {
                let mut resumed = Solver::resume(&scene, params.clone(), &record).unwrap();
                resumed.advance(u64::MAX);
                resumed
            });
            stops += 1;
        }
        assert!(stops > 3, "{name}: {stops} stops");
        assert_eq!(unbroken.record(), broken.record(), "{name}");
        let (a, b) = (unbroken.solution(), broken.solution());
        let c = broken.record().solution(&scene, &params).unwrap();
        for p in scene.patches() {
            let n = scene.normal(p);
            assert_eq!(a.radiance(&scene, p, n), b.radiance(&scene, p, n), "{name}");
            assert_eq!(a.radiance(&scene, p, n), c.radiance(&scene, p, n), "{name}");
        }
        assert_eq!(a.balance(), c.balance());
        // The light of the record alone is that of the solution.
        let light = a.patch_light(&scene);
        let (told, error) = unbroken.record().light(light.area.clone(), light.emits.clone());
        assert_eq!((told, error), (light, a.relative_error()), "{name}");
    }
}

/// Where nothing is reflected no ray is chosen by power, and no rounding may say that it helped or hurt: a share of less than
/// nothing could not be gone on from.
#[test]
fn a_black_scene_under_a_sky_goes_on() {
    let mut authored = sky(builtin::plates(1.0));
    for material in &mut authored.materials {
        material.emission = Rgb::BLACK;
        material.surface = Surface::Lambertian { reflectance: Texel::constant(Rgb::BLACK) };
    }
    let scene = cut(&authored, 500);
    for seed in 1..=3 {
        let params = Params::default_preset(seed);
        let mut solver = Solver::new(&scene, params.clone(), None).unwrap();
        solver.run(100_000);
        let mut resumed = Solver::resume(&scene, params, &solver.record().into_owned()).unwrap();
        for solver in [&mut solver, &mut resumed] {
            solver.run(200_000);
        }
        assert_eq!(solver.record(), resumed.record(), "seed {seed}");
    }
}

/// A limit in the middle of a batch moves no batch.
#[test]
fn where_the_papers_schedule_stops_changes_nothing() {
    let scene = cut(&builtin::cornell(false), 500);
    let params = Params { schedule: Schedule::Paper { batch: 1000 }, ..Params::paper_preset(3) };
    let [mut a, mut b] = [0, 1].map(|_| Solver::new(&scene, params.clone(), None).unwrap());
    a.run(300_000);
    b.run(1500);
    b.run(300_000);
    assert_eq!(a.record(), b.record());
}

/// What belongs to another scene, schedule or nobody is refused in words.
#[test]
fn what_does_not_fit_is_refused() {
    let (small, large) = (cut(&builtin::cornell(false), 500), cut(&builtin::cornell(false), 900));
    let params = Params::default_preset(1);
    let mut solver = Solver::new(&small, params.clone(), None).unwrap();
    solver.run(50_000);
    let record = solver.record().into_owned();
    let refused = |scene: &PatchScene, params: Params, record: &Record| match Solver::resume(scene, params, record)
        .unwrap_err()
    {
        SolveError::Record(error) => error,
        other => panic!("{other}"),
    };
    assert!(matches!(refused(&large, params.clone(), &record), RecordError::Length { array: "deposits", .. }));
    assert!(matches!(refused(&small, Params::paper_preset(1), &record), RecordError::Schedule { .. }));
    let good = waves(record);
    let merged = merge(&[(1, &good)]).unwrap();
    assert_eq!(refused(&small, params.clone(), &Record::Waves(merged)), RecordError::Merged);
    let spoilt = |spoil: &dyn Fn(&mut WavesRecord)| {
        let mut bad = good.clone();
        spoil(&mut bad);
        refused(&small, params.clone(), &Record::Waves(bad)).to_string()
    };
    let said = spoilt(&|bad| bad.deposits.to_mut()[7][1] = f64::NAN);
    assert!(said.contains("\"deposits\", entry 7"), "{said}");
    assert!(spoilt(&|bad| bad.runs.as_mut().unwrap()[1].words[0] = u64::MAX).contains("rays"));
    assert!(spoilt(&|bad| bad.runs.as_mut().unwrap()[0].words[6] = 7f64.to_bits()).contains("shares"));
    assert!(spoilt(&|bad| bad.runs.as_mut().unwrap()[0].radiance.to_mut()[3][0] = f32::NAN).contains("radiance-0"));
    assert!(spoilt(&|bad| bad.hits.to_mut().truncate(9)).contains("hits"));
    assert!(spoilt(&|bad| bad.weight = 0.0).contains("weight"));
}

/// Whatever the order, the same bits; a merge of merges differs by roundings only.
#[test]
fn the_order_of_merging_changes_no_bit() {
    let scene = cut(&glossy_cornell(), 800);
    let records: Vec<WavesRecord> = (1..=5)
        .map(|seed| {
            let mut solver = Solver::new(&scene, Params::default_preset(seed), None).unwrap();
            solver.run(30_000 * seed);
            waves(solver.record().into_owned())
        })
        .collect();
    let of = |seeds: &[usize]| merge(&seeds.iter().map(|&s| (s as u64, &records[s - 1])).collect::<Vec<_>>()).unwrap();
    let all = of(&[1, 2, 3, 4, 5]);
    assert_eq!(all, of(&[4, 2, 5, 1, 3]));
    assert_eq!(all.rays, records.iter().map(|r| r.rays).sum::<u64>());
    let nested = merge(&[(1, &of(&[1, 2])), (3, &of(&[3, 4, 5]))]).unwrap();
    for (a, b) in all.deposits.iter().zip(nested.deposits.iter()) {
        assert!((0..3).all(|c| (a[c] - b[c]).abs() <= 1e-14 * a[c]));
    }
    for (a, b) in all.difference.iter().zip(nested.difference.iter()) {
        assert!((a - b).abs() <= 1e-6 * a);
    }
    assert_eq!(all.hits, nested.hits);
}

/// n solves together have one n-th of one's variance, and their error bars say so.
#[test]
fn merging_divides_the_variance() {
    const TOGETHER: usize = 4;
    const GROUPS: usize = 24;
    let authored = builtin::cornell(false);
    let scene = cut(&authored, 400);
    let params = |seed| Params::default_preset(seed);
    let records: Vec<WavesRecord> = (0..GROUPS * TOGETHER)
        .map(|k| {
            let mut solver = Solver::new(&scene, params(100 + k as u64), None).unwrap();
            solver.run(80_000);
            waves(solver.record().into_owned())
        })
        .collect();
    let seeded: Vec<(u64, &WavesRecord)> = records.iter().enumerate().map(|(k, r)| (k as u64, r)).collect();
    let groups: Vec<WavesRecord> = seeded.chunks(TOGETHER).map(|group| merge(group).unwrap()).collect();

    let cells = || scene.patches().map(|p| (scene.area(p), !scene.emission(p).is_black())).unzip();
    let light = |record: &WavesRecord| {
        let (area, emits) = cells();
        Record::Waves(record.clone()).light(area, emits)
    };
    // Variance about the mean of the same kind, relative to the irradiance: mean over patches that do not emit.
    let variance = |lights: &[(PatchLight, f64)]| {
        let luminance = |l: &PatchLight, p: usize| Rgb::from_f32(l.irradiance[p]).luminance();
        let n = lights.len() as f64;
        let of_patch = |p: usize| {
            let mean = lights.iter().map(|(l, _)| luminance(l, p)).sum::<f64>() / n;
            let squares: f64 = lights.iter().map(|(l, _)| (luminance(l, p) / mean - 1.0).powi(2)).sum();
            squares / (n - 1.0)
        };
        let dark: Vec<usize> = (0..scene.len()).filter(|&p| !lights[0].0.emits[p]).collect();
        dark.iter().map(|&p| of_patch(p)).sum::<f64>() / dark.len() as f64
    };
    let ones: Vec<_> = records.iter().map(light).collect();
    let fours: Vec<_> = groups.iter().map(light).collect();
    let ratio = variance(&ones) / variance(&fours);
    // 400 patches times 23 degrees of freedom tell the variance of the fours to √(2/9200) = 1.5 %, if patches are
    // independent; neighbours share some of their noise, so 3 %. Four of these: false alarm 6e-5.
    assert!((ratio / TOGETHER as f64 - 1.0).abs() < 0.12, "variances have the ratio {ratio}");
    // What the errors claim falls by the root: a solve's own claim is good to some 5 %, the mean of 24 to 1 %.
    let claim = |lights: &[(PatchLight, f64)]| lights.iter().map(|(_, e)| e * e).sum::<f64>() / lights.len() as f64;
    let claimed = claim(&ones) / claim(&fours);
    assert!((claimed / TOGETHER as f64 - 1.0).abs() < 0.06, "claimed variances have the ratio {claimed}");
    // And bars of single patches cover the mean of all as often as they should: 68.3 % and 95.4 %, less what a mean of 24
    // groups hides of their own noise, √(1 − 1/24) (70 % and 96 %).
    let (mut within, mut twice, mut count) = (0, 0, 0);
    for p in (0..scene.len()).filter(|&p| !fours[0].0.emits[p]) {
        let luminance = |l: &PatchLight| Rgb::from_f32(l.irradiance[p]).luminance();
        let mean = fours.iter().map(|(l, _)| luminance(l)).sum::<f64>() / GROUPS as f64;
        for (l, _) in &fours {
            let z = ((luminance(l) - mean) / f64::from(l.standard_error[p])).abs();
            (within, twice, count) = (within + u32::from(z < 1.0), twice + u32::from(z < 2.0), count + 1);
        }
    }
    let share = |n: u32| f64::from(n) / f64::from(count);
    assert!((share(within) - 0.70).abs() < 0.04 && (share(twice) - 0.96).abs() < 0.02, "{within} {twice} of {count}");
}

/// However bright a scene is, squares fit into single precision: a power of two in the light changes no digit of them.
#[test]
fn squares_fit_however_bright_the_light_is() {
    let solve = |factor: f64| {
        let mut authored = builtin::cornell(false);
        authored.materials.iter_mut().for_each(|m| m.emission *= factor);
        let scene = cut(&authored, 300);
        let mut solver = Solver::new(&scene, Params::default_preset(1), None).unwrap();
        solver.run(100_000);
        solver.record().check().unwrap();
        (waves(solver.record().into_owned()), solver.relative_error())
    };
    let (usual, error) = solve(1.0);
    assert!(usual.squares.iter().any(|s| *s > 0.0));
    for exponent in [-90, 30, 90] {
        let (other, same) = solve(2f64.powi(exponent));
        assert_eq!(other.unit, usual.unit * 2f64.powi(exponent));
        assert!(other.squares == usual.squares && other.difference == usual.difference && other.hits == usual.hits);
        assert!((same / error - 1.0).abs() < 1e-12, "{same} against {error}");
    }
}
