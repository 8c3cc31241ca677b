//! Measures twinray and writes `docs/performance.md`.
//!
//! `twinray-bench [--quick] [PART...]`, usually called as `cargo xtask bench`. Every part writes its figures to
//! `benches/results/PART.json`, and the document is made from whatever results are there, so that one part can be
//! measured anew; the part `document` measures nothing. With `--quick` the work is divided and results go to standard output.
//!
//! Parts measure and put into words (`parts`); files are read and written here and in `results`, processes are started by
//! `origin` and `parts::memory` alone.

mod curve;
mod document;
mod embree;
mod measure;
mod origin;
mod parts;
mod rays;
mod results;
mod solving;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use origin::Origin;
use parts::{Effort, Outcome, PARTS, Part};
use results::Record;

/// The part that measures nothing.
const DOCUMENT: &str = "document";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.first().map(String::as_str) {
        Some(parts::memory::CHILD) => parts::memory::child(&arguments[1..]),
        _ => run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("bench: {message}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let (options, names): (Vec<&String>, Vec<&String>) = arguments.iter().partition(|a| a.starts_with('-'));
    let known = |name: &str| name == DOCUMENT || PARTS.iter().any(|p| p.name == name);
    if let Some(wrong) = options.iter().find(|o| *o != &"--quick").or(names.iter().find(|n| !known(n))) {
        return Err(format!("\"{wrong}\" is neither a part nor an option\n{}", usage()));
    }
    let quick = !options.is_empty();
    let effort = if quick { Effort::QUICK } else { Effort::FULL };
    let root = root();
    let origin = Origin::of(&root);
    let chosen = PARTS.iter().filter(|p| names.is_empty() || names.contains(&&p.name.to_owned()));
    for part in chosen {
        let Some(record) = measured(part, effort, &origin)? else { continue };
        // In words too, so that a result that cannot be told is found before the next part takes its minutes.
        let section = (part.describe)(&record.result).map_err(|e| format!("{}: {e}", part.name))?;
        if quick {
            println!("{}\n{}\n", record.text(), section.text);
        } else {
            record.write(&root)?;
        }
    }
    if quick { Ok(()) } else { document::write(&root, PARTS) }
}

/// Runs one part; `None` if it cannot be measured here.
fn measured(part: &Part, effort: Effort, origin: &Origin) -> Result<Option<Record>, String> {
    eprintln!("bench {}: {}", part.name, part.what);
    let start = Instant::now();
    match (part.measure)(effort).map_err(|e| format!("{}: {e}", part.name))? {
        Outcome::Measured(result) => {
            let seconds = start.elapsed().as_secs_f64();
            eprintln!("bench {}: done ({seconds:.0} s)", part.name);
            Ok(Some(Record { part: part.name.to_owned(), origin: origin.clone(), seconds, result }))
        }
        Outcome::Skipped(why) => {
            eprintln!("bench {}: SKIPPED: {why}", part.name);
            Ok(None)
        }
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn usage() -> String {
    let mut out = "usage: cargo xtask bench [--quick] [PART...]; without a part all of them\n".to_owned();
    PARTS.iter().for_each(|p| out += &format!("  {:12} {}\n", p.name, p.what));
    out + &format!("  {DOCUMENT:12} writes docs/performance.md from the results that are there")
}
