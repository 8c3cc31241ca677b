//! What the crate promises, one module per promise: features, faults, round trips, pictures, real and bad files.

mod any_scene;
mod export;
mod gltf_animations;
mod gltf_faults;
mod gltf_geometry;
mod gltf_lights;
mod gltf_material;
mod gltf_nodes;
mod ies;
mod ktx2;
mod limits;
mod lit;
mod mutation;
mod obj;
mod pictures;
mod probes;
mod radiance_map;
mod read_picture;
mod real;
mod round_trip;
mod seeds;
mod support;
mod twin;
