//! `view` and exported walk-throughs. What a browser makes of them is tested by `cargo xtask web`.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

use crate::support::Place;

const TOKEN: &str = "0123456789abcdefXY";

/// A server that has told its address.
struct Viewer {
    child: Child,
    address: String,
}

impl Viewer {
    fn start(place: &Place, args: &[&str]) -> Self {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin!("twinray"))
            .arg("view")
            .args(args)
            .args(["--token", TOKEN, "--json"])
            .current_dir(place.path(""))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let told: serde_json::Value = serde_json::from_str(&line).unwrap();
        let url = told["url"].as_str().unwrap();
        let address = url.strip_prefix("http://").and_then(|rest| rest.strip_suffix(&format!("/{TOKEN}/"))).unwrap();
        Self { child, address: address.to_owned() }
    }

    /// The body of what is asked for.
    fn get(&self, file: &str) -> Vec<u8> {
        self.ask("GET", file)
    }

    fn ask(&self, method: &str, file: &str) -> Vec<u8> {
        let mut connection = TcpStream::connect(&self.address).unwrap();
        let address = &self.address;
        write!(connection, "{method} /{TOKEN}/{file} HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
        let mut reader = BufReader::new(connection);
        let (mut line, mut length) = (String::new(), 0);
        while reader.read_line(&mut line).unwrap() > 2 {
            length = line.strip_prefix("Content-Length: ").map_or(length, |n| n.trim().parse().unwrap());
            line.clear();
        }
        let mut body = vec![0; length];
        reader.read_exact(&mut body).unwrap();
        body
    }

    fn status(&self) -> serde_json::Value {
        serde_json::from_slice(&self.get("status")).unwrap()
    }

    /// Ends it by a signal; its exit code.
    fn end(mut self) -> Option<i32> {
        Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        self.child.wait().unwrap().code()
    }
}

#[test]
fn a_scene_is_served_while_it_is_solved_and_kept() {
    let place = Place::new();
    let solve = ["cornell", "--patches", "2000", "--rays", "100000"];
    let viewer = Viewer::start(&place, &[&solve[..], &["-o", "kept.twin"]].concat());
    assert!(viewer.get("").starts_with(b"<!doctype html>"));
    assert!(viewer.get("scene").starts_with(b"twinwalk"));
    assert!(viewer.get("light?after=0").starts_with(b"twinwalk"));
    while viewer.status()["state"] != "finished" {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(viewer.status()["rays"].as_u64().unwrap() >= 100_000);
    assert_eq!(viewer.end(), Some(0));
    // The same bytes as without anybody who looks.
    place.done(&[&["solve"], &solve[..], &["-o", "solved.twin"]].concat());
    assert_eq!(place.read("kept.twin"), place.read("solved.twin"));
}

/// A pause takes nothing of the time that was asked for.
#[test]
fn a_paused_solve_has_its_whole_time() {
    let place = Place::new();
    let viewer = Viewer::start(&place, &["cornell", "--patches", "2000", "--time", "1.5"]);
    viewer.ask("POST", "pause");
    while viewer.status()["state"] != "paused" {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let before = viewer.status();
    std::thread::sleep(std::time::Duration::from_millis(2000));
    assert_eq!(viewer.status()["rays"], before["rays"]);
    viewer.ask("POST", "resume");
    while viewer.status()["state"] != "finished" {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let after = viewer.status();
    assert!(after["rays"].as_u64() > before["rays"].as_u64(), "{before}, then {after}");
    let seconds = after["seconds"].as_f64().unwrap();
    assert!(seconds >= 1.5, "{after}");
    assert_eq!(viewer.end(), Some(0));
}

#[test]
fn an_address_that_nobody_can_be_told_is_an_error() {
    let place = Place::new();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    let Ok(full) = full else { return eprintln!("skipped: this system has no /dev/full") };
    let run = Command::new(assert_cmd::cargo::cargo_bin!("twinray"))
        .args(["view", "plates", "--rays", "1000"])
        .current_dir(place.path(""))
        .stdout(full)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{said}");
    assert!(said.contains("standard output") && !said.contains("panicked"), "{said}");
}

#[test]
fn a_file_s_light_is_served_at_once() {
    let place = Place::new();
    place.done(&["solve", "plates", "--rays", "50000", "-o", "plates.twin"]);
    let viewer = Viewer::start(&place, &["plates.twin"]);
    assert!(viewer.get("light?after=0").starts_with(b"twinwalk"));
    assert_eq!(viewer.end(), Some(0));
}

#[test]
fn an_exported_walk_is_one_file_of_the_same_bytes_each_time() {
    let place = Place::new();
    place.done(&["solve", "hall", "--patches", "10000", "--rays", "50000", "-o", "hall.twin"]);
    place.done(&["export", "hall.twin", "-o", "a.html"]);
    place.done(&["export", "hall.twin", "-o", "b.html", "--threads", "1"]);
    assert_eq!(place.read("a.html"), place.read("b.html"));
    let text = String::from_utf8(place.read("a.html")).unwrap();
    assert!(text.starts_with("<!doctype html>") && text.contains("id=\"walk-light\""));
}

#[test]
fn wishes_that_make_no_sense_are_refused() {
    let place = Place::new();
    place.done(&["solve", "plates", "--rays", "50000", "-o", "plates.twin"]);
    for (args, words) in [
        (&["cornell", "--token", "short"][..], "at least 16 letters"),
        (&["cornell", "--token", "0123456789abcde/"], "at least 16 letters"),
        (&["cornell", "-o", "light.png"], "ends in .twin"),
        (&["plates.twin", "-o", "again.twin"], "is kept already"),
        (&["plates.twin", "--rays", "5"], "is solved already"),
        (&["nowhere.glb"], "no such file"),
    ] {
        let run = place.run(&[&["view"], args].concat());
        assert_eq!(run.code, Some(2), "{args:?}");
        assert!(run.stderr.contains(words), "{args:?}: {}", run.stderr);
    }
}
