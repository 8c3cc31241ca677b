//! Several processes, one solve: what they must be able to say to each other, and who does what.
//!
//! All of them hold the whole state. A wave's rays are dealt out, its sums are added up over all ranks before they are entered
//! (`wave::exchange`), and everything else is computed by everyone. Sums are integers, and what is floating point is added
//! up in the order of tasks, whose number no rank changes: so all hold the bits of a solver that is alone.
//!
//! Not here: any means of communication. `mpi/` has one, for clusters; the tests have one, of threads.

use std::fmt;

use twinray_scene::sample::stream::mix;

/// Other processes that solve the same scene with the same settings, each a part of every wave's rays.
///
/// All ranks make the same calls in the same order, from the thread that called the solver and never from two threads at
/// a time; each call returns when all ranks have made it. There is no error to return: a process that loses its peers
/// cannot go on.
pub trait Peers: Sync {
    /// This process's number, from 0 on.
    fn rank(&self) -> usize;

    /// How many processes there are, this one included.
    fn count(&self) -> usize;

    /// Replaces every value by its sum over all ranks, wrapping where it does not fit. All ranks give the same number of
    /// values.
    fn sum(&self, values: &mut [i64]);

    /// Replaces every value by the least of all ranks.
    fn least(&self, values: &mut [u64]);

    /// Whether any rank says yes: what a clock or a signal tells must be agreed upon before anybody stops.
    fn any(&self, yes: bool) -> bool {
        let mut said = [u64::from(!yes)];
        self.least(&mut said);
        said == [0]
    }
}

/// The peers of a solve, if it has any.
#[derive(Clone, Copy)]
pub(crate) struct Among<'a>(Option<&'a dyn Peers>);

/// Sums of so many patches cost about as much to send as one ray to shoot (`docs/scale.md`): waves of fewer rays are shot
/// by every rank for itself.
const PATCHES_PER_RAY: u64 = 8;

impl<'a> Among<'a> {
    /// A single process has no peers, whatever it came with.
    pub(crate) fn new(peers: Option<&'a dyn Peers>) -> Self {
        Self(peers.filter(|p| p.count() > 1))
    }

    /// Whether there is nobody else.
    pub(crate) fn is_alone(self) -> bool {
        self.0.is_none()
    }

    /// Those who share a wave of so many rays among so many patches; `None` if everyone shoots all of it.
    pub(crate) fn sharing(self, rays: u64, patches: usize) -> Option<&'a dyn Peers> {
        self.0.filter(|_| rays.saturating_mul(PATCHES_PER_RAY) >= patches as u64)
    }

    /// True if all ranks say the same.
    pub(crate) fn agree(self, on: u64) -> bool {
        let Some(peers) = self.0 else { return true };
        let mut bounds = [on, !on];
        peers.least(&mut bounds);
        bounds[0] == !bounds[1]
    }
}

impl fmt::Debug for Among<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.0 {
            Some(peers) => write!(f, "rank {} of {}", peers.rank(), peers.count()),
            None => write!(f, "alone"),
        }
    }
}

/// One number for a fingerprint and all settings.
pub(crate) fn digest(fingerprint: u64, settings: &str) -> u64 {
    settings.bytes().fold(fingerprint, |hash, byte| mix(hash ^ u64::from(byte)))
}
