//! Two solutions of one scene, patch by patch: how large the difference is, and whether error bars explain it.
//!
//! Errors are those of the whole project: relative RMS of irradiance luminance, √(ΣA ΔE²/ΣA E_B²), without emitters,
//! whose irradiance nobody sees. Called by the command; knows nothing of files.

use twinray_scene::Rgb;
use twinray_solve::PatchLight;

/// How two solutions differ. The second is the reference, B.
#[derive(Clone, Debug, PartialEq)]
pub struct LightDifference {
    /// Patches that were compared: all that do not emit.
    pub compared: usize,
    /// Patches that emit, left out.
    pub emitting: usize,
    /// Compared patches for which one of the two has no finite standard error: left out of `z` and of what is expected.
    pub without_error: usize,
    /// √(ΣA ΔE²/ΣA E_B²) over the compared patches.
    pub relative_rms: f64,
    /// ΣA E_A/ΣA E_B − 1 over the compared patches.
    pub bias: f64,
    /// The same RMS over the patches with error bars alone.
    pub relative_rms_with_error: f64,
    /// What these error bars predict for it: √(ΣA (σ_A² + σ_B²)/ΣA E_B²).
    pub expected_rms: f64,
    /// Differences in units of their standard error; `None` without any patch with error bars.
    pub z: Option<ZScores>,
    /// Largest differences by √A |ΔE|, their share in the RMS, falling.
    pub worst_by_difference: Vec<PatchDifference>,
    /// Largest differences by |z|, falling.
    pub worst_by_z: Vec<PatchDifference>,
}

impl LightDifference {
    /// Share of the squared difference that the error bars explain: 1 where nothing else is to be seen. NaN where
    /// there is no difference.
    pub fn explained(&self) -> f64 {
        (self.expected_rms / self.relative_rms_with_error).powi(2)
    }
}

/// One patch in two solutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchDifference {
    /// Index of the patch.
    pub patch: usize,
    /// Luminance of irradiance in both.
    pub irradiance: [f64; 2],
    /// Their difference in units of its standard error; infinite or NaN where there is none.
    pub z: f64,
}

/// Distribution of z = (E_A − E_B)/√(σ_A² + σ_B²), a standard normal if the errors are honest and independent.
#[derive(Clone, Debug, PartialEq)]
pub struct ZScores {
    /// Patches.
    pub count: usize,
    /// Mean of z; 0 without bias.
    pub mean: f64,
    /// Mean of |z|; √(2/π) = .798 for a normal.
    pub mean_abs: f64,
    /// Share with |z| ≤ 1; .683 for a normal.
    pub within_1: f64,
    /// Share with |z| ≤ 2; .954 for a normal.
    pub within_2: f64,
    /// Patches with z below −4, then in steps of ½ up to 4, then above.
    pub histogram: [u64; 18],
}

/// How many of the worst patches are named.
const WORST: usize = 10;

/// Compares two solutions of one scene.
///
/// # Panics
/// If they have not the same number of patches.
pub fn solutions(test: &PatchLight, reference: &PatchLight) -> LightDifference {
    assert_eq!(test.len(), reference.len(), "solutions of different scenes");
    let (mut all, mut known) = (Sums::default(), Sums::default());
    let mut differences = Vec::new();
    let mut scores = Vec::new();
    for patch in (0..reference.len()).filter(|&k| !reference.emits[k]) {
        let area = reference.area[patch];
        let [a, b] = [test, reference].map(|light| Rgb::from_f32(light.irradiance[patch]).luminance());
        let [error_a, error_b] = [test, reference].map(|light| f64::from(light.standard_error[patch]));
        let variance = error_a * error_a + error_b * error_b;
        // Where both are exact, equal values are no deviation at all.
        let z = if a == b && variance.is_finite() { 0.0 } else { (a - b) / variance.sqrt() };
        all.add(area, a, b, variance);
        if variance.is_finite() {
            known.add(area, a, b, variance);
            scores.push(z);
        }
        let z = if variance.is_finite() { z } else { f64::NAN };
        differences.push((area.sqrt() * (a - b).abs(), PatchDifference { patch, irradiance: [a, b], z }));
    }
    differences.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.patch.cmp(&y.1.patch)));
    let by_difference = differences.iter().filter(|d| d.0 > 0.0).take(WORST).map(|d| d.1).collect();
    differences.retain(|d| d.1.z.abs() > 0.0);
    differences.sort_by(|x, y| y.1.z.abs().total_cmp(&x.1.z.abs()).then(x.1.patch.cmp(&y.1.patch)));
    LightDifference {
        compared: all.count,
        emitting: reference.len() - all.count,
        without_error: all.count - known.count,
        relative_rms: all.relative(all.squares),
        bias: if all.light[0] == all.light[1] { 0.0 } else { all.light[0] / all.light[1] - 1.0 },
        relative_rms_with_error: known.relative(known.squares),
        expected_rms: known.relative(known.variance),
        z: (!scores.is_empty()).then(|| ZScores::of(&scores)),
        worst_by_difference: by_difference,
        worst_by_z: differences.iter().take(WORST).map(|d| d.1).collect(),
    }
}

/// Area-weighted sums over patches.
#[derive(Default)]
struct Sums {
    count: usize,
    squares: f64,
    variance: f64,
    reference: f64,
    light: [f64; 2],
}

impl Sums {
    fn add(&mut self, area: f64, a: f64, b: f64, variance: f64) {
        self.count += 1;
        self.squares += area * (a - b) * (a - b);
        self.variance += area * variance;
        self.reference += area * b * b;
        self.light[0] += area * a;
        self.light[1] += area * b;
    }

    /// Root of a sum in units of the reference; no difference is 0 even of darkness.
    fn relative(&self, sum: f64) -> f64 {
        if sum == 0.0 { 0.0 } else { (sum / self.reference).sqrt() }
    }
}

impl ZScores {
    fn of(scores: &[f64]) -> Self {
        let count = scores.len();
        let share = |limit: f64| scores.iter().filter(|z| z.abs() <= limit).count() as f64 / count as f64;
        let mut histogram = [0; 18];
        for z in scores {
            histogram[((z + 4.0) * 2.0 + 1.0).floor().clamp(0.0, 17.0) as usize] += 1;
        }
        Self {
            count,
            mean: scores.iter().sum::<f64>() / count as f64,
            mean_abs: scores.iter().map(|z| z.abs()).sum::<f64>() / count as f64,
            within_1: share(1.0),
            within_2: share(2.0),
            histogram,
        }
    }
}

#[cfg(test)]
mod tests {
    use twinray_scene::sample::Stream;

    use super::*;

    fn light(values: &[(f32, f32, f32)]) -> PatchLight {
        PatchLight {
            area: values.iter().map(|v| v.0.into()).collect(),
            emits: vec![false; values.len()],
            irradiance: values.iter().map(|v| [v.1; 3]).collect(),
            standard_error: values.iter().map(|v| v.2).collect(),
            hits: vec![1; values.len()],
        }
    }

    #[test]
    fn measures_of_known_solutions() {
        let infinite = f32::INFINITY;
        let reference = light(&[(1.0, 1.0, 0.0), (3.0, 2.0, 0.3), (2.0, 5.0, infinite), (9.0, 9.0, 0.1)]);
        let mut test = light(&[(1.0, 1.5, 0.5), (3.0, 1.0, 0.4), (2.0, 6.0, 0.1), (9.0, 1.0, 0.1)]);
        let mut reference = reference;
        (test.emits[3], reference.emits[3]) = (true, true);
        let d = solutions(&test, &reference);
        assert_eq!((d.compared, d.emitting, d.without_error), (3, 1, 1));
        // ΣA ΔE² = .25 + 3 + 2, ΣA E_B² = 1 + 12 + 50.
        assert!((d.relative_rms - (5.25f64 / 63.0).sqrt()).abs() < 1e-6);
        assert!((d.bias - (16.5 / 17.0 - 1.0)).abs() < 1e-6);
        // Without the third: 3.25 of 13, and error bars of 1 · .25 + 3 · .25 = 1.
        assert!((d.relative_rms_with_error - 0.5).abs() < 1e-6);
        assert!((d.explained() - 1.0 / 3.25).abs() < 1e-6);
        let z = d.z.unwrap();
        assert!((z.mean_abs - 1.5).abs() < 1e-6 && (z.mean + 0.5).abs() < 1e-6);
        // z = 1 lies in [1, 1.5), z = −2 (.3² + .4² = .25) in [−2, −1.5).
        assert_eq!((z.count, z.histogram[11], z.histogram[5]), (2, 1, 1));
        let patches = |list: &[PatchDifference]| list.iter().map(|p| p.patch).collect::<Vec<_>>();
        assert_eq!(patches(&d.worst_by_difference), [1, 2, 0]);
        assert_eq!(patches(&d.worst_by_z), [1, 0]);
    }

    #[test]
    fn equal_solutions_do_not_differ() {
        for error in [0.0, 0.1, f32::INFINITY] {
            let same = light(&[(1.0, 1.1, error), (2.0, 0.3, error), (0.5, 0.0, error)]);
            let d = solutions(&same, &same);
            assert_eq!((d.relative_rms, d.bias), (0.0, 0.0));
            assert!(d.worst_by_difference.is_empty() && d.worst_by_z.is_empty());
            assert_eq!(d.z.map(|z| z.mean_abs), error.is_finite().then_some(0.0));
        }
        let dark = light(&[(1.0, 0.0, 0.0)]);
        assert_eq!(solutions(&dark, &dark).relative_rms, 0.0);
        assert_eq!(solutions(&light(&[(1.0, 1.0, 0.0)]), &dark).relative_rms, f64::INFINITY);
    }

    /// Honest error bars give a standard normal. Of 4000 independent patches the share within one standard error has
    /// the deviation √(.683 · .317/4000) = .0074, mean |z| that of √((1 − 2/π)/4000) = .0095: four of them.
    #[test]
    fn honest_error_bars_are_recognised() {
        let normal = |stream: &mut Stream| {
            (-2.0 * libm::log(1.0 - stream.uniform())).sqrt() * libm::cos(std::f64::consts::TAU * stream.uniform())
        };
        let noisy = |seed| {
            let mut stream = Stream::new(seed, 1, 0);
            let values: Vec<_> = (0..4000).map(|_| (1.0, (2.0 + 0.1 * normal(&mut stream)) as f32, 0.1)).collect();
            light(&values)
        };
        let d = solutions(&noisy(1), &noisy(2));
        let z = d.z.as_ref().unwrap();
        println!("mean |z| {:.4}, within one {:.4}, explained {:.4}", z.mean_abs, z.within_1, d.explained());
        assert!((z.mean_abs - 0.797_88).abs() < 0.038 && (z.within_1 - 0.682_69).abs() < 0.030);
        // χ² with 4000 degrees of freedom, over them: deviation √(2/4000) = .022.
        assert!((1.0 / d.explained() - 1.0).abs() < 0.09);
        assert_eq!(z.histogram.iter().sum::<u64>(), 4000);
    }
}
