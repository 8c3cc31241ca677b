//! Solutions to bytes: the same solution gives the same bytes.

use serde_json::json;

use super::{AREA, EMITS, HEADER, HITS, IRRADIANCE, STANDARD_ERROR, SolutionFile, sections};

/// The bytes of a `.twin` file. Equal solutions give equal bytes.
///
/// # Panics
/// If the arrays of the light differ in length.
pub fn write_solution(solution: &SolutionFile) -> Vec<u8> {
    let light = &solution.light;
    let patches = light.len();
    let lengths = [light.emits.len(), light.irradiance.len(), light.standard_error.len(), light.hits.len()];
    assert!(lengths.iter().all(|&n| n == patches), "write_solution: arrays of {lengths:?} for {patches} patches");
    sections::pack(&[
        (HEADER, header(solution)),
        (AREA.0, floats(light.area.iter().copied())),
        (EMITS.0, light.emits.iter().map(|&e| u8::from(e)).collect()),
        (IRRADIANCE.0, floats(light.irradiance.iter().flatten().copied())),
        (STANDARD_ERROR.0, floats(light.standard_error.iter().copied())),
        (HITS.0, light.hits.iter().flat_map(|n| n.to_le_bytes()).collect()),
    ])
}

fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

fn header(solution: &SolutionFile) -> Vec<u8> {
    let p = &solution.provenance;
    // The shortest decimal of an f32 is exact in both directions, and short to read; JSON has no infinity.
    let error: Option<f64> = p.relative_error.is_finite().then(|| p.relative_error.to_string().parse().ok()).flatten();
    let settings: Vec<_> = p.settings.iter().map(|(name, value)| [name, value]).collect();
    let header = json!({
        "software": p.software,
        "method": p.method.name(),
        "scene": p.scene,
        // A number of 64 bits does not survive every JSON reader.
        "fingerprint": format!("{:016x}", p.fingerprint),
        "patches": solution.light.len(),
        "rays": p.rays,
        "seed": p.seed,
        "settings": settings,
        "relative_error": error,
    });
    format!("{header:#}\n").into_bytes()
}
