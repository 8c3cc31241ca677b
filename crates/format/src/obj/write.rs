//! A scene as OBJ, MTL and PNG files that other programs read.
//!
//! Everything is in world space, so a mesh that is placed twice is written twice. What the format cannot say:
//! cameras and surroundings are left out, one-sided surfaces become two-sided, metallic-roughness becomes the
//! Phong lobe of about the same width, glass loses its attenuation, pictures their turns. Reading is in the sibling modules.

use std::collections::HashSet;
use std::fmt::Write as _;

use glam::{DMat3, DVec3};
use twinray_scene::{
    Instance, Material, Mesh, NormalMap, Opacity, Rgb, Scene, Surface, Texel, TextureRef, TextureTransform, Wrap,
};

use crate::png::encode_rgba;

/// The files of a scene in OBJ format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjFiles {
    /// The `.obj` file; it names `mtl_name`.
    pub obj: Vec<u8>,
    /// The `.mtl` file.
    pub mtl: Vec<u8>,
    /// The name under which `mtl` must be stored beside `obj`.
    pub mtl_name: String,
    /// File names and bytes of the textures, to be stored beside both.
    pub textures: Vec<(String, Vec<u8>)>,
}

/// Writes `scene` as OBJ, MTL and PNG files; equal scenes give equal bytes.
///
/// Emission is written as Ke, Phong as Kd, Ks and Ns, metallic-roughness as the Phong lobe of exponent
/// 2/α² − 2. Cameras, surroundings and one-sidedness are left out: the format has no words for them.
///
/// # Panics
/// If the scene is not valid: an index in it points nowhere, or an image has not `4 × width × height` bytes.
pub fn write_obj(scene: &Scene) -> ObjFiles {
    let stem: String =
        scene.name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
    let stem = if stem.is_empty() { "scene".to_owned() } else { stem };
    let mtl_name = format!("{stem}.mtl");
    let picture_name = |i: usize| format!("{stem}_{i}.png");

    let mut names = Names::default();
    let material_names: Vec<String> = scene.materials.iter().map(|m| names.unique(&m.name, "material")).collect();
    let mut mtl = String::from("# written by twinray: linear colours, Ke is radiance\n");
    let mut used = vec![false; scene.images.len()];
    for (material, name) in scene.materials.iter().zip(&material_names) {
        write_material(&mut mtl, material, name, &picture_name, &mut used);
    }

    let mut obj = format!("# written by twinray: world space, +Y up\nmtllib {mtl_name}\n");
    let (mut names, mut written) = (Names::default(), Written::default());
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let name = names.unique(&instance.name, "object");
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(obj, "o {name}\nusemtl {}", material_names[mesh.material]);
        write_mesh(&mut obj, mesh, instance, &mut written);
    }
    let textures = used.iter().enumerate().filter(|(_, used)| **used).map(|(i, _)| {
        let image = &scene.images[i];
        (picture_name(i), encode_rgba(image.width, image.height, &image.rgba))
    });
    ObjFiles { obj: obj.into_bytes(), mtl: mtl.into_bytes(), mtl_name, textures: textures.collect() }
}

/// Numbers of vertices, texture coordinates and normals so far: OBJ counts through the whole file.
#[derive(Default)]
struct Written {
    positions: usize,
    texcoords: usize,
    normals: usize,
}

fn write_mesh(obj: &mut String, mesh: &Mesh, instance: &Instance, written: &mut Written) {
    let transform = instance.transform;
    for p in &mesh.positions {
        let p = transform.transform_point3(glam::Vec3::from(*p).as_dvec3());
        let _ = writeln!(obj, "v {} {} {}", Decimal(p.x), Decimal(p.y), Decimal(p.z));
    }
    for [u, v] in mesh.texcoords.iter().flatten() {
        let _ = writeln!(obj, "vt {} {}", Decimal(f64::from(*u)), Decimal(1.0 - f64::from(*v)));
    }
    let to_world = normal_matrix(transform.matrix3);
    for n in mesh.normals.iter().flatten() {
        let n = (to_world * glam::Vec3::from(*n).as_dvec3()).normalize_or(DVec3::Y);
        let _ = writeln!(obj, "vn {} {} {}", Decimal(n.x), Decimal(n.y), Decimal(n.z));
    }
    // In world space a mirrored mesh winds the other way round; its front must stay where it was.
    let mirrored = transform.matrix3.determinant() < 0.0;
    for &[a, b, c] in &mesh.triangles {
        obj.push('f');
        for i in if mirrored { [a, c, b] } else { [a, b, c] } {
            let i = i as usize;
            let _ = write!(obj, " {}", written.positions + i + 1);
            match (mesh.texcoords.is_some(), mesh.normals.is_some()) {
                (true, true) => {
                    let _ = write!(obj, "/{}/{}", written.texcoords + i + 1, written.normals + i + 1);
                }
                (true, false) => {
                    let _ = write!(obj, "/{}", written.texcoords + i + 1);
                }
                (false, true) => {
                    let _ = write!(obj, "//{}", written.normals + i + 1);
                }
                (false, false) => {}
            }
        }
        obj.push('\n');
    }
    written.positions += mesh.positions.len();
    written.texcoords += mesh.texcoords.as_ref().map_or(0, Vec::len);
    written.normals += mesh.normals.as_ref().map_or(0, Vec::len);
}

/// Takes normals to the world, up to a positive factor. Unlike the inverse transpose it exists for every matrix.
fn normal_matrix(m: DMat3) -> DMat3 {
    let cofactors = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    // Cofactors are det × inverse transpose: of a mirror they would point inwards.
    if m.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}

fn write_material(
    mtl: &mut String,
    material: &Material,
    name: &str,
    picture_name: &dyn Fn(usize) -> String,
    used: &mut [bool],
) {
    let _ = writeln!(mtl, "\nnewmtl {name}");
    let mut map = |mtl: &mut String, key: &str, texture: &TextureRef| {
        used[texture.image] = true;
        // OBJ has no mirrored tiling.
        let clamp = if texture.wrap == [Wrap::Clamp; 2] { " -clamp on" } else { "" };
        let _ = writeln!(mtl, "{key}{clamp}{} {}", placing(&texture.transform), picture_name(texture.image));
    };
    let (diffuse, specular, exponent) = as_phong(&material.surface);
    colour(mtl, "Kd", diffuse.factor);
    if let Some(texture) = &diffuse.texture {
        map(mtl, "map_Kd", texture);
        if matches!(material.opacity, Opacity::Mask { .. }) {
            map(mtl, "map_d", texture);
        }
    }
    if let Some(exponent) = exponent {
        colour(mtl, "Ks", specular);
        let _ = writeln!(mtl, "Ns {}", Decimal(exponent));
    }
    write_passing(mtl, material, exponent.is_some());
    if !material.emission.is_black() {
        colour(mtl, "Ke", material.emission);
        material.emission_texture.iter().for_each(|t| map(mtl, "map_Ke", t));
    }
    if let Some(NormalMap { texture, scale }) = &material.normal_map {
        map(mtl, &format!("norm -bm {}", Decimal(*scale)), texture);
    }
}

/// The illumination model, and what goes with it: that of glass, or the share that is there.
fn write_passing(mtl: &mut String, material: &Material, has_lobe: bool) {
    let Some(transmission) = &material.transmission else {
        let _ = writeln!(mtl, "illum {}", if has_lobe { 2 } else { 1 });
        if material.opacity == Opacity::Blend {
            let _ = writeln!(mtl, "d {}", Decimal(base(&material.surface).alpha));
        }
        return;
    };
    let ior = if let Surface::MetallicRoughness { ior, .. } = material.surface { ior } else { 1.5 };
    let model = if transmission.volume.is_some() { 7 } else { 4 };
    let _ = writeln!(mtl, "illum {model}\nNi {}", Decimal(ior));
    colour(mtl, "Tf", base(&material.surface).factor);
    if transmission.factor < 1.0 {
        let _ = writeln!(mtl, "d {}", Decimal(1.0 - transmission.factor));
    }
}

/// Options of a map that lies elsewhere. OBJ counts v from below and turns no pictures.
fn placing(transform: &TextureTransform) -> String {
    let TextureTransform { offset: [u, v], scale: [su, sv], .. } = *transform;
    let mut options = String::new();
    if [su, sv] != [1.0; 2] {
        let _ = write!(options, " -s {} {} 1", Decimal(su), Decimal(sv));
    }
    if [u, 1.0 - sv - v] != [0.0; 2] {
        let _ = write!(options, " -o {} {} 0", Decimal(u), Decimal(1.0 - sv - v));
    }
    options
}

fn base(surface: &Surface) -> &Texel {
    match surface {
        Surface::Lambertian { reflectance } => reflectance,
        Surface::MetallicRoughness { base_color, .. } => base_color,
        Surface::Phong { diffuse, .. } => diffuse,
    }
}

fn as_phong(surface: &Surface) -> (Texel, Rgb, Option<f64>) {
    match surface {
        Surface::Lambertian { reflectance } => (reflectance.clone(), Rgb::BLACK, None),
        Surface::Phong { diffuse, specular, exponent } => (diffuse.clone(), *specular, Some(*exponent)),
        Surface::MetallicRoughness { base_color, metallic, roughness, specular, specular_color, ior, .. } => {
            let f0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
            let dielectric = (*specular_color * f0).map(|c| c.min(1.0)) * *specular;
            let lobe = dielectric.lerp(base_color.factor, *metallic);
            let diffuse =
                Texel { factor: base_color.factor * (1.0 - metallic), alpha: 1.0, texture: base_color.texture.clone() };
            // α = roughness², and a Phong lobe of exponent 2/α² − 2 has about its width (Walter et al. 2007, §5.2).
            let alpha = (roughness * roughness).max(1e-3);
            (diffuse, lobe, Some((2.0 / (alpha * alpha) - 2.0).max(1e-3)))
        }
    }
}

fn colour(mtl: &mut String, key: &str, c: Rgb) {
    let _ = writeln!(mtl, "{key} {} {} {}", Decimal(c.r), Decimal(c.g), Decimal(c.b));
}

/// A number in the fewest digits that read back to the same value; single precision where that is what it is.
struct Decimal(f64);

impl std::fmt::Display for Decimal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (wide, narrow) = (self.0, self.0 as f32);
        let single = f64::from(narrow) == wide;
        // Plain decimals, which every reader understands, unless they became very long.
        let plain = wide == 0.0 || (1e-7..1e16).contains(&wide.abs());
        match (single, plain) {
            (true, true) => write!(f, "{narrow}"),
            (true, false) => write!(f, "{narrow:e}"),
            (false, true) => write!(f, "{wide}"),
            (false, false) => write!(f, "{wide:e}"),
        }
    }
}

/// Names that survive the format: one line, no backslash at its end, each used once.
#[derive(Default)]
struct Names {
    taken: HashSet<String>,
}

impl Names {
    fn unique(&mut self, name: &str, fallback: &str) -> String {
        let clean: String = name.chars().map(|c| if c.is_control() || c == '\\' { '_' } else { c }).collect();
        let clean = clean.split_whitespace().collect::<Vec<_>>().join(" ");
        let base = if clean.is_empty() { fallback.to_owned() } else { clean };
        let numbered = (2..).map(|i| format!("{base}.{i}"));
        let free = std::iter::once(base.clone()).chain(numbered).find(|n| !self.taken.contains(n));
        let name = free.unwrap_or(base);
        self.taken.insert(name.clone());
        name
    }
}
