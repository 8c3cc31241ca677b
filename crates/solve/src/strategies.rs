//! The strategies by which rays find their starts, and the shares of rays that they get.
//!
//! Whatever the shares, the balance heuristic keeps the mean; they decide the variance. They are fitted to the solve:
//! the variance of a mixture is ∫ c L²/λ over pairs of points, and a step that gives every strategy the part of
//! it for which it is responsible never makes it larger (Douc, Guillin, Marin, Robert, "Minimum variance importance sampling
//! via population Monte Carlo", ESAIM: Probability and Statistics 11, 2007). Some rays bear witness to those parts.

use twinray_scene::{PatchId, PatchScene, Rgb};

/// Number of strategies.
pub(crate) const STRATEGIES: usize = 6;

/// What part of the rays starts by which strategy; they sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// By the power that patches send out, emitted or reflected: the paper's choice.
    pub power: f64,
    /// By the power that patches emit.
    pub lamps: f64,
    /// Evenly over area.
    pub area: f64,
    /// Evenly over patches, however small.
    pub patches: f64,
    /// From the environment. Where there is none, or no lamp, their shares go to the first.
    pub environment: f64,
    /// From the lights without area, by their power: nothing else finds them.
    pub points: f64,
}

impl Shares {
    /// The paper's: by power alone.
    pub const POWER: Self = Self { power: 1.0, lamps: 0.0, area: 0.0, patches: 0.0, environment: 0.0, points: 0.0 };

    /// What a solve begins with before it has seen anything. Under a sky most power is on roofs that send it back: more
    /// rays start where they are needed instead.
    pub(crate) fn first(sky: bool, lights: bool) -> Self {
        let shares = if sky {
            Self { power: 0.30, lamps: 0.05, area: 0.175, patches: 0.175, environment: 0.3, points: 0.0 }
        } else {
            Self { power: 0.85, lamps: 0.05, area: 0.05, patches: 0.05, environment: 0.0, points: 0.0 }
        };
        if lights { shares.with_points(FIRST_POINTS) } else { shares }
    }

    /// The same, with a share for lights without area that all others give up in proportion.
    pub fn with_points(self, points: f64) -> Self {
        let mut shares = self.to_array().map(|share| share * (1.0 - points));
        shares[STRATEGIES - 1] += points;
        Self::from_array(shares)
    }

    /// A share evenly, half over area and half over patches, one from the environment, the rest by power.
    pub fn even(gather: f64, environment: f64) -> Self {
        let half = 0.5 * gather;
        Self { power: 1.0 - gather - environment, lamps: 0.0, area: half, patches: half, environment, points: 0.0 }
    }

    /// In the order of the fields.
    pub fn to_array(self) -> [f64; STRATEGIES] {
        [self.power, self.lamps, self.area, self.patches, self.environment, self.points]
    }

    /// From the order of the fields.
    pub(crate) fn from_array([power, lamps, area, patches, environment, points]: [f64; STRATEGIES]) -> Self {
        Self { power, lamps, area, patches, environment, points }
    }
}

/// First share of lights without area: all direct light of many a room.
const FIRST_POINTS: f64 = 0.25;
/// Least share of a strategy that was begun with: what starves cannot be found to be needed again.
const LEAST: f64 = 0.005;
/// Witnesses before shares are moved.
const WITNESSES: f64 = 1000.0;

/// How much the square of a deposit matters: c_i, so that Σ c_i d² estimates what is to be made small.
///
/// There are two such errors: the relative mean square error of irradiance as it is reported everywhere, ΣA ΔE²/ΣA E² without
/// emitters, and the mean over patches of (ΔE/E)², which sees small patches and dark ones.
#[derive(Debug)]
pub(crate) struct Witness<'a> {
    scene: &'a PatchScene,
    /// Σ deposits so far, per patch.
    deposits: &'a [[f64; 3]],
    /// Their weight.
    weight: f64,
    known: Known,
}

/// What is known of a solution as a whole.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Known {
    /// ΣA E² of luminance.
    pub energy: f64,
    /// Mean irradiance, W·m⁻².
    pub irradiance: f64,
    /// Whether emitters count: only where there is nothing else.
    pub emitters: bool,
}

impl Known {
    /// From Σ deposits of this weight; O(K).
    pub(crate) fn new(scene: &PatchScene, deposits: &[[f64; 3]], weight: f64) -> Self {
        let of = |emitters: bool| {
            let (mut energy, mut total, mut area) = (0.0, 0.0, 0.0);
            for p in scene.patches().filter(|&p| emitters || scene.emission(p).is_black()) {
                let power = Rgb::from_array(deposits[p.index()]).luminance() / weight;
                energy += power * power / scene.area(p);
                total += power;
                area += scene.area(p);
            }
            Self { energy, irradiance: if area > 0.0 { total / area } else { 0.0 }, emitters }
        };
        let known = of(false);
        if known.energy > 0.0 { known } else { of(true) }
    }

    /// A witness of deposits, unless there is no light to speak of.
    pub(crate) fn witness<'a>(
        self,
        scene: &'a PatchScene,
        deposits: &'a [[f64; 3]],
        weight: f64,
    ) -> Option<Witness<'a>> {
        (self.energy > 0.0).then_some(Witness { scene, deposits, weight, known: self })
    }
}

impl Witness<'_> {
    /// c_i d² of both errors: over area, over patches.
    #[inline]
    pub(crate) fn squares(&self, patch: PatchId, power: Rgb) -> [f64; 2] {
        if !self.known.emitters && !self.scene.emission(patch).is_black() {
            return [0.0; 2];
        }
        let area = self.scene.area(patch);
        let least = LEAST_IRRADIANCE * self.known.irradiance * area;
        let known = (Rgb::from_array(self.deposits[patch.index()]).luminance() / self.weight).max(least);
        let square = power.luminance() * power.luminance();
        [square / (area * self.known.energy), square / (self.scene.len() as f64 * known * known)]
    }
}

/// Of the mean irradiance, what a patch without hits counts as.
const LEAST_IRRADIANCE: f64 = 0.1;
/// The error over area is multiplied by so high a power of the error over patches, and the product is made small: the latter
/// has to fall by three percent for every percent that the former rises. A sum would let the thousands of dark slivers of a real
/// scene have nearly all of the rays.
const OVER_PATCHES: f64 = 1.0 / 3.0;

/// What witnesses tell of the strategies.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fit {
    /// Σ c d² of both errors for which each is responsible.
    pub sums: [[f64; STRATEGIES]; 2],
    pub witnesses: f64,
}

impl Fit {
    /// One witness: Σ c d² of its deposits, of both errors; λ at both ends together, and what of it each strategy gives at either.
    #[inline]
    pub(crate) fn observe(&mut self, squares: [f64; 2], density: f64, a: [f64; STRATEGIES], b: [f64; STRATEGIES]) {
        for (sums, square) in self.sums.iter_mut().zip(squares) {
            for k in 0..STRATEGIES {
                sums[k] += square / density * (a[k] + b[k]);
            }
        }
        self.witnesses += 1.0;
    }

    /// Adds the witnesses of other rays.
    pub(crate) fn add(&mut self, other: &Fit) {
        self.sums.iter_mut().flatten().zip(other.sums.iter().flatten()).for_each(|(a, b)| *a += b);
        self.witnesses += other.witnesses;
    }

    /// Numbers in it.
    pub(crate) const WORDS: usize = 2 * STRATEGIES + 1;

    /// All of it, bit by bit.
    pub(crate) fn to_words(self) -> [u64; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let sums = self.sums.as_flattened().iter().chain([&self.witnesses]);
        words.iter_mut().zip(sums).for_each(|(word, sum)| *word = sum.to_bits());
        words
    }

    /// The inverse of [`Fit::to_words`].
    pub(crate) fn from_words(words: [u64; Self::WORDS]) -> Self {
        let mut fit = Self::default();
        let sums = fit.sums.as_flattened_mut().iter_mut().chain([&mut fit.witnesses]);
        sums.zip(words).for_each(|(sum, word)| *sum = f64::from_bits(word));
        fit
    }

    /// The shares after a step; the old ones until there are enough witnesses.
    pub(crate) fn step(&self, old: Shares) -> Shares {
        let totals = self.sums.map(|sums| sums.iter().sum::<f64>());
        if self.witnesses < WITNESSES || !totals.iter().all(|t| t.is_finite() && *t > 0.0) {
            return old;
        }
        let old = old.to_array();
        // What each is responsible for of the product of both errors, in logarithms.
        let part = |k: usize| {
            (self.sums[0][k] / totals[0] + OVER_PATCHES * self.sums[1][k] / totals[1]) / (1.0 + OVER_PATCHES)
        };
        // Half of a step: whole ones swing to and fro between strategies that do not overlap, whose best shares are the
        // geometric mean of these two.
        let mut next: [f64; STRATEGIES] = std::array::from_fn(|k| (old[k] * part(k)).sqrt());
        let sum: f64 = next.iter().sum();
        for (share, old) in next.iter_mut().zip(old).filter(|(_, old)| *old > 0.0) {
            *share = (*share / sum).max(LEAST.min(old));
        }
        let sum: f64 = next.iter().sum();
        next.iter_mut().for_each(|s| *s /= sum);
        Shares::from_array(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::sample::Stream;

    /// Two strategies, each good at one half of a domain of which the first half needs 16 times the density: steps lead to
    /// the shares with the least variance, ∝ √16 : 1.
    #[test]
    fn steps_lead_to_the_least_variance() {
        let mut shares = Shares { power: 0.5, lamps: 0.5, ..Shares::even(0.0, 0.0) };
        let mut stream = Stream::new(9, 0, 0);
        for _ in 0..20 {
            let mut fit = Fit::default();
            for _ in 0..20_000 {
                // Densities 2 on the own half; integrands 4 and 1.
                let first = stream.uniform() < shares.power;
                let (density, value) = if first { (2.0 * shares.power, 4.0) } else { (2.0 * shares.lamps, 1.0) };
                let parts = if first { [density, 0.0] } else { [0.0, density] };
                let square = (value / density) * (value / density);
                fit.observe([square; 2], density, [parts[0], parts[1], 0.0, 0.0, 0.0, 0.0], [0.0; STRATEGIES]);
            }
            shares = fit.step(shares);
        }
        // 20 000 witnesses tell the ratio to about 1 %.
        assert!((shares.power - 0.8).abs() < 0.01, "{shares:?}");
        assert_eq!(shares.environment, 0.0);
    }

    #[test]
    fn words_hold_all_of_it() {
        let mut fit = Fit::default();
        assert_eq!(fit.to_words(), [0; Fit::WORDS], "nothing must be all zeros");
        fit.observe([1.0, 3.0], 0.7, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.5, 0.6, 0.7, 0.8, 0.9, 1.0]);
        let copy = Fit::from_words(fit.to_words());
        assert_eq!((copy.sums, copy.witnesses), (fit.sums, fit.witnesses));
    }

    #[test]
    fn nothing_starves_and_few_witnesses_change_nothing() {
        let mut fit = Fit::default();
        let all_by_power =
            |fit: &mut Fit| fit.observe([1.0; 2], 1.0, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; STRATEGIES]);
        all_by_power(&mut fit);
        let first = Shares::first(false, true);
        assert_eq!(fit.step(first), first);
        (0..2000).for_each(|_| all_by_power(&mut fit));
        let next = fit.step(first);
        assert!(next.lamps > 0.004 && next.area > 0.004 && next.patches > 0.004 && next.points > 0.004);
        assert_eq!(next.environment, 0.0);
        assert!((next.to_array().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
