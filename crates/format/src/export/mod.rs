//! The light of every cell as a table for other programs: NPZ, CSV, PLY, VTU.
//!
//! Lives here: the table and its columns, of which every format writes the same under the same names. One file a
//! format beside it; each writes row by row to any `Write`, so that a table of millions of cells needs no memory of
//! its own. Not here: solution files, which can be read back and gone on with (`twin`). Called by the command.

mod colour;
mod csv;
mod npz;
mod ply;
mod vtu;
mod zip;

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene, Rgb};
use twinray_solve::{PatchLight, Solution};

pub use csv::write_csv;
pub use npz::write_npz;
pub use ply::write_ply;
pub use vtu::write_vtu;

use crate::twin::Provenance;

/// What is known of the cells of a scene, one row a patch, in the order of the patches.
///
/// Places and areas are asked of the scene where they are written; the rest are arrays `[patches]`. World coordinates are
/// in metres, in the frame of the author's file.
#[derive(Clone, Debug)]
pub struct CellTable<'a> {
    /// The scene whose patches are the rows.
    pub scene: &'a PatchScene,
    /// Irradiance with its standard error, hits, and which cells emit.
    pub light: PatchLight,
    /// Radiosity, W·m⁻² (or lux where radiance is in nit): what leaves the cell, over all directions.
    pub radiosity: Vec<[f32; 3]>,
    /// Where the light comes from, as pairs of name and text, for the formats that have room for it.
    pub provenance: Vec<(String, String)>,
}

impl<'a> CellTable<'a> {
    /// The table of a solution of `scene`.
    ///
    /// Radiosity is π (emission + main part of the reflected radiance): a representative sends as much light as
    /// its share of the main part says, on average over time, and its own value of the moment is left out.
    /// Paper: §2.1, L^d.
    pub fn new(scene: &'a PatchScene, solution: &Solution, provenance: &Provenance) -> Self {
        let main_part = |p| solution.main_part(scene, p);
        Self::with_main_part(scene, solution.patch_light(scene), main_part, provenance)
    }

    /// The table of the light of `scene` where nothing else is known, as from a path tracer.
    ///
    /// Radiosity is then π emission + irradiance × mean albedo: right for Lambertian cells, and for glossy ones as if
    /// light came evenly from all directions.
    pub fn of_light(scene: &'a PatchScene, light: PatchLight, provenance: &Provenance) -> Self {
        let reflected: Vec<Rgb> = (scene.patches().zip(&light.irradiance))
            .map(|(p, e)| Rgb::from_f32(*e) * scene.brdf(p).mean_albedo() / PI)
            .collect();
        Self::with_main_part(scene, light, |p| reflected[p.index()], provenance)
    }

    fn with_main_part(
        scene: &'a PatchScene,
        light: PatchLight,
        main_part: impl Fn(PatchId) -> Rgb,
        provenance: &Provenance,
    ) -> Self {
        let radiosity = |p| ((scene.emission(p) + main_part(p)) * PI).to_f32();
        Self { scene, light, radiosity: scene.patches().map(radiosity).collect(), provenance: pairs(provenance) }
    }

    /// Number of rows, K.
    pub fn len(&self) -> usize {
        self.scene.len()
    }

    /// Never true: a scene has patches.
    pub fn is_empty(&self) -> bool {
        self.scene.is_empty()
    }

    /// Corners of a cell's polygon, world coordinates, metres; counter-clockwise as seen from its side.
    fn corners(&self, patch: PatchId) -> impl ExactSizeIterator<Item = DVec3> {
        self.scene.cell_corners(patch).into_iter().map(|corner| corner + self.scene.centre())
    }

    /// Number of corners of all cells together.
    fn corner_count(&self) -> usize {
        self.scene.patches().map(|p| self.corners(p).len()).sum()
    }

    /// Centre of a cell, world coordinates, metres.
    fn centre(&self, patch: PatchId) -> [f64; 3] {
        (self.scene.cell_centre(patch) + self.scene.centre()).to_array()
    }

    /// Unit normal of a cell, outward.
    fn normal(&self, patch: PatchId) -> [f32; 3] {
        self.scene.normal(patch).as_vec3().to_array()
    }

    /// Every writer begins with this.
    ///
    /// # Panics
    /// If an array has not one value for each patch.
    fn check(&self) {
        let light = &self.light;
        let lengths = [light.area.len(), light.emits.len(), light.irradiance.len(), light.standard_error.len()];
        let all = lengths.into_iter().chain([light.hits.len(), self.radiosity.len()]);
        let all: Vec<usize> = all.collect();
        assert!(all.iter().all(|&n| n == self.len()), "CellTable: arrays of {all:?} for {} patches", self.len());
    }
}

/// The provenance of a solution file as pairs of name and text, and the units.
fn pairs(p: &Provenance) -> Vec<(String, String)> {
    let pair = |name: &str, text: String| (name.to_owned(), text);
    let seeds: Vec<String> = p.seeds.iter().map(u64::to_string).collect();
    let mut pairs = vec![
        pair("software", p.software.clone()),
        pair("scene", p.scene.clone()),
        pair("source", p.source.file.clone()),
        pair("fingerprint", format!("{:016x}", p.fingerprint)),
        pair("method", p.method.name().to_owned()),
        pair("rays", p.rays.to_string()),
        pair("seed", p.seed.to_string()),
        pair("seeds", seeds.join(" ")),
        pair("relative_error", p.relative_error.to_string()),
    ];
    pairs.extend(p.settings.iter().cloned());
    pairs.push(pair("units", "metres, W/m2 (or lux where radiance is in nit); colours are linear Rec. 709".to_owned()));
    pairs
}

/// How a number is stored, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Double precision.
    F64,
    /// Single precision.
    F32,
    /// Unsigned, 32 bits.
    U32,
    /// 0 or 1, one byte.
    Bool,
}

impl Kind {
    fn bytes(self) -> usize {
        match self {
            Kind::F64 => 8,
            Kind::F32 | Kind::U32 => 4,
            Kind::Bool => 1,
        }
    }
}

/// A column of the table as binary formats store it.
struct Column {
    name: &'static str,
    kind: Kind,
    /// Names of the components, appended where a format has a column for each; none for a plain number.
    components: &'static [&'static str],
    /// Appends the bytes of one row.
    encode: fn(&CellTable, PatchId, &mut Vec<u8>),
}

impl Column {
    /// Numbers in a row.
    fn width(&self) -> usize {
        self.components.len().max(1)
    }

    /// A name for each number of a row.
    fn names(&self) -> Vec<String> {
        match self.components {
            [] => vec![self.name.to_owned()],
            components => components.iter().map(|c| format!("{}_{c}", self.name)).collect(),
        }
    }
}

const XYZ: &[&str] = &["x", "y", "z"];
const RGB: &[&str] = &["r", "g", "b"];

/// All columns, in the order in which every format has them.
const COLUMNS: [Column; 8] = [
    Column {
        name: "centre",
        kind: Kind::F64,
        components: XYZ,
        encode: |table, p, out| out.extend(table.centre(p).iter().flat_map(|x| x.to_le_bytes())),
    },
    Column { name: "normal", kind: Kind::F32, components: XYZ, encode: |table, p, out| floats(&table.normal(p), out) },
    Column {
        name: "area",
        kind: Kind::F64,
        components: &[],
        encode: |table, p, out| out.extend(table.scene.area(p).to_le_bytes()),
    },
    Column {
        name: "emits",
        kind: Kind::Bool,
        components: &[],
        encode: |table, p, out| out.push(u8::from(table.light.emits[p.index()])),
    },
    Column {
        name: "irradiance",
        kind: Kind::F32,
        components: RGB,
        encode: |table, p, out| floats(&table.light.irradiance[p.index()], out),
    },
    Column {
        name: "radiosity",
        kind: Kind::F32,
        components: RGB,
        encode: |table, p, out| floats(&table.radiosity[p.index()], out),
    },
    Column {
        name: "standard_error",
        kind: Kind::F32,
        components: &[],
        encode: |table, p, out| floats(&[table.light.standard_error[p.index()]], out),
    },
    Column {
        name: "hits",
        kind: Kind::U32,
        components: &[],
        encode: |table, p, out| out.extend(table.light.hits[p.index()].to_le_bytes()),
    },
];

fn floats(values: &[f32], out: &mut Vec<u8>) {
    out.extend(values.iter().flat_map(|x| x.to_le_bytes()));
}
