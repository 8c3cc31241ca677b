//! Nothing is lost: solves that go on with files, checkpoints, kills, full disks, damaged and foreign files.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use twinray::format::{Limits, SolutionFile, StoredSolution, read_solution, write_solution};

use crate::support::{FLOOR, Place};

const CUT: [&str; 2] = ["--patches", "500"];

fn rays(place: &Place, name: &str) -> u64 {
    let bytes = place.read(name);
    let stored = StoredSolution::open(name, &bytes, &Limits::default()).unwrap();
    stored.verify().unwrap();
    stored.provenance().rays
}

/// The message of a run that must be refused contains each of `words`, and changes no file.
#[track_caller]
fn refused(place: &Place, args: &[&str], words: &[&str]) {
    let before: Vec<_> = place.files().into_iter().map(|name| (place.read(&name), name)).collect();
    let run = place.run(args);
    assert_eq!(run.code, Some(2), "{args:?}: {}", run.stderr);
    assert!(words.iter().all(|word| run.stderr.contains(word)), "{args:?}: {words:?} in {}", run.stderr);
    let after: Vec<_> = place.files().into_iter().map(|name| (place.read(&name), name)).collect();
    assert!(before == after, "{args:?} changed a file");
}

#[test]
fn a_solve_that_goes_on_is_the_unbroken_one() {
    let place = Place::new();
    for preset in ["default", "paper"] {
        let solve = |args: &[&str]| place.done(&[&["solve"], args, &["--preset", preset]].concat());
        let fresh = |rays, name| solve(&[&["cornell", "-o", name, "--rays", rays, "--overwrite"][..], &CUT].concat());
        fresh("300k", "unbroken.twin");
        fresh("60k", "broken.twin");
        solve(&["broken.twin", "--rays", "150k", "--threads", "1", "--seed", "1"]);
        // Elsewhere, and with checkpoints all the way.
        solve(&["broken.twin", "--rays", "300k", "-o", "else.twin", "--checkpoint", "0.001s", "--overwrite"]);
        assert!(place.read("else.twin") == place.read("unbroken.twin"), "{preset}");
        assert!(rays(&place, "broken.twin") < rays(&place, "else.twin"));
        // A goal that is reached leaves the file as it is, to the bit.
        let run = place.done(&["solve", "else.twin", "--rays", "1000"]);
        assert!(run.stderr.contains("as good as asked for"), "{}", run.stderr);
        assert!(place.read("else.twin") == place.read("unbroken.twin"), "{preset}");
    }
    let report = place.done(&["solve", "unbroken.twin", "--error", "3%", "--json"]).json();
    assert!(report["relative_error"].as_f64().unwrap() <= 0.03 && report["rays_before"].as_u64().unwrap() >= 300_000);
}

/// Whatever stands for a scene in other commands is the scene.
#[test]
fn a_solution_stands_for_its_scene() {
    let place = Place::new();
    let small = ["--size", "64x48", "--camera", "0"];
    let cut = [&CUT[..], &["--rays", "100k"]].concat();
    place.done(&[&["solve", "cornell"][..], &cut].concat());
    place.done(&[&["render", "cornell", "-o", "solved.png"][..], &cut, &small].concat());
    let run = place.done(&[&["render", "cornell.twin", "-o", "kept.png"][..], &small].concat());
    assert!(run.stderr.contains("rays read in"), "{}", run.stderr);
    assert!(place.read("kept.png") == place.read("solved.png"), "the picture of a file is that of its solve");
    // Another camera needs no other solve.
    let there = ["--eye", "0.1,0.4,-0.5", "--target", "0.3,0.1,0.3", "--size", "64x48"];
    place.done(&[&["render", "cornell.twin", "-o", "there.png"][..], &there].concat());
    place.done(&["render", "cornell.twin", "-o", "paths.png", "--method", "path", "--samples", "1", "--size", "32x32"]);
    place.done(&["reference", "cornell.twin", "--paths", "4", "-o", "reference.twin"]);
    place.done(&["compare", "cornell.twin", "reference.twin"]);
    place.done(&["scene", "cornell.twin", "-o", "cornell.glb"]);
    place.done(&["info", "cornell.twin"]);
    refused(&place, &["render", "cornell.twin", "--rays", "1M"], &["is solved already", "twinray solve cornell.twin"]);
    refused(&place, &["render", "reference.twin"], &["is a reference"]);
    refused(&place, &["solve", "reference.twin", "--rays", "1M"], &["is a reference"]);
    refused(&place, &["render", "cornell.glb", "--scene-file", "x.glb"], &["cornell.glb is none"]);
}

/// Scenes are found from where the solution is, wherever one stands, and where the user says.
#[test]
fn scenes_are_found_again_or_asked_for() {
    let place = Place::new();
    std::fs::create_dir(place.path("a")).unwrap();
    place.write("a/floor.obj", FLOOR);
    place.write("a/light.twin", "");
    let solve = ["solve", "a/floor.obj", "--unit", "cm", "--rays", "20k", "-o", "light.twin"];
    place.done(&[&solve[..], &CUT].concat());
    place.done(&["solve", "light.twin", "--rays", "40k"]);
    let info = place.done(&["info", "light.twin", "--json"]).json();
    assert_eq!((&info["source"]["file"], &info["source"]["metres_per_unit"]), (&"a/floor.obj".into(), &0.01.into()));
    // The same file in another folder has the same bytes but for the way to its scene.
    std::fs::rename(place.path("light.twin"), place.path("a/light.twin")).unwrap();
    refused_in_words(&place, "a/light.twin", &["a/floor.obj, seen from its folder", "--scene-file"]);
    place.done(&["solve", "a/light.twin", "--scene-file", "a/floor.obj", "--rays", "60k"]);
    place.done(&["solve", "a/light.twin", "--rays", "80k"]);
    // A scene that has changed is another.
    place.write("a/floor.obj", FLOOR.replace("v 1 0 1", "v 1.5 0 1"));
    refused_in_words(&place, "a/light.twin", &["another scene", "fingerprint", "--scene-file"]);
    place.write("a/floor.obj", FLOOR);
    for (option, value) in
        [("--seed", "5"), ("--patches", "90"), ("--unit", "mm"), ("--preset", "paper"), ("--part", "1/2")]
    {
        let run = place.run(&["solve", "a/light.twin", option, value, "--rays", "90k"]);
        assert_eq!(run.code, Some(2), "{}", run.stderr);
        assert!(run.stderr.contains(&format!("another {option}")), "{}", run.stderr);
    }
}

fn refused_in_words(place: &Place, name: &str, words: &[&str]) {
    let before = place.read(name);
    let run = place.run(&["solve", name, "--rays", "90k"]);
    assert_eq!(run.code, Some(2), "{}", run.stderr);
    assert!(words.iter().all(|word| run.stderr.contains(word)), "{words:?} in {}", run.stderr);
    assert!(before == place.read(name));
}

#[test]
fn damaged_files_are_named() {
    let place = Place::new();
    place.done(&[&["solve", "cornell", "-o", "good.twin", "--rays", "20k"][..], &CUT].concat());
    let good = place.read("good.twin");
    let flipped = |at: usize| {
        let mut bytes = good.clone();
        bytes[at] ^= 16;
        bytes
    };
    for (bytes, words) in [
        (good[..good.len() / 2].to_vec(), &["cut off"][..]),
        (good[..20].to_vec(), &["cut off"]),
        (Vec::new(), &["is no solution file"]),
        (flipped(good.len() - 20), &["section", "has been changed", "checksum"]),
        (flipped(70), &["table of sections has been changed"]),
        (flipped(8), &["version", "reads version 3"]),
    ] {
        place.write("bad.twin", bytes);
        for command in
            [&["solve", "bad.twin", "--rays", "1M"][..], &["info", "bad.twin"], &["compare", "bad.twin", "good.twin"]]
        {
            refused(&place, command, &[words, &["bad.twin"]].concat());
        }
    }
}

/// A file that is whole may still be written to do harm: to cut a scene into billions, to read what has no end, to wait for ever.
#[test]
fn hostile_headers_cost_nothing() {
    let place = Place::new();
    for (name, preset) in [("default.twin", "default"), ("paper.twin", "paper")] {
        place.done(&[&["solve", "cornell", "-o", name, "--rays", "20k", "--preset", preset][..], &CUT].concat());
    }
    let hostile = |name: &str, change: &dyn Fn(&mut SolutionFile)| {
        let bytes = place.read(name);
        let mut file = read_solution(name, &bytes, &Limits::default()).unwrap();
        change(&mut file);
        let mut changed = Vec::new();
        write_solution(&file, &mut changed).unwrap();
        place.write("bad.twin", changed);
    };
    let goes_on = ["solve", "bad.twin", "--rays", "1M"];
    hostile("default.twin", &|file| file.provenance.source.patches = Some(2_000_000_000));
    refused(&place, &goes_on, &["bad.twin", "patches", "one of them has changed"]);
    hostile("default.twin", &|file| file.provenance.source.file = "/dev/zero".into());
    refused(&place, &goes_on, &["bad.twin", "/dev/zero", "--scene-file"]);
    hostile("paper.twin", &|file| {
        let batch = file.provenance.settings.iter_mut().find(|(key, _)| key == "batch").unwrap();
        batch.1 = u64::MAX.to_string();
    });
    refused(&place, &goes_on, &["bad.twin", "batch"]);
}

/// A disk that is full, or a limit on the size of files, costs a checkpoint or the end, never the file that is there.
#[test]
#[cfg(unix)]
fn a_full_disk_leaves_the_last_file() {
    let place = Place::new();
    place.done(&[&["solve", "cornell", "-o", "x.twin", "--rays", "20k"][..], &CUT].concat());
    let before = place.read("x.twin");
    // Blocks of 512 bytes; the file of 500 patches has about 40 kB. Writing beyond is an error where the signal is ignored.
    let script = "trap '' XFSZ; ulimit -f 20; exec \"$0\" solve x.twin --rays 200k --checkpoint 0.001s";
    let run = Command::new("sh")
        .args(["-c", script, assert_cmd::cargo::cargo_bin!("twinray").to_str().unwrap()])
        .current_dir(place.path(""))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{said}");
    for words in ["warning: no checkpoint: x.twin: writing failed", "error: x.twin: writing failed", "untouched"] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    assert_eq!(said.matches("no checkpoint").count(), 1, "once is enough: {said}");
    assert_eq!(place.files(), ["x.twin"]);
    assert!(place.read("x.twin") == before);
}

#[test]
#[cfg(unix)]
fn a_folder_that_is_read_only_is_named_before_the_work() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::new();
    let folder = place.path("locked");
    std::fs::create_dir(&folder).unwrap();
    std::fs::set_permissions(&folder, std::fs::Permissions::from_mode(0o555)).unwrap();
    if std::fs::write(folder.join("probe"), "").is_ok() {
        eprintln!("skipped: this user may write into read-only folders");
        return;
    }
    let run = place.run(&["solve", "cornell", "-o", "locked/x.twin", "--time", "600"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("locked/x.twin: cannot write into the folder locked"), "{}", run.stderr);
}

/// What may have taken long is not replaced by accident.
#[test]
fn light_of_the_same_scene_is_not_replaced() {
    let place = Place::new();
    let solve = ["solve", "cornell", "--rays", "20k", "--patches", "500"];
    place.done(&solve);
    refused(&place, &solve, &["cornell.twin: holds", "twinray solve cornell.twin", "--overwrite"]);
    refused(&place, &["solve", "cornell.twin", "--rays", "1M", "-o", "gone/x.twin"], &["no folder"]);
    place.done(&["solve", "cornell.twin", "--rays", "40k", "-o", "more.twin"]);
    refused(&place, &["solve", "cornell.twin", "--rays", "60k", "-o", "more.twin"], &["more.twin: holds"]);
    place.done(&["solve", "cornell.twin", "--rays", "60k", "-o", "more.twin", "--overwrite"]);
    place.done(&[&solve[..], &["--overwrite"]].concat());
    // Other scenes, and what is no solution, are replaced as by any program.
    place.write("cornell.twin", "notes");
    place.done(&solve);
    place.done(&["solve", "doorway", "-o", "cornell.twin", "--rays", "20k", "--patches", "900"]);
    refused(&place, &["merge", "more.twin", "-o", "more.twin"], &["more.twin: holds a solve", "another name"]);
}

/// Names in files command no terminal.
#[test]
#[cfg(unix)]
fn names_in_files_command_no_terminal() {
    let place = Place::new();
    place.write("floor.obj", FLOOR);
    std::fs::rename(place.path("floor.obj"), place.path("a\u{1b}[2Jb.obj")).unwrap();
    let run = place.done(&["solve", "a\u{1b}[2Jb.obj", "--patches", "90", "--rays", "20k", "-o", "x.twin"]);
    assert!(!run.stderr.contains('\u{1b}') && run.stderr.contains("a\\u{1b}[2Jb"), "{}", run.stderr);
    let info = place.done(&["info", "x.twin"]);
    assert!(!info.stdout.contains('\u{1b}') && info.stdout.contains("a\\u{1b}[2Jb.obj"), "{}", info.stdout);
}

/// Two programs never write to one place.
#[test]
fn a_file_that_is_being_written_is_let_alone() {
    let place = Place::new();
    let mut child = command(&place, &["solve", "cornell", "-o", "x.twin", "--time", "600"]).spawn().unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.map_while(Result::ok).any(|line| line.contains('%')), "no progress");
    let run = place.run(&["solve", "cornell", "-o", "x.twin", "--rays", "1k"]);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("x.twin: another twinray is writing it"), "{}", run.stderr);
    // Of the killed one a file may be left beside; the next takes it over.
    place.done(&[&["solve", "cornell", "-o", "x.twin", "--rays", "1k"][..], &CUT].concat());
    assert_eq!(place.files(), ["x.twin"]);
}

/// Who may read a result is the user's to say (`umask`), and not every file system lets it be said.
#[cfg(unix)]
#[test]
fn results_are_as_private_as_the_user_wants() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::new();
    for (umask, mode) in [("077", 0o600), ("022", 0o644)] {
        let mut shell = Command::new("sh");
        shell.args(["-c", "umask $0; exec \"$@\"", umask]).arg(assert_cmd::cargo::cargo_bin!("twinray"));
        shell.args(["scene", "cube", "-o", &format!("{umask}.glb")]).current_dir(place.path(""));
        assert!(shell.status().unwrap().success());
        let permissions = place.path(&format!("{umask}.glb")).metadata().unwrap().permissions();
        assert_eq!(permissions.mode() & 0o777, mode);
    }
}

/// Nor do they after checkpoints: whoever came first stays the only one to its end.
#[test]
fn a_file_with_checkpoints_is_let_alone() {
    let place = Place::new();
    let args = ["solve", "cornell", "-o", "x.twin", "--patches", "300", "--time", "600", "--checkpoint", "0.3s"];
    let mut child = command(&place, &args).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    for _ in 0..3 {
        assert!(lines.any(|line| line.starts_with("kept ")), "no checkpoint");
        let run = place.run(&["solve", "cornell", "-o", "x.twin", "--rays", "1k", "--seed", "2"]);
        assert!(run.stderr.contains("x.twin: another twinray is writing it"), "{}", run.stderr);
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(place.done(&["info", "x.twin"]).stdout.contains("seed 1"));
}

fn command(place: &Place, args: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("twinray"));
    command.args(args).current_dir(place.path("")).stderr(Stdio::piped());
    command
}

/// A log that nobody reads any more, as after `| head -1`, is no reason to lose a solve.
#[test]
fn a_reader_that_goes_away_costs_nothing() {
    let place = Place::new();
    let mut child =
        command(&place, &["solve", "cornell", "-o", "x.twin", "--patches", "300", "--time", "3"]).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().contains("patches"));
    drop(lines);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(rays(&place, "x.twin") > 0);
}

/// Killed without warning a hundred times, at any moment: the file is always whole, never behind what was said to be kept, and
/// in the end the same as if nothing had happened.
#[test]
fn a_hundred_kills_lose_nothing_that_was_kept() {
    let place = Place::new();
    let cut = ["--patches", "300", "--checkpoint", "0.01s", "--rays"];
    // How long it takes to come to the first checkpoint here and now.
    let start = Instant::now();
    let mut child =
        command(&place, &[&["solve", "cornell", "-o", "x.twin"], &cut[..], &["1e12"]].concat()).spawn().unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.map_while(Result::ok).any(|line| line.starts_with("kept ")));
    child.kill().unwrap();
    child.wait().unwrap();
    let window = 2 * start.elapsed().as_micros() as u64;
    std::fs::remove_file(place.path("x.twin")).unwrap();
    let mut random = 12_345u64;
    let (mut kept, mut went_on) = (0, 0);
    for kill in 0..100 {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let there = place.path("x.twin").exists();
        let mut args = if there { vec!["solve", "x.twin"] } else { vec!["solve", "cornell", "-o", "x.twin"] };
        args.extend(&cut[if there { 2 } else { 0 }..]);
        args.push("1e12");
        let mut child = command(&place, &args).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
        let mut said = kept;
        let mut listen = |line: String| match line.strip_prefix("kept ") {
            Some(rest) => {
                said = rest.split_once(' ').unwrap().0.parse().unwrap();
                true
            }
            None => false,
        };
        // Half of them at any moment from the start on, half soon after a checkpoint or two.
        let wait = match kill % 2 {
            0 => (random >> 33) % window,
            _ => {
                (0..1 + kill % 3).for_each(|_| drop(lines.by_ref().find(|line| listen(line.clone()))));
                (random >> 33) % (window / 4)
            }
        };
        std::thread::sleep(Duration::from_micros(wait));
        child.kill().unwrap();
        child.wait().unwrap();
        lines.for_each(|line| {
            listen(line);
        });
        if place.path("x.twin").exists() {
            let now = rays(&place, "x.twin");
            assert!(now >= said && now >= kept, "{now} rays, {said} were said to be kept, {kept} had been before");
            went_on += u32::from(now > kept);
            kept = now;
        }
    }
    assert!(went_on >= 50, "only {went_on} of 100 came to a checkpoint");
    let goal = (kept + 100_000).to_string();
    place.done(&["solve", "x.twin", "--rays", &goal]);
    place.done(&[&["solve", "cornell", "-o", "unbroken.twin"][..], &cut[..2], &["--rays", &goal]].concat());
    assert!(place.read("x.twin") == place.read("unbroken.twin"), "after {went_on} checkpoints");
    assert_eq!(place.files(), ["unbroken.twin", "x.twin"]);
}
