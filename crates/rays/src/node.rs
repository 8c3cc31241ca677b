//! Memory layout of the tree: eight-wide inner nodes and leaves of up to eight triangles, both as
//! arrays of eight lanes.
//!
//! No algorithm lives here; `build` writes these types, `lanes`, `wide` and `triangle` read them.

/// Lanes of every vector operation: the children of an inner node and the triangles of a leaf.
/// Eight floats fill one AVX register; wider would leave more lanes empty than it saves steps.
pub(crate) const LANES: usize = 8;

/// Eight child boxes, structure of arrays. Unused lanes hold an inverted infinite box, which no ray
/// meets. Aligned to cache lines: the rest of the last one costs less than to touch one line more.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// `[plane][lane]`, planes in the order low x, y, z, high x, y, z.
    pub planes: [[f32; LANES]; 6],
    pub children: [Child; LANES],
}

impl Node {
    pub fn empty() -> Node {
        let (low, high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        Node { planes: [low, low, low, high, high, high], children: [Child(0); LANES] }
    }
}

/// Where a child lies: the top bit tells leaves from inner nodes, the rest is the index in the
/// array of its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub(crate) struct Child(pub u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    pub fn node(index: usize) -> Child {
        Child(index as u32)
    }

    pub fn leaf(index: usize) -> Child {
        Child(index as u32 | Child::LEAF)
    }

    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Child::LEAF != 0
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !Child::LEAF) as usize
    }
}

/// A leaf: up to eight triangles, vertices in canonical order (see `triangle`). Unused lanes hold
/// NaN, which fails every comparison.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Leaf {
    /// `[vertex][axis][lane]`.
    pub vertices: [[[f32; LANES]; 3]; 3],
    pub labels: [Label; LANES],
}

impl Leaf {
    pub fn empty() -> Leaf {
        Leaf { vertices: [[[f32::NAN; LANES]; 3]; 3], labels: [Label(0); LANES] }
    }

    pub fn set(&mut self, lane: usize, vertices: &[[f32; 3]; 3], label: Label) {
        let places = self.vertices.iter_mut().flatten();
        for (lanes, coordinate) in places.zip(vertices.iter().flatten()) {
            lanes[lane] = *coordinate;
        }
        self.labels[lane] = label;
    }
}

/// A triangle's id and the order of its stored vertices, in one word: 29 bits and 3 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub(crate) struct Label(u32);

impl Label {
    /// Ids must stay below this.
    pub const MAX_TRIANGLES: usize = 1 << 29;

    /// `order` indexes [`crate::triangle::ORDERS`].
    pub fn new(id: u32, order: usize) -> Label {
        Label(id << 3 | order as u32)
    }

    #[inline(always)]
    pub fn id(self) -> u32 {
        self.0 >> 3
    }

    #[inline(always)]
    pub fn order(self) -> usize {
        (self.0 & 7) as usize
    }
}
