//! The twinray command, with other ranks beside it: `mpirun -n 4 twinray solve …`.

use std::process::ExitCode;

use twinray_mpi::Ranks;
use twinray_solve::Peers;

fn main() -> ExitCode {
    let ranks = match Ranks::new() {
        Ok(ranks) => ranks,
        Err(message) => {
            eprintln!("error: {message}");
            return ExitCode::from(2);
        }
    };
    let code = twinray_cli::run(Some(&ranks));
    if code == 2 && ranks.count() > 1 {
        // The others may be waiting for this one.
        ranks.abort(code.into());
    }
    ExitCode::from(code)
}
