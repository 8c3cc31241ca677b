//! How much a file may ask for before it is refused, and the account that is kept while reading.
//!
//! A few bytes can ask for gigabytes: an accessor without data, a small picture that unpacks to a huge one, a
//! mesh placed a million times. Everything that allocates in proportion to a number in the file asks here first.

use crate::error::FormatError;

/// What a file may ask for. The defaults suit a desktop machine and untrusted files.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Largest single file, referenced ones included, bytes.
    pub max_file_bytes: u64,
    /// Memory that reading may take beyond `memory_per_byte` × the bytes of all files, bytes. Pictures are
    /// limited by `max_texels` instead.
    pub extra_memory: u64,
    /// Memory allowed per byte of input. Real files need 1 to 3; more means that few bytes describe much.
    pub memory_per_byte: u64,
    /// Most triangles in the scene, counted once per placing of a mesh.
    pub max_triangles: u64,
    /// Most placed meshes.
    pub max_instances: u64,
    /// Deepest chain of parent nodes.
    pub max_depth: u64,
    /// Most texels of one picture; a texture with more is left out with a warning.
    pub max_image_texels: u64,
    /// Most texels of all pictures together; pictures beyond it are kept at half, a quarter, … of their size.
    pub max_texels: u64,
    /// Coordinates (metres, or the file's unit) beyond this are treated as damaged.
    pub max_coordinate: f64,
    /// Every channel of a reflectance is brought down to this, so that light always dies out. Real white paint
    /// reflects about 0.9; below 1 the number of bounces stays finite (0.98: half is gone after 34).
    pub max_reflectance: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_file_bytes: 2 << 30,
            extra_memory: 192 << 20,
            memory_per_byte: 4,
            max_triangles: 20_000_000,
            max_instances: 1_000_000,
            max_depth: 512,
            max_image_texels: 1 << 24,
            max_texels: 1 << 25,
            max_coordinate: 1e9,
            max_reflectance: 0.98,
        }
    }
}

/// Memory asked for so far, against what the bytes read so far allow.
#[derive(Debug)]
pub(crate) struct Budget {
    extra: u64,
    per_byte: u64,
    input: u64,
    spent: u64,
}

impl Budget {
    pub(crate) fn new(limits: &Limits) -> Self {
        Self { extra: limits.extra_memory, per_byte: limits.memory_per_byte, input: 0, spent: 0 }
    }

    /// Counts the bytes of one more file, which the caller holds in memory.
    pub(crate) fn add_input(&mut self, bytes: usize) {
        self.input = self.input.saturating_add(bytes as u64);
        self.spent = self.spent.saturating_add(bytes as u64);
    }

    /// Asks for `bytes` that stay allocated for `element`.
    pub(crate) fn charge(&mut self, bytes: u64, file: &str, element: &str) -> Result<(), FormatError> {
        let allowed = self.input.saturating_mul(self.per_byte).saturating_add(self.extra);
        let spent = self.spent.saturating_add(bytes);
        if spent > allowed {
            return Err(FormatError::OverLimit {
                file: file.to_owned(),
                element: element.to_owned(),
                limit: "extra_memory",
                needed: format!("{spent} bytes of memory"),
                allowed,
            });
        }
        self.spent = spent;
        Ok(())
    }

    /// Gives back what `charge` took.
    pub(crate) fn release(&mut self, bytes: u64) {
        self.spent = self.spent.saturating_sub(bytes);
    }
}
