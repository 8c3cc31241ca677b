//! `solve`: the file, what `info` says of it, the same bytes.

use crate::support::{FLOOR, Place};

const CUT: [&str; 4] = ["--patches", "1000", "--rays", "50000"];

#[test]
fn a_solution_is_written_and_described() {
    let place = Place::new();
    let report = place.done(&[&["solve", "cornell", "--seed", "7", "--json"], &CUT[..]].concat()).json();
    assert_eq!(place.files(), ["cornell.twin"]);
    assert!(report["rays"].as_u64().unwrap() >= 50_000);
    assert_eq!((report["seed"].as_u64(), report["interrupted"].as_bool()), (Some(7), Some(false)));
    let info = place.done(&["info", "cornell.twin", "--json"]).json();
    for key in ["scene", "fingerprint", "patches", "rays", "seed"] {
        assert_eq!(info[key], report[key], "{key}");
    }
    assert_eq!(info["method"], "solve");
    assert_eq!(info["settings"]["preset"], "default");
    let (claimed, kept) = (report["relative_error"].as_f64().unwrap(), info["relative_error"].as_f64().unwrap());
    assert!((kept / claimed - 1.0).abs() < 1e-6, "{kept} against {claimed}");
    let text = place.done(&["info", "cornell.twin"]).stdout;
    for word in ["cornell", "preset default", "seed 7", "arriving", report["fingerprint"].as_str().unwrap()] {
        assert!(text.contains(word), "no {word:?} in {text}");
    }
}

#[test]
fn threads_change_no_byte_and_seeds_do() {
    let place = Place::new();
    for (name, more) in [("1.twin", ["--threads", "1"]), ("2.twin", ["--threads", "2"]), ("3.twin", ["--seed", "2"])] {
        place.done(&[&["solve", "doorway", "-o", name], &CUT[..], &more].concat());
    }
    assert!(place.read("1.twin") == place.read("2.twin"));
    assert!(place.read("1.twin") != place.read("3.twin"));
}

#[test]
fn the_paper_preset_is_kept_in_the_settings() {
    let place = Place::new();
    place.done(&[&["solve", "cornell", "--preset", "paper", "--batch", "64"], &CUT[..]].concat());
    let info = place.done(&["info", "cornell.twin", "--json"]).json();
    assert_eq!((&info["settings"]["preset"], &info["settings"]["batch"]), (&"paper".into(), &"64".into()));
}

#[test]
fn bad_input_is_named() {
    let place = Place::new();
    place.write("floor.obj", FLOOR);
    place.write("bad.twin", "not a solution");
    for (args, words) in [
        (&["solve", "cornell", "-o", "a.png"][..], ["a.png", ".twin"]),
        (&["solve", "cornell", "-o", "nowhere/a.twin"], ["nowhere/a.twin", "no folder"]),
        (&["solve", "missing.glb"], ["missing.glb", "no such file"]),
        (&["solve", "floor.obj", "--preset", "paper"], ["floor.obj", "paper preset"]),
        (&["info", "bad.twin"], ["bad.twin", "is no solution file"]),
        (&["info", "missing.twin"], ["missing.twin", "no such file"]),
    ] {
        let run = place.run(args);
        assert_eq!(run.code, Some(2), "{args:?}: {}", run.stderr);
        assert!(words.iter().all(|word| run.stderr.contains(word)), "{words:?} in {}", run.stderr);
    }
    assert_eq!(place.files(), ["bad.twin", "floor.obj"]);
}
