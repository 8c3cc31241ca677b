//! `reference` and `render --method path`: what is written, and what is said about it.

use twinray::format::{Limits, Method, SolutionFile, read_solution};

use crate::support::{Place, Run, shows_something};

const COARSE: [&str; 2] = ["--patches", "300"];

fn reference(place: &Place, args: &[&str]) -> Run {
    place.done(&[&["reference"], args, &COARSE].concat())
}

fn solution(place: &Place, name: &'static str) -> SolutionFile<'static> {
    read_solution(name, place.read(name).leak(), &Limits::default()).unwrap()
}

#[test]
fn a_reference_says_where_it_comes_from() {
    let place = Place::new();
    let report = reference(&place, &["cornell", "--paths", "40", "--seed", "3", "--json"]).json();
    assert_eq!(place.files(), ["cornell-reference.twin"]);
    let SolutionFile { provenance, light, .. } = solution(&place, "cornell-reference.twin");
    assert_eq!((provenance.method, provenance.seed), (Method::Reference, 3));
    assert_eq!((provenance.rays, light.len() as u64), (40 * light.len() as u64, report["patches"].as_u64().unwrap()));
    assert_eq!((report["paths_per_patch"].as_u64(), report["paths"].as_u64()), (Some(40), Some(provenance.rays)));
    assert_eq!((report["interrupted"].as_bool(), report["invalid_paths"].as_u64()), (Some(false), Some(0)));
    assert!((report["relative_error"].as_f64().unwrap() - f64::from(provenance.relative_error)).abs() < 1e-6);
    assert!(light.hits.iter().all(|&n| n == 40) && light.standard_error.iter().all(|e| e.is_finite()));
    // √(ΣA·se²/ΣA·𝓛(E)²) over what does not emit.
    let luminance = |e: [f32; 3]| e.iter().zip([0.2126, 0.7152, 0.0722]).map(|(e, w)| f64::from(*e) * w).sum::<f64>();
    let (mut noise, mut square) = (0.0, 0.0);
    for p in (0..light.len()).filter(|&p| !light.emits[p]) {
        noise += light.area[p] * f64::from(light.standard_error[p]).powi(2);
        square += light.area[p] * luminance(light.irradiance[p]).powi(2);
    }
    assert!(((noise / square).sqrt() / f64::from(provenance.relative_error) - 1.0).abs() < 1e-4);
}

#[test]
fn a_reference_stops_at_its_error_or_in_time() {
    let place = Place::new();
    let report = reference(&place, &["cornell", "-o", "a.twin", "--error", "10%", "--json"]).json();
    assert!(report["relative_error"].as_f64().unwrap() <= 0.1, "{report}");
    assert!((16..5000).contains(&report["paths_per_patch"].as_u64().unwrap()), "{report}");
    let report = reference(&place, &["cornell", "-o", "b.twin", "--time", "0.3", "--json"]).json();
    assert!(report["seconds"]["trace"].as_f64().unwrap() >= 0.3, "{report}");
    let quiet = reference(&place, &["cornell", "-o", "c.twin", "--paths", "2", "--quiet"]);
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn references_repeat_themselves_on_any_number_of_threads() {
    let place = Place::new();
    let bytes = |threads, seed| {
        reference(&place, &["cornell", "-o", "a.twin", "--paths", "4", "--threads", threads, "--seed", seed]);
        place.read("a.twin")
    };
    let one = bytes("1", "1");
    assert!(bytes("3", "1") == one);
    assert!(bytes("3", "2") != one);
}

#[test]
fn a_traced_picture_is_a_picture() {
    let place = Place::new();
    let small = ["render", "cornell", "--method", "path", "--size", "64x48"];
    let run = place.done(&[&small[..], &["--samples", "8", "--json"]].concat());
    shows_something(&place.read("cornell.png"));
    let report = run.json();
    assert_eq!((report["method"].as_str(), report["paths"].as_u64()), (Some("path"), Some(8 * 64 * 48)));
    assert_eq!((report["paths_per_pixel"].as_u64(), report["invalid_paths"].as_u64()), (Some(8), Some(0)));
    assert!((0.01..1.0).contains(&report["relative_error"].as_f64().unwrap()), "{report}");
    assert!(run.stderr.contains("8 paths per pixel"), "{}", run.stderr);
    let report = place.done(&[&small[..], &["--time", "0.3", "--json"]].concat()).json();
    assert!(report["seconds"]["trace"].as_f64().unwrap() >= 0.3, "{report}");
    // The same exposure: all methods see the same box, up to noise.
    for method in ["gather", "patches"] {
        let other = place.done(&["render", "cornell", "--method", method, "--size", "64x48", "--json"]).json();
        assert_eq!(other["method"], method);
        let difference = other["exposure_ev"].as_f64().unwrap() - report["exposure_ev"].as_f64().unwrap();
        assert!(difference.abs() < 0.2, "{method}: {difference} stops apart");
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let place = Place::new();
    for (args, word) in [
        (&["render", "cornell", "--method", "path", "--rays", "1000"][..], "--rays"),
        (&["render", "cornell", "--method", "path", "--preset", "paper"], "--preset paper"),
        (&["render", "cornell", "--method", "path", "--flat"], "--flat"),
        (&["reference", "cornell", "-o", "a.png"], ".twin"),
        (&["reference", "cornell", "--error", "2"], "2% or 0.02"),
        (&["reference", "cornell", "--error", "2%", "--paths", "3"], "--paths"),
        (&["reference", "nowhere.glb"], "no such file"),
    ] {
        let run = place.run(args);
        assert_eq!(run.code, Some(2), "{args:?}");
        assert!(run.stderr.contains(word), "{args:?}: {}", run.stderr);
    }
    assert!(place.files().is_empty());
}
