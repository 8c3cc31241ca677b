//! What any method says about the light of the patches: irradiance with an error bar, patch by patch.
//!
//! Plain arrays, so that solutions, references and files of either can be compared without knowing where they
//! come from. Not here: how the numbers came about.

/// Irradiance of every patch of a scene, with its standard error. All arrays are `[patches]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PatchLight {
    /// Area, m².
    pub area: Vec<f64>,
    /// True where the patch emits: such patches are left out of mean errors.
    pub emits: Vec<bool>,
    /// Irradiance, W·m⁻² (or lux where radiance is in nit), mean over the patch.
    pub irradiance: Vec<[f32; 3]>,
    /// Standard error of the irradiance's luminance, in its unit; infinite where nothing is known.
    pub standard_error: Vec<f32>,
    /// Samples behind the value: rays that brought light, or paths of a path tracer.
    pub hits: Vec<u32>,
}

impl PatchLight {
    /// Number of patches.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// True without patches.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }
}
