//! A fixed camera, as the solver sees it: for every glossy patch, the direction to the eye.
//!
//! A picture of a fixed camera adds what each hit sends to the eye, I · f_r(ω_in, ω_eye), instead of asking the
//! fluctuating representative later: a third of the variance. Diffuse patches need no observer.

use glam::DVec3;
use twinray_scene::{Camera, PatchId, PatchScene, Projection};

/// From where pictures will be taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer {
    eye: DVec3,
    /// Direction towards the eye of a parallel projection.
    parallel: Option<DVec3>,
}

impl Observer {
    /// The observer behind a camera of the world.
    pub fn new(scene: &PatchScene, camera: &Camera) -> Self {
        let [_, _, forward] = camera.axes();
        let parallel = matches!(camera.projection, Projection::Orthographic { .. }).then_some(-forward);
        Self { eye: camera.eye - scene.centre(), parallel }
    }

    /// Unit direction from the centre of a patch to the eye; `None` if the eye is behind the patch.
    pub fn direction(&self, scene: &PatchScene, patch: PatchId) -> Option<DVec3> {
        let to_eye = self.parallel.or_else(|| (self.eye - scene.cell_centre(patch)).try_normalize())?;
        (scene.normal(patch).dot(to_eye) > 0.0).then_some(to_eye)
    }
}
