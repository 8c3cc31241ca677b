//! Ranks of an MPI cluster as peers of one solve.
//!
//! Lives here: all-reduce, and an account of what it cost. Not here: what is said, which `twinray_solve` decides. Every
//! call is made by the thread that started MPI, while threads of a pool do the rest: the level is `MPI_THREAD_FUNNELED`.

use std::ops::Sub;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use mpi::Threading;
use mpi::collective::SystemOperation;
use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Equivalence};
use twinray_solve::Peers;

/// Values of one message: MPI counts in 32 bits, and longer messages are no faster.
const LONGEST: usize = 1 << 20;

/// All processes that `mpirun` started. The universe ends with it.
pub struct Ranks {
    _universe: Universe,
    /// The only thread that may call MPI.
    thread: ThreadId,
    rank: usize,
    count: usize,
    calls: AtomicU64,
    bytes: AtomicU64,
    waiting: AtomicU64,
    talking: AtomicU64,
}

/// What ranks told each other, of one rank's view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// All-reduces.
    pub calls: u64,
    /// Bytes given to them by this rank. What goes over the wires is up to MPI: of n ranks in a ring, each sends and gets
    /// 2(n − 1)/n times as much.
    pub bytes: u64,
    /// Time until the last rank came.
    pub waiting: Duration,
    /// Time from then on.
    pub talking: Duration,
}

impl Ranks {
    /// Starts MPI; from now on this thread alone may talk. Without `mpirun` there is one rank.
    ///
    /// # Errors
    /// If it was started before, or forbids other threads.
    pub fn new() -> Result<Self, String> {
        let (universe, level) =
            mpi::initialize_with_threading(Threading::Funneled).ok_or("MPI was started before: start it once")?;
        if level < Threading::Funneled {
            return Err(format!(
                "this MPI allows {level:?} threads; expected Funneled: install one built with threads"
            ));
        }
        let world = universe.world();
        Ok(Self {
            thread: thread::current().id(),
            rank: world.rank() as usize,
            count: world.size() as usize,
            _universe: universe,
            calls: AtomicU64::new(0),
            bytes: AtomicU64::new(0),
            waiting: AtomicU64::new(0),
            talking: AtomicU64::new(0),
        })
    }

    /// What was said so far.
    pub fn traffic(&self) -> Traffic {
        let time = |nanoseconds: &AtomicU64| Duration::from_nanos(nanoseconds.load(Ordering::Relaxed));
        Traffic {
            calls: self.calls.load(Ordering::Relaxed),
            bytes: self.bytes.load(Ordering::Relaxed),
            waiting: time(&self.waiting),
            talking: time(&self.talking),
        }
    }

    /// Waits for all ranks.
    pub fn wait(&self) {
        self.world().barrier();
    }

    /// Ends all ranks with this exit code: for whoever failed alone, since the others would wait for ever.
    pub fn abort(&self, code: i32) -> ! {
        self.world().abort(code)
    }

    /// Nothing but a name, made anew since MPI's handles may not be shared by threads.
    fn world(&self) -> SimpleCommunicator {
        assert!(thread::current().id() == self.thread, "MPI is called by the thread that started it alone");
        SimpleCommunicator::world()
    }

    fn reduce<T: Equivalence + Copy>(&self, values: &mut [T], operation: SystemOperation) {
        let (world, start) = (self.world(), Instant::now());
        world.barrier();
        let met = Instant::now();
        let mut mine = Vec::new();
        for chunk in values.chunks_mut(LONGEST) {
            mine.clear();
            mine.extend_from_slice(chunk);
            world.all_reduce_into(&mine[..], chunk, operation);
        }
        let add = |to: &AtomicU64, value: u64| to.fetch_add(value, Ordering::Relaxed);
        add(&self.calls, 1);
        add(&self.bytes, size_of_val(values) as u64);
        add(&self.waiting, (met - start).as_nanos() as u64);
        add(&self.talking, met.elapsed().as_nanos() as u64);
    }
}

impl Peers for Ranks {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.count
    }

    fn sum(&self, values: &mut [i64]) {
        self.reduce(values, SystemOperation::sum());
    }

    fn least(&self, values: &mut [u64]) {
        self.reduce(values, SystemOperation::min());
    }
}

impl Drop for Ranks {
    fn drop(&mut self) {
        // The end of MPI waits for all ranks, who wait for this one.
        if thread::panicking() {
            self.abort(101);
        }
    }
}

impl Sub for Traffic {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        Self {
            calls: self.calls - before.calls,
            bytes: self.bytes - before.bytes,
            waiting: self.waiting - before.waiting,
            talking: self.talking - before.talking,
        }
    }
}
