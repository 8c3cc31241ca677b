//! How the command ends: 0 done, 1 a limit exceeded, 2 bad input, 130 or 143 interrupted with the result kept.

use std::process::ExitCode;

use crate::interrupt;

/// How a command that did not fail ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// All was done.
    Done,
    /// All was done, and what was measured is beyond what the user allows.
    Exceeded,
    /// By Ctrl-C or SIGTERM: what there was has been written.
    Interrupted,
}

/// The exit code; a failure is printed to standard error, the outermost reason first.
pub fn exit_code(outcome: anyhow::Result<Ending>) -> ExitCode {
    match outcome {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Exceeded) => ExitCode::from(1),
        Ok(Ending::Interrupted) => ExitCode::from(interrupt::code()),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
