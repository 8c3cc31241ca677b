//! The kernel from outside: what a caller may rely on, tested through the public API only.
//!
//! Tree against brute force is tested beside the code, in `src/oracle.rs`.

mod hits;
mod random;
mod reference;
mod watertight;
