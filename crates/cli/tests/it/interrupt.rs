//! Ctrl-C keeps what there is.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use twinray::format::{Limits, read_solution};

use crate::support::{Place, shows_something};

#[test]
fn ctrl_c_writes_the_picture_and_says_so() {
    let place = Place::new();
    let render = ["render", "cornell", "-o", "kept.png", "--patches", "2000", "--size", "64x48", "--time", "600"];
    interrupt(&place, &render);
    assert_eq!(place.files(), ["kept.png"]);
    shows_something(&place.read("kept.png"));
    interrupt(&place, &[&render[..], &["--method", "path"]].concat());
    assert_eq!(place.files(), ["kept.png"]);
    shows_something(&place.read("kept.png"));
}

#[test]
fn ctrl_c_writes_the_solution() {
    let place = Place::new();
    interrupt(&place, &["solve", "cornell", "-o", "kept.twin", "--patches", "2000", "--time", "600"]);
    assert_eq!(place.files(), ["kept.twin"]);
    let kept = read_solution("kept.twin", place.read("kept.twin").leak(), &Limits::default()).unwrap();
    assert!(kept.provenance.rays >= kept.light.len() as u64);
}

#[test]
fn ctrl_c_writes_the_reference() {
    let place = Place::new();
    interrupt(&place, &["reference", "cornell", "-o", "kept.twin", "--patches", "2000", "--error", "0.0001%"]);
    assert_eq!(place.files(), ["kept.twin"]);
    let kept = read_solution("kept.twin", place.read("kept.twin").leak(), &Limits::default()).unwrap();
    assert!(kept.provenance.rays >= kept.light.len() as u64);
}

/// Light that was solved is not lost when its bake is stopped, and the bake of what is kept is the one that was stopped.
#[test]
fn ctrl_c_keeps_the_light_of_a_bake() {
    let place = Place::new();
    let solve = ["--patches", "2000", "--rays", "200000", "--seed", "7"];
    let bake = ["-o", "lit.glb", "--page-size", "256"];
    let slow = ["--quality", "high", "--texel-rays", "4096"];
    // Light of another bake is not replaced.
    place.write("lit.twin", "light of another bake");
    for (scene, args, files) in [
        ("cornell", [&bake[..], &solve, &slow].concat(), ["lit-2.twin", "lit.twin"]),
        ("lit-2.twin", [&bake[..], &slow].concat(), ["lit-2.twin", "lit.twin"]),
    ] {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin!("twinray"))
            .args([&["bake", scene], &args[..]].concat())
            .current_dir(place.path(""))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
        assert!(lines.any(|line| line.contains("baking")), "no progress");
        send(child.id(), "-INT");
        let said = lines.collect::<Vec<_>>().join("\n");
        assert_eq!(child.wait().unwrap().code(), Some(130), "{said}");
        assert!(said.contains("stopping") && said.contains("light"), "{said}");
        let mut found = place.files();
        found.sort();
        assert_eq!(found, files, "{said}");
    }
    let few = ["--quality", "high", "--texel-rays", "4"];
    place.done(&[&["bake", "lit-2.twin"], &bake[..], &few].concat());
    let kept = place.read("lit.glb");
    place.done(&[&["bake", "cornell"], &bake[..], &solve, &few].concat());
    assert!(place.read("lit.glb") == kept);
}

/// Finished frames stay, none is half, and the message says how to go on.
#[test]
fn ctrl_c_leaves_whole_frames() {
    let place = Place::new();
    let keys = r#"{ "keys": [{ "time": 0, "camera": 0 }, { "time": 100, "camera": 0, "fov": 50 }] }"#;
    place.write("long.json", keys);
    let args = ["render", "cornell", "--path", "long.json", "-o", "f%d.png", "--patches", "500", "--rays", "50000"];
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("twinray"))
        .args([&args[..], &["--size", "64x48", "--spp", "16"]].concat())
        .current_dir(place.path(""))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("% ") && line.contains("of 2401")), "no progress");
    send(child.id(), "-INT");
    let said: Vec<String> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let frames = place.files().len() - 1;
    assert!(frames > 0);
    (0..frames).for_each(|k| shows_something(&place.read(&format!("f{k}.png"))));
    let hint = format!("{frames} of 2401 frames are done; --frames {frames}..2401 makes the rest");
    assert!(said.iter().any(|line| line.contains(&hint)), "{hint} is missing in {said:?}");
}

/// What job schedulers and service managers send.
#[test]
fn sigterm_writes_the_solution() {
    let place = Place::new();
    let solve = ["solve", "cornell", "-o", "kept.twin", "--patches", "2000", "--time", "600", "--checkpoint", "never"];
    signal(&place, &solve, "-TERM", 143);
    assert_eq!(place.files(), ["kept.twin"]);
    let kept = read_solution("kept.twin", place.read("kept.twin").leak(), &Limits::default()).unwrap();
    assert!(kept.provenance.rays >= kept.light.len() as u64 && kept.record.unwrap().can_go_on());
}

/// What whoever started the program wants ignored stays ignored: `nohup` lets a solve outlive its terminal.
#[cfg(target_os = "linux")]
#[test]
fn nohup_is_heeded() {
    let place = Place::new();
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' HUP; exec \"$@\"", "sh"]).arg(assert_cmd::cargo::cargo_bin!("twinray"));
    shell.args(["solve", "cornell", "-o", "kept.twin", "--patches", "300", "--time", "600"]);
    let mut child = shell.current_dir(place.path("")).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains('%')), "no progress");
    send(child.id(), "-HUP");
    // The next line of progress comes two seconds later.
    assert!(lines.next().unwrap().contains('%'));
    send(child.id(), "-TERM");
    lines.for_each(drop);
    assert_eq!(child.wait().unwrap().code(), Some(143));
}

/// The second Ctrl-C does not wait for anything, and leaves what was there, and nothing else.
#[test]
fn a_second_ctrl_c_stops_at_once() {
    let place = Place::new();
    // Batches of the paper preset are whole, and these take seconds.
    let batch = ["--patches", "100", "--preset", "paper", "--batch", "3000000"];
    place.done(&[&["solve", "cornell", "-o", "kept.twin", "--rays", "1"], &batch[..]].concat());
    let before = place.read("kept.twin");
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("twinray"))
        .args(["solve", "kept.twin", "--rays", "1e12", "--checkpoint", "0.001s"])
        .current_dir(place.path(""))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    let mut wait_for = |word: &str| assert!(lines.any(|line| line.contains(word)), "no {word:?}");
    wait_for("triangles");
    send(child.id(), "-INT");
    wait_for("the same again stops at once");
    send(child.id(), "-INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(place.files(), ["kept.twin"], "nothing is left beside");
    assert!(place.read("kept.twin") == before);
}

fn send(process: u32, signal: &str) {
    assert!(Command::new("kill").args([signal, &process.to_string()]).status().unwrap().success());
}

/// Runs the command until it tells of progress, then interrupts it.
fn interrupt(place: &Place, args: &[&str]) {
    signal(place, args, "-INT", 130);
}

/// Runs the command until it tells of progress, then sends a signal; it must end with a code.
fn signal(place: &Place, args: &[&str], signal: &str, code: i32) {
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("twinray"))
        .args(args)
        .current_dir(place.path(""))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let stderr = BufReader::new(child.stderr.take().unwrap());
    let (sender, lines) = mpsc::channel();
    let reader = std::thread::spawn(move || {
        for line in stderr.lines().map_while(Result::ok) {
            let _ = sender.send(line);
        }
    });
    // Progress comes in lines where standard error is no terminal; the first says that the solve has begun.
    let patience = Instant::now() + Duration::from_secs(30);
    let mut said = Vec::new();
    while !said.iter().any(|line: &String| line.contains('%')) && Instant::now() < patience {
        said.extend(lines.recv_timeout(Duration::from_millis(100)));
    }
    send(child.id(), signal);
    let interrupted = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if interrupted.elapsed() > Duration::from_secs(60) => {
                let _ = child.kill();
                panic!("still running a minute after the interrupt: {said:?}");
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    reader.join().unwrap();
    said.extend(lines.try_iter());
    assert_eq!(status.code(), Some(code), "{said:?}");
    assert!(said.iter().any(|line| line.contains("stopping at the end of this wave")), "{said:?}");
}
