//! One file a verb.

pub mod bake;
pub mod check;
mod check_picture;
pub mod compare;
mod compare_pictures;
mod compare_solutions;
pub mod export;
mod frames;
mod gather;
pub mod info;
pub mod merge;
mod path;
pub mod reference;
pub mod render;
pub mod scene;
mod solution;
pub mod solve;
mod solving;
pub mod view;

use serde_json::{Value, json};
use twinray::solve::PowerBalance;

/// Uses `threads` threads, or all.
fn set_threads(threads: Option<u16>) {
    if let Some(n) = threads {
        // Fails only if a pool exists already; there is one command a process.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n)).build_global();
    }
}

fn print_warnings(warnings: &[String], quiet: bool) {
    if !quiet {
        warnings.iter().for_each(|w| crate::say!("warning: {w}"));
    }
}

/// The share of light lost on backs beyond which the user is warned.
const TOLERATED_LOSS: f64 = 1e-3;

fn loss_warning(balance: &PowerBalance) -> Option<String> {
    (balance.lost_share() > TOLERATED_LOSS).then(|| {
        format!(
            "{:.2} % of the light is lost on the backs of one-sided surfaces: turn them round, or use --two-sided",
            100.0 * balance.lost_share()
        )
    })
}

/// Says what was dropped because it was no number.
fn invalid_warning(count: u64, what: &str) -> Option<String> {
    (count > 0).then(|| {
        format!("{count} {what} were dropped, since they were not finite: look for numbers without end in the scene")
    })
}

fn balance_json(b: &PowerBalance) -> Value {
    json!({
        "emitted": b.emitted, "sky": b.sky, "absorbed": b.absorbed, "escaped": b.escaped, "lost": b.lost,
        "residual": b.residual(),
    })
}

fn balance_line(b: &PowerBalance) -> String {
    let share = |x: f64| 100.0 * x / (b.emitted + b.sky);
    format!(
        "power: {:.6} emitted + {:.6} from the sky = {:.2} % absorbed + {:.2} % escaped + {:.3} % lost on backs (residual {:+.2} %)",
        b.emitted,
        b.sky,
        share(b.absorbed),
        share(b.escaped),
        share(b.lost),
        100.0 * b.residual()
    )
}
