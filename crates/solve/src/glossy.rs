//! Which patches are glossy: a compact numbering, so that directional state exists only where it is needed.

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene};

use crate::observer::Observer;

const NONE: u32 = u32::MAX;

/// Numbering of the glossy patches, and their directions to the observer.
#[derive(Clone, Debug)]
pub struct GlossyPatches {
    /// Per patch: its number among the glossy ones; empty if none is glossy.
    number: Vec<u32>,
    patches: Vec<PatchId>,
    /// Per glossy patch: direction to the eye, zero if the eye is behind; empty without an observer.
    to_eye: Vec<[f32; 3]>,
}

impl GlossyPatches {
    /// Bytes per patch of a scene with glossy ones: their numbering.
    pub(crate) const BYTES_PER_PATCH: usize = 4;
    /// Bytes per glossy patch.
    pub(crate) const BYTES_PER_GLOSSY_PATCH: usize = 4;
    /// Bytes that an observer adds.
    pub(crate) const BYTES_PER_OBSERVED_PATCH: usize = 12;

    /// Numbers the glossy patches of a scene.
    pub fn new(scene: &PatchScene, observer: Option<&Observer>) -> Self {
        let patches: Vec<PatchId> = scene.patches().filter(|&p| scene.is_glossy(p)).collect();
        let mut number = Vec::new();
        if !patches.is_empty() {
            number = vec![NONE; scene.len()];
            for (k, p) in patches.iter().enumerate() {
                number[p.index()] = k as u32;
            }
        }
        let direction = |o: &Observer, p| o.direction(scene, p).unwrap_or_default().as_vec3().to_array();
        let to_eye = observer.map_or(Vec::new(), |o| patches.iter().map(|&p| direction(o, p)).collect());
        Self { number, patches, to_eye }
    }

    /// Number of a patch among the glossy ones.
    #[inline]
    pub fn number_of(&self, patch: PatchId) -> Option<usize> {
        match self.number.get(patch.index()) {
            Some(&k) if k != NONE => Some(k as usize),
            _ => None,
        }
    }

    /// The glossy patches in order.
    pub fn patches(&self) -> &[PatchId] {
        &self.patches
    }

    /// Direction from a glossy patch, given by its number, to the eye.
    #[inline]
    pub fn to_eye(&self, number: usize) -> Option<DVec3> {
        let &[x, y, z] = self.to_eye.get(number)?;
        DVec3::new(f64::from(x), f64::from(y), f64::from(z)).try_normalize()
    }

    /// True if there is an observer and something glossy for it to see.
    #[inline]
    pub fn is_observed(&self) -> bool {
        !self.to_eye.is_empty()
    }
}
