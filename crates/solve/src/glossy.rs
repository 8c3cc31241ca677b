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
    /// Per glossy patch: direction to the eye.
    to_eye: Vec<Option<DVec3>>,
}

impl GlossyPatches {
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
        let to_eye = match observer {
            Some(o) => patches.iter().map(|&p| o.direction(scene, p)).collect(),
            None => vec![None; patches.len()],
        };
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
        self.to_eye[number]
    }
}
