//! What a bake tells of its progress, and how it is stopped.

use std::time::{Duration, Instant};

/// About so long passes between two looks at who may want to stop.
const PATIENCE: Duration = Duration::from_millis(250);

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

/// How much is done between two looks: as much as takes about [`PATIENCE`], and something for every thread. What is done does not
/// depend on it.
pub(crate) struct Pace {
    size: usize,
    most: usize,
    since: Instant,
}

impl Pace {
    /// Never more than `most` at once.
    pub fn new(most: usize) -> Self {
        Self { size: rayon::current_num_threads().min(most), most, since: Instant::now() }
    }

    /// How much to do next.
    pub fn next(&mut self) -> usize {
        let took = self.since.elapsed();
        if took < PATIENCE / 2 {
            self.size = (2 * self.size).min(self.most);
        } else if took > PATIENCE {
            self.size = (self.size / 2).max(rayon::current_num_threads()).min(self.most);
        }
        self.since = Instant::now();
        self.size
    }
}
