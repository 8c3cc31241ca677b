//! What a scene will be once it is cut: how many patches, and how much memory, before any of it is paid for.
//!
//! The number of patches is exact, since it is counted as the cutting itself counts. Memory is what the arrays of
//! `patch` and the ray kernel take; the allocator's share is in constants that were fitted to peaks of resident memory.
//! Not here: the solver's memory (solve), pictures and files.

use twinray_rays::Bvh;

use crate::authored::{Environment, Opacity, Scene, Surface, Texel};
use crate::cells::Outline;
use crate::means::{TriangleMeans, has_specular_textures};
use crate::patch::{Attributes, PatchError, PatchOptions, Triangle, bounds, cell_area, place, rare_attributes};
use crate::rgb::Rgb;
use crate::surface::base_texel;

/// What cutting a scene gives and takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Triangles that rays can meet.
    pub triangles: usize,
    /// Patches, exactly.
    pub patches: usize,
    /// Patches with a lobe, exactly.
    pub glossy_patches: usize,
    /// Mean reflectance of the patches by area, luminance: textures count as if they were white by half.
    pub reflectance: f64,
    /// Memory of the [`crate::PatchScene`], its ray kernel included, bytes.
    pub bytes: usize,
    /// Most memory while it is built, itself included, beside the [`Scene`], bytes.
    pub peak_bytes: usize,
}

/// A texture's mean, where nobody has looked.
const TEXTURE_MEAN: f64 = 0.5;

/// Bytes that an allocation takes beyond its contents, and the least that there is of it.
const ALLOCATION: usize = 16;
const LEAST_ALLOCATION: usize = 32;

/// What [`crate::PatchScene::new`] will make of `scene`, in time linear in its triangles and with 32 bytes of memory for
/// each of them.
///
/// # Errors
/// As [`crate::PatchScene::new`].
///
/// # Panics
/// If an index of the scene is out of range: see [`Scene::validate`].
pub fn estimate(scene: &Scene, options: PatchOptions) -> Result<Estimate, PatchError> {
    let (centre, _) = bounds(scene).ok_or(PatchError::Empty)?;
    let (mut outlines, mut materials) = (Vec::new(), Vec::new());
    place(scene, centre, &mut |placed| {
        let material = placed.mesh.material;
        let sides = 1 + u32::from(scene.materials[material].has_two_sides() || options.two_sided);
        outlines.push((Outline::of(placed.corners()), sides));
        materials.push((material as u32, placed.mesh.texcoords.is_some() || placed.mesh.second_texcoords.is_some()));
    });
    if outlines.is_empty() {
        return Err(PatchError::Empty);
    }
    let (area, patches) = cell_area(&outlines, options.budget)?;

    let kinds: Vec<Kind> = scene.materials.iter().map(Kind::of).collect();
    let (mut glossy, mut textured_cells) = (0, 0);
    let (mut total_area, mut reflected) = (0.0, 0.0);
    for ((outline, sides), &(material, has_uv)) in outlines.iter().zip(&materials) {
        let kind = &kinds[material as usize];
        let cells = outline.count(area) as usize;
        glossy += if kind.glossy { cells * *sides as usize } else { 0 };
        textured_cells += if kind.textured && has_uv { cells } else { 0 };
        total_area += outline.area();
        reflected += outline.area() * kind.reflectance;
    }
    let (triangles, patches) = (outlines.len(), patches as usize);
    // A scene without light gets some before it is solved, perhaps a lamp.
    let emits = (scene.environment.is_none() && scene.lights.is_empty())
        || scene.materials.iter().any(|m| !m.emission.is_black());
    let holes = scene.materials.iter().any(|m| m.opacity != Opacity::Opaque);
    let constants = size_of::<u32>() + 12 + if emits { 12 } else { 0 } + if holes { 4 } else { 0 };

    let [kernel, kernel_peak] = Bvh::expected_bytes(triangles);
    let [second, tangents] = rare_attributes(scene);
    let rare = if second { size_of::<Option<[[f32; 2]; 3]>>() } else { 0 }
        + if tangents { size_of::<Option<[[f32; 4]; 3]>>() } else { 0 }
        + if scene.materials.iter().any(has_specular_textures) { size_of::<[f32; 4]>() } else { 0 };
    let fixed = triangles * (size_of::<Triangle>() + size_of::<Attributes>() + rare);
    let kernel_input = triangles * size_of::<[[f32; 3]; 3]>();
    let while_built = kernel_input + size_of::<u32>() * patches + kernel_peak;
    // Every triangle's means are three lists: of one entry each, or grown to one for each cell.
    let means = triangles * (size_of::<TriangleMeans>() + 3 * LEAST_ALLOCATION)
        + textured_cells * 28
        + if textured_cells > 0 { triangles * ALLOCATION } else { 0 };
    let while_averaged = kernel_input + kernel + means + constants * patches;
    // The sums by which directions of a map are chosen.
    let surroundings = match &scene.environment {
        Some(Environment::Map(map)) => size_of::<f64>() * map.image.pixels.len(),
        _ => 0,
    };
    Ok(Estimate {
        triangles,
        patches,
        glossy_patches: glossy,
        reflectance: reflected / total_area,
        bytes: fixed + kernel + constants * patches + surroundings,
        peak_bytes: fixed + surroundings + while_built.max(while_averaged),
    })
}

/// What of a material matters here.
struct Kind {
    glossy: bool,
    textured: bool,
    reflectance: f64,
}

impl Kind {
    fn of(material: &crate::authored::Material) -> Self {
        let base = base_texel(&material.surface);
        let lobe = match material.surface {
            Surface::Lambertian { .. } | Surface::MetallicRoughness { .. } => Rgb::BLACK,
            Surface::Phong { specular, .. } => specular,
        };
        Self {
            glossy: !matches!(material.surface, Surface::Lambertian { .. }),
            textured: base.texture.is_some() || material.emission_texture.is_some(),
            reflectance: mean(base) + lobe.luminance(),
        }
    }
}

fn mean(texel: &Texel) -> f64 {
    texel.factor.luminance() * if texel.texture.is_some() { TEXTURE_MEAN } else { 1.0 }
}

impl Scene {
    /// Memory of the meshes, placements and pictures, bytes; pictures that are shared with others count in full.
    pub fn bytes(&self) -> usize {
        let meshes = self.meshes.iter().map(|m| {
            let normals = m.normals.as_ref().map_or(0, |n| n.len() * 12);
            let tangents = m.tangents.as_ref().map_or(0, |t| t.len() * 16);
            let texcoords = m.texcoords.iter().chain(&m.second_texcoords).map(|t| t.len() * 8).sum::<usize>();
            size_of_val(m)
                + m.name.len()
                + 12 * (m.positions.len() + m.triangles.len())
                + normals
                + tangents
                + texcoords
        });
        let instances = self.instances.iter().map(|i| size_of_val(i) + i.name.len());
        let images = self.images.iter().map(|i| size_of_val(&**i) + i.rgba.len());
        let materials = self.materials.iter().map(|m| size_of_val(m) + m.name.len());
        meshes.chain(instances).chain(images).chain(materials).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::authored::{NormalMap, TextureImage, TextureRef};
    use crate::builtin;
    use crate::patch::{PatchBudget, PatchScene};

    /// The estimate counts what the cutting gives, whatever the budget, and knows what the result takes.
    #[test]
    fn patches_are_counted_exactly() {
        for (name, _) in builtin::NAMES {
            let scene = builtin::by_name(name).expect(name);
            for budget in [PatchBudget::Count(1), PatchBudget::Count(5000), PatchBudget::Size(0.17)] {
                for two_sided in [false, true] {
                    let options = PatchOptions { budget, two_sided };
                    let expected = estimate(&scene, options).expect(name);
                    let patches = PatchScene::new(&scene, options).expect(name);
                    let glossy = patches.patches().filter(|&p| patches.is_glossy(p)).count();
                    let counts = (patches.triangle_count(), patches.len(), glossy);
                    assert_eq!((expected.triangles, expected.patches, expected.glossy_patches), counts, "{name}");
                    let [kernel, constants] = patches.bytes();
                    let ratio = expected.bytes as f64 / (kernel + constants) as f64;
                    assert!((1.0..1.15).contains(&ratio) || expected.bytes < 100_000, "{name} {budget:?}: {ratio}");
                    assert!(expected.peak_bytes >= expected.bytes);
                }
            }
        }
    }

    /// Attributes that few scenes need cost what they take, and nothing where no material asks for them.
    #[test]
    fn rare_attributes_are_counted() {
        let options = PatchOptions { budget: PatchBudget::Count(1), two_sided: false };
        let bytes = |scene: &Scene| {
            let [kernel, constants] = PatchScene::new(scene, options).unwrap().bytes();
            (estimate(scene, options).unwrap().bytes as i64, (kernel + constants) as i64)
        };
        let mut scene = builtin::cornell(false);
        scene.images.push(std::sync::Arc::new(TextureImage {
            name: "t".into(),
            width: 1,
            height: 1,
            rgba: vec![255; 4],
        }));
        let plain = bytes(&scene);
        for mesh in &mut scene.meshes {
            mesh.second_texcoords = Some(vec![[0.0; 2]; mesh.positions.len()]);
            mesh.tangents = Some(vec![[1.0, 0.0, 0.0, 1.0]; mesh.positions.len()]);
        }
        assert_eq!(bytes(&scene), plain);
        let texture = TextureRef { set: 1, ..TextureRef::of(0) };
        scene.materials[0].normal_map = Some(NormalMap { texture: texture.clone(), scale: 1.0 });
        let rich = bytes(&scene);
        assert!(rich.1 > plain.1);
        assert_eq!(rich.0 - plain.0, rich.1 - plain.1);
        scene.materials[0].surface = Surface::MetallicRoughness {
            base_color: Texel::constant(Rgb::grey(0.5)),
            metallic: 0.0,
            roughness: 0.5,
            metallic_roughness_texture: None,
            specular: 1.0,
            specular_texture: Some(texture),
            specular_color: Rgb::WHITE,
            specular_color_texture: None,
            ior: 1.5,
        };
        let glossy = bytes(&scene);
        assert_eq!(glossy.1 - rich.1, 16 * estimate(&scene, options).unwrap().triangles as i64);
        assert_eq!(glossy.0 - rich.0, glossy.1 - rich.1);
    }

    #[test]
    fn what_cannot_be_cut_cannot_be_estimated() {
        let options = |budget| PatchOptions { budget, two_sided: false };
        let scene = builtin::cornell(false);
        let refusal = |budget| {
            let (a, b) = (estimate(&scene, options(budget)), PatchScene::new(&scene, options(budget)));
            // As text, since NaN is not equal to itself.
            assert_eq!(format!("{:?}", a.as_ref().err()), format!("{:?}", b.as_ref().err()));
            a.is_err()
        };
        assert!(refusal(PatchBudget::Size(0.0)) && refusal(PatchBudget::Size(f64::NAN)));
        assert!(refusal(PatchBudget::Size(1e-9)) && refusal(PatchBudget::Count(usize::MAX)));
        assert_eq!(estimate(&Scene::default(), options(PatchBudget::Count(1))), Err(PatchError::Empty));
    }
}
