//! What ranks that share a wave tell each other: sums of patches, the best candidates, what each task counted.
//!
//! Afterwards every rank has what one process would have had, bit by bit. Bytes a patch and wave: 40, and 56 more of a
//! glossy one, or 104 if it is observed (`docs/scale.md`).

use super::Task;
use super::bucket::{BucketSums, Candidate, GlossySums, PatchSums};
use crate::peers::Peers;
use crate::strategies::Fit;
use crate::tally::Tally;

/// Adds up the sums of some buckets over all ranks.
pub(super) fn add_up(peers: &dyn Peers, observed: bool, buckets: &mut [BucketSums]) {
    let mut words: Vec<i64> = all_words(buckets, observed).map(|word| *word).collect();
    peers.sum(&mut words);
    all_words(buckets, observed).zip(words).for_each(|(to, word)| *to = word);
    if buckets.iter().any(|sums| !sums.glossy.is_empty()) {
        choose(peers, buckets);
    }
}

/// Every number that is added up, in an order that is the same everywhere.
fn all_words(buckets: &mut [BucketSums], observed: bool) -> impl Iterator<Item = &mut i64> {
    buckets.iter_mut().flat_map(move |sums| {
        let glossy = sums.glossy.iter_mut().flat_map(move |sum| lobe_words(sum, observed));
        sums.patches.iter_mut().flat_map(patch_words).chain(glossy)
    })
}

fn patch_words(PatchSums { deposits, squares, hits }: &mut PatchSums) -> impl Iterator<Item = &mut i64> {
    deposits.units_mut().iter_mut().chain([squares, hits])
}

fn lobe_words(sums: &mut GlossySums, observed: bool) -> impl Iterator<Item = &mut i64> {
    let GlossySums { reflected, observed: to_eye, importance, best: _ } = sums;
    let to_eye = to_eye.iter_mut().filter(move |_| observed).flat_map(|part| part.units_mut());
    reflected.units_mut().iter_mut().chain([importance]).chain(to_eye)
}

/// Word by word: of the candidates that agree with the least in all words so far, the least next one.
fn choose(peers: &dyn Peers, buckets: &mut [BucketSums]) {
    let mine: Vec<Option<[u64; 3]>> =
        buckets.iter().flat_map(|sums| &sums.glossy).map(|sum| sum.best.map(|best| best.words())).collect();
    let mut least = vec![[u64::MAX; 3]; mine.len()];
    for word in 0..3 {
        let in_race = |(mine, least): (&Option<[u64; 3]>, &[u64; 3])| match mine {
            Some(mine) if mine[..word] == least[..word] => mine[word],
            // Whoever is out of the race is never less than who is in it.
            _ => u64::MAX,
        };
        let mut words: Vec<u64> = mine.iter().zip(&least).map(in_race).collect();
        peers.least(&mut words);
        least.iter_mut().zip(words).for_each(|(least, next)| least[word] = next);
    }
    // No key is the largest word: where it is left, nobody had a candidate.
    let best = least.into_iter().map(|words| (words[0] != u64::MAX).then(|| Candidate::from_words(words)));
    buckets.iter_mut().flat_map(|sums| &mut sums.glossy).zip(best).for_each(|(sum, best)| sum.best = best);
}

/// Gives every rank what every task counted. Tasks of other ranks must hold nothing but zeros here.
///
/// Counts are floating-point numbers: added up later in the order of tasks, they give the bits of one process. Here each is
/// a sum of one number and zeros, taken as bits, so it is exact.
pub(super) fn gather(peers: &dyn Peers, tasks: &mut [Task]) {
    let words = |task: &Task| task.tally.to_words().into_iter().chain(task.fit.to_words());
    let mut words: Vec<i64> = tasks.iter().flat_map(words).map(u64::cast_signed).collect();
    peers.sum(&mut words);
    let mut words = words.into_iter().map(i64::cast_unsigned);
    for task in tasks {
        task.tally = Tally::from_words(std::array::from_fn(|_| words.next().unwrap_or_default()));
        task.fit = Fit::from_words(std::array::from_fn(|_| words.next().unwrap_or_default()));
    }
}
