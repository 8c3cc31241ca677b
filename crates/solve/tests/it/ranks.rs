//! Several processes that share a solve get the bits of one. Here they are threads that talk through a table; what is done
//! among real processes, `mpi/` checks.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex};
use std::time::Duration;

use twinray_scene::{Environment, PatchScene, Rgb, Scene, builtin};
use twinray_solve::record::WavesRecord;
use twinray_solve::{Observer, Params, Peers, Record, Schedule, SolveError, Solver, Stage};

use super::{cut, glossy_cornell};

/// Where ranks meet.
#[derive(Default)]
struct Table {
    count: usize,
    round: Mutex<Round>,
    changed: Condvar,
    calls: AtomicUsize,
}

/// A call that all ranks make.
#[derive(Default)]
struct Round {
    words: Vec<u64>,
    arrived: usize,
    leaving: usize,
}

struct Seat<'a> {
    table: &'a Table,
    rank: usize,
}

impl Table {
    fn combine(&self, values: &mut [u64], op: fn(u64, u64) -> u64) {
        // Whoever waits in vain says so: a test that hangs tells nothing.
        let wait = |round, until: fn(&mut Round) -> bool| {
            let waited = self.changed.wait_timeout_while(round, Duration::from_secs(60), |r| !until(r)).unwrap();
            assert!(!waited.1.timed_out(), "a rank does not come");
            waited.0
        };
        let mut round = wait(self.round.lock().unwrap(), |r| r.leaving == 0);
        if round.arrived == 0 {
            round.words = values.to_vec();
        } else {
            assert_eq!(round.words.len(), values.len(), "ranks make different calls");
            round.words.iter_mut().zip(&*values).for_each(|(word, value)| *word = op(*word, *value));
        }
        round.arrived += 1;
        if round.arrived == self.count {
            (round.arrived, round.leaving) = (0, self.count);
            self.calls.fetch_add(1, Ordering::Relaxed);
            self.changed.notify_all();
        } else {
            round = wait(round, |r| r.leaving > 0);
        }
        values.copy_from_slice(&round.words);
        round.leaving -= 1;
        self.changed.notify_all();
    }
}

impl Peers for Seat<'_> {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.table.count
    }

    fn sum(&self, values: &mut [i64]) {
        assert!(rayon::current_thread_index().is_none(), "called by a task, not by whoever called the solver");
        let mut words: Vec<u64> = values.iter().map(|v| v.cast_unsigned()).collect();
        self.table.combine(&mut words, u64::wrapping_add);
        values.iter_mut().zip(words).for_each(|(value, word)| *value = word.cast_signed());
    }

    fn least(&self, values: &mut [u64]) {
        assert!(rayon::current_thread_index().is_none(), "called by a task, not by whoever called the solver");
        self.table.combine(values, u64::min);
    }
}

/// Runs every rank in a thread of its own; their answers, and how often they talked.
fn among<T: Send>(count: usize, rank: impl Fn(&dyn Peers) -> T + Sync) -> (Vec<T>, usize) {
    let table = Table { count, ..Table::default() };
    let answers = std::thread::scope(|scope| {
        let (table, run) = (&table, &rank);
        let threads: Vec<_> = (0..count).map(|rank| scope.spawn(move || run(&Seat { table, rank }))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    (answers, table.calls.into_inner())
}

struct Case<'a> {
    name: &'a str,
    scene: PatchScene,
    observer: Option<Observer>,
    params: Params,
    rays: u64,
}

impl<'a> Case<'a> {
    fn new(name: &'a str, authored: &Scene, patches: usize, observed: bool, rays: u64) -> Self {
        let scene = cut(authored, patches);
        let observer = observed.then(|| Observer::new(&scene, &authored.cameras[0]));
        Self { name, scene, observer, params: Params::default_preset(3), rays }
    }

    /// Everything that a solution tells, in bits; and how many tasks were traced here.
    fn solve(&self, peers: Option<&dyn Peers>) -> (Vec<u64>, usize) {
        let Self { scene, params, rays, .. } = self;
        let traced = AtomicUsize::new(0);
        let mut solver = Solver::among(scene, params.clone(), self.observer, peers).unwrap();
        while solver.rays() < *rays {
            solver.advance_in_stages(*rays, &|stage| {
                traced.fetch_add(usize::from(stage == Stage::Trace), Ordering::Relaxed);
            });
        }
        let solution = solver.solution();
        let balance = solution.balance();
        let mut bits = vec![solution.rays(), solution.relative_error().to_bits()];
        bits.extend([balance.sky, balance.absorbed, balance.escaped, balance.lost].map(f64::to_bits));
        bits.extend(solver.shares().unwrap().to_array().map(f64::to_bits));
        for p in scene.patches() {
            bits.extend(solution.irradiance(p).to_array().map(f64::to_bits));
            bits.extend(solution.radiance(scene, p, scene.normal(p)).to_array().map(f64::to_bits));
            bits.extend([solution.standard_error(p).to_bits(), u64::from(solution.hits(p))]);
            bits.extend(solution.observed_lobe(p).into_iter().flatten().flat_map(|l| l.to_array().map(f64::to_bits)));
        }
        (bits, traced.into_inner())
    }
}

fn under_a_sky(mut scene: Scene) -> Scene {
    scene.environment = Some(Environment::Uniform(Rgb::new(0.2, 0.3, 0.5)));
    scene
}

#[test]
fn ranks_do_not_change_a_bit() {
    let short = |case: Case<'static>| Case { params: Params { warm_start: 0.25, ..case.params.clone() }, ..case };
    let cases = [
        Case::new("diffuse", &builtin::cornell(false), 2500, false, 150_000),
        Case::new("diffuse, sky", &under_a_sky(builtin::cornell(false)), 5000, false, 150_000),
        Case::new("glossy", &glossy_cornell(), 2500, false, 60_000),
        Case::new("glossy, sky, observer", &under_a_sky(glossy_cornell()), 2500, true, 60_000),
        Case::new("some glossy, observer", &builtin::hall(), 9000, true, 60_000),
        // So many patches that their sums are added up in groups.
        short(Case::new("many patches", &builtin::hall(), 140_000, true, 60_000)),
    ];
    for case in &cases {
        let (alone, traced) = case.solve(None);
        let counts: &[usize] = if case.scene.len() > 100_000 { &[3] } else { &[2, 3, 5] };
        for &count in counts {
            let (ranks, calls) = among(count, |peers| case.solve(Some(peers)));
            for (rank, (bits, _)) in ranks.iter().enumerate() {
                let same = bits.iter().zip(&alone).filter(|(a, b)| a == b).count();
                let Case { name, .. } = case;
                assert!(*bits == alone, "{name}: rank {rank} of {count} has {same} of {} words right", alone.len());
            }
            // Each task was traced by one rank, and none did all.
            let shares: Vec<usize> = ranks.iter().map(|(_, traced)| *traced).collect();
            assert_eq!(shares.iter().sum::<usize>(), traced, "{}: {shares:?}", case.name);
            assert!(
                shares.iter().all(|s| s.abs_diff(traced / count) <= traced / count / 2),
                "{}: {shares:?}",
                case.name
            );
            assert!(calls > 4, "{}: {calls} calls", case.name);
        }
    }
}

/// Begun by three, taken up by two, ended by one, with and without waves between.
#[test]
fn a_solve_may_change_hands() {
    let scene = cut(&under_a_sky(glossy_cornell()), 2500);
    let params = Params::default_preset(8);
    let mut alone = Solver::new(&scene, params.clone(), None).unwrap();
    let begin = |peers: &dyn Peers| {
        let mut solver = Solver::among(&scene, params.clone(), None, Some(peers)).unwrap();
        solver.run(20_000);
        waves(solver.record())
    };
    let (begun, _) = among(3, begin);
    alone.run(20_000);
    assert!(begun.iter().all(|record| *record == waves(alone.record())));
    let go_on = |peers: &dyn Peers| {
        let record = Record::Waves(begun[peers.rank()].clone());
        let mut solver = Solver::resume_among(&scene, params.clone(), &record, Some(peers)).unwrap();
        solver.run(50_000);
        waves(solver.record())
    };
    let (gone_on, _) = among(2, go_on);
    alone.run(50_000);
    assert!(gone_on.iter().all(|record| *record == waves(alone.record())));
    let mut last = Solver::resume(&scene, params.clone(), &Record::Waves(gone_on[1].clone())).unwrap();
    last.run(90_000);
    alone.run(90_000);
    assert_eq!(last.record(), alone.record());

    let differ = |peers: &dyn Peers| {
        let record = Record::Waves([&begun[0], &gone_on[0]][peers.rank()].clone());
        Solver::resume_among(&scene, params.clone(), &record, Some(peers)).err()
    };
    assert_eq!(among(2, differ).0, [const { Some(SolveError::PeersDiffer) }; 2]);
}

fn waves(record: Record) -> WavesRecord<'static> {
    let Record::Waves(waves) = record else { panic!("the paper's schedule") };
    waves.into_owned()
}

/// Nobody waits for whoever does something else.
#[test]
fn ranks_that_cannot_share_are_told() {
    let authored = builtin::cornell(false);
    let scenes = [500, 700].map(|patches| cut(&authored, patches));
    let observer = Observer::new(&scenes[0], &authored.cameras[0]);
    let refused = |of: &(dyn Fn(usize) -> (usize, Params, Option<Observer>) + Sync)| {
        let start = |peers: &dyn Peers| {
            let (scene, params, observer) = of(peers.rank());
            Solver::among(&scenes[scene], params, observer, Some(peers)).err()
        };
        among(3, start).0
    };
    let params = Params::default_preset(1);
    let odd = |rank: usize| usize::from(rank == 1);
    assert_eq!(refused(&|rank| (odd(rank), params.clone(), None)), [const { Some(SolveError::PeersDiffer) }; 3]);
    let seed = |rank| Params::default_preset(odd(rank) as u64);
    assert_eq!(refused(&|rank| (0, seed(rank), None)), [const { Some(SolveError::PeersDiffer) }; 3]);
    let seen = |rank| (0, params.clone(), (rank == 1).then_some(observer));
    assert_eq!(refused(&seen), [const { Some(SolveError::PeersDiffer) }; 3]);
    let paper = Params { schedule: Schedule::Paper { batch: 64 }, ..params.clone() };
    assert_eq!(refused(&|_| (0, paper.clone(), None)), [const { Some(SolveError::PaperPeers) }; 3]);
    assert_eq!(refused(&|_| (0, params.clone(), None)), [const { None }; 3]);
}

#[test]
fn what_one_rank_says_all_hear() {
    for who in [None, Some(0), Some(2)] {
        let (heard, _) = among(3, |peers| peers.any(Some(peers.rank()) == who));
        assert_eq!(heard, [who.is_some(); 3]);
    }
}
