//! What light meets: colour, geometry, materials, patches, cameras and the built-in scenes.
pub mod animation;
pub mod authored;
pub mod brdf;
pub mod builtin;
mod bumps;
mod bvh;
pub mod camera;
pub mod camera_path;
pub mod cells;
pub mod check;
pub mod complete;
pub mod environment;
mod estimate;
mod fingerprint;
pub mod geom;
mod means;
mod mips;
pub mod passing;
pub mod patch;
pub mod punctual;
pub mod rgb;
pub mod sample;
mod sight;
mod surface;
pub mod texture;
pub mod validate;

pub use animation::{CameraAnimation, Interpolation, Joint, MovingJoint, Track};
pub use authored::{
    Environment, EnvironmentMap, Instance, LightKind, LightProfile, Material, Mesh, NormalMap, Opacity, PunctualLight,
    RadianceMap, Scene, Sky, SkyLevel, SkyModel, Surface, Texel, TextureImage, TextureRef, TextureTransform,
    Transmission, Volume, Wrap,
};
pub use bvh::SurfaceHit;
pub use camera::{Camera, Lens, Projection};
pub use camera_path::{CameraKey, CameraPath};
pub use cells::Cells;
pub use estimate::{Estimate, estimate};
pub use patch::{PatchBudget, PatchError, PatchId, PatchOptions, PatchScene, Side, TriangleSource, sources};
pub use punctual::PointLight;
pub use rgb::Rgb;
pub use surface::SurfacePoint;
