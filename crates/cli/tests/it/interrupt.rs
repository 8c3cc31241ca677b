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
    let kept = read_solution("kept.twin", &place.read("kept.twin"), &Limits::default()).unwrap();
    assert!(kept.provenance.rays >= kept.light.len() as u64);
}

#[test]
fn ctrl_c_writes_the_reference() {
    let place = Place::new();
    interrupt(&place, &["reference", "cornell", "-o", "kept.twin", "--patches", "2000", "--error", "0.0001%"]);
    assert_eq!(place.files(), ["kept.twin"]);
    let kept = read_solution("kept.twin", &place.read("kept.twin"), &Limits::default()).unwrap();
    assert!(kept.provenance.rays >= kept.light.len() as u64);
}

/// Runs the command until it tells of progress, then interrupts it.
fn interrupt(place: &Place, args: &[&str]) {
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
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupt.success());
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
    assert_eq!(status.code(), Some(130), "{said:?}");
    assert!(said.iter().any(|line| line.contains("stopping at the end of this wave")), "{said:?}");
}
