//! Baked light: the irradiance of a solution as textures and vertex values on the scene's own meshes, and in free space.
//!
//! `parts` says which sides of which meshes carry light, `atlas` gives every point of them a place on a page, `texels`
//! fills pages with the light that each texel's own piece of surface received, `dilate` goes on beyond the charts' rims
//! as far as filters look, `seams` makes charts agree where a smooth surface was cut, `vertices` fits values at vertices
//! instead, `probes` is the light in free space, `colours` multiplies by what surfaces reflect, for viewers without light. Knows
//! no file: what becomes of pages is `twinray-format`'s.

pub mod atlas;
mod clip;
mod colours;
mod dilate;
mod light;
mod lightmap;
mod overlap;
mod page;
pub mod parts;
pub mod probes;
mod seams;
mod texels;
mod vertices;
mod watch;

pub use atlas::{Atlas, AtlasError, AtlasOptions, LaidPart, LaidVertex, Layout, TexelDensity};
pub use colours::{Colours, colours};
pub use light::{Quality, SurfaceLight};
pub use lightmap::{Lightmap, LightmapOptions, bake};
pub use page::Page;
pub use parts::{Face, Part, parts};
pub use probes::{ProbeError, ProbeGrid, ProbeOptions, ProbeSpacing, ProbeVolume, bake_probes};
pub use seams::SeamJump;
pub use texels::PagePoint;
pub use vertices::{VertexLight, bake_vertices};
pub use watch::{Cancelled, Stage, Watch};
