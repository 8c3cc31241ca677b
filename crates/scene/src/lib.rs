//! What light meets: colour, geometry, materials, patches, cameras and the built-in scenes.
pub mod authored;
pub mod brdf;
pub mod builtin;
pub mod camera;
pub mod geom;
pub mod rgb;
pub mod sample;

pub use authored::{
    Environment, Instance, Material, Mesh, Opacity, Scene, Surface, Texel, TextureImage, TextureRef, Wrap,
};
pub use camera::{Camera, Projection};
pub use rgb::Rgb;
