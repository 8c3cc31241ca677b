//! What a bake tells of its progress, and how it is stopped.

/// Rays of each thread, or work that takes as long, between two looks at who may want to stop: less than a second.
const PATIENCE: usize = 200_000;

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

/// How many pieces of work are done between two looks, each of which takes as long as `rays` rays: something for every thread,
/// and at most `most`, whose results are held at once.
pub(crate) fn pace(rays: usize, most: usize) -> usize {
    let threads = rayon::current_num_threads();
    (threads * PATIENCE / rays.max(1)).max(threads).min(most)
}
