//! The walk-through: a scene and its light for a browser, from a local server while it is solved, or as one file.
//!
//! [`package`] makes bytes of a scene, [`light`] of its light (both in the [`container`] that `web/walk.js` reads);
//! [`page`] puts the files of `web/` together; [`server`] serves them to this machine alone, with whatever [`feed`] has
//! last been given. Nothing here solves, reads a scene or writes a file: the command does.

mod connection;
pub mod container;
pub mod feed;
pub mod light;
pub mod package;
mod packed;
pub mod page;
pub mod server;
mod textures;
