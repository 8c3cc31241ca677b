//! Ray kernel.
