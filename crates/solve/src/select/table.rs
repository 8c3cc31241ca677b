//! Choice among many by a cumulative table with a guide, for a state that stays frozen for a wave.
//!
//! Monotone in u, so that the strata of a low-discrepancy sequence become strata over patches. O(1) expected per
//! choice, O(K) per build; the tree serves where single changes must be followed.

/// Cumulative weights, and for each of K equal slices of [0, 1) the first entry it can choose.
#[derive(Clone, Debug, Default)]
pub struct Table {
    cumulative: Vec<f64>,
    guide: Vec<u32>,
}

impl Table {
    /// Refills the table from non-negative weights with a positive sum; returns the sum.
    pub fn fill(&mut self, weights: impl ExactSizeIterator<Item = f64>) -> f64 {
        let count = weights.len();
        self.cumulative.clear();
        let mut sum = 0.0;
        self.cumulative.extend(weights.map(|w| {
            sum += w;
            sum
        }));
        self.guide.clear();
        let mut entry = 0;
        for slice in 0..count {
            let start = slice as f64 / count as f64 * sum;
            while entry + 1 < count && self.cumulative[entry] <= start {
                entry += 1;
            }
            self.guide.push(entry as u32);
        }
        sum
    }

    /// The entry at `u` in [0, 1) of the running sum of weights.
    #[inline]
    pub fn select(&self, u: f64) -> usize {
        let count = self.cumulative.len();
        let target = u * self.cumulative[count - 1];
        let mut entry = self.guide[((u * count as f64) as usize).min(count - 1)] as usize;
        // Rounding may have put the guide one too far.
        while entry > 0 && self.cumulative[entry - 1] > target {
            entry -= 1;
        }
        while entry + 1 < count && self.cumulative[entry] <= target {
            entry += 1;
        }
        // Trailing entries without weight share the last cumulative value.
        while entry > 0 && self.cumulative[entry] == self.cumulative[entry - 1] {
            entry -= 1;
        }
        entry
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::sample::Stream;
    use twinray_testkit::chi2;

    #[test]
    fn frequencies_follow_the_weights() {
        let weights: Vec<f64> = (0..1000).map(|i| if i % 3 == 0 { 0.0 } else { f64::from(i * i) }).collect();
        let mut table = Table::default();
        let sum = table.fill(weights.iter().copied());
        let mut stream = Stream::new(3, 0, 0);
        let mut count = vec![0u64; 1000];
        let draws = 1_000_000;
        (0..draws).for_each(|_| count[table.select(stream.uniform())] += 1);
        let expected: Vec<f64> = weights.iter().map(|w| w / sum * f64::from(draws)).collect();
        let outcome = chi2::test(&count, &expected);
        assert!(outcome.p_value > 0.01, "{outcome:?}");
        assert_eq!(table.select(0.0), 1);
        assert_eq!(table.select(1.0 - f64::EPSILON / 2.0), 998);
    }
}
