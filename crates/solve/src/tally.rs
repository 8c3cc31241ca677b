//! Where the light went: absorbed, escaped, lost; and how noisy the deposits were. Sums over rays.

use twinray_scene::{PatchId, PatchScene, Rgb};

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
    /// Σ 𝓛(deposit)²/A over patches that do not emit: the noise of one ray in Σ A·Var(E).
    pub squares: f64,
    /// Deposits that were not finite and were dropped. Never expected; counted, so that it is never silent.
    pub invalid: u64,
}

impl Tally {
    /// Adds `other` with a weight for its sums and the square of that weight for its squares.
    pub fn add_weighted(&mut self, other: &Tally, weight: f64) {
        self.rays += other.rays;
        self.invalid += other.invalid;
        self.arrived += other.arrived * weight;
        self.absorbed += other.absorbed * weight;
        self.escaped += other.escaped * weight;
        self.lost += other.lost * weight;
        self.sky += other.sky * weight;
        self.squares += other.squares * weight * weight;
    }
}

impl Tally {
    /// Relative RMS error of patch irradiance that the noise of independent rays leaves:
    /// Σ A·Var(E) = (Σ 𝓛(d)²/A − n Σ A E²)/n² over n rays, relative to Σ A E², emitters left out.
    /// `irradiance` gives 𝓛(E) of a patch.
    pub fn relative_error(&self, scene: &PatchScene, rays: f64, irradiance: impl Fn(PatchId) -> f64) -> f64 {
        let lit = scene.patches().filter(|&p| scene.emission(p).is_black());
        let energy: f64 = lit.map(|p| scene.area(p) * irradiance(p).powi(2)).sum();
        if energy <= 0.0 {
            return 0.0;
        }
        let variance = self.squares / (rays * rays) - energy / rays;
        (variance.max(0.0) / energy).sqrt()
    }
}
