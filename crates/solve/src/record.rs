//! A solve written down: everything that decides how it goes on, as plain arrays.
//!
//! Lives here: the arrays, what must hold of them, and the light that they stand for. Not here: bytes and files, which
//! are others' promises. Records borrow from the solver that gives them, or from the file that they were read from.

use std::borrow::Cow;

use twinray_scene::sample::stream::mix;
use twinray_scene::{PatchId, PatchScene, Rgb};

use crate::glossy::GlossyPatches;
use crate::params::Params;
use crate::patch_light::PatchLight;
use crate::sequential::{self, Sequential};
use crate::solution::Solution;
use crate::source::PackedRepresentative;
use crate::sums::{PatchEvidences, Sums};
use crate::tally::Tally;

/// More rays than anybody can shoot; up to here no sum of counts overflows.
pub const MOST_RAYS: u64 = 1 << 56;

/// A solve written down, by its schedule. K is the number of patches, G that of glossy ones.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // there is one at a time
pub enum Record<'a> {
    /// The default schedule.
    Waves(WavesRecord<'a>),
    /// The paper's schedule.
    Sequential(SequentialRecord<'a>),
}

/// The default schedule, or several solves by it that were added up.
#[derive(Clone, Debug, PartialEq)]
pub struct WavesRecord<'a> {
    /// Rays shot, n.
    pub rays: u64,
    /// Weight of the sums: rays, but for what was forgotten; those of a warm start may count for less.
    pub weight: f64,
    /// Where the light went, sums of that weight, W.
    pub tally: Tally,
    /// Unit of `difference`, W, and root of that of `squares`: a power of two near the power of the scene.
    pub unit: f64,
    /// `[K]`: Σ deposits, R, G, B, W. Divided by weight and area they are irradiance.
    pub deposits: Cow<'a, [[f64; 3]]>,
    /// `[K]`: Σ 𝓛(deposit)², in units squared.
    pub squares: Cow<'a, [f32]>,
    /// `[K]`: Σ 𝓛(deposit) of the first replica minus that of the second, in units; of solves that were added up the root of the sum
    /// of squares of theirs.
    pub difference: Cow<'a, [f32]>,
    /// `[K]`: number of deposits.
    pub hits: Cow<'a, [u32]>,
    /// `[G]`: which patches are glossy, in order.
    pub glossy: Cow<'a, [u32]>,
    /// `[G]`: Σ deposit · albedo(ω_in), W. Divided by π, weight and area it is the main part of the reflected radiance.
    pub reflected: Cow<'a, [[f32; 3]]>,
    /// `[G]`: the remembered samples, of the first replica or of one of the solves that were added up.
    pub representatives: Cow<'a, [PackedRepresentative]>,
    /// What it takes to go on; `None` of solves that were added up.
    pub runs: Option<[RunRecord<'a>; 2]>,
}

/// What one replica starts its rays from.
#[derive(Clone, Debug, PartialEq)]
pub struct RunRecord<'a> {
    /// Its numbers; whole ones as they are, others as the bits of doubles.
    pub words: [u64; RUN_WORDS],
    /// `[K]`: radiance that rays start with, W·sr⁻¹·m⁻²: emission and main part of the reflected radiance.
    pub radiance: Cow<'a, [[f32; 3]]>,
    /// `[G]`: the replica's own remembered samples. Empty in the first, whose are those of the solution.
    pub representatives: Cow<'a, [PackedRepresentative]>,
}

/// The paper's schedule.
#[derive(Clone, Debug, PartialEq)]
pub struct SequentialRecord<'a> {
    /// Iterations, n.
    pub rays: u64,
    /// Updates of the power tree since it was last summed anew.
    pub updates: u64,
    /// Where the light went, sums over iterations, W.
    pub tally: Tally,
    /// `[K]`: Σ I, W·m⁻².
    pub irradiance: Cow<'a, [[f64; 3]]>,
    /// `[K]`: Σ 𝓛(deposit)², W².
    pub squares: Cow<'a, [f64]>,
    /// `[K]`: number of deposits.
    pub hits: Cow<'a, [u32]>,
    /// Reflected power × n of every node of the power tree, W, in heap order; paper §2.2.
    pub tree: Cow<'a, [f64]>,
    /// `[G]`: which patches are glossy, in order.
    pub glossy: Cow<'a, [u32]>,
    /// `[G]`: what they remember.
    pub memory: Cow<'a, [GlossyRecord]>,
}

/// A glossy patch of the paper's schedule: Σ I·a/π (R, G, B), Σ l, the stored sample's I(m) (R, G, B), ω_m (x, y, z), l and its
/// rival's l, all as doubles.
pub type GlossyRecord = [f64; 12];

/// Why a record cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// An array that is not of this scene.
    #[error("\"{array}\" has {found} entries; expected {expected}")]
    Length {
        /// Which.
        array: &'static str,
        /// Entries that it has.
        found: usize,
        /// Entries that it should have.
        expected: usize,
    },
    /// A value that no solve gives.
    #[error("\"{array}\"{} holds a value that no solve gives; expected {expected}", .index.map_or(String::new(), |i| format!(", entry {i},")))]
    Value {
        /// Which array.
        array: &'static str,
        /// Which entry, if there is more than one.
        index: Option<usize>,
        /// What it may be.
        expected: &'static str,
    },
    /// A record of another schedule than the settings name.
    #[error("it was made by another schedule; expected {expected}")]
    Schedule {
        /// Which.
        expected: &'static str,
    },
    /// Solves that were added up have no state of their own.
    #[error("several solves were added up: expected one that can go on")]
    Merged,
}

/// Numbers of a [`RunRecord`]: n, wave, n at the end of the epoch, weight of the source, weight of the output, six
/// shares, two times six sums of the fit, witnesses, energy and irradiance that are known, whether emitters count, and the tally.
pub const RUN_WORDS: usize = 27 + TALLY_WORDS;
/// Numbers of a [`Tally`]: rays, invalid deposits, and R, G, B of arrived, absorbed, escaped, lost, sky.
pub const TALLY_WORDS: usize = 17;

impl Record<'_> {
    /// The same, borrowing from nobody.
    pub fn into_owned(self) -> Record<'static> {
        match self {
            Record::Waves(waves) => Record::Waves(waves.into_owned()),
            Record::Sequential(s) => Record::Sequential(SequentialRecord {
                irradiance: owned(s.irradiance),
                squares: owned(s.squares),
                hits: owned(s.hits),
                tree: owned(s.tree),
                glossy: owned(s.glossy),
                memory: owned(s.memory),
                ..s
            }),
        }
    }

    /// Rays shot, n.
    pub fn rays(&self) -> u64 {
        match self {
            Record::Waves(waves) => waves.rays,
            Record::Sequential(sequential) => sequential.rays,
        }
    }

    /// Patches, K.
    pub fn patches(&self) -> usize {
        match self {
            Record::Waves(waves) => waves.deposits.len(),
            Record::Sequential(sequential) => sequential.irradiance.len(),
        }
    }

    /// Glossy patches, G.
    pub fn glossy(&self) -> usize {
        match self {
            Record::Waves(waves) => waves.glossy.len(),
            Record::Sequential(sequential) => sequential.glossy.len(),
        }
    }

    /// True if a solver can go on from it.
    pub fn can_go_on(&self) -> bool {
        match self {
            Record::Waves(waves) => waves.runs.is_some(),
            Record::Sequential(_) => true,
        }
    }

    /// Checks that arrays agree in length with each other and hold nothing that no solve gives.
    ///
    /// # Errors
    /// Names the first array that does not.
    pub fn check(&self) -> Result<(), RecordError> {
        match self {
            Record::Waves(waves) => waves.check(),
            Record::Sequential(sequential) => sequential.check(),
        }
    }

    /// The light that it stands for, as a solver's [`crate::Solver::solution`] would give it without an observer. O(K).
    ///
    /// # Errors
    /// If it is of another scene or schedule, or holds what no solve gives.
    pub fn solution(&self, scene: &PatchScene, params: &Params) -> Result<Solution, RecordError> {
        self.check()?;
        let glossy = GlossyPatches::new(scene, None);
        self.check_belongs(scene, &glossy)?;
        match self {
            Record::Waves(waves) => Ok(waves.sums().solution(scene, &glossy, params.representation)),
            Record::Sequential(sequential) => {
                Ok(Sequential::resume(scene, &glossy, sequential)?.solution(scene, &glossy, params))
            }
        }
    }

    /// Irradiance with error bars, and the relative error of the whole, of patches of these areas (m²), of which some emit.
    ///
    /// # Panics
    /// If there are not K of them; checked records do not panic otherwise.
    pub fn light(&self, area: Vec<f64>, emits: Vec<bool>) -> (PatchLight, f64) {
        assert!(area.len() == self.patches() && emits.len() == self.patches(), "areas of other patches");
        match self {
            Record::Waves(waves) => waves.light(area, emits),
            Record::Sequential(sequential) => sequential.light(area, emits),
        }
    }

    /// One number for what decides how the solve goes on: equal records have equal ones.
    pub(crate) fn digest(&self) -> u64 {
        let eat = |hash: u64, word: u64| mix(hash ^ word);
        match self {
            Record::Waves(waves) => {
                let runs = || waves.runs.iter().flatten();
                let words = runs().flat_map(|run| run.words);
                let sums = waves.deposits.as_flattened().iter().map(|x| x.to_bits());
                let light = runs().flat_map(|run| run.radiance.as_flattened()).map(|x| u64::from(x.to_bits()));
                words.chain(sums).chain(light).fold(waves.rays, eat)
            }
            Record::Sequential(sequential) => {
                sequential.irradiance.as_flattened().iter().map(|x| x.to_bits()).fold(sequential.rays, eat)
            }
        }
    }

    pub(crate) fn check_belongs(&self, scene: &PatchScene, glossy: &GlossyPatches) -> Result<(), RecordError> {
        let (first, numbers) = match self {
            Record::Waves(waves) => ("deposits", &waves.glossy),
            Record::Sequential(sequential) => ("irradiance", &sequential.glossy),
        };
        length(first, self.patches(), scene.len())?;
        length("glossy", self.glossy(), glossy.patches().len())?;
        let index = numbers.iter().zip(glossy.patches()).position(|(k, p)| *k != p.0);
        let expected = "the numbers of the scene's glossy patches";
        index.map_or(Ok(()), |k| Err(RecordError::Value { array: "glossy", index: Some(k), expected }))
    }
}

fn owned<T: Clone>(array: Cow<[T]>) -> Cow<'static, [T]> {
    Cow::Owned(array.into_owned())
}

impl WavesRecord<'_> {
    /// The same, borrowing from nobody.
    pub fn into_owned(self) -> WavesRecord<'static> {
        let run = |run: RunRecord| RunRecord {
            words: run.words,
            radiance: owned(run.radiance),
            representatives: owned(run.representatives),
        };
        WavesRecord {
            deposits: owned(self.deposits),
            squares: owned(self.squares),
            difference: owned(self.difference),
            hits: owned(self.hits),
            glossy: owned(self.glossy),
            reflected: owned(self.reflected),
            representatives: owned(self.representatives),
            runs: self.runs.map(|runs| runs.map(run)),
            ..self
        }
    }

    pub(crate) fn sums(&self) -> Sums<'_> {
        Sums {
            rays: self.rays,
            weight: self.weight,
            tally: self.tally,
            unit: self.unit,
            deposits: &self.deposits,
            evidence: PatchEvidences::Apart(&self.squares, &self.difference, &self.hits),
            reflected: &self.reflected,
            observed: &[],
            representatives: &self.representatives,
        }
    }

    fn light(&self, area: Vec<f64>, emits: Vec<bool>) -> (PatchLight, f64) {
        let sums = self.sums();
        let irradiance = |(k, area): (usize, &f64)| sums.irradiance(PatchId(k as u32), *area).to_f32();
        let irradiance = area.iter().enumerate().map(irradiance).collect();
        let (standard_error, relative_error) = {
            let noise = sums.noise(|p| (area[p.index()], emits[p.index()]));
            (noise.standard_errors(), noise.relative_error())
        };
        (PatchLight { area, emits, irradiance, standard_error, hits: self.hits.to_vec() }, relative_error)
    }

    pub(crate) fn check(&self) -> Result<(), RecordError> {
        let (patches, glossy) = (self.deposits.len(), self.glossy.len());
        number("rays", self.rays <= MOST_RAYS, "at most 2^56")?;
        number("weight", self.weight > 0.0 && self.weight.is_finite(), "a positive number")?;
        number("unit", self.unit > 1e-150 && self.unit < 1e150, "a positive number")?;
        if let Some([first, second]) = &self.runs {
            let sum = first.words[0].saturating_add(second.words[0]);
            number("rays", self.rays == sum, "those of both replicas together")?;
        }
        number("tally", is_sound(&self.tally), FINITE)?;
        length("squares", self.squares.len(), patches)?;
        length("difference", self.difference.len(), patches)?;
        length("hits", self.hits.len(), patches)?;
        length("reflected", self.reflected.len(), glossy)?;
        length("sample-0", self.representatives.len(), glossy)?;
        // The directional part may take away what the main part gave too much: sums may be negative.
        values("deposits", &self.deposits, |d| d.iter().all(|x| x.is_finite()), FINITE)?;
        values("squares", &self.squares, |x| x.is_finite() && *x >= 0.0, POSITIVE)?;
        values("difference", &self.difference, |x| x.is_finite(), FINITE)?;
        values("reflected", &self.reflected, |r| r.iter().all(|x| x.is_finite()), FINITE)?;
        values("sample-0", &self.representatives, PackedRepresentative::is_sound, FINITE)?;
        for (run, (words, radiance)) in
            self.runs.iter().flatten().zip([("run-0", "radiance-0"), ("run-1", "radiance-1")])
        {
            number(words, run.words[0] <= MOST_RAYS, "at most 2^56 rays")?;
            length(radiance, run.radiance.len(), patches)?;
            values(radiance, &run.radiance, |r| r.iter().all(|x| x.is_finite()), FINITE)?;
        }
        if let Some([first, second]) = &self.runs {
            length("sample-0 of the first run", first.representatives.len(), 0)?;
            length("sample-1", second.representatives.len(), glossy)?;
            values("sample-1", &second.representatives, PackedRepresentative::is_sound, FINITE)?;
        }
        Ok(())
    }
}

impl SequentialRecord<'_> {
    fn check(&self) -> Result<(), RecordError> {
        let patches = self.irradiance.len();
        number("rays", self.rays <= MOST_RAYS && self.updates <= MOST_RAYS, "at most 2^56")?;
        number("tally", is_sound(&self.tally), FINITE)?;
        length("squares", self.squares.len(), patches)?;
        length("hits", self.hits.len(), patches)?;
        length("tree", self.tree.len(), 2 * patches.next_power_of_two())?;
        length("memory", self.memory.len(), self.glossy.len())?;
        values("irradiance", &self.irradiance, |i| i.iter().all(|x| x.is_finite()), FINITE)?;
        values("squares", &self.squares, |x| x.is_finite() && *x >= 0.0, POSITIVE)?;
        values("tree", &self.tree, |x| x.is_finite(), FINITE)?;
        values("memory", &self.memory, |g| g.iter().all(|x| x.is_finite()), FINITE)
    }

    fn light(&self, area: Vec<f64>, emits: Vec<bool>) -> (PatchLight, f64) {
        let (standard_error, relative_error) = {
            let noise = sequential::noise(self.rays, area.len(), |p| {
                let k = p.index();
                (area[k], emits[k], self.irradiance[k], self.squares[k], self.hits[k])
            });
            (noise.standard_errors(), noise.relative_error())
        };
        let n = self.rays.max(1) as f64;
        let irradiance = self.irradiance.iter().map(|i| (Rgb::from_array(*i) / n).to_f32()).collect();
        (PatchLight { area, emits, irradiance, standard_error, hits: self.hits.to_vec() }, relative_error)
    }
}

const FINITE: &str = "finite numbers";
const POSITIVE: &str = "finite numbers of at least 0";

/// False of what no solve gives.
pub(crate) fn is_sound(tally: &Tally) -> bool {
    let sums = tally.to_words()[2..].iter().all(|w| f64::from_bits(*w).is_finite());
    sums && tally.rays <= MOST_RAYS && tally.invalid <= MOST_RAYS
}

fn number(array: &'static str, good: bool, expected: &'static str) -> Result<(), RecordError> {
    if good { Ok(()) } else { Err(RecordError::Value { array, index: None, expected }) }
}

fn length(array: &'static str, found: usize, expected: usize) -> Result<(), RecordError> {
    if found == expected { Ok(()) } else { Err(RecordError::Length { array, found, expected }) }
}

fn values<T>(
    array: &'static str,
    values: &[T],
    is_good: impl Fn(&T) -> bool,
    expected: &'static str,
) -> Result<(), RecordError> {
    match values.iter().position(|v| !is_good(v)) {
        None => Ok(()),
        index => Err(RecordError::Value { array, index, expected }),
    }
}

/// Words one after another, as whole numbers or as doubles.
pub(crate) struct Words<'a>(std::slice::Iter<'a, u64>);

impl<'a> Words<'a> {
    pub(crate) fn new(words: &'a [u64]) -> Self {
        Self(words.iter())
    }

    pub(crate) fn whole(&mut self) -> u64 {
        self.0.next().copied().unwrap_or_default()
    }

    pub(crate) fn double(&mut self) -> f64 {
        f64::from_bits(self.whole())
    }

    pub(crate) fn doubles<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.double())
    }

    pub(crate) fn color(&mut self) -> Rgb {
        Rgb::from_array(self.doubles())
    }
}
