//! Choosing a patch by its power: a tree that follows every change (paper §2.2), and a table for frozen states.

pub mod table;
pub mod tree;

pub use table::Table;
pub use tree::PowerTree;
