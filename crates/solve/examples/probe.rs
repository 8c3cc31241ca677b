use std::time::Instant;
use twinray_scene::*;
use twinray_solve::*;
fn main() {
    for rho in [0.0, 0.5, 0.8, 0.95] {
        let scene = PatchScene::new(&builtin::furnace(rho, 1.0), PatchOptions { budget: PatchBudget::Count(2000), two_sided: false }).unwrap();
        let t = Instant::now();
        let mut s = Solver::new(&scene, Params::default_preset(3), None).unwrap();
        let warm = t.elapsed().as_secs_f64();
        s.run(1_000_000);
        let sol = s.solution();
        let e = sol.arriving_power(&scene).luminance() / scene.total_area();
        let exact = 1.0 / (1.0 - rho);
        let rms = (scene.patches().map(|p| scene.area(p) * (sol.irradiance(p).luminance() - exact).powi(2)).sum::<f64>() / scene.total_area()).sqrt() / exact;
        println!("rho {rho} K {} power rel err {:.5} rms {:.4} est {:.4} bal {:?} warm {warm:.2}s total {:.2}s", scene.len(), e / exact - 1.0, rms, sol.relative_error(), sol.balance().residual(), t.elapsed().as_secs_f64());
    }
    for name in ["cornell", "doorway", "hall"] {
        let Some(a) = builtin::by_name(name) else { continue };
        let k = a.suggested_patches.unwrap_or(20000);
        let scene = PatchScene::new(&a, PatchOptions { budget: PatchBudget::Count(k), two_sided: false }).unwrap();
        let t = Instant::now();
        let mut s = Solver::new(&scene, Params::default_preset(3), None).unwrap();
        let warm = t.elapsed().as_secs_f64();
        s.run(4_000_000);
        let n = s.rays();
        let sol = s.solution();
        println!("{name} tris {} K {} rays {n} est {:.4} bal {:?} warm {warm:.2} total {:.2}s", scene.triangle_count(), scene.len(), sol.relative_error(), sol.balance(), t.elapsed().as_secs_f64());
        let t = Instant::now();
        let mut s = Solver::new(&scene, Params::paper_preset(3), None).unwrap();
        s.run(1_000_000);
        println!("   paper 1e6 {:.2}s {:?}", t.elapsed().as_secs_f64(), s.solution().balance());
    }
}
