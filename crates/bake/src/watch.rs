//! What a bake tells of its progress, and how it is stopped.

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Texture coordinates are found.
    Atlas,
    /// Texels are filled.
    Texels,
    /// Charts are made to agree.
    Seams,
    /// Light is fitted to vertices.
    Vertices,
    /// Probes look around.
    Probes,
}

/// Somebody stopped it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped")]
pub struct Cancelled;

/// Is told how far a stage is, in [0, 1], and may stop the bake.
pub type Watch<'a> = dyn FnMut(Stage, f64) -> Result<(), Cancelled> + 'a;
