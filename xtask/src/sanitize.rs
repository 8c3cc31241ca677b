//! `cargo xtask sanitize`: the tests of the code with `unsafe`, run by what sees undefined behaviour.
//!
//! Miri interprets: it sees every fault of the ray kernel's small tests, on the portable path and on that of AVX2, which
//! it knows; AVX-512 it does not. AddressSanitizer runs all tests of the kernel at full speed on whatever the processor
//! has, and those of the command that open solution files. Both need a nightly compiler.

use std::process::Command;

use crate::structure;

/// The instructions of the ray kernel's AVX2 path, which Miri believes in only if told at compile time.
const AVX2: &str = "-Ctarget-feature=+avx2,+bmi1,+bmi2,+lzcnt,+popcnt";
/// The queues of `rayon` break the older rules of borrowing, and its threads are never joined.
const MIRI: &str = "-Zmiri-tree-borrows -Zmiri-ignore-leaks";
const ASAN: &str = "-Zsanitizer=address";

/// Where the sanitizer is available; tests are built for a named target, so that build scripts are without it.
const ASAN_TARGETS: [&str; 3] = ["x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu", "aarch64-apple-darwin"];

/// Runs all, and says first what is missing.
pub fn run() -> Result<(), String> {
    let host = host()?;
    if !works(&["miri", "--version"]) {
        return Err("Miri is missing: rustup +nightly component add miri rust-src".to_owned());
    }
    miri("the portable path", "")?;
    if host.starts_with("x86_64") {
        miri("the AVX2 path", AVX2)?;
    }
    if !ASAN_TARGETS.contains(&host.as_str()) {
        eprintln!("xtask sanitize: no AddressSanitizer for {host}, left out");
        return Ok(());
    }
    address_sanitizer(&host, &["--package", "twinray-rays", "--lib", "--test", "it"])?;
    address_sanitizer(&host, &["--package", "twinray-cli", "--test", "it", "--", "solve::", "compare::"])
}

fn miri(what: &str, flags: &str) -> Result<(), String> {
    eprintln!("xtask sanitize: Miri, {what}");
    let mut command = nightly();
    command.args(["miri", "test", "--quiet", "--package", "twinray-rays", "--lib"]);
    command.env("MIRIFLAGS", MIRI).env("RUSTFLAGS", flags).env("CARGO_TARGET_DIR", folder("miri"));
    crate::run(&mut command)
}

fn address_sanitizer(host: &str, what: &[&str]) -> Result<(), String> {
    eprintln!("xtask sanitize: AddressSanitizer, {}", what[1]);
    let mut command = nightly();
    command.args(["test", "--quiet", "--target", host]).args(what);
    command.env("RUSTFLAGS", ASAN).env("CARGO_TARGET_DIR", folder("asan"));
    crate::run(&mut command)
}

/// The nightly compiler's target.
fn host() -> Result<String, String> {
    let missing =
        || "a nightly compiler is missing: rustup toolchain install nightly --component miri rust-src".to_owned();
    let output = Command::new("rustup").args(["run", "nightly", "rustc", "-vV"]).output().map_err(|_| missing())?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().find_map(|line| line.strip_prefix("host: ")).map(str::to_owned).ok_or_else(missing)
}

fn works(args: &[&str]) -> bool {
    nightly().args(args).output().is_ok_and(|output| output.status.success())
}

/// The nightly cargo, at the root of the workspace.
fn nightly() -> Command {
    let mut command = Command::new("rustup");
    command.args(["run", "nightly", "cargo"]).current_dir(structure::root());
    // What the cargo that runs this program has set for itself.
    for name in ["CARGO", "RUSTC", "RUSTUP_TOOLCHAIN"] {
        command.env_remove(name);
    }
    command
}

/// Targets of their own: other flags would build the usual one anew, and the next step once more.
fn folder(name: &str) -> std::path::PathBuf {
    structure::root().join("target").join("sanitize").join(name)
}
