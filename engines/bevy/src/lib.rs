//! Light baked by `twinray bake --for bevy`, as Bevy's own [`Lightmap`]s.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use twinray_bevy::TwinrayLightmaps;
//!
//! App::new().add_plugins((DefaultPlugins, TwinrayLightmaps::default())).run();
//! ```
//!
//! # Which number is which brightness
//!
//! A texel holds E/π: irradiance over π, in cd/m² (nit) where the lights of the scene are in lux, candela and nit, as glTF has
//! them. A matt surface of reflectance ρ that receives E sends out the radiance L = ρ·E/π, and Bevy computes exactly that, times
//! the camera's exposure:
//!
//! ```text
//! pixel = 2^-ev100 / 1.2 × lightmap_exposure × texel × ρ,   ρ = base colour × (1 − metallic) × (1 − transmission)
//! ```
//!
//! So [`StandardMaterial::lightmap_exposure`] is 1, no matter how bright the scene is: brightness belongs to
//! [`Exposure`](bevy::camera::Exposure), under which lights, emission and lightmaps stay in proportion. With `ev100` = −log₂ 1.2
//! (see [`EV100_OF_ONE`]) the pixel *is* L, in nit. Other values than 1 are for files in other units: 683 for one whose lights are
//! in watts at 555 nm.

use std::collections::HashSet;
use std::path::Path;

use bevy::asset::{AssetPath, LoadContext, RenderAssetUsages};
use bevy::gltf::extensions::{ErasedGltfExtensionHandler, GltfExtensionHandler, GltfExtensionHandlers};
use bevy::gltf::{GltfLoaderSettings, GltfMaterialExtras, gltf};
use bevy::image::{ImageLoaderSettings, ImageSampler};
use bevy::light::GlobalAmbientLight;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::world_serialization::WorldInstanceReady;
use serde_json::Value;

/// The `ev100` under which pixels are radiances in nit, as they are.
pub const EV100_OF_ONE: f32 = -0.263_034_4;

/// Gives the meshes of glTF scenes the lightmaps that `twinray bake --for bevy` wrote beside them, and keeps light that is baked
/// from being added once more. Add it after [`DefaultPlugins`].
#[derive(Resource, Clone, Copy, Debug)]
pub struct TwinrayLightmaps {
    /// Goes to [`StandardMaterial::lightmap_exposure`]: nit that the value 1 of a lightmap stands for.
    pub exposure: f32,
    /// Smoother, slower; reaches further than the two texels of padding that bakes have by default: bake with `--padding 4`.
    pub bicubic: bool,
}

impl Default for TwinrayLightmaps {
    fn default() -> Self {
        Self { exposure: 1.0, bicubic: false }
    }
}

impl Plugin for TwinrayLightmaps {
    fn build(&self, app: &mut App) {
        app.insert_resource(*self).add_observer(dress);
        // The sky is in the lightmaps already. What has none still gets this light.
        app.world_mut().get_resource_or_init::<GlobalAmbientLight>().affects_lightmapped_meshes = false;
        let handlers = app.world_mut().get_resource_or_init::<GltfExtensionHandlers>();
        handlers.0.write_blocking().push(Box::new(BakedLights::default()));
    }
}

/// Runs when a scene has spawned: its meshes get the lightmaps that their materials' extras name.
fn dress(
    ready: On<WorldInstanceReady>,
    options: Res<TwinrayLightmaps>,
    server: Res<AssetServer>,
    roots: Query<&WorldAssetRoot>,
    children: Query<&Children>,
    meshes: Query<(&GltfMaterialExtras, &MeshMaterial3d<StandardMaterial>)>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut commands: Commands,
) {
    let Some(document) = roots.get(ready.entity).ok().and_then(|root| server.get_path(root.0.id())) else { return };
    for entity in children.iter_descendants(ready.entity) {
        let Ok((extras, material)) = meshes.get(entity) else { continue };
        let name = match lightmap_file(&extras.value) {
            Ok(Some(name)) => name,
            Ok(None) => continue,
            Err(fault) => {
                warn!("{document}: twinray_lightmap: {fault}");
                continue;
            }
        };
        // Not parsed as a path of assets: names may have a # in them.
        let beside = document.path().with_file_name(name);
        let image = server
            .load_builder()
            .with_settings(|settings: &mut ImageLoaderSettings| {
                settings.is_srgb = false;
                settings.sampler = ImageSampler::linear();
                settings.asset_usage = RenderAssetUsages::all();
            })
            .load(AssetPath::from_path_buf(beside).with_source(document.source().clone_owned()));
        commands.entity(entity).insert(Lightmap { image, bicubic_sampling: options.bicubic, ..default() });
        if let Some(mut material) = materials.get_mut(&material.0) {
            material.lightmap_exposure = options.exposure;
        }
    }
}

/// The file that a material's extras name.
fn lightmap_file(extras: &str) -> Result<Option<String>, String> {
    let extras: Value = serde_json::from_str(extras).map_err(|e| e.to_string())?;
    let Some(lightmap) = extras.get("twinray_lightmap") else { return Ok(None) };
    if lightmap["quantity"] != "irradiance/π" {
        return Err(format!("holds {}, not \"irradiance/π\": bake with --for bevy", lightmap["quantity"]));
    }
    if lightmap["texCoord"] != 1 {
        return Err(format!("lies on texture coordinates {}, and Bevy takes 1", lightmap["texCoord"]));
    }
    let uri = lightmap["uri"].as_str().unwrap_or_default();
    match Path::new(uri).file_name() {
        Some(name) if name == uri => Ok(Some(uri.to_owned())),
        _ => Err(format!("{uri:?} is not the name of a file beside the document")),
    }
}

/// Lights of a document that are in its lightmaps, which `--keep-lights` leaves in the file for what moves: they shine on
/// everything, but add no diffuse light to surfaces that have it baked.
#[derive(Clone, Default)]
struct BakedLights {
    names: HashSet<String>,
}

impl BakedLights {
    fn has(&self, node: &gltf::Node) -> bool {
        let Some(light) = node.light() else { return false };
        let name = light.name().or(node.name()).map_or_else(|| format!("light {}", light.index()), str::to_owned);
        self.names.contains(&name)
    }
}

impl GltfExtensionHandler for BakedLights {
    fn dyn_clone(&self) -> Box<dyn ErasedGltfExtensionHandler> {
        Box::new(self.clone())
    }

    fn on_root(&mut self, _: &mut LoadContext<'_>, gltf: &gltf::Gltf, _: &GltfLoaderSettings) {
        let extras = gltf.as_json().asset.extras.as_ref().and_then(|e| serde_json::from_str::<Value>(e.get()).ok());
        self.names = extras.map(|e| baked_lights(&e)).unwrap_or_default();
    }

    fn on_spawn_light_directional(&mut self, _: &mut LoadContext<'_>, node: &gltf::Node, entity: &mut EntityWorldMut) {
        if let Some(mut light) = entity.get_mut::<DirectionalLight>().filter(|_| self.has(node)) {
            light.affects_lightmapped_mesh_diffuse = false;
        }
    }

    fn on_spawn_light_point(&mut self, _: &mut LoadContext<'_>, node: &gltf::Node, entity: &mut EntityWorldMut) {
        if let Some(mut light) = entity.get_mut::<PointLight>().filter(|_| self.has(node)) {
            light.affects_lightmapped_mesh_diffuse = false;
        }
    }

    fn on_spawn_light_spot(&mut self, _: &mut LoadContext<'_>, node: &gltf::Node, entity: &mut EntityWorldMut) {
        if let Some(mut light) = entity.get_mut::<SpotLight>().filter(|_| self.has(node)) {
            light.affects_lightmapped_mesh_diffuse = false;
        }
    }
}

/// Names in `asset.extras.twinray_bake.lights.punctual`.
fn baked_lights(extras: &Value) -> HashSet<String> {
    let names = extras.pointer("/twinray_bake/lights/punctual").and_then(Value::as_array);
    names.into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use bevy::camera::Exposure;
    use serde_json::json;

    use super::*;

    #[test]
    fn extras_name_a_file_beside_the_document() {
        let of = |value: Value| lightmap_file(&json!({ "mine": 1, "twinray_lightmap": value }).to_string());
        let with = |uri: &str| of(json!({ "uri": uri, "page": 0, "texCoord": 1, "quantity": "irradiance/π" }));
        assert_eq!(with("a b#1-0.ktx2"), Ok(Some("a b#1-0.ktx2".to_owned())));
        for bad in ["", "..", "/etc/a.ktx2", "../a.ktx2", "b/a.ktx2"] {
            assert!(with(bad).is_err(), "{bad}");
        }
        assert!(of(json!({ "uri": "a.exr", "page": 0, "texCoord": 1, "quantity": "irradiance" })).is_err());
        assert_eq!(lightmap_file("{\"mine\": 1}"), Ok(None));
        assert_eq!(lightmap_file("7"), Ok(None));
        assert!(lightmap_file("{").is_err());
    }

    #[test]
    fn lights_that_were_baked_are_known_by_name() {
        let extras = json!({ "twinray_bake": { "lights": { "punctual": ["sun", "light 1"] } } });
        assert_eq!(baked_lights(&extras), HashSet::from(["sun".to_owned(), "light 1".to_owned()]));
        assert!(baked_lights(&json!(null)).is_empty());
    }

    #[test]
    fn exposure_of_one_is_one() {
        assert!((Exposure { ev100: EV100_OF_ONE }.exposure() - 1.0).abs() < 1e-6);
    }
}
