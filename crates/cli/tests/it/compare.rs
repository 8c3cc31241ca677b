//! `compare`: numbers, exit codes, messages.

use serde_json::Value;

use crate::support::{Place, Run, png};

/// A place with two rough pictures and two rough solutions of the Cornell box, and a better one of each.
fn place() -> Place {
    let place = Place::new();
    for (name, seed, rays) in [("one", "1", "100000"), ("two", "2", "100000"), ("good", "3", "2000000")] {
        let cut = ["--patches", "1000", "--rays", rays, "--seed", seed];
        place.done(&[&["solve", "cornell", "-o", &format!("{name}.twin")], &cut[..]].concat());
    }
    for extension in ["png", "exr"] {
        for (name, seed) in [("one", "1"), ("two", "2")] {
            place.render(&["cornell", "-o", &format!("{name}.{extension}"), "--seed", seed]);
        }
    }
    place
}

fn report(place: &Place, args: &[&str]) -> Value {
    place.done(&[&["compare"], args, &["--json"]].concat()).json()
}

#[track_caller]
fn ends(run: &Run, code: i32, words: &[&str]) {
    assert_eq!(run.code, Some(code), "{}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "no {word:?} in: {}", run.stderr);
    }
}

#[test]
fn solutions_are_compared_by_patch_with_their_error_bars() {
    let place = place();
    let found = report(&place, &["one.twin", "good.twin"]);
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{value} in {found:#}"));
    let (rms, expected) = (number(&found["relative_rms"]), number(&found["expected_rms"]));
    assert!((0.01..0.3).contains(&rms), "{rms}");
    // The square of some 1000 patches, of which bright ones count for more, has a deviation of about 10 %, its root
    // of 5 %: four of them.
    assert!((rms / expected - 1.0).abs() < 0.2, "{rms} against {expected}");
    // √((1 − 2/π)/1000) = .019, and bars that were themselves scaled by a mean of 1000 squares, ½√(2/1000) = 2.2 % of
    // .798 = .018: together .026, and four of them.
    assert!((number(&found["z"]["mean_abs"]) - 0.798).abs() < 0.105, "{}", found["z"]);
    assert!(number(&found["bias"]).abs() < 0.02, "{found:#}");
    assert_eq!(found["worst_by_z"].as_array().unwrap().len(), 10);
    assert_eq!(found["equal"], false);

    let text = place.done(&["compare", "one.twin", "good.twin"]).stdout;
    for word in ["relative RMS", "bias", "mean |z|", "largest |z|", "largest differences"] {
        assert!(text.contains(word), "no {word:?} in {text}");
    }
    let same = report(&place, &["one.twin", "one.twin", "--max-error", "0"]);
    assert_eq!((&same["relative_rms"], &same["bias"], &same["equal"]), (&0.0.into(), &0.0.into(), &true.into()));
}

#[test]
fn limits_decide_the_exit_code() {
    let place = place();
    let run = |args: &[&str]| place.run(&[&["compare"], args].concat());
    ends(&run(&["one.twin", "good.twin", "--max-error", "1%"]), 1, &["one.twin", "relative RMS", "1%", "--max-error"]);
    ends(&run(&["one.twin", "good.twin", "--max-error", "30%"]), 0, &[]);
    ends(&run(&["one.png", "two.png", "--max-error", "0.1%"]), 1, &["FLIP", "0.1%"]);
    ends(&run(&["one.png", "two.png", "--max-error", "0.9"]), 0, &[]);
    ends(&run(&["one.png", "two.png", "--max-error", "0.9", "--metric", "rmse"]), 0, &[]);
    ends(&run(&["one.exr", "two.exr", "--max-error", "1e-9", "--metric", "relmse"]), 1, &["relMSE", "0.000000001"]);
    // Of PSNR more is better.
    ends(&run(&["one.png", "two.png", "--max-error", "5", "--metric", "psnr"]), 0, &[]);
    ends(&run(&["one.png", "two.png", "--max-error", "90", "--metric", "psnr"]), 1, &["PSNR"]);
    for same in ["one.png", "one.exr"] {
        ends(&run(&[same, same, "--max-error", "0"]), 0, &[]);
    }
    let quiet = run(&["one.png", "two.png", "--max-error", "0", "--quiet"]);
    assert_eq!((quiet.code, quiet.stdout.as_str(), quiet.stderr.as_str()), (Some(1), "", ""));
}

#[test]
fn pictures_are_compared_by_pixel_and_by_eye() {
    let place = place();
    let shown = report(&place, &["one.png", "two.png", "--diff", "d.png"]);
    let (width, height, rgb) = png(&place.read("d.png"));
    assert_eq!((width, height), (64, 48));
    // Magma: black where nothing differs (the lamp), purple where something does.
    assert!(rgb.chunks(3).any(|c| c[2] > 40) && rgb.chunks(3).any(|c| c == [0, 0, 4]), "{:?}", &rgb[..30]);
    let linear = report(&place, &["one.exr", "two.exr"]);
    for (report, range) in [(&shown, "LDR"), (&linear, "HDR")] {
        let mean = report["flip"]["mean"].as_f64().unwrap();
        assert!((0.001..0.6).contains(&mean), "{mean}");
        assert_eq!(report["flip"]["range"], range);
        assert!(report["rmse"].as_f64().unwrap() > 0.0 && report["relmse"].as_f64().unwrap() > 0.0);
    }
    assert!((15.0..60.0).contains(&shown["psnr"].as_f64().unwrap()), "{shown}");
    assert_eq!(linear["psnr"], Value::Null);
    // Threads change nothing.
    let args = ["one.exr", "two.exr", "--threads", "1"];
    assert_eq!(report(&place, &args), linear);
}

#[test]
fn what_cannot_be_compared_is_named() {
    let place = place();
    place.done(&["render", "cornell", "-o", "large.png", "--size", "65x48", "--patches", "500", "--rays", "1000"]);
    place.done(&["solve", "cornell", "-o", "fine.twin", "--patches", "2000", "--rays", "1000"]);
    place.done(&["solve", "doorway", "-o", "other.twin", "--patches", "1000", "--rays", "1000"]);
    place.write("text.png", "no picture");
    let mut damaged = place.read("one.twin");
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    place.write("damaged.twin", damaged);
    let check = |args: &[&str], words: &[&str]| ends(&place.run(&[&["compare"], args].concat()), 2, words);
    check(&["one.twin", "fine.twin"], &["one.twin", "fine.twin", "patches", "--patches"]);
    check(&["one.twin", "other.twin"], &["\"cornell\"", "\"doorway\""]);
    check(&["one.twin", "one.png"], &["a solution and a picture"]);
    check(&["one.png", "one.exr"], &["two PNG pictures or two EXR"]);
    check(&["one.png", "large.png"], &["64 x 48", "65 x 48", "--size"]);
    check(&["one.png", "missing.png"], &["missing.png", "cannot be read"]);
    check(&["text.png", "one.png"], &["text.png", "no picture of a known kind"]);
    check(&["damaged.twin", "one.twin"], &["damaged.twin", "section", "has been changed"]);
    check(&["one.exr", "two.exr", "--metric", "psnr"], &["PSNR", "--metric flip"]);
    check(&["one.png", "two.png", "--metric", "psnr", "--max-error", "2%"], &["decibels"]);
    check(&["one.twin", "two.twin", "--metric", "flip"], &["--metric is for pictures"]);
    check(&["one.twin", "two.twin", "--diff", "d.png"], &["--diff is for pictures"]);
    check(&["one.png", "two.png", "--diff", "d.jpg"], &["d.jpg", ".png"]);
    check(&["one.png", "two.png", "--max-error", "-1"], &["at least 0"]);
    assert!(!place.files().iter().any(|name| name.starts_with("d.")));
}

#[test]
fn equal_seeds_are_said() {
    let place = Place::new();
    for (name, rays) in [("a.twin", "10000"), ("b.twin", "50000")] {
        place.done(&["solve", "cornell", "-o", name, "--patches", "500", "--rays", rays]);
    }
    ends(&place.run(&["compare", "a.twin", "b.twin"]), 0, &["both have the seed 1", "not independent"]);
    // A second side gives as many patches again.
    place.done(&[
        "solve",
        "cornell",
        "-o",
        "c.twin",
        "--rays",
        "10000",
        "--patches",
        "500",
        "--two-sided",
        "--seed",
        "2",
    ]);
    ends(&place.run(&["compare", "a.twin", "c.twin"]), 2, &["--two-sided"]);
}
