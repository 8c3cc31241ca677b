//! The rays of a wave in order of their first number, without sorting.
//!
//! Of 2ᵏ points of the Sobol sequence from a multiple of 2ᵏ on, exactly one has each value of the first k digits: so
//! the digits are the place, and one pass over the points writes them in order. Rays in order of the number that
//! chooses their patch start from neighbours one after another: the choice becomes a sweep, patches are read in
//! sequence, and rays share the nodes that they meet as well as if they had been sorted by origin (`docs/performance.md`).

use rayon::prelude::*;
use twinray_scene::sample::Sobol;

const EMPTY: u32 = u32::MAX;

/// Several aligned runs of points that cover a wave, each in order; memory that waves take turns to use.
#[derive(Debug, Default)]
pub(crate) struct Order {
    digits: u32,
    first_run: u64,
    /// `[run][place]`: the point's number within its run.
    places: Vec<u32>,
}

impl Order {
    /// Orders points `first .. first + count`.
    pub(crate) fn fill(&mut self, sobol: &Sobol, first: u64, count: u64) {
        // Eight to sixteen runs: long ones for order, several so that little of the first and the last is outside.
        self.digits = (count.ilog2()).saturating_sub(3).min(31);
        let (digits, end) = (self.digits, first + count);
        self.first_run = first >> digits;
        let runs = (((end - 1) >> digits) - self.first_run + 1) as usize;
        let length = 1 << digits;
        self.places.resize(runs << digits, EMPTY);
        self.places.par_chunks_mut(length).enumerate().for_each(|(run, places)| {
            let base = (self.first_run + run as u64) << digits;
            let block = sobol.block(base);
            let range = first.max(base)..end.min(base + length as u64);
            if range.end - range.start < length as u64 {
                places.fill(EMPTY);
            }
            for index in range {
                // In 64 bits, where a shift by all 32 digits is allowed.
                let place = u64::from(block.first_digits(index as u32)) >> (32 - digits);
                places[place as usize] = (index - base) as u32;
            }
        });
    }

    /// Number of places in every run.
    pub(crate) fn places(&self) -> usize {
        1 << self.digits
    }

    /// First points of the runs.
    pub(crate) fn bases(&self) -> impl Iterator<Item = u64> {
        let runs = (self.places.len() >> self.digits) as u64;
        (0..runs).map(|run| (self.first_run + run) << self.digits)
    }

    /// The point of a run at a place, counted from the run's base; `None` if it is not in the wave.
    #[inline]
    pub(crate) fn at(&self, run: usize, place: usize) -> Option<u32> {
        let low = self.places[run << self.digits | place];
        (low != EMPTY).then_some(low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every point of any range comes once, and first numbers come in order but for the width of a place.
    #[test]
    fn every_point_comes_once_and_in_order() {
        let sobol = Sobol::new(17);
        let mut order = Order::default();
        for (first, count) in [(0, 1), (5, 7), (1000, 3000), (4096, 4096), ((1 << 32) - 100, 5000), (12_345, 65_536)] {
            order.fill(&sobol, first, count);
            let bases: Vec<u64> = order.bases().collect();
            let mut seen = vec![false; count as usize];
            for place in 0..order.places() {
                for (run, base) in bases.iter().enumerate() {
                    let Some(low) = order.at(run, place) else { continue };
                    let index = base + u64::from(low);
                    assert!(!std::mem::replace(&mut seen[(index - first) as usize], true));
                    assert_eq!((sobol.point(index)[0] * order.places() as f64) as usize, place);
                }
            }
            assert!(seen.iter().all(|&s| s), "{first}, {count}");
        }
    }
}
