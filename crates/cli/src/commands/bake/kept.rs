//! Light that was solved and could not be baked: kept as `twinray solve` keeps it, since nothing that took long is to be lost.

use std::path::{Path, PathBuf};

use anyhow::Error;
use serde_json::json;
use twinray::bake::Cancelled;

use crate::args::LoadArgs;
use crate::commands::solve::Keeper;
use crate::commands::solving::Solved;
use crate::failure::Ending;
use crate::input::Loaded;
use crate::output::Output;
use crate::settings::Settings;

/// Seconds of solving that are kept whatever went wrong; who stops a bake has always a file.
const WORTH_KEEPING: f64 = 5.0;

/// What is said at a signal while light is baked that no file has yet, and while one has it.
pub const SAYS: [&str; 2] = [
    "stopping; the light that was solved will be kept in a .twin file (the same again stops at once)",
    "stopping; nothing will be written, and the light stays where it is (the same again stops at once)",
];

/// A solver that has done its work, and how it was asked for.
pub struct Light<'a> {
    pub solved: Solved<'a>,
    pub settings: Settings,
}

/// Ends a bake that `reason` ended, whose output would have been `output`.
///
/// # Errors
/// The reason, unless it was a signal.
pub fn end(
    reason: Error,
    light: Option<&Light<'_>>,
    loaded: &Loaded,
    output: &Path,
    args: &LoadArgs,
) -> anyhow::Result<Ending> {
    let is_stopped = reason.is::<Cancelled>();
    let kept = light.filter(|light| is_stopped || light.solved.seconds > WORTH_KEEPING).map(|light| {
        let path = free(output);
        let keeper = Output::open(&path).map(|file| Keeper::new(loaded, light.settings, &path, Some(file)));
        keeper.and_then(|mut keeper| {
            let solver = &light.solved.solver;
            keeper.keep(solver).map_err(|error| keeper.rescue(solver, error)).map(|_| path)
        })
    });
    let said = match &kept {
        Some(Ok(path)) => format!("{}: the light, which `twinray bake` takes in place of its scene", path.display()),
        Some(Err(error)) => format!("the light could not be kept: {error:#}"),
        None if is_stopped => format!("{}: has its light as before", args.scene),
        None => String::new(),
    };
    // However quiet: a signal has an answer, and light that is lost is an error.
    if !said.is_empty() {
        crate::say!("{said}");
    }
    if !is_stopped {
        return Err(reason);
    }
    if args.json {
        let kept = kept.and_then(Result::ok).map(|path| path.display().to_string());
        println!("{:#}", json!({ "output": null, "interrupted": true, "kept": kept }));
    }
    Ok(Ending::Interrupted)
}

/// A name like the output's that nothing has yet.
fn free(output: &Path) -> PathBuf {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let numbered = (2..).map(|k| output.with_file_name(format!("{stem}-{k}.twin")));
    let mut names = std::iter::once(output.with_extension("twin")).chain(numbered);
    names.find(|path| !path.exists()).unwrap_or_else(|| output.with_extension("twin"))
}
