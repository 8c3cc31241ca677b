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
    /// Memory that reading may take in all, whatever the files' size, bytes: the files, what is made of them, and
    /// pictures while they are decoded.
    pub max_memory: u64,
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
    /// Every channel of what a surface or the sky emits is brought down to this, W·sr⁻¹·m⁻² or nit, so that sums of it
    /// and of its squares stay finite in single precision. The sun has 2e9 nit.
    pub max_radiance: f64,
    /// True: files outside the scene's folder may be referred to, by `..` or absolute paths. Other URI schemes stay
    /// refused.
    pub allow_outside: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_file_bytes: 2 << 30,
            extra_memory: 192 << 20,
            memory_per_byte: 4,
            max_memory: u64::MAX,
            max_triangles: 20_000_000,
            max_instances: 1_000_000,
            max_depth: 512,
            max_image_texels: 1 << 24,
            max_texels: 1 << 25,
            max_coordinate: 1e9,
            max_reflectance: 0.98,
            max_radiance: 1e12,
            allow_outside: false,
        }
    }
}

/// Memory of a texel while its picture is decoded: eight bytes of the picture, and as many of the decoder.
pub(crate) const DECODING_BYTES: u64 = 16;

impl Limits {
    /// These limits, tightened so that reading takes no more than `bytes` of memory: a quarter of it may be pictures
    /// at work, and another quarter pictures kept.
    pub fn within(self, bytes: u64) -> Self {
        Self {
            max_file_bytes: self.max_file_bytes.min(bytes),
            max_memory: self.max_memory.min(bytes / 2),
            max_image_texels: self.max_image_texels.min(bytes / 4 / DECODING_BYTES),
            max_texels: self.max_texels.min(bytes / 4 / 4),
            ..self
        }
    }
}

/// Longest name that is kept, bytes. Names are copied for every part of what they name, so that long ones would let
/// few bytes ask for much memory, and time.
const MAX_NAME: usize = 256;

/// `text` as a name: its beginning, if it is longer than a name.
pub(crate) fn as_name(text: &str) -> &str {
    let end = (0..=MAX_NAME.min(text.len())).rev().find(|&end| text.is_char_boundary(end));
    &text[..end.unwrap_or(0)]
}

/// Memory asked for so far, against what the bytes read so far allow.
#[derive(Debug)]
pub(crate) struct Budget {
    extra: u64,
    per_byte: u64,
    max: u64,
    input: u64,
    spent: u64,
}

impl Budget {
    pub(crate) fn new(limits: &Limits) -> Self {
        let (extra, per_byte, max) = (limits.extra_memory, limits.memory_per_byte, limits.max_memory);
        Self { extra, per_byte, max, input: 0, spent: 0 }
    }

    /// Counts the bytes of one more file, which the caller holds in memory.
    pub(crate) fn add_input(&mut self, bytes: usize) {
        self.input = self.input.saturating_add(bytes as u64);
        self.spent = self.spent.saturating_add(bytes as u64);
    }

    /// Asks for `bytes` that stay allocated for `element`.
    pub(crate) fn charge(&mut self, bytes: u64, file: &str, element: &str) -> Result<(), FormatError> {
        let by_input = self.input.saturating_mul(self.per_byte).saturating_add(self.extra);
        let (allowed, limit) = if by_input <= self.max { (by_input, "extra_memory") } else { (self.max, "max_memory") };
        let spent = self.spent.saturating_add(bytes);
        if spent > allowed {
            return Err(FormatError::OverLimit {
                file: file.to_owned(),
                element: element.to_owned(),
                limit,
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
