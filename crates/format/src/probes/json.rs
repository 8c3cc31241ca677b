//! The neutral file: all that is known of probes, in words and numbers.

use std::fmt::Write;

use super::ProbeArrays;

/// JSON of a value, with the shortest decimals that read back to the bit. Not a function: its argument's trait is that of a crate
/// that is not ours to name.
macro_rules! json {
    ($value:expr) => {
        serde_json::to_string(&$value).unwrap_or_default()
    };
}

/// The text of a JSON file with all of the probes and what is needed to understand them; described in `docs/formats.md`.
///
/// `unit` is that of radiance, such as `nit`; `attributes` are pairs of name and text. Equal arguments give equal bytes.
///
/// # Panics
/// If an array has not an element for each probe, or there is none.
pub fn write_probes_json(probes: &ProbeArrays<'_>, unit: &str, attributes: &[(&str, &str)]) -> String {
    probes.check();
    let lattice = &probes.lattice;
    let provenance: serde_json::Map<String, serde_json::Value> =
        attributes.iter().map(|(name, text)| ((*name).to_owned(), (*text).into())).collect();
    let steps: Vec<[i32; 3]> = (0..27).filter(|k| *k != 13).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]).collect();
    let mut text = String::from("{\n");
    let mut line = |name: &str, value: String| {
        text.push_str(&format!("  \"{name}\": {value},\n"));
    };
    line("format", json!("twinray-probes"));
    line("version", json!(1));
    line("provenance", json!(provenance));
    line("unit", json!(unit));
    line("up", json!("+Y"));
    line("low", json!(lattice.low));
    line("cell", json!(lattice.cell));
    line("counts", json!(lattice.counts));
    line(
        "order",
        json!("x fastest, then y, then z; probe (i, j, k) at low + (i + 1/2, j + 1/2, k + 1/2) cell + offset"),
    );
    line("harmonics", json!(["1", "y", "z", "x", "xy", "yz", "3z^2-1", "xz", "x^2-y^2"]));
    line("factors", json!(FACTORS));
    line("cosine", json!(["pi", "2pi/3", "2pi/3", "2pi/3", "pi/4", "pi/4", "pi/4", "pi/4", "pi/4"]));
    line("neighbours", json!(steps));
    text.push_str("  \"probes\": [");
    for probe in 0..lattice.len() {
        text.push_str(if probe == 0 { "\n" } else { ",\n" });
        let _ = write!(
            text,
            "    {{\"validity\": {}, \"offset\": {}, \"radiance\": {}, \"nearness\": {}}}",
            json!(probes.validity[probe]),
            json!(probes.offset[probe]),
            json!(probes.radiance[probe]),
            json!(probes.nearness[probe].as_slice()),
        );
    }
    text.push_str("\n  ]\n}\n");
    text
}

/// What the polynomials of the harmonics are multiplied by, to single precision.
const FACTORS: [f32; 9] = [
    0.282_094_8,
    0.488_602_5,
    0.488_602_5,
    0.488_602_5,
    1.092_548_4,
    1.092_548_4,
    0.315_391_57,
    1.092_548_4,
    0.546_274_24,
];
