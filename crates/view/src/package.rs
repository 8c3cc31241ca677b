//! A scene as the page needs it, once: triangles, lattices of nodes, materials, textures, cameras, surroundings.
//!
//! Places are those of the patches, about the scene's centre, so that single precision is enough; the header says where
//! the centre is. Triangles that are drawn alike follow each other. What the light is, comes apart: [`crate::light`].

use std::collections::HashMap;

use glam::DVec3;
use serde_json::{Value, json};
use twinray::render::walk::Nodes;
use twinray::scene::authored::{Material, Opacity, Surface, TextureRef, Wrap};
use twinray::scene::brdf::{Brdf, Ggx, Phong};
use twinray::scene::{Camera, Cells, PatchScene, Projection, Side};

use crate::container::Container;
use crate::packed::{LARGEST, octahedral, rgb9e5, snorm16};
use crate::textures::Textures;

/// Steps of the table of lobes' albedos: cosines in a row, then one column of means; rows by perceptual roughness.
const TABLE: u32 = 32;
/// The sky's picture.
const SKY: [u32; 2] = [512, 256];
/// Vertical fields of view for cameras that have none, radians: of a parallel projection that looks past the scene; of a
/// panorama, and at most of a fisheye, since a plane film stretches more than that too far.
const FIELD_OF_VIEW: f64 = 1.0;
const WIDE_FIELD_OF_VIEW: f64 = 1.5;
/// What the page allows.
const FIELDS_OF_VIEW: [f64; 2] = [0.175, 2.09];
/// A parallel projection's scene lies ahead if its middle is so far, in radii of the scene.
const AHEAD: f64 = 0.05;

/// What is said of a scene beside its surfaces.
#[derive(Clone, Debug)]
pub struct About<'a> {
    /// Its name.
    pub name: &'a str,
    /// Cameras to start from.
    pub cameras: &'a [Camera],
    /// Whether a server will bring light.
    pub live: bool,
    /// Name of the unit of irradiance.
    pub unit: &'a str,
    /// Textures are made smaller until their longer side is no longer than this, pixels.
    pub texture_size: u32,
}

/// The scene's bytes.
pub fn package(scene: &PatchScene, nodes: &Nodes, about: &About) -> Vec<u8> {
    let mut container = Container::default();
    let (order, batches) = batches(scene);
    let vertices = Vertices::of(scene, &order);
    container.add("positions", vertices.list.iter().flat_map(|v| v.position));
    container.add("normals", vertices.list.iter().flat_map(|v| v.normal));
    if scene.materials().iter().any(|m| !m.textures().is_empty()) {
        container.add("texcoords", vertices.list.iter().flat_map(|v| v.texcoords).map(f32::from_bits));
    }
    container.add("corners", vertices.corners.iter().copied());
    container.add("triangles", order.iter().flat_map(|&t| record(scene, nodes, t)));
    container.add("nodes", nodes.node_of_slot.iter().copied());
    container.add("albedos", albedos());
    let sky = scene.environment().map(|sky| {
        let pixel = |index: u32| {
            let (x, y) = (index % SKY[0], index / SKY[0]);
            let longitude = ((f64::from(x) + 0.5) / f64::from(SKY[0]) - 0.5) * std::f64::consts::TAU;
            let (sin, cos) = ((f64::from(y) + 0.5) / f64::from(SKY[1]) * std::f64::consts::PI).sin_cos();
            sky.radiance(DVec3::new(sin * longitude.sin(), cos, -sin * longitude.cos())).to_f32()
        };
        let pixels: Vec<[f32; 3]> = (0..SKY[0] * SKY[1]).map(pixel).collect();
        let scale = scale(pixels.iter().flatten().copied());
        container.add("sky", pixels.iter().map(|p| rgb9e5(p.map(|c| c / scale))));
        json!({ "width": SKY[0], "height": SKY[1], "scale": scale })
    });
    let mut textures = Textures::new(about.texture_size);
    let materials: Vec<Value> = scene.materials().iter().map(|m| material(m, &mut textures)).collect();
    let images = textures.write(scene.images(), &mut container);
    let bounds = vertices.bounds();
    let cameras: Vec<Value> = about.cameras.iter().map(|c| camera(c, scene.centre(), scene.radius())).collect();
    container.finish(json!({
        "version": 1,
        "id": id(scene, nodes),
        "generator": concat!("twinray ", env!("CARGO_PKG_VERSION")),
        "name": about.name,
        "live": about.live,
        "unit": about.unit,
        "up": [0, 1, 0],
        "centre": scene.centre().to_array(),
        "radius": scene.radius(),
        "bounds": bounds,
        "cameras": cameras,
        "materials": materials,
        "batches": batches,
        "images": images,
        "sky": sky,
        "table": TABLE,
        "glossy": { "slots": nodes.glossy_slots, "nodes": nodes.glossy_nodes, "cells": nodes.glossy_cells() },
        "stats": { "triangles": scene.triangle_count(), "cells": scene.len(), "nodes": nodes.len() },
    }))
}

/// What light must be of, to be that of this package: the scene as it is lit, and its nodes.
pub fn id(scene: &PatchScene, nodes: &Nodes) -> String {
    format!("{:016x}-{}-{}", scene.fingerprint(), nodes.len(), nodes.glossy_cells())
}

/// By which power of two numbers are divided so that they fit into [`rgb9e5`] with room.
pub(crate) fn scale(numbers: impl Iterator<Item = f32>) -> f32 {
    let most = numbers.filter(|x| x.is_finite()).fold(0.0, f32::max);
    if most > 0.0 { f32::exp2((most / (0.25 * LARGEST)).log2().ceil().clamp(-100.0, 100.0)) } else { 1.0 }
}

/// Triangles in the order in which they are drawn, and the runs of it: opaque ones first.
fn batches(scene: &PatchScene) -> (Vec<u32>, Vec<Value>) {
    type Key = (bool, bool, [Option<Sampler>; 4]);
    let key = |material: &Material| -> Key {
        let see_through = material.opacity == Opacity::Blend || material.transmission.is_some();
        (see_through, material.has_two_sides(), slots(material).map(|t| t.map(Sampler::of)))
    };
    let keys: Vec<Key> = scene.materials().iter().map(key).collect();
    let of = |t: u32| {
        let (see_through, _, samplers) = keys[scene.material_index(t)];
        // A scene may be two-sided as a whole.
        (see_through, scene.sides_of(t) == 2, samplers)
    };
    let mut order: Vec<u32> = (0..scene.triangle_count() as u32).collect();
    order.sort_by_key(|&t| (of(t), t));
    let mut batches = Vec::new();
    let mut start = 0;
    for run in order.chunk_by(|&a, &b| of(a) == of(b)) {
        let (see_through, two_sided, _) = of(run[0]);
        // Any material of the run has its textures and wraps.
        let material = scene.material_index(run[0]);
        batches.push(json!({
            "start": start, "count": run.len(), "seeThrough": see_through, "twoSided": two_sided, "material": material,
        }));
        start += run.len();
    }
    (order, batches)
}

/// What of a texture is set for a draw call.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Sampler {
    image: usize,
    wrap: [u8; 2],
    nearest: bool,
}

impl Sampler {
    fn of(texture: &TextureRef) -> Self {
        Self { image: texture.image, wrap: texture.wrap.map(|w| w as u8), nearest: texture.nearest }
    }
}

/// Textures of a material that the page knows: base colour, emission, metalness and roughness, normals.
fn slots(material: &Material) -> [Option<&TextureRef>; 4] {
    let (base, metal) = match &material.surface {
        Surface::Lambertian { reflectance } => (&reflectance.texture, None),
        Surface::MetallicRoughness { base_color, metallic_roughness_texture, .. } => {
            (&base_color.texture, metallic_roughness_texture.as_ref())
        }
        Surface::Phong { diffuse, .. } => (&diffuse.texture, None),
    };
    let normals = material.normal_map.as_ref().map(|n| &n.texture);
    [base.as_ref(), material.emission_texture.as_ref(), metal, normals]
}

fn material(material: &Material, textures: &mut Textures) -> Value {
    let rgb = |c: twinray::scene::Rgb| c.to_array();
    let mut texture = |t: Option<&TextureRef>, is_colour: bool| {
        t.map(|t| {
            let wrap = t.wrap.map(|w| match w {
                Wrap::Repeat => "repeat",
                Wrap::Mirror => "mirror",
                Wrap::Clamp => "clamp",
            });
            let [x, y, origin] = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]].map(|p| t.transform.apply(p));
            json!({
                "image": textures.wanted(t.image, is_colour), "set": t.set, "wrap": wrap, "nearest": t.nearest,
                // Columns of a matrix, then the offset.
                "matrix": [x[0] - origin[0], x[1] - origin[1], y[0] - origin[0], y[1] - origin[1], origin[0], origin[1]],
            })
        })
    };
    let [base, emission, metal, normals] = slots(material);
    let textures = json!({
        "base": texture(base, true), "emission": texture(emission, true), "metallicRoughness": texture(metal, false),
        "normal": texture(normals, false),
    });
    let (alpha, surface) = match &material.surface {
        Surface::Lambertian { reflectance: t } => (t.alpha, json!({ "kind": "lambertian", "color": rgb(t.factor) })),
        Surface::MetallicRoughness { base_color, metallic, roughness, specular, specular_color, ior, .. } => (
            base_color.alpha,
            json!({
                "kind": "metallic-roughness", "color": rgb(base_color.factor), "metallic": metallic,
                "roughness": roughness, "specular": specular, "specularColor": rgb(*specular_color), "ior": ior,
            }),
        ),
        Surface::Phong { diffuse, specular, exponent } => (
            diffuse.alpha,
            json!({ "kind": "phong", "color": rgb(diffuse.factor), "specular": rgb(*specular), "exponent": exponent }),
        ),
    };
    let cutoff = if let Opacity::Mask { cutoff } = material.opacity { Some(cutoff) } else { None };
    json!({
        "name": material.name, "surface": surface, "alpha": alpha, "cutoff": cutoff,
        "blend": material.opacity == Opacity::Blend, "emission": rgb(material.emission),
        "transmission": material.transmission.as_ref().map_or(0.0, |t| t.factor),
        "normalScale": material.normal_map.as_ref().map_or(1.0, |n| n.scale), "textures": textures,
    })
}

/// A camera as the page's perspective one: what is no perspective is seen from the same place, and says what it is.
fn camera(camera: &Camera, centre: DVec3, radius: f64) -> Value {
    let (eye, forward) = (camera.eye - centre, camera.forward.normalize());
    let [least, most] = FIELDS_OF_VIEW;
    let (fov, projection) = match camera.projection {
        Projection::Perspective { vertical_fov } => (vertical_fov, "perspective"),
        Projection::Orthographic { half_height } => {
            // As much of the scene's middle as the parallel picture has.
            let depth = -eye.dot(forward);
            let fits = 2.0 * (half_height / depth).atan();
            (if depth > AHEAD * radius { fits.clamp(least, most) } else { FIELD_OF_VIEW }, "parallel")
        }
        Projection::Panorama => (WIDE_FIELD_OF_VIEW, "panorama"),
        Projection::Fisheye { angle } => (angle.clamp(least, WIDE_FIELD_OF_VIEW), "fisheye"),
    };
    json!({
        "name": camera.name, "eye": eye.to_array(), "fov": fov, "projection": projection,
        "forward": forward.to_array(), "up": camera.up.normalize_or(DVec3::Y).to_array(),
    })
}

/// Two texels of four numbers: `[m, or for strips 2³¹ + 4 · foot + first; first slot in front; behind; material]`, where
/// 65,535 stands for a foot at 1; `[first glossy cell in front; behind; columns; rows]`.
fn record(scene: &PatchScene, nodes: &Nodes, t: u32) -> [u32; 8] {
    let index = t as usize;
    let [front, back] = nodes.first_slots[index];
    let [cells_front, cells_back] = nodes.first_cells[index];
    let material = scene.material_index(t) as u32;
    match scene.cells_of(t) {
        Cells::Regular { m } => [m, front, back, material, cells_front, cells_back, 0, 0],
        Cells::Strips { columns, rows, first, foot } => {
            let foot = (foot * 65_535.0).round() as u32;
            let kind = 1 << 31 | foot << 2 | u32::from(first);
            [kind, front, back, material, cells_front, cells_back, columns, rows]
        }
    }
}

/// Albedos of lobes, `[TABLE][TABLE + 1][4]`: factors on the reflectance at normal and grazing incidence of a GGX lobe, the
/// albedo of a white Phong lobe, 0; in the last column the cosine-weighted means of the first two.
fn albedos() -> Vec<f32> {
    let mut numbers = Vec::new();
    for row in 0..TABLE {
        let roughness = f64::from(row) / f64::from(TABLE - 1);
        let metal = |white: f64| {
            let color = twinray::scene::Rgb::grey(white);
            Brdf::Ggx(Ggx::new(color, 1.0, roughness, 1.0, twinray::scene::Rgb::WHITE, 1.5))
        };
        let alpha = (roughness * roughness).max(1e-4);
        let none = twinray::scene::Rgb::BLACK;
        let phong = Brdf::Phong(Phong::new(none, twinray::scene::Rgb::WHITE, 2.0 / (alpha * alpha) - 2.0));
        let split = |cosine: f64| {
            let [one, zero] = [1.0, 0.0].map(|f0| metal(f0).lobe_albedo(cosine).g);
            [one - zero, zero]
        };
        for column in 0..TABLE {
            let cosine = f64::from(column) / f64::from(TABLE - 1);
            let [scale, bias] = split(cosine);
            numbers.extend([scale, bias, phong.lobe_albedo(cosine).g, 0.0].map(|x| x as f32));
        }
        const N: u32 = 64;
        let mut mean = [0.0; 2];
        for k in 0..N {
            let s = split((1.0 - (f64::from(k) + 0.5) / f64::from(N)).sqrt());
            mean = [0, 1].map(|i| mean[i] + s[i] / f64::from(N));
        }
        numbers.extend([mean[0], mean[1], 0.0, 0.0].map(|x| x as f32));
    }
    numbers
}

/// A vertex as it is told apart from others.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Vertex {
    position: [u32; 3],
    normal: [i16; 2],
    texcoords: [u32; 4],
}

/// A vertex's numbers.
struct Plain {
    position: [f32; 3],
    normal: [i16; 2],
    texcoords: [u32; 4],
}

struct Vertices {
    list: Vec<Plain>,
    corners: Vec<u32>,
}

impl Vertices {
    fn of(scene: &PatchScene, order: &[u32]) -> Self {
        let mut number: HashMap<Vertex, u32> = HashMap::new();
        let (mut list, mut corners) = (Vec::new(), Vec::with_capacity(3 * order.len()));
        for &t in order {
            let points = scene.corners(t);
            let sets = [0, 1].map(|set| scene.vertex_texcoords(t, set).unwrap_or_default());
            for (k, [u, v]) in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
                let position = points[k].to_array().map(|x| x as f32);
                let normal = octahedral(scene.shading_normal(t, Side::Front, u, v)).map(snorm16);
                let [[a, b], [c, d]] = sets.map(|s| s[k].map(f32::to_bits));
                let texcoords = [a, b, c, d];
                let vertex = Vertex { position: position.map(f32::to_bits), normal, texcoords };
                corners.push(*number.entry(vertex).or_insert_with(|| {
                    list.push(Plain { position, normal, texcoords });
                    list.len() as u32 - 1
                }));
            }
        }
        Self { list, corners }
    }

    fn bounds(&self) -> [[f32; 3]; 2] {
        let fold = |start: f32, f: fn(f32, f32) -> f32| {
            self.list.iter().fold([start; 3], |b, v| [0, 1, 2].map(|k| f(b[k], v.position[k])))
        };
        [fold(f32::INFINITY, f32::min), fold(f32::NEG_INFINITY, f32::max)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_without_a_perspective_get_one_from_the_same_place() {
        let centre = DVec3::new(10.0, 0.0, 0.0);
        let packed = |projection, eye| {
            let looking = Camera::look_at("c", eye, eye - DVec3::Z, DVec3::Y, 40.0);
            camera(&Camera { projection, ..looking }, centre, 5.0)
        };
        let before = centre + 4.0 * DVec3::Z;
        let fov = |value: &Value| value["fov"].as_f64().unwrap();
        // Half of the height, at the distance of the scene's middle.
        let parallel = packed(Projection::Orthographic { half_height: 3.0 }, before);
        assert!((fov(&parallel) - 2.0 * 0.75_f64.atan()).abs() < 1e-12, "{parallel}");
        assert_eq!((&parallel["projection"], &parallel["eye"]), (&json!("parallel"), &json!([0.0, 0.0, 4.0])));
        for (projection, eye, expected) in [
            (Projection::Orthographic { half_height: 3.0 }, centre - DVec3::Z, FIELD_OF_VIEW),
            (Projection::Orthographic { half_height: 1e9 }, before, FIELDS_OF_VIEW[1]),
            (Projection::Panorama, before, WIDE_FIELD_OF_VIEW),
            (Projection::Fisheye { angle: 3.1 }, before, WIDE_FIELD_OF_VIEW),
            (Projection::Fisheye { angle: 0.7 }, before, 0.7),
            (Projection::Perspective { vertical_fov: 2.5 }, before, 2.5),
        ] {
            assert!((fov(&packed(projection, eye)) - expected).abs() < 1e-12, "{projection:?}");
        }
    }
}
