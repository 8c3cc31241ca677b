//! `twinray compare`: how far a picture, or a solution, is from a reference.

use anyhow::bail;

use crate::args::CompareArgs;
use crate::commands::{self, compare_pictures, compare_solutions};
use crate::failure::Ending;
use crate::output::extension;

/// Runs the command.
pub fn run(args: &CompareArgs) -> anyhow::Result<Ending> {
    commands::set_threads(args.threads);
    match [&args.test, &args.reference].map(|name| extension(name.as_ref()) == "twin") {
        [true, true] => compare_solutions::run(args),
        [false, false] => compare_pictures::run(args),
        _ => bail!(
            "{} and {}: a solution and a picture cannot be compared; expected two pictures or two .twin files",
            args.test,
            args.reference
        ),
    }
}

/// Whether `--max-error` is kept; says so where it is not.
pub fn verdict(args: &CompareArgs, measure: &str, value: f64, is_within: bool) -> Ending {
    let Some(limit) = args.max_error else { return Ending::Done };
    if is_within {
        return Ending::Done;
    }
    if !args.quiet {
        let shown = if limit.percent { format!("{:.4}%", 100.0 * value) } else { format!("{value:.6}") };
        crate::say!("{}: {measure} is {shown}, beyond the {} that --max-error allows", args.test, limit.text());
    }
    Ending::Exceeded
}
