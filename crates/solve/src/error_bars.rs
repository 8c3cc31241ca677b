//! How wrong each patch may be: standard errors of irradiance, from one run.
//!
//! Two things make a patch noisy: the rays that bring its light, and the light they carry, which other rays brought
//! before. The first is seen on the patch itself: Σ 𝓛(d)² over its deposits d is the variance that independent rays
//! would leave. But rays are stratified, which makes that too large, and noise is reflected, which makes it too
//! small. Both are measured by a *noise field*. Rays come in two halves with independent random numbers; each deposit
//! enters the field with the sign of its half, and the field is then reflected and carried on by later rays as the
//! light is. The halves' light cancels in it and their noise does not, so it has the variance and the covariance of
//! the solution's own error, many bounces and stratification included (a multiplier bootstrap with one multiplier a
//! half: Wu, "Jackknife, bootstrap and other resampling methods in regression analysis", Ann. Statist. 14, 1986).
//! It is one draw of a random variable, so no patch can be judged by its own; but its mean square over many patches
//! is the mean square error, and their ratio to Σ 𝓛(d)² scales every patch's bar. Stratification helps patches that
//! many rays meet more than others, so the ratio is taken among patches of about as many hits.
//!
//! Not here: bias. Both presets are free of it but for what `docs/paper.md` says of the paper's 1/n average.

use twinray_scene::{PatchId, PatchScene};

/// What a patch's error bar is made from. Sums over rays with equal weights.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Evidence {
    /// Σ deposits of the noise field, W.
    pub noise: f64,
    /// Σ 𝓛(deposit)², W².
    pub squares: f64,
    /// Number of deposits.
    pub hits: u32,
}

/// Patches that the ratio 1 counts for, beside those of the scene: a dozen patches have no ratio of their own.
const PRIOR_PATCHES: f64 = 8.0;
/// Patches that the whole scene's ratio counts for, beside those of about as many hits: enough for an octave of a few
/// patches, too few to draw the much-hit patches towards the others.
const SCENE_PATCHES: f64 = 8.0;
/// Octaves of numbers of hits.
const OCTAVES: usize = 32;

/// Error bars of a solution.
#[derive(Clone, Debug, Default)]
pub(crate) struct ErrorBars {
    /// Per patch: standard error of 𝓛(E), W·m⁻².
    pub standard_error: Vec<f32>,
    /// √(ΣA Var(E) / ΣA E²) without emitters.
    pub relative: f64,
}

/// Error bars after `rays` rays; `irradiance` is 𝓛(E) of a patch, `evidence` what its deposits say.
pub(crate) fn error_bars(
    scene: &PatchScene,
    rays: f64,
    irradiance: impl Fn(PatchId) -> f64,
    evidence: impl Fn(PatchId) -> Evidence,
) -> ErrorBars {
    let independent = |p: PatchId| variance_of_independent_rays(scene, rays, p, irradiance(p), evidence(p));
    // The mean over patches of (noise field)² over the variance of independent rays: every patch has the same say.
    let mut octaves = [Ratio::default(); OCTAVES];
    for p in scene.patches() {
        let (e, variance) = (evidence(p), independent(p));
        if e.hits > 0 && variance > 0.0 {
            let ratio = (e.noise / (rays * scene.area(p))).powi(2) / variance;
            octaves[octave(e.hits)].add(ratio, 1.0);
        }
    }
    let mut scene_ratio = Ratio { sum: PRIOR_PATCHES, patches: PRIOR_PATCHES };
    octaves.iter().for_each(|o| scene_ratio.add(o.sum, o.patches));
    let scene_ratio = scene_ratio.mean();
    octaves.iter_mut().for_each(|o| o.add(SCENE_PATCHES * scene_ratio, SCENE_PATCHES));
    let standard_error = scene.patches().map(|p| match evidence(p).hits {
        0 => f32::INFINITY,
        hits => (octaves[octave(hits)].mean() * independent(p)).sqrt() as f32,
    });
    let standard_error = standard_error.collect();
    ErrorBars { standard_error, relative: relative_error(scene, rays, irradiance, evidence) }
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

/// √(ΣA Var(E) / ΣA E²) of luminance, emitters left out (unless everything emits). The noise field's mean square is
/// an unbiased estimate of the mean square error, whatever is known of single patches.
pub(crate) fn relative_error(
    scene: &PatchScene,
    rays: f64,
    irradiance: impl Fn(PatchId) -> f64,
    evidence: impl Fn(PatchId) -> Evidence,
) -> f64 {
    let sums = |which: &dyn Fn(PatchId) -> bool| {
        scene.patches().filter(|&p| which(p)).fold([0.0; 2], |[noise, energy], p| {
            let area = scene.area(p);
            [noise + (evidence(p).noise / rays).powi(2) / area, energy + area * irradiance(p).powi(2)]
        })
    };
    let mut sum = sums(&|p| scene.emission(p).is_black());
    if sum[1] <= 0.0 {
        sum = sums(&|_| true);
    }
    let [noise, energy] = sum;
    // Noise makes ΣA E² too large by what it adds itself.
    if energy > 0.0 { (noise / (energy - noise).max(0.1 * energy)).sqrt() } else { 0.0 }
}

/// Var(E) of a mean over independent rays, (Σd² − (Σd)²/N)/(N A)², W²·m⁻⁴. Paper: design formula F2 of the variance.
fn variance_of_independent_rays(scene: &PatchScene, rays: f64, patch: PatchId, irradiance: f64, e: Evidence) -> f64 {
    let per_area = 1.0 / (rays * scene.area(patch));
    (e.squares * per_area * per_area - irradiance * irradiance / rays).max(0.0)
}
