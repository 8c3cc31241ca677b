//! Where the light went: absorbed, escaped, lost. Sums over rays.

use twinray_scene::Rgb;

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
    /// Adds `other` with a weight for its sums.
    pub fn add_weighted(&mut self, other: &Tally, weight: f64) {
        self.rays += other.rays;
        self.invalid += other.invalid;
        self.arrived += other.arrived * weight;
        self.absorbed += other.absorbed * weight;
        self.escaped += other.escaped * weight;
        self.lost += other.lost * weight;
        self.sky += other.sky * weight;
    }
}
