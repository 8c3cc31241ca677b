//! Where a viewer knows the light: corners of cells, by index arithmetic on the author's triangles.
//!
//! The grid of a triangle's cells ([`twinray_scene::Cells::grid`]) are its slots: a viewer finds the slots around any point from their number alone. Slots
//! of neighbours at the same place with the same normal share one node, whose light is computed and sent once.

use std::collections::HashMap;

use rayon::prelude::*;
use twinray_scene::{PatchId, PatchScene, Side, SurfaceHit};

/// Stands for a side that has no slots.
pub const NO_NODE: u32 = u32::MAX;

/// Places are the same within this share of the scene's radius,
const SAME_PLACE: f64 = 1e-5;
/// and normals within steps of this size.
const SAME_NORMAL: f64 = 0.02;
/// Light at a triangle's rim is asked for this share of the way to the middle of its cell: on the rim itself a wall may stand.
const INWARDS: f64 = 0.12;
/// How high above the surface a wall between neighbours is looked for, as a share of their distance.
const LIFT: f64 = 0.25;

/// Where the light of a node is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub patch: PatchId,
    pub hit: SurfaceHit,
}

/// All nodes of a scene.
#[derive(Debug)]
pub struct Nodes {
    /// Per triangle: its first slot on the front and on the back, [`NO_NODE`] where there is none.
    pub first_slots: Vec<[u32; 2]>,
    /// Per triangle, for glossy ones: the number among cells of glossy sides of its first cell on the front and on the
    /// back, [`NO_NODE`] where there is none.
    pub first_cells: Vec<[u32; 2]>,
    /// Per slot: its node.
    pub node_of_slot: Vec<u32>,
    /// Slots of glossy sides come first; so many there are.
    pub glossy_slots: usize,
    /// The same for nodes.
    pub glossy_nodes: usize,
    /// Per node.
    pub(crate) places: Vec<Place>,
    /// Per cell of a glossy side: its patch.
    pub(crate) glossy_patches: Vec<PatchId>,
}

/// What must be equal for two slots to be one node: place, normal.
type Key = ([i64; 3], [i8; 3]);

impl Nodes {
    /// Finds the nodes of a scene, O(K).
    pub fn new(scene: &PatchScene) -> Self {
        let triangles = scene.triangle_count() as u32;
        let mut this = Self {
            first_slots: vec![[NO_NODE; 2]; triangles as usize],
            first_cells: vec![[NO_NODE; 2]; triangles as usize],
            node_of_slot: Vec::new(),
            glossy_slots: 0,
            glossy_nodes: 0,
            places: Vec::new(),
            glossy_patches: Vec::new(),
        };
        let sides: Vec<(u32, Side)> = (0..triangles)
            .flat_map(|t| [Side::Front, Side::Back].into_iter().take(scene.sides_of(t) as usize).map(move |s| (t, s)))
            .collect();
        let (glossy, matte): (Vec<_>, Vec<_>) = sides.into_iter().partition(|&(t, side)| is_glossy(scene, t, side));
        for &(t, side) in &glossy {
            this.first_cells[t as usize][side as usize] = this.glossy_patches.len() as u32;
            if let Some(first) = first_patch(scene, t, side) {
                this.glossy_patches.extend((0..scene.cells_of(t).count()).map(|k| PatchId(first.0 + k)));
            }
        }
        this.add(scene, &glossy);
        (this.glossy_slots, this.glossy_nodes) = (this.node_of_slot.len(), this.places.len());
        this.add(scene, &matte);
        this
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// True if there are none, which no scene has.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Number of cells of glossy sides.
    pub fn glossy_cells(&self) -> usize {
        self.glossy_patches.len()
    }

    fn add(&mut self, scene: &PatchScene, sides: &[(u32, Side)]) {
        let found: Vec<Vec<(Key, Place)>> = sides.par_iter().map(|&(t, side)| slots(scene, t, side)).collect();
        let mut nodes: HashMap<Key, Vec<u32>> = HashMap::new();
        for (&(t, side), slots) in sides.iter().zip(found) {
            self.first_slots[t as usize][side as usize] = self.node_of_slot.len() as u32;
            for (key, place) in slots {
                // Surfaces may meet under a wall, whose sides have light of their own.
                let there = nodes.entry(key).or_default();
                let joined = there.iter().copied().find(|&n| sees(scene, &self.places[n as usize], &place));
                let node = joined.unwrap_or_else(|| {
                    self.places.push(place);
                    there.push(self.places.len() as u32 - 1);
                    self.places.len() as u32 - 1
                });
                self.node_of_slot.push(node);
            }
        }
    }
}

/// The first patch of a side. Those of its cells follow.
fn first_patch(scene: &PatchScene, triangle: u32, side: Side) -> Option<PatchId> {
    let [u, v] = scene.cells_of(triangle).centre(0);
    scene.patch_at(triangle, side, u, v)
}

fn is_glossy(scene: &PatchScene, triangle: u32, side: Side) -> bool {
    first_patch(scene, triangle, side).is_some_and(|p| scene.is_glossy(p) || scene.specular(p).is_some())
}

/// Slots of one side with what tells them apart and where their light is asked for.
fn slots(scene: &PatchScene, triangle: u32, side: Side) -> Vec<(Key, Place)> {
    let cells = scene.cells_of(triangle);
    let step = 1.0 / (SAME_PLACE * scene.radius());
    let slot = |[u, v]: [f64; 2]| {
        let point = scene.point_of(triangle, u, v);
        let normal = scene.shading_normal(triangle, side, u, v);
        let key = (
            (point * step).to_array().map(|x| x.round() as i64),
            (normal / SAME_NORMAL).to_array().map(|x| x.round() as i8),
        );
        // A little into the triangle, then into the cell that is there.
        let third = 1.0 / 3.0;
        let [a, b] = [u + 1e-3 * (third - u), v + 1e-3 * (third - v)];
        let on_rim = u <= 0.0 || v <= 0.0 || u + v >= 1.0 - 1e-12;
        let [u, v] = if on_rim {
            let [cu, cv] = cells.centre(cells.locate(a, b));
            [u + INWARDS * (cu - u), v + INWARDS * (cv - v)]
        } else {
            [u, v]
        };
        let patch = scene.patch_at(triangle, side, a, b).unwrap_or(PatchId(0));
        (key, Place { patch, hit: SurfaceHit { triangle, side, u, v, t: 0.0 } })
    };
    cells.grid().into_iter().map(slot).collect()
}

/// True if nothing stands between two places of a surface, seen from a little above it.
fn sees(scene: &PatchScene, a: &Place, b: &Place) -> bool {
    let at = |p: &Place| {
        let hit = &p.hit;
        let point = scene.point_of(hit.triangle, hit.u, hit.v);
        (point, scene.shading_normal(hit.triangle, hit.side, hit.u, hit.v))
    };
    let ((from, n), (to, m)) = (at(a), at(b));
    let lift = LIFT * from.distance(to);
    scene.visible(from + n * lift, n, to + m * lift, m)
}
