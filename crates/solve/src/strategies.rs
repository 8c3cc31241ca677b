//! The strategies by which rays find their starts, and the shares of rays that they get.

use twinray_scene::{PatchId, Rgb};

use crate::params::Params;

/// Number of strategies.
pub(crate) const STRATEGIES: usize = 5;

/// What part of the rays starts by which strategy; they sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shares {
    /// By the power that patches send out, emitted or reflected.
    pub power: f64,
    /// By the power that patches emit.
    pub lamps: f64,
    /// Evenly over area.
    pub area: f64,
    /// By the patches' own weights.
    pub patches: f64,
    /// From the environment; 0 where it does not shine in this wave.
    pub environment: f64,
}

impl Shares {
    /// Those that a solve begins with.
    pub(crate) fn first(params: &Params, sky: bool) -> Self {
        // Under a sky most power is on roofs that send it back: more rays start where they are needed instead.
        let gather = if sky { params.gather_share.max(0.35) } else { params.gather_share };
        Self::of(gather, if sky { params.environment_share } else { 0.0 })
    }

    /// By power, but for a gather share (half by area, half by patches) and one of the environment.
    pub(crate) fn of(gather: f64, environment: f64) -> Self {
        Self { power: 1.0 - gather - environment, lamps: 0.0, area: 0.5 * gather, patches: 0.5 * gather, environment }
    }
}

/// How much the square of a deposit matters, by patch.
#[derive(Debug)]
pub(crate) struct Witness {
    _private: (),
}

impl Witness {
    #[inline]
    pub(crate) fn square(&self, _patch: PatchId, _power: Rgb) -> f64 {
        0.0
    }
}

/// What witnesses tell of the strategies.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fit {
    sums: [f64; STRATEGIES],
}

impl Fit {
    #[inline]
    pub(crate) fn observe(&mut self, squares: f64, density: f64, a: [f64; STRATEGIES], b: [f64; STRATEGIES]) {
        let per_density = squares / density;
        for k in 0..STRATEGIES {
            self.sums[k] += per_density * (a[k] + b[k]);
        }
    }

    pub(crate) fn add(&mut self, other: &Fit) {
        self.sums.iter_mut().zip(&other.sums).for_each(|(a, b)| *a += b);
    }
}
