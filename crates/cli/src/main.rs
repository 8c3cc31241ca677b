//! The command, alone.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(twinray_cli::run(None))
}
