//! Bytes to twinray's types and back, for every file kind: glTF 2.0 and OBJ scenes, PNG, EXR and KTX2 pictures, irradiance volumes.
//!
//! Lives here: [`read_scene`] and the writers, one module per file kind, the [`Limits`] hostile bytes run into,
//! and the two lists a reader answers with, [`FormatError`] and [`Warning`]. Not here: paths and the disk. The
//! caller hands in bytes and a function that fetches referenced files; what it fetches is checked here first, so
//! that no file can make a program read outside its own folder. Called by: the command and the viewer.
//!
//! ```
//! use twinray_format::{Limits, read_scene};
//! let obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
//! let mut no_files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
//! let reading = read_scene("triangle.obj", obj, &mut no_files, &Limits::default()).unwrap();
//! assert_eq!(reading.scene.meshes[0].triangles.len(), 1);
//! ```

mod context;
mod error;
mod export;
mod exr;
mod geometry;
mod gltf;
mod ies;
mod ktx2;
mod limits;
mod obj;
mod picture;
mod png;
mod probes;
mod radiance;
mod read;
mod reference;
mod reflectance;
mod texture;
mod twin;
mod warning;

pub use crate::error::FormatError;
pub use crate::export::{CellTable, write_csv, write_npz, write_ply, write_vtu};
pub use crate::exr::{write_exr, write_exr_aovs};
pub use crate::gltf::{Lit, LitGlb, LitMaterial, LitPage, LitPicture, LitSurface, LitVertex, write_glb, write_lit_glb};
pub use crate::ies::read_ies;
pub use crate::ktx2::{Ktx2Format, Ktx2Packing, write_ktx2};
pub use crate::limits::Limits;
pub use crate::obj::{ObjFiles, write_obj};
pub use crate::picture::{PictureFile, read_picture};
pub use crate::png::{write_png, write_png_rgba};
pub use crate::probes::{
    BevyVolumeError, ProbeArrays, ProbeLattice, write_bevy_volume, write_probes_exr, write_probes_json,
};
pub use crate::radiance::read_radiance_map;
pub use crate::read::{Origin, Reading, Resolver, read_scene};
pub use crate::twin::{Method, Provenance, SceneSource, SolutionFile, StoredSolution, read_solution, write_solution};
pub use crate::warning::Warning;
