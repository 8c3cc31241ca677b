//! Where probes are: in the middles of equal boxes that fill the scene's bounds.

use glam::DVec3;
use twinray_scene::PatchScene;

use crate::watch::Cancelled;

/// Number of a probe's neighbours.
pub const NEIGHBOURS: usize = 26;

/// Metres between probes where nothing is said,
const USUAL: f64 = 1.0;
/// but at least so many probes along the longest side, and at most so many in all.
const LEAST: f64 = 4.0;
const USUAL_MOST: f64 = 32_768.0;
/// The most probes that can be asked for.
const MOST: f64 = 2_097_152.0;

/// How far probes are apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProbeSpacing {
    /// A metre; less in small scenes, more in very large ones.
    Default,
    /// At most so many metres, along each axis.
    Metres(f64),
    /// So many probes along x, y, z.
    Counts([u32; 3]),
}

/// Why there is no grid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// Not a length.
    #[error("probes {0} m apart make no sense: expected a positive number")]
    Spacing(f64),
    /// Somebody stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// None along an axis.
    #[error("a grid needs at least one probe along each axis")]
    Empty,
    /// Beyond what is sensible.
    #[error("{count:.0} probes are too many: at most {limit:.0} are possible; let them be farther apart")]
    TooMany {
        /// Asked for.
        count: f64,
        /// Possible.
        limit: f64,
    },
}

/// Boxes with a probe in the middle of each, in world coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeGrid {
    /// Lowest corner of the first box, metres.
    pub low: [f64; 3],
    /// Sides of a box, metres: how far probes are apart.
    pub cell: [f64; 3],
    /// Boxes along x, y, z.
    pub counts: [u32; 3],
}

impl ProbeGrid {
    /// A grid over all that rays can meet.
    ///
    /// # Errors
    /// If the spacing is no length, or asks for too many probes.
    pub fn new(patches: &PatchScene, spacing: ProbeSpacing) -> Result<Self, ProbeError> {
        let corners = (0..patches.triangle_count() as u32).flat_map(|t| patches.corners(t));
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = corners.fold(none, |(low, high), p| (low.min(p), high.max(p)));
        let (low, high) = (low + patches.centre(), high + patches.centre());
        // What is flat gets boxes with some room.
        let longest = (high - low).max_element();
        let extent = (high - low).max(DVec3::splat(1e-3 * longest));
        let counts_at = |spacing: f64| (extent / spacing).to_array().map(|n| (n - 1e-9).ceil().max(1.0));
        let product = |counts: [f64; 3]| counts.iter().product::<f64>();
        let (counts, limit) = match spacing {
            ProbeSpacing::Default => {
                let mut metres = USUAL.min(longest / LEAST);
                while product(counts_at(metres)) > USUAL_MOST {
                    metres *= 1.25;
                }
                (counts_at(metres), USUAL_MOST)
            }
            ProbeSpacing::Metres(metres) if metres > 0.0 && metres.is_finite() => (counts_at(metres), MOST),
            ProbeSpacing::Metres(metres) => return Err(ProbeError::Spacing(metres)),
            ProbeSpacing::Counts(counts) => (counts.map(f64::from), MOST),
        };
        let count = product(counts);
        if count < 1.0 {
            return Err(ProbeError::Empty);
        }
        if count > limit {
            return Err(ProbeError::TooMany { count, limit });
        }
        let cell = (extent / DVec3::from_array(counts)).to_array();
        Ok(Self { low: low.to_array(), cell, counts: counts.map(|n| n as u32) })
    }

    /// Number of probes.
    pub fn len(&self) -> usize {
        self.counts.iter().map(|&n| n as usize).product()
    }

    /// False: there is always a probe.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Column, row and layer of a probe.
    pub fn cell_of(&self, probe: usize) -> [u32; 3] {
        let [nx, ny, _] = self.counts.map(|n| n as usize);
        [probe % nx, probe / nx % ny, probe / (nx * ny)].map(|k| k as u32)
    }

    /// The probe of a column, row and layer; `None` outside.
    pub fn probe_at(&self, at: [i64; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.counts.map(i64::from);
        let inside = (0..nx).contains(&at[0]) && (0..ny).contains(&at[1]) && (0..nz).contains(&at[2]);
        inside.then(|| (at[0] + nx * (at[1] + ny * at[2])) as usize)
    }

    /// The probe a step away; `None` outside.
    pub fn neighbour(&self, probe: usize, step: [i32; 3]) -> Option<usize> {
        let cell = self.cell_of(probe);
        self.probe_at(std::array::from_fn(|axis| i64::from(cell[axis]) + i64::from(step[axis])))
    }

    /// Point of a probe.
    pub fn point(&self, probe: usize) -> DVec3 {
        let cell = DVec3::from_array(self.cell_of(probe).map(f64::from));
        DVec3::from_array(self.low) + (cell + 0.5) * DVec3::from_array(self.cell)
    }
}

/// Steps to the neighbours of a probe, x fastest.
pub fn neighbours() -> [[i32; 3]; NEIGHBOURS] {
    std::array::from_fn(|k| {
        // The probe itself, in the middle of 27, is left out.
        let k = (if k < 13 { k } else { k + 1 }) as i32;
        [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]
    })
}
