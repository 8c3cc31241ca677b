//! Solution files: round trips, and bytes that somebody has changed.

use std::sync::LazyLock;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};
use twinray_format::{
    FormatError, Limits, Method, Provenance, SceneSource, SolutionFile, StoredSolution, read_solution, write_solution,
};
use twinray_scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray_solve::{Params, PatchLight, Record, Schedule, Solver, state_bytes};

use crate::seeds::bodies;

fn read(bytes: &[u8]) -> Result<SolutionFile<'_>, FormatError> {
    read_solution("a.twin", bytes, &Limits::default())
}

pub fn write(solution: &SolutionFile) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_solution(solution, &mut bytes).unwrap();
    bytes
}

/// A reference of three patches.
pub fn small() -> SolutionFile<'static> {
    SolutionFile {
        provenance: Provenance {
            software: "twinray 0.1.0".into(),
            method: Method::Reference,
            scene: "cornell".into(),
            source: SceneSource {
                file: "rooms/cornell.glb".into(),
                metres_per_unit: 0.001,
                patches: None,
                patch_size: Some(f64::INFINITY),
                two_sided: true,
                light: vec![("sun".into(), "35,180".into())],
            },
            fingerprint: 0xfedc_ba98_7654_3210,
            rays: 1 << 60,
            seed: u64::MAX,
            part: Some([3, 16]),
            seeds: vec![7, u64::MAX],
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
        record: None,
    }
}

/// A solve of a few glossy patches with the state to go on from; `merged`: as several that were added up.
pub fn solved(params: &Params, merged: bool) -> SolutionFile<'static> {
    let scene = bodies::lobes();
    let mut solver = Solver::new(&scene, params.clone(), None).unwrap();
    solver.run(20_000);
    // Through a file, so that nothing is borrowed from the solver.
    let mut record = solver.record();
    if let (true, Record::Waves(waves)) = (merged, &record) {
        record = Record::Waves(twinray_solve::merge(&[(1, waves)]).unwrap());
    }
    let solution = solver.solution();
    let mut file = small();
    file.provenance.method = Method::Solve;
    file.provenance.rays = record.rays();
    file.provenance.part = None;
    file.light = solution.patch_light(&scene);
    file.record = Some(record);
    let bytes: &'static [u8] = write(&file).leak();
    read(bytes).unwrap()
}

/// A container as `docs/formats.md` describes it, written a second time so that readers meet sections of any content:
/// name, kind, columns, bytes.
fn container(version: u32, sections: &[(&str, &str, u32, &[u8])]) -> Vec<u8> {
    let mut table = [&b"\x89TWIN\r\n\x1a"[..], &version.to_le_bytes(), &(sections.len() as u32).to_le_bytes()].concat();
    let mut offset = 16 + 40 * sections.len() + 8;
    for (name, kind, columns, bytes) in sections {
        table.extend(name.bytes().chain(std::iter::repeat(0)).take(12));
        table.extend(crc(bytes).to_le_bytes());
        table.extend((offset as u64).to_le_bytes());
        table.extend((bytes.len() as u64).to_le_bytes());
        table.extend(kind.bytes().chain(std::iter::repeat(0)).take(4));
        table.extend(columns.to_le_bytes());
        offset = (offset + bytes.len()).next_multiple_of(8);
    }
    table.extend(u64::from(crc(&table)).to_le_bytes());
    for (.., bytes) in sections {
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
    json!({ "software": "x", "method": "reference", "scene": "s", "fingerprint": "00000000000000ff", "patches": 1,
        "glossy_patches": 0, "rays": 5, "seed": 6, "part": null, "seeds": [6], "can_go_on": false,
        "source": { "file": "s.glb", "metres_per_unit": 1, "patches": 7, "patch_size": null, "two_sided": false,
            "light": [] },
        "settings": [["a", "b"]], "relative_error": null })
}

/// A file of one patch, with a header and an array changed.
fn one_patch(header: &Value, change: (&str, &[u8])) -> Vec<u8> {
    let text = header.to_string();
    let (one, three) = (1f32.to_le_bytes(), [1f32.to_le_bytes(); 3].concat());
    let sections: [(&str, &str, u32, &[u8]); 6] = [
        ("header", "|u1", 1, text.as_bytes()),
        ("area", "<f8", 1, &1f64.to_le_bytes()),
        ("emits", "|u1", 1, &[0]),
        ("irradiance", "<f4", 3, &three),
        ("error", "<f4", 1, &one),
        ("hits", "<u4", 1, &one),
    ];
    let changed = |s: (&'static str, &'static str, u32, _)| if s.0 == change.0 { (s.0, s.1, s.2, change.1) } else { s };
    container(3, &sections.map(changed))
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
    let bytes = write(&small());
    assert_eq!(bytes, write(&small()), "equal solutions, equal bytes");
    assert_eq!(read(&bytes).unwrap(), small());
    let mut nothing_known = small();
    nothing_known.provenance.relative_error = f32::INFINITY;
    nothing_known.provenance.source.patch_size = Some(0.125);
    assert_eq!(read(&write(&nothing_known)).unwrap(), nothing_known);
}

fn paper() -> Params {
    Params { schedule: Schedule::Paper { batch: 1 }, ..Params::paper_preset(1) }
}

/// A solver that goes on from the file is the one that was never stopped.
#[test]
fn a_solve_goes_on_from_its_file() {
    let scene = bodies::lobes();
    for params in [Params::default_preset(1), paper()] {
        let bytes = write(&solved(&params, false));
        let file = read(&bytes).unwrap();
        assert_eq!(bytes, write(&file));
        let mut resumed = Solver::resume(&scene, params.clone(), file.record.as_ref().unwrap()).unwrap();
        let mut unbroken = Solver::new(&scene, params, None).unwrap();
        resumed.run(60_000);
        unbroken.run(60_000);
        assert_eq!(resumed.record(), unbroken.record());
        assert!(resumed.record().glossy() > 0);
    }
    let merged = solved(&Params::default_preset(1), true);
    assert_eq!(read(&write(&merged)).unwrap(), merged);
    assert!(!merged.record.unwrap().can_go_on());
}

/// The file of a solve takes no more than 1.1 times the memory of its state.
#[test]
fn files_are_as_small_as_the_state() {
    let scene = PatchScene::new(
        &builtin::cornell(false),
        PatchOptions { budget: PatchBudget::Count(20_000), two_sided: false },
    )
    .unwrap();
    let mut solver = Solver::new(&scene, Params::default_preset(1), None).unwrap();
    solver.run(1);
    let mut file = small();
    file.provenance.method = Method::Solve;
    file.light = solver.solution().patch_light(&scene);
    file.record = Some(solver.record());
    let (bytes, state) = (write(&file).len(), state_bytes(scene.len(), 0, false));
    assert!(bytes as f64 <= 1.1 * state as f64, "{bytes} bytes for {state}");
}

/// Of a file whose arrays were changed nobody who asks for other things need know.
#[test]
fn parts_are_read_alone() {
    let mut bytes = write(&small());
    let at = bytes.len() - 7;
    bytes[at] ^= 1;
    let stored = StoredSolution::open("a.twin", &bytes, &Limits::default()).unwrap();
    assert_eq!(*stored.provenance(), small().provenance);
    assert_eq!(stored.patches(), 3);
    assert!(stored.light().is_err() && stored.verify().is_err());
}

#[test]
fn the_layout_is_the_one_described() {
    let file = one_patch(&header(), ("", &[]));
    let file = read(&file).unwrap();
    assert_eq!((file.provenance.fingerprint, file.provenance.rays, file.light.len()), (255, 5, 1));
    assert_eq!(file.light.irradiance, [[1.0; 3]]);
    // What another version adds is ignored, if it is whole.
    let mut more = header();
    more["patches"] = json!(0);
    more["news"] = json!("good");
    let more = more.to_string();
    let empty: [(&str, &str, u32, &[u8]); 5] = [
        ("area", "<f8", 1, b""),
        ("emits", "|u1", 1, b""),
        ("irradiance", "<f4", 3, b""),
        ("error", "<f4", 1, b""),
        ("hits", "<u4", 1, b""),
    ];
    let sections = [&[("header", "|u1", 1, more.as_bytes())][..], &empty, &[("news", "|x9", 7, b"some")]].concat();
    assert!(read(&container(3, &sections)).unwrap().light.is_empty());
}

#[test]
fn damage_is_named() {
    let bytes = write(&small());
    refused(b"", &["is no solution file", ".twin"]);
    refused(b"glTF", &["is no solution file"]);
    refused(&bytes[..12], &["cut off after 12 bytes"]);
    refused(&bytes[..bytes.len() - 9], &["cut off in section \"hits\"", "expected", "complete"]);
    let mut flipped = bytes.clone();
    let at = bytes.len() - 70;
    flipped[at] ^= 4;
    refused(&flipped, &["section", "has been changed", "checksum"]);
    refused(&[&bytes[..], b"more"].concat(), &["4 bytes after its last section"]);
    refused(&container(1, &[]), &["version 1", "reads version 3", "solve again"]);
    refused(&container(3, &[]), &["no such section", "\"header\""]);
    refused(&container(3, &[("a", "|u1", 1, b"x"), ("a", "|u1", 1, b"x")]), &["two sections \"a\""]);
    refused(&container(3, &[("", "|u1", 1, b"x")]), &["ASCII"]);
    let many = vec![("a", "|u1", 1, &b""[..]); 300];
    refused(&container(3, &many), &["300 sections", "256"]);
}

#[test]
fn values_that_make_no_sense_are_named() {
    for (value, shown) in [(-1f64, "-1.0"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let bytes = value.to_le_bytes();
        refused(&one_patch(&header(), ("area", &bytes)), &["section \"area\", patch 0", shown, "finite"]);
    }
    let nan = [1f32.to_le_bytes(), f32::NAN.to_le_bytes(), 1f32.to_le_bytes()].concat();
    refused(&one_patch(&header(), ("irradiance", &nan)), &["section \"irradiance\", patch 0", "NaN"]);
    refused(&one_patch(&header(), ("error", &(-1f32).to_le_bytes())), &["section \"error\", patch 0", "infinity"]);
    refused(&one_patch(&header(), ("error", &f32::NAN.to_le_bytes())), &["section \"error\", patch 0", "NaN"]);
    refused(&one_patch(&header(), ("emits", &[2])), &["section \"emits\", patch 0", "found 2", "0 or 1"]);
    let shape = |name, kind, columns| {
        container(3, &[("header", "|u1", 1, header().to_string().as_bytes()), (name, kind, columns, &[0; 8])])
    };
    refused(&shape("area", "<f4", 2), &["section \"area\" has 2 of <f4", "1 columns of <f8"]);
    refused(&one_patch(&header(), ("hits", &[0; 8])), &["section \"hits\" has 8 bytes", "1 rows of 4 bytes"]);
}

#[test]
fn headers_are_checked() {
    let with = |key: &str, value: Value| {
        let mut header = header();
        header[key] = value;
        one_patch(&header, ("", &[]))
    };
    refused(&with("patches", json!(u64::MAX)), &["section \"area\" has 8 bytes"]);
    refused(&with("patches", json!(-1)), &["header.patches", "found -1"]);
    refused(&with("rays", json!(1.5)), &["header.rays", "found 1.5", "whole number"]);
    refused(&with("fingerprint", json!("+00000000000000f")), &["header.fingerprint", "16 hexadecimal"]);
    refused(&with("fingerprint", json!(255)), &["header.fingerprint", "a text"]);
    refused(&with("method", json!("magic")), &["the method \"magic\"", "use the twinray that wrote"]);
    refused(&with("settings", json!([["a", "b", "c"]])), &["header.settings", "pairs"]);
    refused(&with("relative_error", json!(-0.1)), &["header.relative_error", "found -0.1"]);
    refused(&with("seeds", json!([3, 2])), &["header.seeds", "ascending"]);
    refused(&with("seeds", json!([])), &["header.seeds", "ascending"]);
    refused(&with("part", json!([0, 2])), &["header.part", "which of how many"]);
    refused(&with("can_go_on", json!("yes")), &["header.can_go_on", "true or false"]);
    refused(&with("source", json!({ "file": 1 })), &["header.source", "how it was cut"]);
    refused(&with("method", json!("solve")), &["no such section", "\"totals\""]);
    refused(&with("scene", json!(vec!["x"; 1000])), &["header.scene", "…"]);
    refused(&one_patch(&json!([]), ("", &[])), &["header: is something else", "a JSON object"]);
    refused(&one_patch(&header(), ("header", b"{")), &["header: EOF"]);
    let long = vec![b' '; (1 << 20) + 1];
    refused(&one_patch(&header(), ("header", &long)), &["header: 1048577 bytes"]);
}

#[test]
fn limits_hold() {
    let bytes = write(&small());
    let limits = Limits { max_file_bytes: 100, ..Limits::default() };
    let error = read_solution("a.twin", &bytes, &limits).unwrap_err();
    assert!(matches!(error, FormatError::OverLimit { limit: "max_file_bytes", .. }), "{error}");
}

static SOLVED: LazyLock<SolutionFile> = LazyLock::new(|| solved(&Params::default_preset(1), false));

fn any_solution() -> impl Strategy<Value = SolutionFile<'static>> {
    let bits = |bits: u32| Some(f32::from_bits(bits)).filter(|x| x.is_finite()).unwrap_or(0.5);
    let patch = (any::<u32>(), any::<bool>(), any::<[u32; 3]>(), any::<u32>(), any::<u32>());
    let words = prop::collection::vec((".{0,9}", ".{0,9}"), 0..4);
    let numbers = (any::<bool>(), any::<u64>(), any::<u64>(), any::<u64>(), any::<u32>());
    (prop::collection::vec(patch, 0..20), words, ".{0,20}", numbers).prop_map(
        move |(patches, settings, text, numbers)| {
            let (plain, fingerprint, rays, seed, error) = numbers;
            SolutionFile {
                provenance: Provenance {
                    software: text.clone(),
                    method: Method::Reference,
                    scene: text.clone(),
                    source: SceneSource {
                        file: text,
                        metres_per_unit: f64::from(bits(error).abs()).max(1e-9),
                        patches: plain.then_some(rays.max(1)),
                        patch_size: (!plain).then_some(f64::from(bits(error).abs()).max(1e-9)),
                        two_sided: plain,
                        light: Vec::new(),
                    },
                    fingerprint,
                    rays,
                    seed,
                    part: plain.then_some([1, 1 + error / 2]),
                    seeds: if seed < u64::MAX { vec![seed, u64::MAX] } else { vec![seed] },
                    settings,
                    relative_error: bits(error).abs(),
                },
                light: PatchLight {
                    area: patches.iter().map(|p| f64::from(bits(p.0).abs())).collect(),
                    emits: patches.iter().map(|p| p.1).collect(),
                    irradiance: patches.iter().map(|p| p.2.map(bits)).collect(),
                    standard_error: patches.iter().map(|p| f32::from_bits(p.3).abs().max(0.0)).collect(),
                    hits: patches.iter().map(|p| p.4).collect(),
                },
                record: None,
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn any_solution_comes_back(solution in any_solution()) {
        let bytes = write(&solution);
        prop_assert_eq!(read(&bytes).unwrap(), solution);
    }

    /// A burst of up to 32 changed bits never escapes a CRC-32; what is not under one is compared.
    #[test]
    fn changed_bytes_are_refused(place in any::<prop::sample::Index>(), change in 1..=255u8) {
        for file in [small(), (*SOLVED).clone()] {
            let mut bytes = write(&file);
            let at = place.index(bytes.len());
            bytes[at] ^= change;
            prop_assert!(read(&bytes).is_err());
        }
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
