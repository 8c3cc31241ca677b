//! A wave's sums of one bucket of patches: 64-bit fixed point and keyed candidates, so that no order of tasks, threads or
//! machines changes a bit.

use twinray_scene::Rgb;
use twinray_scene::sample::stream::{mix, to_unit};

use super::close::{Closing, Part};
use super::deposits::Deposit;
use super::{Task, WaveContext};
use crate::direction;
use crate::fixed::FixedRgb;
use crate::params::Representation;

/// A bucket's sums of one wave.
#[derive(Debug, Default)]
pub(super) struct BucketSums {
    pub(super) patches: Vec<PatchSums>,
    pub(super) glossy: Vec<GlossySums>,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PatchSums {
    pub(super) deposits: FixedRgb,
    pub(super) squares: i64,
    pub(super) hits: i64,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GlossySums {
    pub(super) reflected: FixedRgb,
    pub(super) observed: [FixedRgb; 2],
    pub(super) importance: i64,
    pub(super) best: Option<Candidate>,
}

/// A candidate for a glossy patch's representative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    /// Exponential variate over importance, not negative: the smallest of a wave is drawn in proportion to importance.
    pub(super) key: f64,
    /// The deposit's, of single precision.
    pub(super) power: Rgb,
    /// Packed direction.
    pub(super) from: u32,
}

impl Candidate {
    /// All of it as numbers, of which the lexicographically least is drawn: first comes the key, whose bits are in its
    /// order, then what tells candidates of one key apart, so that nothing depends on who meets whom first. The number
    /// `u64::MAX` is not among the keys.
    pub(super) fn words(&self) -> [u64; 3] {
        let [r, g, b] = self.power.to_f32().map(|c| u64::from(c.to_bits()));
        [self.key.to_bits(), r << 32 | g, b << 32 | u64::from(self.from)]
    }

    /// The inverse of [`Candidate::words`].
    pub(super) fn from_words([key, rg, b_from]: [u64; 3]) -> Self {
        let power = [(rg >> 32) as u32, rg as u32, (b_from >> 32) as u32].map(f32::from_bits);
        Self { key: f64::from_bits(key), power: Rgb::from_f32(power), from: b_from as u32 }
    }

    #[inline]
    fn beats(&self, other: &Self) -> bool {
        self.key < other.key || self.key == other.key && self.words() < other.words()
    }
}

impl BucketSums {
    /// Sums all that the tasks left in a bucket.
    pub(super) fn fill(&mut self, context: &WaveContext, closing: &Closing, tasks: &[Task], part: &Part) {
        let [patches, lobes] = part.sizes();
        self.patches.clear();
        self.patches.resize(patches, PatchSums::default());
        self.glossy.clear();
        self.glossy.resize(lobes, GlossySums::default());
        let units = closing.units;
        for task in tasks {
            let (deposits, from) = task.deposits.bucket(part.bucket);
            for (k, deposit) in deposits.iter().enumerate() {
                if deposit.is_nothing() {
                    continue;
                }
                if !deposit.is_direct_part() {
                    let sums = &mut self.patches[deposit.patch().index() - part.first];
                    let power = deposit.power();
                    sums.deposits.add(power, units.deposit);
                    // Squares span twice the orders of magnitude that deposits do, so they are rounded at random.
                    let [a, b] = deposit.bits();
                    let square = power.luminance() * power.luminance();
                    let square = units.square.quantize_dithered(square, to_unit(mix(a ^ b.rotate_left(32))));
                    sums.squares = sums.squares.wrapping_add(square);
                    sums.hits += 1;
                }
                if let Some(number) = context.glossy.number_of(deposit.patch()) {
                    let lobe = &mut self.glossy[number - part.first_glossy];
                    lobe.add(context, closing, deposit, from[k], number);
                }
            }
        }
    }
}

impl GlossySums {
    fn add(&mut self, context: &WaveContext, closing: &Closing, deposit: &Deposit, from: u32, number: usize) {
        let (patch, power) = (deposit.patch(), deposit.power());
        let (n, wi) = (context.scene.normal(patch), direction::unpack(from));
        let brdf = context.scene.brdf(patch);
        let unit = closing.units.deposit;
        if context.representation != Representation::Main
            && let Some(eye) = context.glossy.to_eye(number)
        {
            let lobe = power * brdf.lobe_eval(n, wi, eye);
            if deposit.is_direct_part() {
                self.observed[0].add(lobe, unit);
                self.observed[1].add(-lobe, unit);
            } else {
                self.observed[1].add(lobe, unit);
            }
        }
        if deposit.is_direct_part() {
            return;
        }
        let cosine = n.dot(wi).max(0.0);
        let albedo = brdf.albedo(cosine);
        self.reflected.add(power * albedo, unit);
        let importance = match context.representation {
            Representation::Main => return,
            Representation::Sample => (power * albedo).luminance(),
            _ => (power * brdf.lobe_albedo(cosine)).luminance(),
        };
        if importance > 0.0 && cosine > 0.0 {
            self.importance = self.importance.wrapping_add(unit.quantize(importance));
            // A number from the deposit's own bits: the same whoever shot it, in whatever order.
            let [a, b] = deposit.bits();
            let uniform = to_unit(mix(mix(closing.seed ^ a) ^ mix(b ^ u64::from(from) << 32)));
            // Subtracted from 0, for a key of 0 must not be −0.
            let candidate = Candidate { key: (0.0 - libm::log(1.0 - uniform)) / importance, power, from };
            if self.best.is_none_or(|best| candidate.beats(&best)) {
                self.best = Some(candidate);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_survive_as_words_and_ties_do_not_ask_who_came_first() {
        let of = |key: f64, g: f32, from| Candidate { key, power: Rgb::from_f32([0.1, g, -3.0]), from };
        let all = [of(0.0, 1.0, 7), of(2.5, 1.0, 7), of(2.5, 1.0, 8), of(2.5, -1.0, 3), of(f64::INFINITY, 0.5, 0)];
        for a in all {
            assert_eq!(Candidate::from_words(a.words()), a);
            assert_ne!(a.words()[0], u64::MAX);
            for b in all {
                assert_eq!(u8::from(a.beats(&b)) + u8::from(b.beats(&a)), u8::from(a != b), "{a:?} and {b:?}");
                assert_eq!(a.beats(&b), a.words() < b.words(), "{a:?} and {b:?}");
            }
        }
    }
}
