//! The solver's settings: from the command line, or from a solution file that is gone on with.

use anyhow::{anyhow, bail};
use clap::ValueEnum;
use twinray::format::Provenance;
use twinray::solve::{Estimator, Params, Representation, Schedule};

use crate::args::{EstimatorArg, LARGEST_BATCH, Preset, RepresentationArg, SolveArgs};

/// Names of the settings in files.
const WORDS: [&str; 4] = ["preset", "estimator", "representation", "batch"];

/// What decides a solution beside scene and rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Seed that the user gave.
    pub seed: u64,
    /// Which of how many parts.
    pub part: Option<[u32; 2]>,
    /// Preset.
    pub preset: Preset,
    estimator: EstimatorArg,
    representation: RepresentationArg,
    batch: u64,
}

impl Settings {
    /// As the command line says.
    pub fn new(args: &SolveArgs, part: Option<[u32; 2]>) -> Self {
        Self {
            seed: args.seed.unwrap_or(1),
            part,
            preset: args.preset.unwrap_or_default(),
            estimator: args.estimator.unwrap_or_default(),
            representation: args.representation.unwrap_or_default(),
            batch: args.batch.unwrap_or(1),
        }
    }

    /// As a solution file says, which the command line may repeat but not contradict.
    pub fn stored(name: &str, provenance: &Provenance, args: &SolveArgs) -> anyhow::Result<Self> {
        if let Some((key, _)) = provenance.settings.iter().find(|(key, _)| !WORDS.contains(&key.as_str())) {
            bail!("{name}: has a setting {key}, which this twinray does not know: use the one that wrote it");
        }
        let word = |key: &str| provenance.settings.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str());
        fn value<T: ValueEnum + Default>(name: &str, key: &str, word: Option<&str>) -> anyhow::Result<T> {
            let Some(word) = word else { return Ok(T::default()) };
            T::from_str(word, false).map_err(|_| {
                anyhow!("{name}: its setting {key} is \"{word}\", which this twinray does not know: use the one that wrote it")
            })
        }
        let batch = word("batch").map_or(Some(1), |word| word.parse().ok().filter(|n| (1..=LARGEST_BATCH).contains(n)));
        let stored = Self {
            seed: provenance.seed,
            part: provenance.part,
            preset: value(name, "preset", word("preset"))?,
            estimator: value(name, "estimator", word("estimator"))?,
            representation: value(name, "representation", word("representation"))?,
            batch: batch.ok_or_else(|| anyhow!("{name}: its setting batch is no number from 1 to {LARGEST_BATCH}"))?,
        };
        if provenance.seeds.len() == 1 && provenance.seeds[0] != stored.effective_seed() {
            bail!("{name}: its random numbers are not those of its seed: use the twinray that wrote it");
        }
        let wish = [
            ("--seed", args.seed.is_some_and(|seed| seed != stored.seed)),
            ("--preset", args.preset.is_some_and(|preset| preset != stored.preset)),
            ("--estimator", args.estimator.is_some_and(|estimator| estimator != stored.estimator)),
            ("--representation", args.representation.is_some_and(|r| r != stored.representation)),
            ("--batch", args.batch.is_some_and(|batch| batch != stored.batch)),
        ];
        if let Some((option, _)) = wish.iter().find(|(_, differs)| *differs) {
            bail!(
                "{name}: was solved with another {option}: leave it out to go on, or solve the scene anew into another file"
            );
        }
        Ok(stored)
    }

    /// The seed that random numbers are made from.
    pub fn effective_seed(&self) -> u64 {
        self.part.map_or(self.seed, |[k, n]| Params::seed_of_part(self.seed, k, n))
    }

    /// The solver's.
    pub fn params(&self) -> Params {
        let seed = self.effective_seed();
        let preset = match self.preset {
            Preset::Default => Params::default_preset(seed),
            Preset::Paper => Params { schedule: Schedule::Paper { batch: self.batch }, ..Params::paper_preset(seed) },
        };
        Params {
            estimator: match self.estimator {
                EstimatorArg::Forward => Estimator::Forward,
                EstimatorArg::Backward => Estimator::Backward,
                EstimatorArg::Equal => Estimator::Equal,
                EstimatorArg::Balance => Estimator::Balance,
            },
            representation: match self.representation {
                RepresentationArg::Main => Representation::Main,
                RepresentationArg::Sample => Representation::Sample,
                RepresentationArg::Both => Representation::Both,
                RepresentationArg::Last => Representation::Last,
            },
            ..preset
        }
    }

    /// In words, as files keep them; not the seed and the part, which files keep by themselves.
    pub fn words(&self) -> Vec<(String, String)> {
        let mut pairs = vec![
            ("preset", word(self.preset)),
            ("estimator", word(self.estimator)),
            ("representation", word(self.representation)),
        ];
        if self.preset == Preset::Paper {
            pairs.push(("batch", self.batch.to_string()));
        }
        pairs.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

/// An option's value as the user writes it.
fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
}
