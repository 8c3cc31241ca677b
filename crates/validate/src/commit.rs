//! What is checked out: it stands at the head of every document that a program writes.

use std::path::Path;
use std::process::Command;

/// Short hash of the commit at `root`, and whether its sources were changed since.
pub fn hash(root: &Path) -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).current_dir(root).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(hash) = git(&["rev-parse", "--short=12", "HEAD"]) else { return "unknown".to_owned() };
    let changes = git(&["status", "--porcelain", "--", "crates", "Cargo.lock", "Cargo.toml"]).unwrap_or_default();
    if changes.is_empty() { hash } else { format!("{hash}, with changes") }
}
