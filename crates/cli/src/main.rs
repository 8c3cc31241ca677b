//! The twinray command.
fn main() {}
