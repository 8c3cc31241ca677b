//! The twinray command: paths, flags, progress, exit codes. Everything else is the `twinray` library's.

mod args;
mod commands;
mod failure;
mod input;
mod interrupt;
mod output;
mod progress;
mod settings;
mod stored;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let outcome = match args::Args::parse().command {
        args::Command::Render(args) => commands::render::run(&args),
        args::Command::Solve(args) => commands::solve::run(&args),
        args::Command::Merge(args) => commands::merge::run(&args),
        args::Command::Reference(args) => commands::reference::run(&args),
        args::Command::Info(args) => commands::info::run(&args),
        args::Command::Compare(args) => commands::compare::run(&args),
        args::Command::Scene(args) => commands::scene::run(&args),
    };
    failure::exit_code(outcome)
}
