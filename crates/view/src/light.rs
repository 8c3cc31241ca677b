//! The light of nodes as bytes: four for the irradiance of a node, 36 more for what a glossy one knows of directions, eight
//! for the sample that a glossy cell remembers.

use glam::DVec3;
use serde_json::json;
use twinray::render::walk::{BASIS, NodeLight, Sample};

use crate::container::Container;
use crate::package::scale;
use crate::packed::{octahedral, rgb9e5, snorm8, snorm16};

/// What the light is of, and how exact.
#[derive(Clone, Debug)]
pub struct Behind {
    /// [`crate::package::id`].
    pub id: String,
    /// Rays.
    pub rays: u64,
    /// Estimated relative RMS error.
    pub error: f64,
    /// Whether nothing better will come.
    pub is_final: bool,
}

/// Steps of the error's logarithm: 16 for a factor of two.
const ERROR_STEPS: f64 = 16.0;
/// The error that 0 stands for; 255 stands for infinite ones.
const LEAST_ERROR: f64 = 1.0 / 4096.0;

/// The light's bytes: `irradiance` u32 per node (RGB9_E5, over `scale`), `error` u8 per node (relative, 2^(e/16)/4096, 255
/// unknown), `radiance` u32 per glossy node (mean radiance of all directions, RGB9_E5 over `radianceScale`), `directions` i8
/// `[glossy nodes][8][3]` (the other factors of the basis over the first, and over the largest that light from one direction
/// gives them), `lamps` u32 `[glossy nodes][2]` (light straight from what emits, RGB9_E5 over `lampScale`; its direction,
/// octahedral, 12 bits each, and the root of one less agreement, 8 bits), and `samples` as [`samples`] writes them.
pub fn light(light: &NodeLight, samples: &[Sample], behind: &Behind) -> Vec<u8> {
    let mut container = Container::default();
    let scale_of = scale(light.irradiance.iter().flatten().copied());
    container.add("irradiance", light.irradiance.iter().map(|e| rgb9e5(e.map(|c| c / scale_of))));
    container.add("error", light.error.iter().map(|e| error_code(f64::from(*e))));
    let radiance_scale = scale(light.radiance.iter().flat_map(|l| l[0]));
    container.add("radiance", light.radiance.iter().map(|l| rgb9e5(l[0].map(|c| c / radiance_scale))));
    let directions = light.radiance.iter().flat_map(|l| {
        (1..BASIS).flat_map(move |k| {
            (0..3).map(move |c| {
                // |Yk| / Y0 of one direction is √3 at most for the first degree, √5 for the second.
                let most = if k < 4 { 3.0_f64.sqrt() } else { 5.0_f64.sqrt() };
                if l[0][c] > 0.0 { snorm8(f64::from(l[k][c]) / f64::from(l[0][c]) / most) } else { 0 }
            })
        })
    });
    container.add("directions", directions.collect::<Vec<i8>>());
    let lamp_scale = scale(light.lamps.iter().flat_map(|l| l.radiance));
    let lamps = light.lamps.iter().flat_map(|l| {
        let towards = DVec3::from_array(l.towards.map(f64::from));
        let agreement = towards.length();
        let [x, y] = if agreement > 0.0 { octahedral(towards / agreement) } else { [0.0; 2] };
        // Twelve bits for each number of the direction, eight for what is missing of agreement, fine where little is.
        let twelve = |x: f64| ((x * 0.5 + 0.5) * 4095.0).round().clamp(0.0, 4095.0) as u32;
        let spread = ((1.0 - agreement).max(0.0).sqrt() * 255.0).round().min(255.0) as u32;
        [rgb9e5(l.radiance.map(|c| c / lamp_scale)), twelve(x) | twelve(y) << 12 | spread << 24]
    });
    container.add("lamps", lamps.collect::<Vec<u32>>());
    let sample_scale = add_samples(&mut container, samples);
    container.finish(json!({
        "kind": "light", "id": behind.id, "final": behind.is_final, "lampScale": lamp_scale, "rays": behind.rays, "relativeError": finite(behind.error),
        "scale": scale_of, "radianceScale": radiance_scale, "sampleScale": sample_scale,
    }))
}

/// Samples alone, between two lights: `samples` u32 `[glossy cells][2]`, irradiance as RGB9_E5 over `sampleScale` and the
/// direction's octahedral numbers in sixteen bits each.
pub fn samples(samples: &[Sample], behind: &Behind) -> Vec<u8> {
    let mut container = Container::default();
    let scale = add_samples(&mut container, samples);
    container.finish(json!({
        "kind": "samples", "id": behind.id, "rays": behind.rays, "relativeError": finite(behind.error), "sampleScale": scale,
    }))
}

fn add_samples(container: &mut Container, samples: &[Sample]) -> f32 {
    let scale = scale(samples.iter().flat_map(|s| s.irradiance));
    let packed = samples.iter().flat_map(|s| {
        let [x, y] = match s.irradiance {
            [0.0, 0.0, 0.0] => [0; 2],
            _ => octahedral(DVec3::from_array(s.direction.map(f64::from))).map(snorm16),
        };
        [rgb9e5(s.irradiance.map(|c| c / scale)), u32::from(x as u16) | u32::from(y as u16) << 16]
    });
    container.add("samples", packed.collect::<Vec<u32>>());
    scale
}

fn error_code(error: f64) -> u8 {
    if error.is_finite() { (ERROR_STEPS * (error / LEAST_ERROR).log2()).round().clamp(0.0, 254.0) as u8 } else { 255 }
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_keep_their_size() {
        for error in [0.001, 0.02, 0.5, 3.0] {
            let back = LEAST_ERROR * (f64::from(error_code(error)) / ERROR_STEPS).exp2();
            assert!((back / error - 1.0).abs() < 0.023, "{error}: {back}");
        }
        assert_eq!((error_code(f64::INFINITY), error_code(f64::NAN), error_code(0.0)), (255, 255, 0));
    }
}
