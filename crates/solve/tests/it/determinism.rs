//! The same scene, settings and seed give the same bits, whatever the number of threads.

use twinray_scene::builtin;
use twinray_solve::{Observer, Params, Schedule, Solver};

use super::cut;

fn bits(threads: usize, params: &Params, rays: u64) -> Vec<u64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let authored = builtin::hall();
        let scene = cut(&authored, 8_000);
        let observer = Observer::new(&scene, &authored.cameras[0]);
        let mut solver = Solver::new(&scene, params.clone(), Some(observer)).unwrap();
        solver.run(rays);
        let solution = solver.solution();
        let mut out = vec![solution.rays(), solution.relative_error().to_bits(), solution.balance().absorbed.to_bits()];
        for p in scene.patches() {
            let n = scene.normal(p);
            out.extend(solution.irradiance(p).to_array().map(f64::to_bits));
            out.extend(solution.radiance(&scene, p, n).to_array().map(f64::to_bits));
            out.extend(solution.observed_lobe(p).into_iter().flatten().flat_map(|l| l.to_array().map(f64::to_bits)));
        }
        out
    })
}

#[test]
fn threads_do_not_change_a_bit() {
    let waves = Params::default_preset(11);
    let paper = Params { schedule: Schedule::Paper { batch: 64 }, ..Params::paper_preset(11) };
    for (params, rays) in [(waves, 200_000), (paper, 50_000)] {
        let one = bits(1, &params, rays);
        for threads in [2, 3, 8] {
            assert!(bits(threads, &params, rays) == one, "{threads} threads differ from 1 with {params:?}");
        }
        let other = bits(2, &Params { seed: 12, ..params }, rays);
        assert!(other != one, "another seed must give another result");
    }
}

/// Stopping early and looking does not change what follows.
#[test]
fn looking_at_a_solution_changes_nothing() {
    let scene = cut(&builtin::cornell(false), 2000);
    let mut a = Solver::new(&scene, Params::default_preset(1), None).unwrap();
    a.run(400_000);
    let mut b = Solver::new(&scene, Params::default_preset(1), None).unwrap();
    while b.rays() < 400_000 {
        b.advance(400_000);
        let _ = b.solution();
    }
    let (a, b) = (a.solution(), b.solution());
    assert!(scene.patches().all(|p| a.irradiance(p) == b.irradiance(p)));
}
