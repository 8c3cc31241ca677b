//! `export`: a table of every kind from a solve and from a reference, and what is refused.

use twinray::format::{Limits, read_solution};

use crate::support::{FLOOR, Place};

const CUT: [&str; 2] = ["--patches", "500"];

/// Σ A E of a CSV, and its number of cells.
fn power(csv: &[u8]) -> ([f64; 3], usize) {
    let text = std::str::from_utf8(csv).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let (area, red) = (column("area"), column("irradiance_r"));
    let mut sum = [0.0; 3];
    for line in lines.clone() {
        let fields: Vec<f64> = line.split(',').map(|f| f.parse().unwrap()).collect();
        (0..3).for_each(|c| sum[c] += fields[area] * fields[red + c]);
    }
    (sum, lines.count())
}

#[test]
fn solutions_and_references_are_exported() {
    let place = Place::new();
    place.done(&[&["solve", "cornell", "--rays", "50000", "-o", "a.twin"], &CUT[..]].concat());
    place.done(&[&["reference", "cornell", "--paths", "8", "-o", "b.twin"], &CUT[..]].concat());
    for solution in ["a.twin", "b.twin"] {
        let info = place.done(&["info", solution, "--json"]).json();
        for (output, begin) in [("t.npz", "PK\x03\x04"), ("t.csv", "cell,"), ("t.ply", "ply\n"), ("t.vtu", "<?xml")] {
            let report = place.done(&["export", solution, "-o", output, "--json"]).json();
            assert_eq!((&report["patches"], &report["fingerprint"]), (&info["patches"], &info["fingerprint"]));
            let file = place.read(output);
            assert!(file.starts_with(begin.as_bytes()), "{output}");
            place.done(&["export", solution, "-o", output, "--threads", "1", "--quiet"]);
            assert!(place.read(output) == file, "{output}: equal solutions, equal bytes");
        }
        let (sum, cells) = power(&place.read("t.csv"));
        assert_eq!(info["patches"], cells);
        for (c, sum) in sum.iter().enumerate() {
            // The irradiance of a CSV has the 24 bits of the solution's: parsed as f64, each is off by 2⁻²⁵ at most.
            let expected = info["arriving_power_rgb"][c].as_f64().unwrap();
            assert!((sum / expected - 1.0).abs() < 3e-8, "{solution}: {sum} and {expected}");
        }
        assert!(
            read_solution(solution, &place.read(solution), &Limits::default()).is_ok(),
            "what was read is untouched"
        );
    }
}

/// A scene that has moved is found by `--scene-file`; its coordinates are those of the file, in metres.
#[test]
fn places_are_those_of_the_scene() {
    let place = Place::new();
    let far: String = FLOOR.replace("v -1", "v 999").replace("v 1", "v 1001");
    place.write("floor.obj", far);
    place.done(&["solve", "floor.obj", "--unit", "cm", "--rays", "5000", "--patch-size", "inf", "-o", "floor.twin"]);
    std::fs::rename(place.path("floor.obj"), place.path("moved.obj")).unwrap();
    let run = place.run(&["export", "floor.twin", "-o", "a.csv"]);
    assert_eq!(run.code, Some(2), "{}", run.stderr);
    assert!(run.stderr.contains("--scene-file"), "{}", run.stderr);
    place.done(&["export", "floor.twin", "--scene-file", "moved.obj", "-o", "a.csv"]);
    let text = String::from_utf8(place.read("a.csv")).unwrap();
    assert!(text.lines().count() > 2, "{text}");
    for line in text.lines().skip(1) {
        let fields: Vec<f64> = line.split(',').map(|f| f.parse().unwrap()).collect();
        assert!((9.99..10.01).contains(&fields[1]) && fields[2] == 0.0 && fields[3].abs() < 0.01, "{line}");
    }
}

#[test]
fn what_cannot_be_exported_is_named() {
    let place = Place::new();
    place.write("bad.twin", "not a solution");
    for (args, words) in [
        (&["export", "cornell", "-o", "a.csv"][..], ["cornell", "twinray solve cornell"]),
        (&["export", "bad.twin", "-o", "a.csv"], ["bad.twin", "is no solution file"]),
        (&["export", "missing.twin", "-o", "a.csv"], ["missing.twin", "no such file"]),
        (&["export", "bad.twin", "-o", "a.xlsx"], ["a.xlsx", ".npz, .csv, .ply, .vtu or .html"]),
        (&["export", "bad.twin"], ["--output", "required"]),
    ] {
        let run = place.run(args);
        assert_eq!(run.code, Some(2), "{args:?}: {}", run.stderr);
        assert!(words.iter().all(|word| run.stderr.contains(word)), "{words:?} in {}", run.stderr);
    }
    assert_eq!(place.files(), ["bad.twin"]);
}
