//! A solve that is kept in a file, gone on with, and added to another one.
//!
//!     cargo run --release -p twinray --example keep_and_go_on

use std::error::Error;
use std::fs;

use twinray::format::{Limits, Method, Provenance, SceneSource, SolutionFile, StoredSolution, write_solution};
use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::{Params, Record, Solver, merge};

fn main() -> Result<(), Box<dyn Error>> {
    let options = PatchOptions { budget: PatchBudget::Count(5_000), two_sided: false };
    let scene = PatchScene::new(&builtin::cornell(false), options)?;

    // A solve, and all that it knows in a file.
    let mut solver = Solver::new(&scene, Params::default_preset(1), None)?;
    solver.run(500_000);
    let file = SolutionFile {
        provenance: provenance(&scene, &solver),
        light: solver.solution().patch_light(&scene),
        record: Some(solver.record()),
    };
    let mut bytes = Vec::new();
    write_solution(&file, &mut bytes)?;
    fs::write("kept.twin", &bytes)?;

    // Another day it goes on, and is what it would have been without a break.
    let bytes = fs::read("kept.twin")?;
    let stored = StoredSolution::open("kept.twin", &bytes, &Limits::default())?;
    let record = stored.record()?.ok_or("the file holds no solve")?;
    let mut resumed = Solver::resume(&scene, Params::default_preset(1), &record)?;
    resumed.run(1_000_000);
    solver.run(1_000_000);
    assert!(resumed.record() == solver.record());
    println!("{} rays: relative error {:.2} %", resumed.rays(), 100.0 * resumed.relative_error());

    // Another seed, on another machine perhaps; together they are better.
    let mut other = Solver::new(&scene, Params::default_preset(2), None)?;
    other.run(1_000_000);
    let (Record::Waves(one), Record::Waves(two)) = (resumed.record(), other.record()) else { unreachable!() };
    let both = Record::Waves(merge(&[(1, &one), (2, &two)])?);
    let solution = both.solution(&scene, &Params::default_preset(1))?;
    println!("{} rays: relative error {:.2} %", solution.rays(), 100.0 * solution.relative_error());
    Ok(())
}

/// What the file says of itself.
fn provenance(scene: &PatchScene, solver: &Solver) -> Provenance {
    Provenance {
        software: "the example keep_and_go_on".into(),
        method: Method::Solve,
        scene: "cornell".into(),
        source: SceneSource {
            file: "cornell".into(),
            metres_per_unit: 1.0,
            patches: Some(5_000),
            patch_size: None,
            two_sided: false,
            light: Vec::new(),
        },
        fingerprint: scene.fingerprint(),
        rays: solver.rays(),
        seed: 1,
        part: None,
        seeds: vec![1],
        settings: vec![("preset".into(), "default".into())],
        relative_error: solver.relative_error() as f32,
    }
}
