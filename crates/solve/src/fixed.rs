//! Sums that any number of threads may add to in any order, with the same bits: 64-bit fixed point.
//!
//! One wave adds at most two deposits a ray, so the unit follows from the largest deposit and the wave's size:
//! 62 bits for their product leave the smallest deposits that matter some 30 bits.

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

    /// In units, rounded to the nearest.
    #[inline]
    pub fn quantize(self, x: f64) -> i64 {
        // `as` cuts off towards zero, and saturates: a deposit beyond the bound is clipped, never wrapped.
        let units = x * self.per_value;
        (units + 0.5f64.copysign(units)) as i64
    }

    /// Rounds a value that is not negative up or down at random, with `dither` uniform in [0, 1): the mean is kept
    /// however small `x` is.
    #[inline]
    pub fn quantize_dithered(self, x: f64, dither: f64) -> i64 {
        (x * self.per_value + dither) as i64
    }

    /// One unit.
    #[inline]
    pub fn value(self) -> f64 {
        self.value
    }
}

/// Units of a wave's sums.
#[derive(Clone, Copy, Debug)]
pub struct Units {
    /// Of deposits.
    pub deposit: Unit,
    /// Of their squares.
    pub square: Unit,
}

impl Units {
    /// For at most `count` deposits of magnitude at most `largest`.
    pub fn new(largest: f64, count: u64) -> Self {
        Self { deposit: Unit::new(largest, count), square: Unit::new(largest * largest, count) }
    }
}

/// A sum of colours.
#[derive(Clone, Copy, Debug, Default)]
pub struct FixedRgb([i64; 3]);

impl FixedRgb {
    /// Adds a value.
    #[inline]
    pub fn add(&mut self, value: Rgb, unit: Unit) {
        for (channel, v) in self.0.iter_mut().zip(value.to_array()) {
            // The unit leaves room for every deposit of a solve; numbers that somebody else wrote may go round.
            *channel = channel.wrapping_add(unit.quantize(v));
        }
    }

    /// The sum in units, to be added to others.
    pub fn units_mut(&mut self) -> &mut [i64; 3] {
        &mut self.0
    }

    /// The sum.
    #[inline]
    pub fn value(&self, unit: Unit) -> Rgb {
        Rgb::from_array(self.0.map(|c| c as f64 * unit.value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use twinray_scene::sample::stream::{mix, to_unit};

    fn sum(values: impl Iterator<Item = f64>, unit: Unit) -> Rgb {
        let mut sum = FixedRgb::default();
        values.for_each(|v| sum.add(Rgb::grey(v), unit));
        sum.value(unit)
    }

    #[test]
    fn the_order_of_additions_does_not_matter_and_the_sum_is_right() {
        let unit = Unit::new(1e3, 2000);
        let values: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.37).sin() * 1e3).collect();
        let (a, b) = (sum(values.iter().copied(), unit), sum(values.iter().rev().copied(), unit));
        assert_eq!(a, b);
        assert!((a.g - values.iter().sum::<f64>()).abs() < 1e-9);
    }

    /// Squares far below their unit keep their mean: the error bar of a dark patch beside a bright lamp.
    #[test]
    fn tiny_squares_keep_their_mean() {
        let (unit, n) = (Units::new(1e6, 1 << 22).square, 1 << 16);
        // 0.02 units each: 65 536 of them give 1311 ± 36.
        let square = 0.02 * unit.value;
        let sum: i64 = (0..n).map(|i| unit.quantize_dithered(square, to_unit(mix(i)))).sum();
        let mean = sum as f64 * unit.value / (n as f64 * square);
        assert!((mean - 1.0).abs() < 0.11, "{mean}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// Any values of any magnitude up to the bound, in any order: the same bits, and the sum to half a unit a value.
        #[test]
        fn any_order_gives_the_same_bits(
            values in prop::collection::vec((-1.0..1.0f64, any::<u64>()), 1..200), exponent in -30.0..30.0f64,
        ) {
            let largest = 10f64.powf(exponent);
            let unit = Unit::new(largest, values.len() as u64);
            let mut order: Vec<usize> = (0..values.len()).collect();
            let a = sum(values.iter().map(|(v, _)| v * largest), unit);
            order.sort_by_key(|&i| values[i].1);
            let b = sum(order.iter().map(|&i| values[i].0 * largest), unit);
            prop_assert_eq!(a, b);
            let exact: f64 = values.iter().map(|(v, _)| v * largest).sum();
            let rounding = largest * values.len() as f64 * 1e-15;
            prop_assert!((a.g - exact).abs() <= rounding, "{} against {exact}", a.g);
        }
    }

    /// Deposits of states that no solve gives may be beyond every bound: their sums go round, and nothing ends.
    #[test]
    fn what_is_beyond_the_bound_goes_round() {
        let unit = Unit::new(1.0, 4);
        assert!(sum([1e300; 3].into_iter(), unit).g.is_finite());
        assert_eq!(sum([1e300, -1e300, 1e300].into_iter(), unit), sum([1e300, 1e300, -1e300].into_iter(), unit));
    }

    #[test]
    fn the_largest_wave_does_not_overflow() {
        let unit = Unit::new(1.0, 1 << 22);
        assert_eq!(sum((0..1 << 22).map(|_| 1.0), unit).g, f64::from(1 << 22));
    }
}
