//! Ctrl-C: the first asks to stop at the end of the wave and keep the result, the second stops at once.

use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);

/// Installs the handler.
pub fn install() {
    // A second installation fails; there is none.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
        eprintln!(
            "\nstopping at the end of this wave or pass; what there is will be written (Ctrl-C again stops at once)"
        );
    });
}

/// True once the user has asked to stop.
pub fn requested() -> bool {
    STOP.load(Ordering::SeqCst)
}
