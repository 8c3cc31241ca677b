//! `--error`: a solve that ends when it is as good as it was asked to be.

use crate::support::Place;

/// Runs `args` with a goal; the reported error and rays.
fn solved(place: &Place, args: &[&str], goal: &str) -> (f64, u64) {
    let report = place.done(&[args, &["--error", goal, "--json", "--quiet"]].concat()).json();
    (report["relative_error"].as_f64().unwrap(), report["rays"].as_u64().unwrap())
}

#[test]
fn rays_are_shot_until_the_error_is_reached() {
    let place = Place::new();
    let render = ["render", "cornell", "--method", "patches", "--patches", "2000", "--size", "64x48"];
    for (preset, coarse, fine) in [("default", "8%", "4%"), ("paper", "10%", "5%")] {
        let args = [&render[..], &["--preset", preset]].concat();
        let (error, few) = solved(&place, &args, coarse);
        let goal = |text: &str| text.trim_end_matches('%').parse::<f64>().unwrap() / 100.0;
        assert!(error <= goal(coarse), "{preset}: {error}");
        let (error, many) = solved(&place, &args, fine);
        // Rays come in whole waves, so the error may be below the goal, but not by much.
        assert!(error <= goal(fine) && error > 0.7 * goal(fine), "{preset}: {error}");
        // Half the error wants four times the rays, or a little fewer; waves are an eighth of the rays.
        assert!(many > 2 * few, "{preset}: {few} and {many} rays");
    }
}

#[test]
fn a_solution_keeps_its_error_bars() {
    let place = Place::new();
    let args = ["solve", "cornell", "--patches", "1000", "-o", "x.twin"];
    let (error, _) = solved(&place, &args, "0.05");
    let held = place.done(&["info", "x.twin", "--json"]).json();
    assert!((held["relative_error"].as_f64().unwrap() - error).abs() < 1e-6, "{held}");
}

#[test]
fn progress_tells_the_error() {
    let place = Place::new();
    // Longer than the first line takes to come, however fast the machine.
    let args = ["render", "doorway", "--patches", "20000", "--size", "64x48", "--time", "5"];
    let said = place.done(&args).stderr;
    assert!(said.contains("error ≈") && said.contains("left"), "{said}");
}
