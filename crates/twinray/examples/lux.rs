//! A light meter: mean illuminance of the floors of two rooms, one with a lamp, one lit through a door.
//!
//! The lamp of `doorway` is given in nit (cd/m²), so the luminance of irradiance is in lux.

use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Params, Solver};

/// The rooms along x, metres: the wall between them stands at 4.00 to 4.15.
const ROOMS: [(&str, f64, f64); 2] = [("room with the lamp", 0.0, 4.0), ("room behind the door", 4.15, 8.15)];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = PatchOptions { budget: PatchBudget::Count(20_000), ..PatchOptions::default() };
    let scene = PatchScene::new(&builtin::doorway(), options)?;
    let mut solver = Solver::new(&scene, Params::default_preset(1), None)?;
    solver.run(4_000_000);
    let solution = solver.solution();
    for (name, low, high) in ROOMS {
        let (mut lumen, mut area) = (0.0, 0.0);
        for patch in scene.patches() {
            // Patches are placed relative to the scene's centre.
            let place = scene.cell_centre(patch) + scene.centre();
            let on_floor = scene.normal(patch).y > 0.99 && place.y < 0.1;
            if on_floor && (low..high).contains(&place.x) {
                lumen += solution.irradiance(patch).luminance() * scene.area(patch);
                area += scene.area(patch);
            }
        }
        println!("{name:21} {:7.1} lx on {area:.1} m² of floor", lumen / area);
    }
    println!("estimated error of a patch: {:.1} %", 100.0 * solution.relative_error());
    Ok(())
}
