//! Independent solves of one scene added up: as if all of their rays had been shot by one.
//!
//! Sums have equal weights per ray, so merging is adding; n solves of equal length have one n-th of one's variance.
//! Not here: who may be added to whom, which needs settings and seeds.

use std::borrow::Cow;

use twinray_scene::sample::Stream;

use crate::record::{RecordError, WavesRecord};
use crate::source::PackedRepresentative;
use crate::tally::Tally;

const STREAM_MERGE: u64 = 8;

/// Adds up solves of the default schedule by their seeds, which must differ; records that were added up before are
/// welcome, by a number that no seed of theirs is (or what was chosen at random then would be chosen again). The sums are
/// taken in the order of seeds, so the order of `parts` changes no bit.
///
/// # Errors
/// If a record holds what no solve gives, or arrays differ in length.
///
/// # Panics
/// Without parts.
pub fn merge(parts: &[(u64, &WavesRecord)]) -> Result<WavesRecord<'static>, RecordError> {
    let mut parts = parts.to_vec();
    parts.sort_by_key(|(seed, _)| *seed);
    let (_, first) = parts[0];
    for (_, part) in &parts {
        part.check()?;
        if part.unit != first.unit {
            let expected = "the same unit in all: that of the scene";
            return Err(RecordError::Value { array: "totals", index: Some(1), expected });
        }
        for (array, found, expected) in
            [("deposits", part.deposits.len(), first.deposits.len()), ("glossy", part.glossy.len(), first.glossy.len())]
        {
            if found != expected {
                return Err(RecordError::Length { array, found, expected });
            }
        }
    }
    let (patches, lobes) = (|| 0..first.deposits.len(), || 0..first.glossy.len());
    let weight: f64 = parts.iter().map(|(_, part)| part.weight).sum();
    let mut tally = Tally::default();
    parts.iter().for_each(|(_, part)| tally.add_weighted(&part.tally, 1.0));
    let sum = |of: &dyn Fn(&WavesRecord) -> f64| parts.iter().map(|(_, part)| of(part)).sum::<f64>();
    // The variance of a sum is the sum of variances, each of which one difference tells.
    let difference = |k: usize| sum(&|part| f64::from(part.difference[k]).powi(2)).sqrt() as f32;
    let hits = |k: usize| parts.iter().fold(0, |hits: u32, (_, part)| hits.saturating_add(part.hits[k]));
    let colors = |k: usize| std::array::from_fn(|c| sum(&|part| part.reflected[k][c].into()) as f32);
    Ok(WavesRecord {
        rays: parts.iter().fold(0, |rays: u64, (_, part)| rays.saturating_add(part.rays)),
        weight,
        tally,
        unit: first.unit,
        deposits: patches().map(|k| std::array::from_fn(|c| sum(&|part| part.deposits[k][c]))).collect(),
        squares: patches().map(|k| sum(&|part| part.squares[k].into()) as f32).collect(),
        difference: patches().map(difference).collect(),
        hits: patches().map(hits).collect(),
        glossy: Cow::Owned(first.glossy.to_vec()),
        reflected: lobes().map(colors).collect(),
        representatives: lobes().map(|k| representative(&parts, k, weight)).collect(),
        runs: None,
    })
}

/// One of the samples, drawn in proportion to what it stands for: the directional part of the mean of all.
fn representative(parts: &[(u64, &WavesRecord)], k: usize, weight: f64) -> PackedRepresentative {
    let mut least = f64::INFINITY;
    let mut drawn = PackedRepresentative::default();
    let mut importance = 0.0;
    for (seed, part) in parts {
        let sample = &part.representatives[k];
        let stands_for = part.weight * f64::from(sample.importance);
        importance += stands_for;
        if sample.is_there() && stands_for > 0.0 {
            // The smallest of exponential variates over weights is drawn in proportion to weight.
            let key = -libm::log(1.0 - Stream::new(*seed, STREAM_MERGE, k as u64).uniform()) / stands_for;
            if key < least {
                (least, drawn) = (key, *sample);
            }
        }
    }
    drawn.importance = (importance / weight) as f32;
    drawn
}
