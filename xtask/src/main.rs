//! Chores: `cargo xtask ci` and its parts; `cargo xtask validate`; `cargo xtask bench`;
//! `cargo xtask sanitize`, `cargo xtask bevy`. No tool has to be installed beside Rust itself, but for these two, `mpi`, `web`
//! and `three`.
//!
//! One line a step; the first step that fails ends the run and is named. `structure` holds the checks that need no
//! compiler, which are tests of this crate as well.

mod json;
mod sanitize;
mod structure;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

/// A step: its name, what it does in a line, and the function.
type Step = (&'static str, &'static str, fn() -> Result<(), String>);

const STEPS: &[Step] = &[
    ("fmt", "cargo fmt --check", fmt),
    ("clippy", "cargo clippy, warnings are errors", clippy),
    ("docs", "cargo doc, warnings are errors", docs),
    ("examples", "every example of crates/twinray runs", examples),
    ("deps", "which crate may depend on which; links and names in the documents", deps),
    (
        "mpi",
        "ranks of an MPI, installed where it is missing, give the bits of one process: [RAYS [SCENE:PATCHES...]]",
        mpi,
    ),
    (
        "web",
        "the walk-through's page: format, types, tests in a browser; Node and Chromium are installed where missing",
        web,
    ),
    ("three", "baked light as three.js shows it in a browser, which is installed where missing", three),
];

/// Not a part of `ci`: it takes minutes, and its comparisons are tests of `crates/validate` already.
const VALIDATE: Step = ("validate", "writes docs/validation.md and its plots anew", validate);

/// Not a part of `ci` either: its figures are those of an idle machine, and nothing in it can fail.
const BENCH: Step = ("bench", "measures, writes docs/performance.md: [--quick] [PART...]", bench);

/// Nor this, which needs a nightly compiler.
const SANITIZE: Step =
    ("sanitize", "the code with `unsafe` under Miri and AddressSanitizer; needs a nightly", sanitize::run);

/// Nor this: Bevy wants a newer compiler than the rest, and takes longer to compile than all of `ci`.
const BEVY: Step =
    ("bevy", "baked light as Bevy shows it on a Vulkan driver in software, installed where missing", bevy);

fn main() -> ExitCode {
    let wish = std::env::args().nth(1).unwrap_or_default();
    let steps: Vec<&Step> = STEPS.iter().filter(|(name, ..)| wish == "ci" || wish == *name).collect();
    let apart = [&VALIDATE, &BENCH, &SANITIZE, &BEVY];
    let steps = apart.iter().find(|(name, ..)| wish == *name).map_or(steps, |step| vec![*step]);
    if steps.is_empty() {
        eprintln!("usage: cargo xtask COMMAND\n\n  ci         all of these, in this order");
        STEPS.iter().for_each(|(name, what, _)| eprintln!("  {name:10} {what}"));
        eprintln!();
        apart.iter().for_each(|(name, what, _)| eprintln!("  {name:10} {what}"));
        return ExitCode::from(2);
    }
    for (name, _, run) in steps {
        let start = Instant::now();
        if let Err(message) = run() {
            eprintln!("xtask {name}: FAILED: {message}");
            return ExitCode::FAILURE;
        }
        eprintln!("xtask {name}: ok ({:.0} s)", start.elapsed().as_secs_f64());
    }
    ExitCode::SUCCESS
}

fn fmt() -> Result<(), String> {
    run(cargo().args(["fmt", "--all", "--check"]))
}

fn clippy() -> Result<(), String> {
    run(cargo().args(["clippy", "--quiet", "--workspace", "--all-targets", "--", "-D", "warnings"]))
}

fn docs() -> Result<(), String> {
    run(cargo().args(["doc", "--quiet", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Runs every example in an empty folder, so that what it writes is not left behind.
fn examples() -> Result<(), String> {
    let mut names = Vec::new();
    for path in structure::files(&structure::root().join("crates/twinray/examples"), "rs")? {
        names.extend(path.file_stem().map(|s| s.to_string_lossy().into_owned()));
    }
    let built = programs()?;
    let folder = Folder::new()?;
    for name in names {
        eprintln!("xtask examples: {name}");
        run(Command::new(built.join("examples").join(&name)).current_dir(&folder.0))?;
    }
    Ok(())
}

/// The folder of the programs that `cargo test` builds, optimised and with all their checks: the command and the examples
/// are not compiled a second time.
fn programs() -> Result<PathBuf, String> {
    run(cargo().args(["test", "--quiet", "--workspace", "--no-run"]))?;
    // A relative target folder is meant from the root.
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    Ok(structure::root().join(target).join("debug"))
}

fn validate() -> Result<(), String> {
    run(cargo().args(["run", "--quiet", "--release", "--package", "twinray-validate"]))
}

/// Whatever follows on the command line is for the benchmark.
fn bench() -> Result<(), String> {
    let mut command = cargo();
    command.args(["run", "--quiet", "--release", "--package", "twinray-bench", "--"]);
    run(command.args(std::env::args_os().skip(2)))
}

/// Whatever follows on the command line is for the check.
fn mpi() -> Result<(), String> {
    let mut command = Command::new("bash");
    command.arg("mpi/test.sh").args(std::env::args_os().skip(2)).current_dir(structure::root());
    run(&mut command)?;
    // A workspace of its own, which the steps of `ci` do not see.
    let there = ["--manifest-path", "mpi/Cargo.toml"];
    run(cargo().arg("fmt").args(there).arg("--check"))?;
    run(cargo().args(["clippy", "--quiet", "--release", "--all-targets"]).args(there).args(["--", "-D", "warnings"]))
}

fn web() -> Result<(), String> {
    in_browser("crates/view/web/check.sh")
}

fn three() -> Result<(), String> {
    in_browser("engines/three/check.sh")
}

fn in_browser(script: &str) -> Result<(), String> {
    let command = programs()?.join(format!("twinray{}", std::env::consts::EXE_SUFFIX));
    run(Command::new("bash").arg(script).env("TWINRAY", command).current_dir(structure::root()))
}

/// The script takes the compiler that Bevy wants, and does not see the one of this program's cargo.
fn bevy() -> Result<(), String> {
    run(Command::new("bash").arg("engines/bevy/check.sh").current_dir(structure::root()))
}

fn deps() -> Result<(), String> {
    structure::dependencies_follow_the_table()?;
    structure::borrowed_crates_have_their_reasons()?;
    structure::libraries_touch_nothing_outside()?;
    structure::links_lead_somewhere()?;
    structure::the_example_is_the_doctest()?;
    structure::names_in_documents_exist()
}

/// The cargo that runs this program, at the root of the workspace.
fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(structure::root());
    command
}

fn run(command: &mut Command) -> Result<(), String> {
    let words = command.get_args().map(|a| a.to_string_lossy());
    let program = Path::new(command.get_program()).file_stem().unwrap_or_default().to_string_lossy();
    let shown = format!("{program} {}", words.collect::<Vec<_>>().join(" "));
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{shown} ended with {status}")),
        Err(error) => Err(format!("{shown} could not be started: {error}")),
    }
}

/// A folder that is there as long as the value.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self, String> {
        let path = std::env::temp_dir().join(format!("twinray-xtask-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(Path::new(&self.0));
    }
}
