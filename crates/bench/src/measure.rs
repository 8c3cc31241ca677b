//! Rates, their medians, and what is made of them: contestants take turns, so that a machine that slows down for a while
//! slows all of them, and ratios are taken within each turn.

use std::collections::BTreeMap;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::{Value, json};

use crate::results::Reader;

/// The middle value; the mean of the middle two. Not a number if there are none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

/// What `work` gives, and its seconds.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

/// Threads of their own: rayon's global ones are left alone.
pub fn pool(threads: usize) -> Result<ThreadPool, String> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| format!("{threads} threads: {e}"))
}

/// Rates of contestants that took turns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Race {
    rounds: BTreeMap<String, Vec<f64>>,
}

impl Race {
    /// Enters a contestant's rate of this turn.
    pub fn add(&mut self, name: &str, rate: f64) {
        self.rounds.entry(name.to_owned()).or_default().push(rate);
    }

    /// Median of a contestant.
    pub fn median(&self, name: &str) -> Result<f64, String> {
        Ok(median(self.of(name)?))
    }

    /// Median over the turns of one contestant's rate over another's.
    pub fn ratio(&self, name: &str, other: &str) -> Result<f64, String> {
        let ratios: Vec<f64> = self.of(name)?.iter().zip(self.of(other)?).map(|(a, b)| a / b).collect();
        Ok(median(&ratios))
    }

    /// Number of turns.
    pub fn turns(&self) -> usize {
        self.rounds.values().map(Vec::len).max().unwrap_or(0)
    }

    fn of(&self, name: &str) -> Result<&[f64], String> {
        self.rounds.get(name).map(Vec::as_slice).ok_or_else(|| format!("no rates of {name}"))
    }

    /// Every rate, to be stored.
    pub fn json(&self) -> Value {
        json!(self.rounds)
    }

    /// What [`Race::json`] stored.
    pub fn read(stored: Reader) -> Result<Self, String> {
        let rates = |(name, values): (String, Reader)| {
            let values: Result<Vec<f64>, String> = values.items()?.iter().map(Reader::number).collect();
            Ok((name, values?))
        };
        let rounds: Result<_, String> = stored.members()?.into_iter().map(rates).collect();
        Ok(Self { rounds: rounds? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn ratios_are_taken_within_a_turn() {
        let mut race = Race::default();
        // A machine of half the speed in the second turn.
        for speed in [1.0, 0.5, 1.0] {
            race.add("a", 6.0 * speed);
            race.add("b", 3.0 * speed);
        }
        assert_eq!(race.ratio("a", "b"), Ok(2.0));
        assert_eq!((race.median("a"), race.turns()), (Ok(6.0), 3));
        assert!(race.ratio("a", "c").is_err());
        assert_eq!(Race::read(Reader::new(&race.json())), Ok(race));
    }
}
