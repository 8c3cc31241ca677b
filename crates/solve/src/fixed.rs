//! Sums that any number of threads may add to in any order, with the same bits: 64-bit fixed point.
//!
//! One wave adds at most two deposits a ray, so the unit follows from the largest deposit and the wave's size:
//! 62 bits for their product leave the smallest deposits that matter some 30 bits.

use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};

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

    /// Rounds up or down at random, with `dither` uniform in [0, 1): the mean is kept however small `x` is.
    #[inline]
    fn quantize_dithered(self, x: f64, dither: f64) -> i64 {
        (x * self.per_value + dither).floor() as i64
    }
}

/// What a wave leaves on its patches: Σ deposits, and what the error bars need of them, side by side in memory.
#[derive(Debug, Default)]
pub struct DepositSums(Vec<PatchSums>);

#[derive(Debug, Default)]
struct PatchSums {
    deposits: [AtomicI64; 3],
    squares: AtomicI64,
    hits: AtomicU32,
}

/// Bytes of a patch's sums.
pub(crate) const BYTES_PER_PATCH: usize = size_of::<PatchSums>();

/// One patch's sums, read.
#[derive(Clone, Copy, Debug, Default)]
pub struct PatchTotals {
    /// Σ deposits, W.
    pub deposits: Rgb,
    /// Σ 𝓛(deposit)², W².
    pub squares: f64,
    /// Number of deposits.
    pub hits: u32,
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

impl DepositSums {
    /// Sums of zero for so many patches.
    pub fn new(patches: usize) -> Self {
        Self((0..patches).map(|_| PatchSums::default()).collect())
    }

    /// Adds one deposit. Squares span twice the orders of magnitude that deposits do,
    /// so they are rounded with `dither`, uniform in [0, 1).
    #[inline]
    pub fn add(&self, index: usize, deposit: Rgb, dither: f64, units: Units) {
        let sums = &self.0[index];
        for (channel, v) in sums.deposits.iter().zip(deposit.to_array()) {
            channel.fetch_add(units.deposit.quantize(v), Ordering::Relaxed);
        }
        let square = deposit.luminance() * deposit.luminance();
        sums.squares.fetch_add(units.square.quantize_dithered(square, dither), Ordering::Relaxed);
        sums.hits.fetch_add(1, Ordering::Relaxed);
    }

    /// Reads one patch's sums and sets them to zero.
    #[inline]
    pub fn take(&self, index: usize, units: Units) -> PatchTotals {
        let sums = &self.0[index];
        let take = |sum: &AtomicI64, unit: Unit| sum.swap(0, Ordering::Relaxed) as f64 * unit.value;
        PatchTotals {
            deposits: Rgb::from_array([0, 1, 2].map(|c| take(&sums.deposits[c], units.deposit))),
            squares: take(&sums.squares, units.square),
            hits: sums.hits.swap(0, Ordering::Relaxed),
        }
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
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use rayon::prelude::*;
    use twinray_scene::sample::stream::{mix, to_unit};

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

    /// Squares far below their unit keep their mean: the error bar of a dark patch beside a bright lamp.
    #[test]
    fn tiny_squares_keep_their_mean() {
        let units = Units::new(1e6, 1 << 22);
        let (sums, n) = (DepositSums::new(1), 1 << 16);
        // 0.02 units each: 65 536 of them give 1311 ± 36.
        let deposit = (0.02 * units.square.value).sqrt();
        (0..n).for_each(|i| sums.add(0, Rgb::grey(deposit), to_unit(mix(i)), units));
        let mean = sums.take(0, units).squares / (n as f64 * deposit * deposit);
        assert!((mean - 1.0).abs() < 0.11, "{mean}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// Any values of any magnitude up to the bound, in any order and on several threads: the same bits, and the
        /// sum to half a unit a value.
        #[test]
        fn any_order_gives_the_same_bits(
            values in prop::collection::vec((-1.0..1.0f64, any::<u64>()), 1..200), exponent in -30.0..30.0f64,
        ) {
            let largest = 10f64.powf(exponent);
            let unit = Unit::new(largest, values.len() as u64);
            let mut order: Vec<usize> = (0..values.len()).collect();
            let sums = FixedSums::new(3);
            values.iter().for_each(|(v, _)| sums.add(0, Rgb::grey(v * largest), unit));
            order.sort_by_key(|&i| values[i].1);
            order.iter().for_each(|&i| sums.add(1, Rgb::grey(values[i].0 * largest), unit));
            order.par_iter().for_each(|&i| sums.add(2, Rgb::grey(values[i].0 * largest), unit));
            let (a, b, c) = (sums.take(0, unit), sums.take(1, unit), sums.take(2, unit));
            prop_assert!(a == b && b == c);
            let exact: f64 = values.iter().map(|(v, _)| v * largest).sum();
            let rounding = largest * values.len() as f64 * 1e-15;
            prop_assert!((a.g - exact).abs() <= rounding, "{} against {exact}", a.g);
        }
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
