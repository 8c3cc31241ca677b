//! Where the light went: absorbed, escaped, lost. Sums over rays.

use twinray_scene::Rgb;

use crate::record::{TALLY_WORDS, Words};

/// Sums over rays, each divided by the density of the ray: the mean over rays is a power.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rays, those that carried nothing included.
    pub rays: u64,
    /// Power that arrived on patches.
    pub arrived: Rgb,
    /// Power that patches absorbed.
    pub absorbed: Rgb,
    /// Power that left the scene.
    pub escaped: Rgb,
    /// Power that met absorbing backs.
    pub lost: Rgb,
    /// Power that patches got from the environment directly.
    pub sky: Rgb,
    /// Deposits that were not finite and were dropped. Never expected; counted, so that it is never silent.
    pub invalid: u64,
}

impl Tally {
    /// As words: rays, invalid deposits, and the bits of R, G, B of arrived, absorbed, escaped, lost, sky.
    pub fn to_words(&self) -> [u64; TALLY_WORDS] {
        let mut words = [0; TALLY_WORDS];
        [words[0], words[1]] = [self.rays, self.invalid];
        let sums = [self.arrived, self.absorbed, self.escaped, self.lost, self.sky];
        words[2..].iter_mut().zip(sums.iter().flat_map(|s| s.to_array())).for_each(|(w, x)| *w = x.to_bits());
        words
    }

    /// From [`Tally::to_words`].
    pub fn from_words(words: [u64; TALLY_WORDS]) -> Self {
        let mut words = Words::new(&words);
        Self {
            rays: words.whole(),
            invalid: words.whole(),
            arrived: words.color(),
            absorbed: words.color(),
            escaped: words.color(),
            lost: words.color(),
            sky: words.color(),
        }
    }

    /// Adds `other` with a weight for its sums.
    pub fn add_weighted(&mut self, other: &Tally, weight: f64) {
        self.rays = self.rays.saturating_add(other.rays);
        self.invalid = self.invalid.saturating_add(other.invalid);
        self.arrived += other.arrived * weight;
        self.absorbed += other.absorbed * weight;
        self.escaped += other.escaped * weight;
        self.lost += other.lost * weight;
        self.sky += other.sky * weight;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_hold_all_of_it() {
        let color = |x: f64| Rgb::new(x, -x, 0.1 / x);
        let [arrived, absorbed, escaped] = [1.0, 2.0, 3.0].map(color);
        let tally =
            Tally { rays: u64::MAX - 3, arrived, absorbed, escaped, lost: color(4.0), sky: color(5.0), invalid: 9 };
        assert_eq!(Tally::from_words(tally.to_words()), tally);
        assert_eq!(Tally::default().to_words(), [0; TALLY_WORDS], "nothing must be all zeros");
    }
}
