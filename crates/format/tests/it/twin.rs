//! Solution files: round trips, and bytes that somebody has changed.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};
use twinray_format::{FormatError, Limits, Method, Provenance, SolutionFile, read_solution, write_solution};
use twinray_solve::PatchLight;

fn read(bytes: &[u8]) -> Result<SolutionFile, FormatError> {
    read_solution("a.twin", bytes, &Limits::default())
}

pub fn small() -> SolutionFile {
    SolutionFile {
        provenance: Provenance {
            software: "twinray 0.1.0".into(),
            method: Method::Solve,
            scene: "cornell".into(),
            fingerprint: 0xfedc_ba98_7654_3210,
            rays: 1 << 60,
            seed: u64::MAX,
            settings: vec![("preset".into(), "default".into()), ("patches".into(), "3".into())],
            relative_error: 0.0123,
        },
        light: PatchLight {
            area: vec![0.5, 0.25, 1e-30],
            emits: vec![false, true, false],
            irradiance: vec![[1.0, 2.0, 3.0], [0.0; 3], [0.1, 1e-20, 1e20]],
            standard_error: vec![0.1, f32::INFINITY, 0.0],
            hits: vec![1, 0, u32::MAX],
        },
    }
}

/// A container as `docs/formats.md` describes it, written a second time so that readers meet sections of any content.
fn container(version: u32, sections: &[(&str, &[u8])]) -> Vec<u8> {
    let mut table = [&b"\x89TWIN\r\n\x1a"[..], &version.to_le_bytes(), &(sections.len() as u32).to_le_bytes()].concat();
    let mut offset = 16 + 32 * sections.len() + 8;
    for (name, bytes) in sections {
        table.extend(name.bytes().chain(std::iter::repeat(0)).take(12));
        table.extend(crc(bytes).to_le_bytes());
        table.extend((offset as u64).to_le_bytes());
        table.extend((bytes.len() as u64).to_le_bytes());
        offset = (offset + bytes.len()).next_multiple_of(8);
    }
    table.extend(u64::from(crc(&table)).to_le_bytes());
    for (_, bytes) in sections {
        table.extend(*bytes);
        table.resize(table.len().next_multiple_of(8), 0);
    }
    table
}

/// CRC-32 of zlib and PNG, bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    })
}

fn header() -> Value {
    json!({ "software": "x", "method": "solve", "scene": "s", "fingerprint": "00000000000000ff", "patches": 1,
        "rays": 5, "seed": 6, "settings": [["a", "b"]], "relative_error": null })
}

/// A file of one patch, with a header and an array changed.
fn one_patch(header: &Value, change: (&str, &[u8])) -> Vec<u8> {
    let text = header.to_string();
    let (one, three) = (1f32.to_le_bytes(), [1f32.to_le_bytes(); 3].concat());
    let sections: [(&str, &[u8]); 6] = [
        ("header", text.as_bytes()),
        ("area", &one),
        ("emits", &[0]),
        ("irradiance", &three),
        ("error", &one),
        ("hits", &one),
    ];
    container(1, &sections.map(|(name, bytes)| if name == change.0 { change } else { (name, bytes) }))
}

/// The message must contain each of `words`.
#[track_caller]
fn refused(bytes: &[u8], words: &[&str]) {
    let message = read(bytes).expect_err("must be refused").to_string();
    for word in ["a.twin"].iter().chain(words) {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
}

#[test]
fn a_solution_comes_back() {
    let bytes = write_solution(&small());
    assert_eq!(bytes, write_solution(&small()), "equal solutions, equal bytes");
    assert_eq!(read(&bytes).unwrap(), small());
    let mut nothing_known = small();
    nothing_known.provenance.relative_error = f32::INFINITY;
    assert_eq!(read(&write_solution(&nothing_known)).unwrap(), nothing_known);
}

#[test]
fn the_layout_is_the_one_described() {
    let file = read(&one_patch(&header(), ("", &[]))).unwrap();
    assert_eq!((file.provenance.fingerprint, file.provenance.rays, file.light.len()), (255, 5, 1));
    assert_eq!(file.light.irradiance, [[1.0; 3]]);
    // What another version adds is ignored, if it is whole.
    let text = header().to_string();
    let empty = json!({ "patches": 0 });
    let mut more = header();
    more.as_object_mut().unwrap().extend(empty.as_object().unwrap().clone());
    let more = more.to_string();
    let sections: Vec<(&str, &[u8])> =
        ["area", "emits", "irradiance", "error", "hits", "solver"].map(|n| (n, &b""[..])).into();
    let sections = [&[("header", more.as_bytes())][..], &sections, &[("resume", text.as_bytes())]].concat();
    assert!(read(&container(1, &sections)).unwrap().light.is_empty());
}

#[test]
fn damage_is_named() {
    let bytes = write_solution(&small());
    refused(b"", &["is no solution file", ".twin"]);
    refused(b"glTF", &["is no solution file"]);
    refused(&bytes[..12], &["cut off after 12 bytes"]);
    refused(&bytes[..bytes.len() - 9], &["cut off in section \"hits\"", "expected", "complete"]);
    let mut flipped = bytes.clone();
    let at = bytes.len() - 70;
    flipped[at] ^= 4;
    refused(&flipped, &["section", "has been changed", "checksum"]);
    refused(&[&bytes[..], b"more"].concat(), &["4 bytes after its last section"]);
    refused(&container(2, &[]), &["version 2", "reads version 1", "solve again"]);
    refused(&container(1, &[]), &["no such section", "\"header\""]);
    refused(&container(1, &[("a", b"x"), ("a", b"x")]), &["two sections \"a\""]);
    refused(&container(1, &[("", b"x")]), &["ASCII"]);
    let many = vec![("a", &b""[..]); 300];
    refused(&container(1, &many), &["300 sections", "256"]);
}

#[test]
fn values_that_make_no_sense_are_named() {
    for (value, shown) in [(-1f32, "-1.0"), (f32::NAN, "NaN"), (f32::INFINITY, "inf")] {
        let bytes = value.to_le_bytes();
        refused(&one_patch(&header(), ("area", &bytes)), &["section \"area\", patch 0", shown, "finite"]);
    }
    let nan = [1f32.to_le_bytes(), f32::NAN.to_le_bytes(), 1f32.to_le_bytes()].concat();
    refused(&one_patch(&header(), ("irradiance", &nan)), &["section \"irradiance\", patch 0", "NaN"]);
    refused(&one_patch(&header(), ("error", &(-1f32).to_le_bytes())), &["section \"error\", patch 0", "infinity"]);
    refused(&one_patch(&header(), ("error", &f32::NAN.to_le_bytes())), &["section \"error\", patch 0", "NaN"]);
    refused(&one_patch(&header(), ("emits", &[2])), &["section \"emits\", patch 0", "found 2", "0 or 1"]);
    refused(&one_patch(&header(), ("hits", &[0; 8])), &["section \"hits\" has 8 bytes", "4 for each of 1 patches"]);
}

#[test]
fn headers_are_checked() {
    let with = |key: &str, value: Value| {
        let mut header = header();
        header[key] = value;
        one_patch(&header, ("", &[]))
    };
    refused(&with("patches", json!(u64::MAX)), &["section \"area\" has 4 bytes"]);
    refused(&with("patches", json!(-1)), &["header.patches", "found -1"]);
    refused(&with("rays", json!(1.5)), &["header.rays", "found 1.5", "whole number"]);
    refused(&with("fingerprint", json!("+00000000000000f")), &["header.fingerprint", "16 hexadecimal"]);
    refused(&with("fingerprint", json!(255)), &["header.fingerprint", "a text"]);
    refused(&with("method", json!("magic")), &["the method \"magic\"", "use the twinray that wrote"]);
    refused(&with("settings", json!([["a", "b", "c"]])), &["header.settings", "pairs"]);
    refused(&with("relative_error", json!(-0.1)), &["header.relative_error", "found -0.1"]);
    refused(&with("scene", json!(vec!["x"; 1000])), &["header.scene", "…"]);
    refused(&one_patch(&json!([]), ("", &[])), &["header: is something else", "a JSON object"]);
    refused(&one_patch(&header(), ("header", b"{")), &["header: EOF"]);
    let long = vec![b' '; (1 << 20) + 1];
    refused(&one_patch(&header(), ("header", &long)), &["header: 1048577 bytes"]);
}

#[test]
fn limits_hold() {
    let bytes = write_solution(&small());
    let limits = Limits { max_file_bytes: 100, ..Limits::default() };
    let error = read_solution("a.twin", &bytes, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_file_bytes", .. }), "{error}");
    let limits = Limits { extra_memory: 0, memory_per_byte: 1, ..Limits::default() };
    let error = read_solution("a.twin", &bytes, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "extra_memory", .. }), "{error}");
}

fn any_solution() -> impl Strategy<Value = SolutionFile> {
    let bits = |bits: u32| Some(f32::from_bits(bits)).filter(|x| x.is_finite()).unwrap_or(0.5);
    let patch = (any::<u32>(), any::<bool>(), any::<[u32; 3]>(), any::<u32>(), any::<u32>());
    let words = prop::collection::vec((".{0,9}", ".{0,9}"), 0..4);
    let numbers = (any::<bool>(), any::<u64>(), any::<u64>(), any::<u64>(), any::<u32>());
    (prop::collection::vec(patch, 0..20), words, ".{0,20}", numbers).prop_map(
        move |(patches, settings, text, numbers)| {
            let (solve, fingerprint, rays, seed, error) = numbers;
            SolutionFile {
                provenance: Provenance {
                    software: text.clone(),
                    method: if solve { Method::Solve } else { Method::Reference },
                    scene: text,
                    fingerprint,
                    rays,
                    seed,
                    settings,
                    relative_error: bits(error).abs(),
                },
                light: PatchLight {
                    area: patches.iter().map(|p| bits(p.0).abs()).collect(),
                    emits: patches.iter().map(|p| p.1).collect(),
                    irradiance: patches.iter().map(|p| p.2.map(bits)).collect(),
                    standard_error: patches.iter().map(|p| f32::from_bits(p.3).abs().max(0.0)).collect(),
                    hits: patches.iter().map(|p| p.4).collect(),
                },
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn any_solution_comes_back(solution in any_solution()) {
        prop_assert_eq!(read(&write_solution(&solution)).unwrap(), solution);
    }

    /// A burst of up to 32 changed bits never escapes a CRC-32; what is not under one is compared.
    #[test]
    fn changed_bytes_are_refused(place in any::<prop::sample::Index>(), change in 1..=255u8) {
        let mut bytes = write_solution(&small());
        let at = place.index(bytes.len());
        bytes[at] ^= change;
        prop_assert!(read(&bytes).is_err());
    }

    /// Headers and arrays of a whole container may hold anything: no panic, no memory without limit.
    #[test]
    fn whole_containers_of_anything(section in 0..7usize, bytes in prop::collection::vec(any::<u8>(), 0..40), place in any::<prop::sample::Index>()) {
        let mut text = header().to_string().into_bytes();
        let at = place.index(text.len());
        text.splice(at..(at + 3).min(text.len()), bytes.iter().copied().take(3));
        let names = ["header", "area", "emits", "irradiance", "error", "hits", "other"];
        let _ = read(&one_patch(&header(), (names[section], &bytes)));
        let _ = read(&one_patch(&header(), ("header", &text)));
        let _ = read(&bytes);
    }
}
