//! Accessors: typed elements inside buffers, checked as a whole before the first one is read.
//!
//! Once [`Accessor::load`] has succeeded every element below `count` lies inside its buffer, so that reading one
//! cannot fail. Elements are decoded when asked for: a large accessor shared by many primitives costs nothing.
//! Not here: what positions and indices mean (`primitive`).

use super::container::{Buffers, View, slice};
use super::json::Element;
use crate::error::FormatError;

/// How one component is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(super) fn from_code(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The value stored in the first bytes of `bytes`.
    pub(super) fn read(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Self::I8, [a, ..]) => f64::from(*a as i8),
            (Self::U8, [a, ..]) => f64::from(*a),
            (Self::I16, [a, b, ..]) => f64::from(i16::from_le_bytes([*a, *b])),
            (Self::U16, [a, b, ..]) => f64::from(u16::from_le_bytes([*a, *b])),
            (Self::U32, [a, b, c, d, ..]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
            (Self::F32, [a, b, c, d, ..]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => 0.0, // cannot happen: `load` checked the extent
        }
    }

    /// The integer stored in the first bytes of `bytes`.
    fn read_index(self, bytes: &[u8]) -> u32 {
        match (self, bytes) {
            (Self::U8, [a, ..]) => u32::from(*a),
            (Self::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
            (Self::U32, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]),
            _ => 0,
        }
    }

    /// Factor and lower bound that map normalized integers to [−1, 1] or [0, 1] (glTF §3.6.2.2).
    fn normalization(self) -> (f64, f64) {
        match self {
            Self::I8 => (1.0 / 127.0, -1.0),
            Self::U8 => (1.0 / 255.0, 0.0),
            Self::I16 => (1.0 / 32767.0, -1.0),
            Self::U16 => (1.0 / 65535.0, 0.0),
            Self::U32 | Self::F32 => (1.0, f64::NEG_INFINITY),
        }
    }
}

/// What a user of an accessor can read.
pub(super) struct Expected<'e> {
    /// `SCALAR`, `VEC2`, …
    pub(super) kind: &'e str,
    /// How components may be stored.
    pub(super) components: &'e [Component],
}

/// Elements of one type.
pub(super) struct Accessor<'v> {
    /// For messages.
    pub(super) path: String,
    /// Number of elements.
    pub(super) count: usize,
    component: Component,
    normalized: bool,
    /// Bytes and stride; without them every element is 0.
    base: Option<(&'v [u8], usize)>,
    sparse: Option<Sparse<'v>>,
    size: usize,
}

/// Elements that replace those of the base; `indices` are strictly increasing.
struct Sparse<'v> {
    count: usize,
    component: Component,
    indices: &'v [u8],
    values: &'v [u8],
}

impl<'v> Accessor<'v> {
    /// Checks the accessor `element` against its views and against what the caller can read.
    pub(super) fn load(
        root: &Element<'_>,
        buffers: &'v Buffers<'_>,
        element: &Element<'_>,
        expected: &Expected<'_>,
    ) -> Result<Self, FormatError> {
        let code = element.require("componentType", "a component type")?;
        let component = Component::from_code(code.as_integer()?)
            .filter(|c| expected.components.contains(c))
            .ok_or_else(|| code.invalid(&format!("one of {:?}", expected.components)))?;
        let kind = element.require("type", expected.kind)?;
        if element.text("type")? != Some(expected.kind) {
            return Err(kind.invalid(expected.kind));
        }
        let size = element_bytes(component, expected.kind);
        let counter = element.require("count", "the number of elements")?;
        let count = usize::try_from(counter.as_integer()?).unwrap_or(usize::MAX);
        // Indices are 32 bits wide, and their largest value means "restart".
        if count == 0 || count >= u32::MAX as usize {
            return Err(counter.invalid("a count from 1 to 4294967294"));
        }
        let base = match buffers.view(root, element)? {
            Some(view) => Some(extent(element, &view, count, size)?),
            None => None,
        };
        let sparse = element.get("sparse").map(|s| Sparse::load(root, buffers, &s, count, size)).transpose()?;
        let normalized = element.flag("normalized");
        Ok(Self { path: element.path.clone(), count, component, normalized, base, sparse, size })
    }

    /// Element `i` as `N` numbers. Zeros beyond the end, where nobody should read.
    pub(super) fn floats<const N: usize>(&self, i: usize) -> [f32; N] {
        let bytes = self.element(i);
        let width = self.component.bytes();
        let (scale, lowest) = if self.normalized { self.component.normalization() } else { (1.0, f64::NEG_INFINITY) };
        std::array::from_fn(|c| {
            let value = bytes.get(c * width..).map_or(0.0, |b| self.component.read(b));
            // NaN must stay NaN: it marks damaged vertices. `max` would turn it into the bound.
            if value.is_nan() { f32::NAN } else { (value * scale).max(lowest) as f32 }
        })
    }

    /// Element `i` as an index.
    pub(super) fn index(&self, i: usize) -> u32 {
        self.component.read_index(self.element(i))
    }

    /// The bytes of element `i`, and more after them; none where every element is 0.
    pub(super) fn element(&self, i: usize) -> &'v [u8] {
        if let Some(bytes) = self.sparse.as_ref().and_then(|s| s.find(i, self.size)) {
            return bytes;
        }
        self.base.and_then(|(bytes, stride)| bytes.get(i.checked_mul(stride)?..)).unwrap_or(&[])
    }
}

impl<'v> Sparse<'v> {
    fn load(
        root: &Element<'_>,
        buffers: &'v Buffers<'_>,
        element: &Element<'_>,
        base_count: usize,
        size: usize,
    ) -> Result<Self, FormatError> {
        let counter = element.require("count", "the number of replaced elements")?;
        let count = usize::try_from(counter.as_integer()?).unwrap_or(usize::MAX);
        if count == 0 || count > base_count {
            return Err(counter.invalid(&format!("a count from 1 to {base_count}, that of the accessor")));
        }
        let part = |key: &str, width: usize| {
            let part = element.require(key, "an object")?;
            let view = buffers.view(root, &part)?;
            let view = view.ok_or_else(|| part.fault("no bufferView", "the index of a buffer view"))?;
            let view = View { bytes: view.bytes, stride: None };
            extent(&part, &view, count, width).map(|(bytes, _)| (part, bytes))
        };
        let indices = element.require("indices", "an object")?;
        let code = indices.require("componentType", "a component type")?;
        let component = Component::from_code(code.as_integer()?)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
            .ok_or_else(|| code.invalid("5121, 5123 or 5125 (unsigned integers)"))?;
        let (indices, index_bytes) = part("indices", component.bytes())?;
        let (_, values) = part("values", size)?;
        let sparse = Self { count, component, indices: index_bytes, values };
        if !buffers.checked.borrow_mut().insert(element.path.clone()) {
            return Ok(sparse);
        }
        let mut last = None;
        for i in 0..count {
            let index = sparse.index(i);
            if index as usize >= base_count || last.is_some_and(|l| index <= l) {
                let expected = format!("increasing indices below {base_count}");
                return Err(indices.fault(format!("index {index} at place {i}"), expected));
            }
            last = Some(index);
        }
        Ok(sparse)
    }

    fn index(&self, i: usize) -> u32 {
        self.indices.get(i * self.component.bytes()..).map_or(0, |b| self.component.read_index(b))
    }

    /// The replacement of element `i`.
    fn find(&self, i: usize, size: usize) -> Option<&'v [u8]> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match (self.index(middle) as usize).cmp(&i) {
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
                std::cmp::Ordering::Equal => return self.values.get(middle * size..),
            }
        }
        None
    }
}

/// The bytes of `view` from `element`'s offset, and the stride, if `count` elements of `size` bytes fit in.
fn extent<'v>(
    element: &Element<'_>,
    view: &View<'v>,
    count: usize,
    size: usize,
) -> Result<(&'v [u8], usize), FormatError> {
    let stride = view.stride.unwrap_or(size);
    if stride < size {
        return Err(element.fault(format!("a byteStride of {stride}"), format!("at least {size}, one element")));
    }
    let offset = element.integer("byteOffset")?.unwrap_or(0);
    let needed = (count as u64 - 1).checked_mul(stride as u64).and_then(|n| n.checked_add(size as u64));
    let fits = needed.and_then(|needed| slice(view.bytes, offset, needed));
    let bytes = fits.ok_or_else(|| {
        let found = format!("{count} elements of {size} bytes, {stride} apart, from byte {offset}");
        element.fault(found, format!("elements inside the {} bytes of the buffer view", view.bytes.len()))
    })?;
    Ok((bytes, stride))
}

/// Bytes of an element. Columns of matrices start at multiples of four bytes (glTF §3.6.2.4).
pub(super) fn element_bytes(component: Component, kind: &str) -> usize {
    let columns = |n: usize| n * (n * component.bytes()).next_multiple_of(4);
    match kind {
        "VEC2" => 2 * component.bytes(),
        "VEC3" => 3 * component.bytes(),
        "VEC4" => 4 * component.bytes(),
        "MAT2" => columns(2),
        "MAT3" => columns(3),
        "MAT4" => columns(4),
        _ => component.bytes(),
    }
}
