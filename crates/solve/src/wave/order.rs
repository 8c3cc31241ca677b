//! The rays of a wave in order of their first number, without sorting.
//!
//! Of 2ᵏ points of the Sobol sequence from a multiple of 2ᵏ on, exactly one has each value of the first k digits: so
//! the digits are the place, and one pass over the points writes them in order. Rays in order of the number that
//! chooses their patch start from neighbours one after another: the choice becomes a sweep, patches are read in
//! sequence, and rays share the nodes that they meet as well as if they had been sorted by origin (`docs/performance.md`).
//!
//! A task is an equal part of the places, so its points are those with the same few digits in front: every so manyth.
//! It puts them in order alone, in a core's cache, and whoever does not shoot it never looks at them.

use std::ops::Range;

use twinray_scene::sample::{Sobol, SobolBlock};

const EMPTY: u32 = u32::MAX;

/// Several aligned runs of points that cover a wave, cut into tasks.
#[derive(Debug)]
pub(crate) struct Order<'a> {
    /// Points of the wave.
    points: Range<u64>,
    /// log₂ of a run's places.
    digits: u32,
    /// log₂ of the tasks.
    task_digits: u32,
    runs: Vec<Run<'a>>,
}

/// An aligned run of points, some of which may lie outside of the wave.
#[derive(Debug)]
struct Run<'a> {
    base: u64,
    block: SobolBlock<'a>,
}

impl<'a> Order<'a> {
    /// Of points `first .. first + count`, in `tasks` parts, a power of two; fewer if there are fewer places.
    pub(crate) fn new(sobol: &'a Sobol, first: u64, count: u64, tasks: usize) -> Self {
        // Eight to sixteen runs: long ones for order, several so that little of the first and the last is outside.
        let digits = (count.ilog2()).saturating_sub(3).min(31);
        let end = first + count;
        let bases = (first >> digits..=(end - 1) >> digits).map(|run| run << digits);
        let runs = bases.map(|base| Run { base, block: sobol.block(base) }).collect();
        Self { points: first..end, digits, task_digits: tasks.ilog2().min(digits), runs }
    }

    /// Number of tasks.
    pub(crate) fn tasks(&self) -> usize {
        1 << self.task_digits
    }

    /// Calls `each` with the points of a task that [`Order::fill`] put in order.
    #[inline]
    pub(crate) fn each(&self, lows: &[u32], mut each: impl FnMut(u64, &SobolBlock)) {
        let places = self.places();
        for place in 0..places {
            for (r, run) in self.runs.iter().enumerate() {
                let low = lows[r * places + place];
                if low != EMPTY {
                    each(run.base + u64::from(low), &run.block);
                }
            }
        }
    }

    /// Places of a task in every run.
    fn places(&self) -> usize {
        1 << (self.digits - self.task_digits)
    }

    /// Fills `lows[run][place]` of a task with the point's number within its run, [`EMPTY`] if it is not in the wave.
    pub(crate) fn fill(&self, task: usize, lows: &mut Vec<u32>) {
        lows.clear();
        lows.resize(self.runs.len() * self.places(), EMPTY);
        for (run, lows) in self.runs.iter().zip(lows.chunks_exact_mut(self.places())) {
            let offset = u64::from(run.block.with_first_digits(task as u32, self.task_digits));
            for low in (offset..1 << self.digits).step_by(self.tasks()) {
                let index = run.base + low;
                if self.points.contains(&index) {
                    // In 64 bits, where a shift by all 32 digits is allowed.
                    let place = (u64::from(run.block.first_digits(index as u32)) >> (32 - self.digits)) as usize;
                    lows[place & (self.places() - 1)] = low as u32;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every point of any range comes once in whatever tasks, and first numbers come in order but for the width of a place.
    #[test]
    fn every_point_comes_once_and_in_order() {
        let sobol = Sobol::new(17);
        for (first, count) in [(0, 1), (5, 7), (1000, 3000), (4096, 4096), ((1 << 32) - 100, 5000), (12_345, 65_536)] {
            for tasks in [1, 8, 64] {
                let order = Order::new(&sobol, first, count, tasks);
                assert!(order.tasks() == tasks || order.places() == 1);
                let all = order.tasks() * order.places();
                let (mut seen, mut before, mut lows) = (vec![false; count as usize], 0, Vec::new());
                for task in 0..order.tasks() {
                    order.fill(task, &mut lows);
                    order.each(&lows, |index, block| {
                        assert!(!std::mem::replace(&mut seen[(index - first) as usize], true));
                        assert_eq!(block.point(index as u32), sobol.point(index));
                        let place = (sobol.point(index)[0] * all as f64) as usize;
                        assert!(place >= before && place / order.places() == task);
                        before = place;
                    });
                }
                assert!(seen.iter().all(|&s| s), "{first}, {count}, {tasks} tasks");
            }
        }
    }
}
