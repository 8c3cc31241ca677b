//! `merge`: any order, the same bytes; what does not belong together is refused.

use crate::support::{FLOOR, Place};

const CUT: [&str; 2] = ["--patches", "500"];

fn solve(place: &Place, name: &str, more: &[&str]) {
    place.done(&[&["solve", "cornell", "-o", name], &CUT[..], more].concat());
}

#[track_caller]
fn refused(place: &Place, files: &[&str], words: &[&str]) {
    let run = place.run(&[&["merge"], files, &["-o", "refused.twin"]].concat());
    assert_eq!(run.code, Some(2), "{files:?}: {}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "{files:?}: no {word:?} in {}", run.stderr);
    }
    assert!(!place.path("refused.twin").exists());
}

#[test]
fn any_order_gives_the_same_bytes() {
    let place = Place::new();
    for seed in ["1", "2", "3"] {
        solve(&place, &format!("{seed}.twin"), &["--seed", seed, "--rays", &format!("{seed}00k")]);
    }
    let report = place.done(&["merge", "1.twin", "2.twin", "3.twin", "-o", "a.twin", "--json"]).json();
    place.done(&["merge", "3.twin", "1.twin", "2.twin", "-o", "b.twin"]);
    assert!(place.read("a.twin") == place.read("b.twin"));
    // A merge of merges is the same light.
    place.done(&["merge", "3.twin", "2.twin", "-o", "c.twin"]);
    place.done(&["merge", "1.twin", "c.twin", "-o", "d.twin"]);
    place.done(&["compare", "d.twin", "a.twin", "--max-error", "1e-6"]);

    let info = |name: &str| place.done(&["info", name, "--json"]).json();
    let [one, two, three, all] = ["1.twin", "2.twin", "3.twin", "a.twin"].map(info);
    let rays = |info: &serde_json::Value| info["rays"].as_u64().unwrap();
    assert_eq!(rays(&all), rays(&one) + rays(&two) + rays(&three));
    assert_eq!(report["relative_error"].as_f64().map(|e| e as f32), all["relative_error"].as_f64().map(|e| e as f32));
    // Six times the rays of one: the error is that of the third by its root of two, to what such estimates are good for.
    let error = |info: &serde_json::Value| info["relative_error"].as_f64().unwrap();
    assert!((error(&all) / error(&three) * 2f64.sqrt() - 1.0).abs() < 0.25, "{} of {}", error(&all), error(&three));
    // It is light like any other: pictures, comparisons, but no state.
    place.done(&["render", "a.twin", "-o", "a.png", "--size", "64x48"]);
    let run = place.run(&["solve", "a.twin", "--rays", "1M"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("added up") && run.stderr.contains("another --seed"), "{}", run.stderr);
}

#[test]
fn parts_are_joined() {
    let place = Place::new();
    let names = ["p1.twin", "p2.twin", "p3.twin", "p4.twin"];
    for (k, name) in names.iter().enumerate() {
        solve(&place, name, &["--part", &format!("{}/4", k + 1), "--rays", "400k"]);
    }
    place.done(&[&["merge"], &names[..], &["-o", "all.twin"]].concat());
    let info = place.done(&["info", "all.twin", "--json"]).json();
    // Each shoots its share, rounded up to whole waves.
    let rays = info["rays"].as_u64().unwrap();
    assert!((400_000..600_000).contains(&rays), "{rays}");
    let run = place.done(&["merge", "p2.twin", "p4.twin", "-o", "some.twin"]);
    assert!(run.stderr.contains("2 of 4 parts of seed 1, without 1, 3"), "{}", run.stderr);
    refused(&place, &["p2.twin", "p2.twin"], &["random numbers in common", "seed 1 part 2/4"]);
    refused(&place, &["all.twin", "p2.twin"], &["random numbers in common"]);
    // A part goes on as itself.
    place.done(&["solve", "p2.twin", "--rays", "800k"]);
    let info = place.done(&["info", "p2.twin", "--json"]).json();
    assert_eq!(info["part"], serde_json::json!([2, 4]));
    assert!((200_000..300_000).contains(&info["rays"].as_u64().unwrap()));
}

#[test]
fn references_are_averaged() {
    let place = Place::new();
    for seed in ["1", "2"] {
        let name = format!("{seed}.twin");
        place.done(&[&["reference", "cornell", "--paths", "64", "--seed", seed, "-o", &name], &CUT[..]].concat());
    }
    place.done(&["merge", "2.twin", "1.twin", "-o", "both.twin"]);
    place.done(&["merge", "1.twin", "2.twin", "-o", "same.twin"]);
    assert!(place.read("both.twin") == place.read("same.twin"));
    let error = |name: &str| place.done(&["info", name, "--json"]).json()["relative_error"].as_f64().unwrap();
    assert!((error("both.twin") / error("1.twin") * 2f64.sqrt() - 1.0).abs() < 0.1);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let place = Place::new();
    place.write("floor.obj", FLOOR);
    let rays = ["--rays", "20k"];
    solve(&place, "a.twin", &rays);
    solve(&place, "main.twin", &[&rays[..], &["--seed", "2", "--representation", "main"]].concat());
    solve(&place, "paper.twin", &[&rays[..], &["--preset", "paper"]].concat());
    place.done(&["solve", "cornell", "--patches", "900", "--seed", "2", "--rays", "20k", "-o", "fine.twin"]);
    place.done(&["solve", "floor.obj", "--patches", "90", "--seed", "2", "--rays", "20k", "-o", "floor.twin"]);
    place.done(&[&["reference", "cornell", "--paths", "4", "--seed", "2", "-o", "reference.twin"], &CUT[..]].concat());
    place.write("bad.twin", "not a solution");
    refused(&place, &["a.twin", "main.twin"], &["a.twin", "main.twin", "different settings", "representation"]);
    refused(&place, &["a.twin", "fine.twin"], &["not of the same patches", "patches"]);
    refused(&place, &["a.twin", "floor.twin"], &["not of the same patches", "scenes are"]);
    refused(&place, &["a.twin", "reference.twin"], &["different ways", "solve", "reference"]);
    refused(&place, &["paper.twin"], &["paper preset", "Go on", "--rays"]);
    refused(&place, &["a.twin", "a.twin"], &["random numbers in common", "seed 1"]);
    refused(&place, &["a.twin", "bad.twin"], &["bad.twin", "is no solution file"]);
    refused(&place, &["a.twin", "gone.twin"], &["gone.twin", "no such file"]);
    let run = place.run(&["merge", "a.twin", "-o", "a.png"]);
    assert!(run.code == Some(2) && run.stderr.contains(".twin"), "{}", run.stderr);
}
