//! How wrong each patch may be: standard errors of irradiance, from one solve.
//!
//! Two things make a patch noisy: the rays that bring its light, and the light they carry, which other rays brought
//! before. The first is seen on the patch itself: Σ 𝓛(d)² over its deposits d is the variance that independent rays
//! leave. But rays are stratified, which makes that too large, and noise is reflected, which makes it too small. Both
//! are in the difference of two replicas (`replicas`), whose mean square over patches is the mean square error of
//! their mean. One difference is one draw of a random variable, so no patch
//! can be judged by its own; but among patches of about as many hits (many are stratified better than few), the
//! ratio of mean squares scales the bars.
//!
//! Not here: bias. What there is of it stands in `docs/paper.md`: the loss of the paper's 1/n average, and a far smaller
//! one of the default preset's low-discrepancy numbers.

use twinray_scene::PatchId;

/// What a patch's error bar is made from. Sums over rays with equal weights.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Evidence {
    /// Σ 𝓛(deposit)², W².
    pub squares: f64,
    /// Number of deposits.
    pub hits: u32,
}

/// The evidence of two replicas on one patch. Entered once a wave, so that single precision does not stall.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct PatchEvidence {
    /// Σ 𝓛(deposit)² of both, W².
    pub squares: f32,
    /// Σ 𝓛(deposit) of the first minus that of the second, W.
    pub difference: f32,
    /// Number of deposits of both.
    pub hits: u32,
}

/// What is known of one patch's noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchNoise {
    /// m².
    pub area: f64,
    /// Whether the patch emits: such are left out of the error of the whole.
    pub emits: bool,
    /// 𝓛(E), W·m⁻².
    pub irradiance: f64,
    /// Of all rays.
    pub evidence: Evidence,
    /// Half the difference of 𝓛(E) between two replicas, W·m⁻²; `None` where there are none and rays are independent.
    pub half_difference: Option<f64>,
}

/// The noise of a solution, as a function of a patch.
pub(crate) struct Noise<F> {
    /// Rays, or the weight of all of them.
    pub rays: f64,
    /// How many there are.
    pub patches: usize,
    /// Asked several times for every patch.
    pub of: F,
}

/// Patches that the ratio 1 counts for, beside those of the scene: a dozen patches have no ratio of their own.
const PRIOR_PATCHES: f64 = 8.0;
/// Patches that the whole scene's ratio counts for, beside those of about as many hits: enough for an octave of a few
/// patches, too few to draw the much-hit patches towards the others.
const SCENE_PATCHES: f64 = 8.0;
/// Octaves of numbers of hits.
const OCTAVES: usize = 32;

impl<F: Fn(PatchId) -> PatchNoise> Noise<F> {
    /// Per patch: standard error of 𝓛(E), W·m⁻²; infinite where nothing arrived.
    pub fn standard_errors(&self) -> Vec<f32> {
        let octaves = self.octaves();
        let bar = |p: PatchId| {
            let noise = (self.of)(p);
            match noise.evidence.hits {
                0 => f32::INFINITY,
                hits => (octaves[octave(hits)].mean() * self.independent(&noise)).sqrt() as f32,
            }
        };
        self.all().map(bar).collect()
    }

    fn all(&self) -> impl Iterator<Item = PatchId> + use<F> {
        (0..self.patches).map(|k| PatchId(k as u32))
    }

    /// Mean ratio of the replicas' variance to that of independent rays, by number of hits. Every patch has the same
    /// say.
    fn octaves(&self) -> [Ratio; OCTAVES] {
        let mut octaves = [Ratio::default(); OCTAVES];
        let mut whole = Ratio { sum: PRIOR_PATCHES, patches: PRIOR_PATCHES };
        for p in self.all() {
            let noise = (self.of)(p);
            let (hits, variance) = (noise.evidence.hits, self.independent(&noise));
            if let Some(half_difference) = noise.half_difference.filter(|_| hits > 0 && variance > 0.0) {
                octaves[octave(hits)].add(half_difference.powi(2) / variance, 1.0);
            }
        }
        octaves.iter().for_each(|o| whole.add(o.sum, o.patches));
        octaves.iter_mut().for_each(|o| o.add(SCENE_PATCHES * whole.mean(), SCENE_PATCHES));
        octaves
    }

    /// Var(E) of a mean over independent rays, (Σd² − (Σd)²/N)/(N A)², W²·m⁻⁴.
    fn independent(&self, noise: &PatchNoise) -> f64 {
        let per_area = 1.0 / (self.rays * noise.area);
        let mean_square = noise.irradiance.powi(2) / self.rays;
        (noise.evidence.squares * per_area * per_area - mean_square).max(0.0)
    }

    /// √(ΣA Var(E) / ΣA E²) of luminance, emitters left out (unless no other patch is lit). The squares of differences
    /// estimate the mean square error without bias, whatever is known of single patches.
    pub fn relative_error(&self) -> f64 {
        let variance = |noise: &PatchNoise| match noise.half_difference {
            Some(half_difference) => half_difference.powi(2),
            None => self.independent(noise),
        };
        let sums = |emitters: bool| {
            let those = self.all().map(&self.of).filter(|noise| emitters || !noise.emits);
            those.fold([0.0; 2], |[squares, energy], noise| {
                [squares + noise.area * variance(&noise), energy + noise.area * noise.irradiance.powi(2)]
            })
        };
        let mut sum = sums(false);
        if sum[1] <= 0.0 {
            sum = sums(true);
        }
        let [squares, energy] = sum;
        // Noise makes ΣA E² too large by what it adds itself.
        if energy > 0.0 { (squares / (energy - squares).max(0.1 * energy)).sqrt() } else { 0.0 }
    }
}

/// A mean over patches.
#[derive(Clone, Copy, Debug, Default)]
struct Ratio {
    sum: f64,
    patches: f64,
}

impl Ratio {
    fn add(&mut self, sum: f64, patches: f64) {
        self.sum += sum;
        self.patches += patches;
    }

    fn mean(self) -> f64 {
        self.sum / self.patches
    }
}

fn octave(hits: u32) -> usize {
    hits.max(1).ilog2() as usize
}
