//! How the command ends: 0 done, 1 a limit exceeded, 2 bad input, 130 or 143 interrupted with the result kept.

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
pub fn exit_code(outcome: anyhow::Result<Ending>) -> u8 {
    match outcome {
        Ok(Ending::Done) => 0,
        Ok(Ending::Exceeded) => 1,
        Ok(Ending::Interrupted) => interrupt::code(),
        Err(error) => {
            crate::say!("error: {error:#}");
            2
        }
    }
}
