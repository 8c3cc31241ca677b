//! Sums that any number of threads may add to in any order, with the same bits: 64-bit fixed point.
//!
//! One wave adds at most two deposits a ray, so the unit follows from the largest deposit and the wave's size:
//! 62 bits for their product leave the smallest deposits that matter some 30 bits.

use std::sync::atomic::{AtomicI64, Ordering};

use twinray_scene::Rgb;

/// The unit of a wave's sums.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    per_value: f64,
    value: f64,
}

impl Unit {
    /// For at most `count` deposits of magnitude at most `largest`.
    pub fn new(largest: f64, count: u64) -> Self {
        let value = largest.max(f64::MIN_POSITIVE) * count.max(1) as f64 / (1u64 << 62) as f64;
        Self { per_value: 1.0 / value, value }
    }

    #[inline]
    fn quantize(self, x: f64) -> i64 {
        // `as` saturates: a deposit beyond the bound is clipped, never wrapped.
        (x * self.per_value).round_ties_even() as i64
    }
}

/// An array of RGB sums.
#[derive(Debug, Default)]
pub struct FixedSums(Vec<[AtomicI64; 3]>);

impl FixedSums {
    /// `count` sums of zero.
    pub fn new(count: usize) -> Self {
        Self((0..count).map(|_| Default::default()).collect())
    }

    /// Adds to one sum.
    #[inline]
    pub fn add(&self, index: usize, value: Rgb, unit: Unit) {
        let sum = &self.0[index];
        for (channel, v) in sum.iter().zip(value.to_array()) {
            channel.fetch_add(unit.quantize(v), Ordering::Relaxed);
        }
    }

    /// Reads one sum and sets it to zero.
    #[inline]
    pub fn take(&self, index: usize, unit: Unit) -> Rgb {
        let take = |c: usize| self.0[index][c].swap(0, Ordering::Relaxed) as f64 * unit.value;
        Rgb::new(take(0), take(1), take(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_additions_does_not_matter_and_the_sum_is_right() {
        let unit = Unit::new(1e3, 2000);
        let values: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.37).sin() * 1e3).collect();
        let sum = |order: &mut dyn Iterator<Item = usize>| {
            let sums = FixedSums::new(1);
            order.for_each(|i| sums.add(0, Rgb::grey(values[i]), unit));
            sums.take(0, unit)
        };
        let (a, b) = (sum(&mut (0..1000)), sum(&mut (0..1000).rev()));
        assert_eq!(a, b);
        assert!((a.g - values.iter().sum::<f64>()).abs() < 1e-9);
    }

    #[test]
    fn the_largest_wave_does_not_overflow() {
        let unit = Unit::new(1.0, 1 << 22);
        let sums = FixedSums::new(1);
        (0..1 << 22).for_each(|_| sums.add(0, Rgb::WHITE, unit));
        assert_eq!(sums.take(0, unit).g, f64::from(1 << 22));
        assert_eq!(sums.take(0, unit), Rgb::BLACK);
    }
}
