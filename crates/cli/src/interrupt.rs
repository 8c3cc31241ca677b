//! Ctrl-C and SIGTERM: the first asks to stop at the end of the wave and keep the result, the second stops at once.

use std::sync::Mutex;
use std::sync::atomic::{AtomicI32, Ordering};

/// The signal that asks to stop; 0 for none.
static SIGNAL: AtomicI32 = AtomicI32::new(0);
/// The last there was.
static LAST: AtomicI32 = AtomicI32::new(0);

/// What is said when one asks to stop.
static SAID: Mutex<Option<&str>> = Mutex::new(Some(
    "stopping at the end of this wave or pass; what there is will be written (the same again stops at once)",
));

/// From now on a signal is the usual end, and nothing is said of it.
pub fn expect() {
    say_instead(None);
}

/// From now on this is said when a signal asks to stop.
pub fn say_instead(words: Option<&'static str>) {
    *SAID.lock().unwrap_or_else(|e| e.into_inner()) = words;
}

/// What a signal asked for is done, and something else begins: the next one is a first one again.
pub fn answered() {
    SIGNAL.store(0, Ordering::SeqCst);
}

fn say() {
    if let Some(words) = *SAID.lock().unwrap_or_else(|e| e.into_inner()) {
        crate::say!("\n{words}");
    }
}

/// Installs the handlers.
#[cfg(unix)]
pub fn install() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    // A second installation would do no harm; there is none. Without signals there is nothing to listen to.
    let wanted = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|&signal| !is_ignored(signal));
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            LAST.store(signal, Ordering::SeqCst);
            if SIGNAL.swap(signal, Ordering::SeqCst) != 0 {
                // The last checkpoint is in its place.
                crate::output::abandon();
                std::process::exit(exit_code(signal).into());
            }
            say();
        }
    });
}

/// Whether whoever started this program wants a signal ignored, as `nohup` does; Linux tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Installs the handlers, where there are but flags.
#[cfg(not(unix))]
pub fn install() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    use signal_hook::consts::SIGINT;
    let flag = Arc::new(AtomicBool::new(false));
    if signal_hook::flag::register(SIGINT, Arc::clone(&flag)).is_err() {
        return;
    }
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(50));
            if flag.swap(false, Ordering::SeqCst) {
                LAST.store(SIGINT, Ordering::SeqCst);
                if SIGNAL.swap(SIGINT, Ordering::SeqCst) != 0 {
                    crate::output::abandon();
                    std::process::exit(exit_code(SIGINT).into());
                }
                say();
            }
        }
    });
}

/// True once somebody has asked to stop.
pub fn requested() -> bool {
    SIGNAL.load(Ordering::SeqCst) != 0
}

/// The exit code of a program that was asked to stop: 128 and the signal's number, 130 for Ctrl-C and 143 for SIGTERM.
pub fn code() -> u8 {
    exit_code(LAST.load(Ordering::SeqCst))
}

fn exit_code(signal: i32) -> u8 {
    u8::try_from(128 + signal).unwrap_or(130)
}
