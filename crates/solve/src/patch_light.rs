//! What any method says about the light of the patches: irradiance with an error bar, patch by patch.
//!
//! Plain arrays, so that solutions, references and files of either can be compared without knowing where they
//! come from. Not here: how the numbers came about.

use twinray_scene::Rgb;

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

    /// The mean of independent results for the same patches, weighted by samples; sums are taken in the order given.
    ///
    /// # Panics
    /// Without any, or if they differ in length.
    pub fn mean(parts: &[&PatchLight]) -> Self {
        let first = parts[0];
        assert!(parts.iter().all(|part| part.len() == first.len()), "lights of different patches");
        let samples = |k: usize| parts.iter().map(|part| f64::from(part.hits[k])).sum::<f64>().max(1.0);
        let mean = |k: usize, of: &dyn Fn(&PatchLight) -> f64| {
            parts.iter().map(|part| f64::from(part.hits[k]) * of(part)).sum::<f64>() / samples(k)
        };
        let error = |k: usize| {
            let known = || parts.iter().filter(|part| part.hits[k] > 0);
            let squares = |part: &&PatchLight| (f64::from(part.hits[k]) * f64::from(part.standard_error[k])).powi(2);
            match known().count() {
                0 => f64::INFINITY,
                _ => known().map(squares).sum::<f64>().sqrt() / samples(k),
            }
        };
        let patches = || 0..first.len();
        Self {
            area: first.area.clone(),
            emits: first.emits.clone(),
            irradiance: patches()
                .map(|k| std::array::from_fn(|c| mean(k, &|part| part.irradiance[k][c].into()) as f32))
                .collect(),
            standard_error: patches().map(|k| error(k) as f32).collect(),
            hits: patches().map(|k| parts.iter().fold(0, |n: u32, part| n.saturating_add(part.hits[k]))).collect(),
        }
    }

    /// √(ΣA ΔE²/ΣA E²) as its standard errors have it, without emitters unless there is nothing else; infinite where one is.
    pub fn relative_error(&self) -> f64 {
        let sums = |emitters: bool| {
            let those = (0..self.len()).filter(|&k| emitters || !self.emits[k]);
            those.fold([0.0; 2], |[squares, energy], k| {
                let (error, irradiance) =
                    (f64::from(self.standard_error[k]), Rgb::from_f32(self.irradiance[k]).luminance());
                [squares + self.area[k] * error * error, energy + self.area[k] * irradiance * irradiance]
            })
        };
        let dark = sums(false);
        let [squares, energy] = if dark[1] > 0.0 { dark } else { sums(true) };
        if energy > 0.0 { (squares / energy).sqrt() } else { 0.0 }
    }

    /// True without patches.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }
}
