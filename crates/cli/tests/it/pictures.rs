//! `render`: what is written, where, and what is said about it.

use crate::support::{Place, SMALL, png, shows_something};

#[test]
fn a_built_in_scene_becomes_a_png() {
    let place = Place::new();
    place.render(&["cornell", "-o", "picture.png"]);
    shows_something(&place.read("picture.png"));
    assert_eq!(place.files(), ["picture.png"]);
}

#[test]
fn the_default_name_is_that_of_the_scene_in_this_folder() {
    let place = Place::new();
    place.render(&["cornell"]);
    assert_eq!(place.files(), ["cornell.png"]);
    std::fs::create_dir(place.path("sub")).unwrap();
    place.done(&["scene", "plates", "-o", "sub/two.plates.glb"]);
    place.render(&["sub/two.plates.glb"]);
    assert_eq!(place.files(), ["cornell.png", "sub", "two.plates.png"]);
}

#[test]
fn the_default_size_is_that_of_the_camera() {
    let place = Place::new();
    // The Cornell camera asks for a square; one sample a pixel is enough to count pixels.
    place.done(&["render", "cornell", "--patches", "500", "--rays", "1000", "--samples", "1"]);
    let (width, height, _) = png(&place.read("cornell.png"));
    assert_eq!((width, height), (512, 512));
}

#[test]
fn exr_holds_linear_radiance() {
    let place = Place::new();
    place.render(&["cornell", "-o", "picture.exr"]);
    let file = exr::prelude::read_first_rgba_layer_from_file(
        place.path("picture.exr"),
        |size, _| vec![vec![[0.0f32; 3]; size.width()]; size.height()],
        |pixels, at, (r, g, b, _): (f32, f32, f32, f32)| pixels[at.y()][at.x()] = [r, g, b],
    );
    let layer = file.unwrap().layer_data;
    assert_eq!((layer.size.width(), layer.size.height()), (64, 48));
    let values: Vec<f32> = layer.channel_data.pixels.into_iter().flatten().flatten().collect();
    assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0));
    // The lamp is in the picture, and it is no brighter than it is: radiance 17.2 in red.
    let brightest = values.iter().copied().fold(0.0, f32::max);
    assert!((1.0..17.5).contains(&brightest), "{brightest}");
}

#[test]
fn the_report_is_json_and_alone_on_standard_output() {
    let place = Place::new();
    let run = place.render(&["cornell", "--json", "--seed", "7"]);
    let report = run.json();
    assert!(report["rays"].as_u64().unwrap() >= 100_000);
    let error = report["relative_error"].as_f64().unwrap();
    assert!((0.001..0.5).contains(&error), "{error}");
    assert_eq!(report["seed"], 7);
    assert_eq!(report["output"], "cornell.png");
    assert_eq!(report["interrupted"], false);
    assert_eq!(report["invalid_deposits"], 0);
    assert!(report["warnings"].as_array().unwrap().is_empty());
    let power = &report["power"];
    // The lamp: .2126 · .737514 + .7152 · .492002 + .0722 · .131119 W.
    assert!((power["emitted"].as_f64().unwrap() - 0.518_14).abs() < 1e-4, "{power}");
    assert!(power["residual"].as_f64().unwrap().abs() < 0.02, "{power}");
    assert!(!run.stderr.is_empty(), "progress goes to standard error");
}

#[test]
fn quiet_is_quiet() {
    let place = Place::new();
    let run = place.render(&["cornell", "--quiet"]);
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
    shows_something(&place.read("cornell.png"));
}

#[test]
fn eye_and_target_override_the_camera() {
    let place = Place::new();
    let usual = place.report(&["cornell", "-o", "usual.png"]);
    let other = place.report(&["cornell", "-o", "other.png", "--eye", "0.1,0.4,-0.5", "--target", "0.3,0.1,0.3"]);
    assert_eq!((usual["camera"].as_str(), other["camera"].as_str()), (Some("main"), Some("command line")));
    shows_something(&place.read("other.png"));
    assert!(place.read("usual.png") != place.read("other.png"));
    // Lengths of the command line are in the scene's unit, as those of the file.
    place.report(&["cornell", "-o", "mm.png", "--unit", "mm", "--eye", "0.1,0.4,-0.5", "--target", "0.3,0.1,0.3"]);
    let difference = mean_difference(&place.read("mm.png"), &place.read("other.png"));
    assert!(difference < 2.0, "{difference}");
}

fn mean_difference(a: &[u8], b: &[u8]) -> f64 {
    let (a, b) = (png(a).2, png(b).2);
    let sum: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    sum / a.len() as f64
}

#[test]
fn cameras_go_by_name_and_by_index() {
    let place = Place::new();
    let main = place.report(&["hall-diffuse", "--camera", "0"]);
    let gallery = place.report(&["hall-diffuse", "--camera", "gallery"]);
    assert_eq!((main["camera"].as_str(), gallery["camera"].as_str()), (Some("main"), Some("gallery")));
    let gallery = place.report(&["hall-diffuse", "--camera", "1"]);
    assert_eq!(gallery["camera"].as_str(), Some("gallery"));
}

#[test]
fn every_preset_estimator_and_representation_makes_a_picture() {
    let place = Place::new();
    let mut variants: Vec<Vec<&str>> = vec![vec!["--preset", "paper"], vec!["--preset", "paper", "--batch", "64"]];
    variants.extend(["forward", "backward", "equal"].map(|e| vec!["--estimator", e]));
    variants.extend(["main", "sample", "both", "last"].map(|r| vec!["--representation", r]));
    variants.extend([vec!["--flat"], vec!["--lobes", "patches"], vec!["--tone", "none"], vec!["--exposure", "-1"]]);
    for variant in variants {
        // The hall is glossy.
        place.done(&[&["render", "hall", "-o", "p.png"], &SMALL[..], &variant].concat());
        let (_, _, rgb) = png(&place.read("p.png"));
        if !variant.contains(&"--exposure") {
            assert!(rgb.iter().any(|&c| c > 40), "{variant:?} is black");
            assert!(rgb.iter().any(|&c| c < 215), "{variant:?} is white");
        }
    }
}

#[test]
fn paper_preset_shoots_exactly_as_many_rays_as_asked() {
    let place = Place::new();
    let args = ["render", "cornell", "--preset", "paper", "--patches", "500", "--rays", "12345", "--size", "8x8"];
    let report = place.done(&[&args[..], &["--json"]].concat()).json();
    assert_eq!(report["rays"], 12345);
}

#[test]
fn a_file_in_its_place_is_replaced_as_a_whole() {
    let place = Place::new();
    place.write("cornell.png", "old");
    place.render(&["cornell"]);
    shows_something(&place.read("cornell.png"));
    assert_eq!(place.files(), ["cornell.png"]);
}
