//! The twinray command: paths, flags, progress, exit codes. Everything else is the `twinray` library's.
//!
//! A library, so that the crate `twinray-mpi` can be the same command with other processes beside it.

/// A line to standard error, if anybody still listens: a pipe or terminal that was closed must not cost the work. What
/// files say goes through it, so nothing in it commands a terminal.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), "{}", crate::plain(&format!($($text)*)));
    }};
}
pub(crate) use say;

/// A text whose control characters, but for ends of lines, are shown instead of obeyed.
fn plain(text: &str) -> String {
    let shown = |c: char| if c.is_control() && c != '\n' { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(shown).collect()
}

mod args;
mod commands;
mod denoise;
mod display;
mod estimate;
mod failure;
mod files;
mod input;
mod interrupt;
mod keyframes;
mod light_args;
mod lights;
mod memory;
mod motion;
mod numbered;
mod output;
mod progress;
mod settings;
mod stored;
mod video;

use anyhow::bail;
use clap::Parser;
use twinray::solve::Peers;

/// Runs the command of this process's arguments, and says with which code the process should end.
///
/// Of several `peers`, all of which must make this call with the same arguments, the first one writes and speaks. After
/// code 2 the others may wait for this one in vain and must be told, or stopped.
pub fn run(peers: Option<&dyn Peers>) -> u8 {
    let peers = peers.filter(|p| p.count() > 1);
    failure::exit_code(command(args::Args::parse().command, peers))
}

fn command(command: args::Command, peers: Option<&dyn Peers>) -> anyhow::Result<failure::Ending> {
    if let (Some(peers), false) = (peers, matches!(command, args::Command::Solve(_))) {
        bail!("{} ranks: only `twinray solve` can be shared; run other commands alone", peers.count());
    }
    match command {
        args::Command::Render(args) => commands::render::run(&args),
        args::Command::Solve(args) => commands::solve::run(&args, peers),
        args::Command::Merge(args) => commands::merge::run(&args),
        args::Command::Reference(args) => commands::reference::run(&args),
        args::Command::Bake(args) => commands::bake::run(&args),
        args::Command::View(args) => commands::view::run(&args),
        args::Command::Check(args) => commands::check::run(&args),
        args::Command::Info(args) => commands::info::run(&args),
        args::Command::Export(args) => commands::export::run(&args),
        args::Command::Compare(args) => commands::compare::run(&args),
        args::Command::Scene(args) => commands::scene::run(&args),
    }
}
