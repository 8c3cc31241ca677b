//! The same scene, settings and seed give the same bytes, whatever the number of threads.

use crate::support::Place;

#[test]
fn threads_change_no_byte_and_seeds_do() {
    let place = Place::new();
    for (scene, name) in [("hall", "a.png"), ("cornell", "a.exr")] {
        let picture = |threads: &str, seed: &str| {
            place.render(&[scene, "-o", name, "--threads", threads, "--seed", seed]);
            place.read(name)
        };
        let one = picture("1", "5");
        for threads in ["2", "3", "8"] {
            assert!(picture(threads, "5") == one, "{scene}: {threads} threads differ from 1");
        }
        assert!(picture("2", "6") != one, "{scene}: another seed must give another picture");
    }
}

#[test]
fn the_paper_preset_repeats_itself_too() {
    let place = Place::new();
    let picture = |threads: &str| {
        place.render(&["hall", "-o", "a.png", "--preset", "paper", "--threads", threads]);
        place.read("a.png")
    };
    assert!(picture("1") == picture("8"));
}

#[test]
fn written_scenes_repeat_themselves() {
    let place = Place::new();
    for name in ["a.glb", "b.glb"] {
        place.done(&["scene", "doorway", "-o", name]);
    }
    assert!(place.read("a.glb") == place.read("b.glb"));
}
