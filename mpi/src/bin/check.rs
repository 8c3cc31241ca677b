//! Solves built-in scenes alone and among all ranks, compares the bits, and prints what the ranks told each other.
//!
//!     mpirun -n 4 check [RAYS [SCENE:PATCHES ...]]
//!
//! The table's last line of a scene is Markdown for `docs/scale.md`. Exit code 1 if a bit differs, 2 if the words are wrong.

use std::process::ExitCode;
use std::time::Instant;

use twinray_mpi::{Ranks, Traffic};
use twinray_scene::sample::stream::mix;
use twinray_scene::{PatchBudget, PatchOptions, PatchScene, Scene, builtin};
use twinray_solve::{Observer, Params, Peers, Shares, Solver};

const RAYS: u64 = 400_000;
const SCENES: [&str; 3] = ["cornell:3000", "hall:8000", "hall-diffuse:8000"];

fn main() -> ExitCode {
    let ranks = match Ranks::new() {
        Ok(ranks) => ranks,
        Err(message) => {
            eprintln!("check: {message}");
            return ExitCode::from(2);
        }
    };
    let words: Vec<String> = std::env::args().skip(1).collect();
    let cases = match cases(&words) {
        Ok(cases) => cases,
        Err(message) => {
            if ranks.rank() == 0 {
                eprintln!("check: {message}");
            }
            return ExitCode::from(2);
        }
    };
    if ranks.rank() == 0 {
        println!(
            "| scene | patches | glossy | ranks | rays | waves | epochs | calls | kB a wave | kB an epoch | alone, s | \
             shared, s | waiting, s | talking, s |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
        );
    }
    let differ = cases.iter().filter(|case| !case.check(&ranks)).count();
    ExitCode::from(u8::from(differ > 0))
}

struct Case {
    name: String,
    authored: Scene,
    patches: usize,
    rays: u64,
}

fn cases(words: &[String]) -> Result<Vec<Case>, String> {
    let rays = words.first().map_or(Ok(RAYS), |w| w.parse().map_err(|_| format!("\"{w}\" is no number of rays")))?;
    let case = |word: &str| {
        let faulty = || format!("\"{word}\" is no SCENE:PATCHES, such as cornell:3000");
        let (name, patches) = word.split_once(':').ok_or_else(faulty)?;
        let authored = builtin::by_name(name).ok_or_else(faulty)?;
        Ok(Case { name: name.into(), authored, patches: patches.parse().map_err(|_| faulty())?, rays })
    };
    match words.get(1..) {
        None | Some([]) => SCENES.into_iter().map(case).collect(),
        Some(words) => words.iter().map(|w| case(w)).collect(),
    }
}

/// How a solve went.
struct Run<'a> {
    solver: Solver<'a>,
    waves: u64,
    epochs: u64,
    seconds: f64,
    /// Of the waves, without what came before.
    traffic: Traffic,
}

impl Case {
    /// True if all bits agree.
    fn check(&self, ranks: &Ranks) -> bool {
        let options = PatchOptions { budget: PatchBudget::Count(self.patches), two_sided: false };
        let scene = match PatchScene::new(&self.authored, options) {
            Ok(scene) => scene,
            Err(error) => panic!("{}: {error}", self.name),
        };
        let observer = self.authored.cameras.first().map(|camera| Observer::new(&scene, camera));
        // One rank alone, while the others wait: they would only be in its way.
        let alone = (ranks.rank() == 0).then(|| self.solve(&scene, observer, ranks, None));
        ranks.wait();
        let shared = self.solve(&scene, observer, ranks, Some(ranks));

        let bits = digest(&scene, &shared.solver);
        let mut bounds = [bits, !bits];
        ranks.least(&mut bounds);
        let mut same = bounds[0] == !bounds[1];
        if let Some(alone) = alone {
            same &= alone.solver.record() == shared.solver.record() && digest(&scene, &alone.solver) == bits;
            let verdict = if same { "same bits" } else { "BITS DIFFER" };
            eprintln!("{} on {} ranks: {verdict} ({bits:016x})", self.name, ranks.count());
            let (waves, epochs, traffic) = (shared.waves, shared.epochs, shared.traffic);
            let kilobytes = |per: u64| traffic.bytes as f64 / 1000.0 / per as f64;
            println!(
                "| {} | {} | {} | {} | {} | {waves} | {epochs} | {} | {:.1} | {:.1} | {:.2} | {:.2} | {:.2} | {:.2} |",
                self.name,
                scene.len(),
                scene.patches().filter(|&p| scene.is_glossy(p)).count(),
                ranks.count(),
                shared.solver.rays(),
                traffic.calls,
                kilobytes(waves),
                kilobytes(epochs),
                alone.seconds,
                shared.seconds,
                traffic.waiting.as_secs_f64(),
                traffic.talking.as_secs_f64(),
            );
        }
        !ranks.any(!same)
    }

    fn solve<'a>(
        &self,
        scene: &'a PatchScene,
        observer: Option<Observer>,
        ranks: &Ranks,
        peers: Option<&'a dyn Peers>,
    ) -> Run<'a> {
        let start = Instant::now();
        let mut solver = match Solver::among(scene, Params::default_preset(1), observer, peers) {
            Ok(solver) => solver,
            Err(error) => panic!("{}: {error}", self.name),
        };
        let before = ranks.traffic();
        let (mut waves, mut epochs, mut shares) = (0, 1, solver.shares());
        while solver.rays() < self.rays {
            solver.advance(self.rays);
            // Each replica has one.
            waves += 2;
            let now: Option<Shares> = solver.shares();
            epochs += u64::from(now != shares);
            shares = now;
        }
        Run { solver, waves, epochs, seconds: start.elapsed().as_secs_f64(), traffic: ranks.traffic() - before }
    }
}

/// One number for all that a solution tells.
fn digest(scene: &PatchScene, solver: &Solver) -> u64 {
    let solution = solver.solution();
    let whole = [solution.rays(), solution.relative_error().to_bits(), solution.balance().residual().to_bits()];
    let patch = |p| {
        let normal = scene.normal(p);
        let colors = [solution.irradiance(p), solution.radiance(scene, p, normal)].into_iter();
        let lobes = solution.observed_lobe(p).into_iter().flatten();
        let numbers = colors.chain(lobes).flat_map(|c| c.to_array()).chain([solution.standard_error(p)]);
        numbers.map(f64::to_bits).chain([solution.hits(p).into()])
    };
    whole.into_iter().chain(scene.patches().flat_map(patch)).fold(0, |hash, word| mix(hash ^ word))
}
