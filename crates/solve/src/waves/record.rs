//! A run of waves, written down and taken up again.

use std::borrow::Cow;

use super::{Surroundings, Waves};
use crate::record::{MOST_RAYS, RUN_WORDS, RecordError, RunRecord, Words, is_sound};
use crate::source::PackedRepresentative;
use crate::strategies::{Fit, Known, STRATEGIES, Shares};
use crate::tally::Tally;

impl Waves {
    /// Goes on from what was written down.
    pub(crate) fn resume(
        around: Surroundings,
        seed: u64,
        sign: f64,
        record: &RunRecord,
        representatives: &[PackedRepresentative],
    ) -> Result<Self, RecordError> {
        let mut this = Self::begin(around, seed, sign);
        let words = &mut Words::new(&record.words);
        [this.n, this.wave, this.epoch] = std::array::from_fn(|_| words.whole());
        [this.source_weight, this.output_weight] = words.doubles();
        let shares: [f64; STRATEGIES] = words.doubles();
        this.shares = Shares::from_array(shares);
        this.fit = Fit { sums: [words.doubles(), words.doubles()], witnesses: words.double() };
        this.known = Known { energy: words.double(), irradiance: words.double(), emitters: words.whole() != 0 };
        this.tally = Tally::from_words(std::array::from_fn(|_| words.whole()));
        let sum: f64 = shares.iter().sum();
        let positive = [this.source_weight, this.output_weight, this.known.energy, this.known.irradiance];
        let fits = this.fit.sums.iter().flatten().chain([&this.fit.witnesses]);
        let weights = positive.iter().all(|x| x.is_finite()) && this.wave <= MOST_RAYS && is_sound(&this.tally);
        let positive = positive.iter().chain(fits).chain(&shares).all(|x| *x >= 0.0);
        if !(weights && positive && (sum - 1.0).abs() < 1e-6) {
            let expected = "weights of at least 0, and shares that are 1 together";
            return Err(RecordError::Value { array: "run-0 or run-1", index: None, expected });
        }
        for (source, radiance) in this.source.sources.iter_mut().zip(record.radiance.iter()) {
            source.constant = *radiance;
        }
        this.source.representatives.copy_from_slice(representatives);
        Ok(this)
    }

    /// Writes down what it starts rays from, but for the representatives.
    pub(crate) fn record(&self) -> RunRecord<'static> {
        let mut words = [0; RUN_WORDS];
        let weights = [self.source_weight, self.output_weight];
        let known = [self.known.energy, self.known.irradiance];
        let doubles = weights.into_iter().chain(self.shares.to_array());
        let doubles = doubles.chain(self.fit.sums.into_iter().flatten()).chain([self.fit.witnesses]).chain(known);
        let values = [self.n, self.wave, self.epoch].into_iter().chain(doubles.map(f64::to_bits));
        let values = values.chain([u64::from(self.known.emitters)]).chain(self.tally.to_words());
        words.iter_mut().zip(values).for_each(|(w, x)| *w = x);
        RunRecord {
            words,
            radiance: self.source.sources.iter().map(|s| s.constant).collect(),
            representatives: Cow::Borrowed(&[]),
        }
    }
}
