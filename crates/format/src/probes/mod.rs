//! Irradiance volumes for other programs: `json` and `exr` hold all that is known of probes, `bevy` is the 3D texture that
//! Bevy samples.

mod bevy;
mod exr;
mod json;

pub use bevy::{BevyVolumeError, write_bevy_volume};
pub use exr::write_probes_exr;
pub use json::write_probes_json;

/// Number of harmonics of a probe.
pub const HARMONICS: usize = 9;
/// Number of a probe's neighbours.
pub const NEIGHBOURS: usize = 26;

/// Boxes that fill a part of the world, with a probe in the middle of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeLattice {
    /// Lowest corner of the first box, metres.
    pub low: [f64; 3],
    /// Sides of a box, metres.
    pub cell: [f64; 3],
    /// Boxes along x, y, z.
    pub counts: [u32; 3],
}

impl ProbeLattice {
    /// Number of probes.
    pub fn len(&self) -> usize {
        self.counts.iter().map(|&n| n as usize).product()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Probes as plain arrays, all `[z, y, x]`, x fastest.
#[derive(Clone, Copy, Debug)]
pub struct ProbeArrays<'a> {
    /// Where they are.
    pub lattice: ProbeLattice,
    /// Radiance as factors of nine spherical harmonics, W·sr⁻¹·m⁻² or nit.
    pub radiance: &'a [[[f32; 3]; HARMONICS]],
    /// 1 in the open, 0 within bodies.
    pub validity: &'a [f32],
    /// From the middle of the box to where the light was taken, metres.
    pub offset: &'a [[f32; 3]],
    /// How far each neighbour is away over the free distance in its direction.
    pub nearness: &'a [[f32; NEIGHBOURS]],
}

impl ProbeArrays<'_> {
    /// # Panics
    /// If an array has not an element for each probe.
    fn check(&self) {
        let lengths = [self.radiance.len(), self.validity.len(), self.offset.len(), self.nearness.len()];
        let expected = self.lattice.len();
        assert!(expected > 0 && lengths == [expected; 4], "{expected} probes were announced, there are {lengths:?}");
    }
}
