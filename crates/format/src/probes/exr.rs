//! Probes as a picture: layers of its boxes on top of each other, a layer of channels for each harmonic.

use super::{HARMONICS, ProbeArrays};
use crate::exr::write_channels;

/// The bytes of an EXR file of `counts.x` columns and `counts.y` × `counts.z` rows: probe (i, j, k) in column i and row j +
/// `counts.y` · k, rows counted from the top. R, G, B are the mean radiance over all directions; `sh0.R` to `sh8.B` the
/// factors of the harmonics, `validity.Y`, and `offset.X`, `.Y`, `.Z` in metres. The lattice is in the header.
///
/// `white_luminance` and `attributes` as in [`crate::write_exr`].
///
/// # Panics
/// If an array has not an element for each probe, or there is none.
pub fn write_probes_exr(
    probes: &ProbeArrays<'_>,
    white_luminance: Option<f32>,
    attributes: &[(&str, &str)],
) -> Vec<u8> {
    probes.check();
    let lattice = &probes.lattice;
    let [width, rows, layers] = lattice.counts;
    let mut channels: Vec<(String, Vec<f32>)> = Vec::new();
    let mut triple = |names: [String; 3], value: &dyn Fn(usize) -> [f32; 3]| {
        let values: Vec<[f32; 3]> = (0..lattice.len()).map(value).collect();
        for (c, name) in names.into_iter().enumerate() {
            channels.push((name, values.iter().map(|v| v[c]).collect()));
        }
    };
    // The mean of the first harmonic is its constant.
    const MEAN: f32 = 0.282_094_8;
    triple(["R", "G", "B"].map(String::from), &|i| probes.radiance[i][0].map(|c| c * MEAN));
    for k in 0..HARMONICS {
        triple(["R", "G", "B"].map(|c| format!("sh{k}.{c}")), &|i| probes.radiance[i][k]);
    }
    triple(["X", "Y", "Z"].map(|c| format!("offset.{c}")), &|i| probes.offset[i]);
    channels.push(("validity.Y".into(), probes.validity.to_vec()));
    let text = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
    let (low, cell, counts) = (text(lattice.low), text(lattice.cell), text(lattice.counts.map(f64::from)));
    let own = [("probes.low", low.as_str()), ("probes.cell", cell.as_str()), ("probes.counts", counts.as_str())];
    let attributes: Vec<(&str, &str)> = attributes.iter().copied().chain(own).collect();
    write_channels(width, rows * layers, channels, white_luminance, &attributes)
}
