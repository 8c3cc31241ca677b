//! The command from outside: files, messages, exit codes. Every test has a folder of its own.
//!
//! Sizes are small: 2000 patches, 100 000 rays, 64 × 48 pixels.

mod accuracy;
mod bake;
mod built_in;
mod check;
mod compare;
mod completion;
mod display;
mod export;
mod faults;
mod frames;
mod interrupt;
mod lights;
mod merge;
mod odd_files;
mod pictures;
mod real;
mod reference;
mod reproducible;
mod resume;
mod solve;
mod support;
mod view;
