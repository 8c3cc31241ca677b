//! Materials, textures and the warnings about them.

use std::sync::Arc;

use serde_json::json;
use twinray_format::write_glb;
use twinray_scene::{
    NormalMap, Opacity, Rgb, Scene, Surface, TextureImage, TextureRef, TextureTransform, Transmission, Wrap,
};

use crate::support::{Doc, assert_warns, colour, png, read_with, warnings};

#[test]
fn a_missing_material_is_the_default_one() {
    let mut doc = Doc::square();
    doc.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let reading = doc.read().unwrap();
    let Surface::MetallicRoughness { base_color, metallic, roughness, specular, ior, .. } =
        &reading.scene.materials[0].surface
    else {
        panic!("{:?}", reading.scene.materials[0])
    };
    assert_eq!((*metallic, *roughness, *specular, *ior), (1.0, 1.0, 1.0, 1.5));
    assert_eq!(base_color.factor, Rgb::grey(0.98));
    assert_warns(&reading, &["0.98", "1 material", "\"glTF default\""]);
}

#[test]
fn specular_zero_is_lambertian_and_other_values_are_kept() {
    let mut doc = Doc::square();
    let specular = |factor: f64| json!({ "KHR_materials_specular": { "specularFactor": factor, "specularColorFactor": [0.5, 1, 2] } });
    doc.json["materials"][0]["extensions"] = specular(0.0);
    doc.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = json!(0);
    assert!(
        matches!(&doc.scene().materials[0].surface, Surface::Lambertian { reflectance } if reflectance.factor == Rgb::grey(0.5))
    );
    doc.json["materials"][0]["extensions"] = specular(0.25);
    doc.json["materials"][0]["extensions"]["KHR_materials_ior"] = json!({ "ior": 1.33 });
    doc.json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.5);
    let Surface::MetallicRoughness { metallic, roughness, specular, specular_color, ior, .. } =
        doc.scene().materials[0].surface
    else {
        panic!()
    };
    assert_eq!((metallic, roughness, specular, ior), (0.0, 0.5, 0.25, 1.33));
    assert_eq!(specular_color, Rgb::new(0.5, 1.0, 2.0));
}

#[test]
fn emission_is_factor_times_strength_with_its_texture() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[255, 0, 0]]));
    doc.json["materials"][0]["emissiveFactor"] = json!([1, 0.5, 0.25]);
    doc.json["materials"][0]["emissiveTexture"] = json!({ "index": 0 });
    doc.json["materials"][0]["extensions"] = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 40 } });
    doc.json["materials"][0]["doubleSided"] = json!(true);
    let scene = doc.scene();
    let material = &scene.materials[0];
    assert_eq!(material.emission, Rgb::new(40.0, 20.0, 10.0));
    assert!(material.two_sided);
    let image = material.emission_texture.as_ref().unwrap().image;
    assert_eq!(scene.images[image].rgba, [255, 0, 0, 255]);
}

#[test]
fn textures_are_decoded_once_and_only_when_used() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[255, 255, 255], [0, 0, 0]]));
    doc.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }]);
    doc.json["textures"] = json!([{ "source": 0, "sampler": 0 }, { "source": 0 }, { "source": 1 }]);
    doc.json["images"].as_array_mut().unwrap().push(json!({ "uri": "unused.png" }));
    let pbr = &mut doc.json["materials"][0]["pbrMetallicRoughness"];
    pbr["baseColorTexture"] = json!({ "index": 0 });
    pbr["metallicRoughnessTexture"] = json!({ "index": 1 });
    let reading = doc.read().unwrap();
    assert!(reading.warnings.is_empty(), "{}", warnings(&reading));
    let scene = reading.scene;
    assert_eq!((scene.images.len(), scene.images[0].width, scene.images[0].name.as_str()), (1, 2, "picture"));
    let Surface::MetallicRoughness { base_color, metallic_roughness_texture, .. } = &scene.materials[0].surface else {
        panic!()
    };
    let sampled = TextureRef { wrap: [Wrap::Clamp, Wrap::Mirror], nearest: true, ..TextureRef::of(0) };
    assert_eq!(base_color.texture, Some(sampled));
    assert_eq!(metallic_roughness_texture, &Some(TextureRef::of(0)));
}

#[test]
fn textures_come_from_files_data_uris_and_views() {
    let picture = png(&[[10, 20, 30]]);
    let mut doc = Doc::square();
    doc.texture(&picture);
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let mut sources = vec![json!({ "bufferView": 3 }), json!({ "uri": "my%20picture.png" })];
    // The same bytes as plain text: percent-encoded.
    let encoded: String = picture.iter().map(|b| format!("%{b:02x}")).collect();
    sources.push(json!({ "uri": format!("data:image/png,{encoded}") }));
    for source in sources {
        doc.json["images"] = json!([source]);
        let reading = read_with("test.glb", &doc.glb(), &[("my picture.png", &picture)]).unwrap();
        assert_eq!(reading.scene.images[0].rgba, [10, 20, 30, 255], "{source}");
    }
}

#[test]
fn textures_that_cannot_be_had_leave_the_factor() {
    let cases = [
        (json!([{ "uri": "missing.png" }]), "images[0]", "cannot be read"),
        (json!([{ "uri": "../secret.png" }]), "images[0]", "leaves the scene's folder"),
        (json!([{ "uri": "/etc/secret.png" }]), "images[0]", "absolute"),
        (json!([{ "uri": "http://example.com/a.png" }]), "images[0]", "absolute"),
        (json!([{ "uri": "data:image/png;base64,AAAA" }]), "images[0]", "unknown picture format"),
        (json!([{ "name": "none" }]), "images[0] \"none\"", "neither uri nor bufferView"),
        (json!([{ "bufferView": 99 }]), "images[0]", "99"),
        (json!([]), "baseColorTexture", "index below 0, the number of images"),
    ];
    for (images, element, message) in cases {
        let mut doc = Doc::square();
        doc.json["textures"] = json!([{ "source": 0 }]);
        doc.json["images"] = images;
        doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
        let reading = doc.read().unwrap();
        assert_warns(&reading, &["test.glb", element, message]);
        let texel = colour(&reading.scene.materials[0].surface);
        assert_eq!((texel.factor, &texel.texture), (Rgb::grey(0.5), &None));
    }
}

#[test]
fn texture_sets_and_transforms_are_read() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[10, 20, 30]]));
    let slot = |doc: &mut Doc, slot| doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = slot;
    let texture = |doc: &Doc| {
        let reading = doc.read().unwrap();
        assert!(reading.warnings.is_empty(), "{}", warnings(&reading));
        colour(&reading.scene.materials[0].surface).texture.clone().unwrap()
    };
    slot(&mut doc, json!({ "index": 0, "texCoord": 1 }));
    assert_eq!(texture(&doc), TextureRef { set: 1, ..TextureRef::of(0) });
    let transform = json!({ "offset": [0.5, -1], "rotation": 0.25, "scale": [2, -3], "texCoord": 1 });
    slot(&mut doc, json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } }));
    let transform = TextureTransform { offset: [0.5, -1.0], rotation: 0.25, scale: [2.0, -3.0] };
    assert_eq!(texture(&doc), TextureRef { set: 1, transform, ..TextureRef::of(0) });
    slot(&mut doc, json!({ "index": 0, "extensions": { "KHR_texture_transform": {} } }));
    assert_eq!(texture(&doc), TextureRef::of(0));
    // Further sets, and transforms that are none, leave the factor.
    slot(&mut doc, json!({ "index": 0, "texCoord": 2 }));
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["materials[0] \"paint\".pbrMetallicRoughness.baseColorTexture", "TEXCOORD_2"]);
    assert!(colour(&reading.scene.materials[0].surface).texture.is_none());
    slot(&mut doc, json!({ "index": 0, "extensions": { "KHR_texture_transform": { "scale": 2 } } }));
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["baseColorTexture", "array of 2 numbers", "factor is used alone"]);
}

#[test]
fn second_texture_coordinates_and_tangents_are_read() {
    let mut doc = Doc::square();
    let second = doc.bytes(&[0, 255, 255, 255, 255, 0, 0, 0], "VEC2", 2, 5121);
    doc.json["accessors"][second]["normalized"] = json!(true);
    let tangents = doc.floats(&[[1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, -1.0], [f32::NAN, 0.0, 0.0, 1.0], [0.0; 4]]);
    let attributes = &mut doc.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = json!(second);
    attributes["TANGENT"] = json!(tangents);
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["1 tangents are not numbers"]);
    let mesh = &reading.scene.meshes[0];
    assert_eq!(mesh.second_texcoords, mesh.texcoords);
    let expected = vec![[1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, -1.0], [0.0; 4], [0.0; 4]];
    assert_eq!(mesh.tangents, Some(expected));
    // What does not fit is left out.
    let short = doc.floats(&[[1.0, 0.0, 0.0, 1.0]]);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(short);
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["TANGENT", "1 elements for 4 positions"]);
    assert!(reading.scene.meshes[0].tangents.is_none());
}

#[test]
fn normal_maps_are_read_and_occlusion_is_named_once() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[128, 128, 255]]));
    let paint =
        json!({ "normalTexture": { "index": 0, "scale": 0.5, "texCoord": 1 }, "occlusionTexture": { "index": 0 } });
    doc.json["materials"] = json!([paint, paint]);
    doc.primitive(json!({ "attributes": { "POSITION": 0 }, "indices": 2, "material": 1 }));
    let reading = doc.read().unwrap();
    let texture = TextureRef { set: 1, ..TextureRef::of(0) };
    assert_eq!(reading.scene.materials[0].normal_map, Some(NormalMap { texture, scale: 0.5 }));
    assert_warns(&reading, &["occlusion", "\"material 0\", \"material 1\""]);
    let about = reading.warnings.iter().filter(|w| w.message.contains("occlusion"));
    assert_eq!(about.count(), 1, "{}", warnings(&reading));
    doc.json["materials"][0]["normalTexture"] = json!({ "index": 0 });
    assert_eq!(doc.scene().materials[0].normal_map.as_ref().unwrap().scale, 1.0);
}

#[test]
fn alpha_modes() {
    let mut doc = Doc::square();
    let alpha = |doc: &Doc| {
        let material = doc.scene().materials.swap_remove(0);
        (material.opacity, colour(&material.surface).alpha)
    };
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.5, 0.5, 0.5, 0.75]);
    assert_eq!(alpha(&doc), (Opacity::Opaque, 0.75));
    doc.json["materials"][0]["alphaMode"] = json!("MASK");
    assert_eq!(alpha(&doc), (Opacity::Mask { cutoff: 0.5 }, 0.75));
    doc.json["materials"][0]["alphaCutoff"] = json!(0.25);
    assert_eq!(alpha(&doc), (Opacity::Mask { cutoff: 0.25 }, 0.75));
    doc.json["materials"][0]["alphaMode"] = json!("BLEND");
    assert_eq!(alpha(&doc), (Opacity::Blend, 0.75));
    assert!(doc.read().unwrap().warnings.is_empty());
}

#[test]
fn panes_and_bodies_of_glass() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[128, 0, 0]]));
    let extensions = |doc: &mut Doc, extensions| doc.json["materials"][0]["extensions"] = extensions;
    let transmission = |doc: &Doc| doc.scene().materials[0].transmission.clone();
    let glass = json!({ "transmissionFactor": 0.5, "transmissionTexture": { "index": 0 } });
    extensions(&mut doc, json!({ "KHR_materials_transmission": glass }));
    let pane = Transmission { factor: 0.5, texture: Some(TextureRef::of(0)), volume: None };
    assert_eq!(transmission(&doc), Some(pane.clone()));
    extensions(&mut doc, json!({ "KHR_materials_transmission": { "transmissionFactor": 0 } }));
    assert_eq!(transmission(&doc), None);

    // A volume without thickness is a pane; exp(-0.5 × 2 × ln 2) is a half, at a distance of 2 it is the colour.
    let ln2 = std::f64::consts::LN_2;
    for (volume, attenuation) in [
        (json!({}), None),
        (json!({ "thicknessFactor": 0, "attenuationDistance": 1 }), None),
        (json!({ "thicknessFactor": 0.1 }), Some(Rgb::BLACK)),
        (json!({ "thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5] }), Some(Rgb::BLACK)),
        (
            json!({ "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0] }),
            Some(Rgb::new(0.0, ln2 / 2.0, 1e6f64.ln() / 2.0)),
        ),
        (json!({ "thicknessFactor": 1, "attenuationDistance": 0, "attenuationColor": [0, 0, 0] }), Some(Rgb::BLACK)),
    ] {
        let text = volume.to_string();
        extensions(&mut doc, json!({ "KHR_materials_transmission": glass, "KHR_materials_volume": volume }));
        let found = transmission(&doc).unwrap().volume.map(|v| v.attenuation);
        let close = |a: Rgb, b: Rgb| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-12);
        let same = match (found, attenuation) {
            (Some(a), Some(b)) => close(a, b),
            (a, b) => a == b,
        };
        assert!(same, "{text}: {found:?}");
    }
    extensions(&mut doc, json!({ "KHR_materials_volume": { "thicknessFactor": 1 } }));
    assert_eq!(transmission(&doc), None);

    // Without a lobe, what passes may still be blurred: such glass is not Lambertian.
    doc.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = json!(0);
    let specular = json!({ "specularFactor": 0 });
    for (roughness, lambertian) in [(0.4, false), (0.0, true)] {
        doc.json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
        extensions(&mut doc, json!({ "KHR_materials_transmission": glass, "KHR_materials_specular": specular }));
        let surface = doc.scene().materials.swap_remove(0).surface;
        assert_eq!(matches!(surface, Surface::Lambertian { .. }), lambertian, "{surface:?}");
    }
}

#[test]
fn specular_maps_are_read() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[128, 0, 0]]));
    let specular = json!({ "specularTexture": { "index": 0 }, "specularColorTexture": { "index": 0, "texCoord": 1 } });
    doc.json["materials"][0]["extensions"] = json!({ "KHR_materials_specular": specular });
    let reading = doc.read().unwrap();
    assert!(reading.warnings.is_empty(), "{}", warnings(&reading));
    let Surface::MetallicRoughness { specular_texture, specular_color_texture, .. } =
        &reading.scene.materials[0].surface
    else {
        panic!()
    };
    assert_eq!(specular_texture, &Some(TextureRef::of(0)));
    assert_eq!(specular_color_texture, &Some(TextureRef { set: 1, ..TextureRef::of(0) }));
}

/// The lobe's colour becomes its reflectance at normal incidence; roughness is 1 − glossiness, by the texel where the
/// alpha of the picture says so.
#[test]
fn specular_glossiness_is_converted() {
    let mut doc = Doc::square();
    let extension = json!({
        "diffuseFactor": [0.5, 0.25, 0.125, 0.5], "specularFactor": [0.2, 0.4, 1.0], "glossinessFactor": 0.75,
    });
    doc.json["materials"][0]["extensions"] = json!({ "KHR_materials_pbrSpecularGlossiness": extension });
    doc.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["KHR_materials_pbrSpecularGlossiness", "\"paint\""]);
    let Surface::MetallicRoughness { base_color, metallic, roughness, specular, specular_color, ior, .. } =
        &reading.scene.materials[0].surface
    else {
        panic!()
    };
    assert_eq!((base_color.factor, base_color.alpha), (Rgb::new(0.5, 0.25, 0.125), 0.5));
    assert_eq!((*metallic, *roughness, *specular, *ior), (0.0, 0.25, 1.0, 0.0));
    // A lobe that reflects everything would never let light end.
    assert_eq!(*specular_color, Rgb::new(0.2, 0.4, 0.98));

    let rgba = image_of(&[[255, 128, 0, 255], [0, 0, 0, 102]]);
    doc.texture(&rgba);
    let extension = &mut doc.json["materials"][0]["extensions"]["KHR_materials_pbrSpecularGlossiness"];
    extension["specularGlossinessTexture"] = json!({ "index": 0 });
    let scene = doc.scene();
    let Surface::MetallicRoughness { roughness, metallic_roughness_texture, specular_color_texture, .. } =
        &scene.materials[0].surface
    else {
        panic!()
    };
    assert_eq!((*roughness, specular_color_texture.as_ref().map(|t| t.image)), (1.0, Some(0)));
    // 255 × (1 − 0.75 × alpha): alphas of 1 and 0.4.
    let derived = &scene.images[metallic_roughness_texture.as_ref().unwrap().image].rgba;
    assert_eq!((derived[1], derived[5]), (64, 179));
}

/// A PNG file of one row with alpha, by way of a scene that has it as a texture.
fn image_of(rgba: &[[u8; 4]]) -> Vec<u8> {
    let image = TextureImage { name: "p".into(), width: rgba.len() as u32, height: 1, rgba: rgba.concat() };
    let scene = Scene { images: vec![Arc::new(image)], ..Scene::default() };
    let bytes = write_glb(&scene);
    let start = bytes.windows(8).position(|w| w == b"\x89PNG\r\n\x1a\n").unwrap();
    bytes[start..].to_vec()
}

/// Each once, with the materials that wanted it, also where the file cannot do without.
#[test]
fn extensions_that_are_not_read_are_named() {
    let mut doc = Doc::square();
    let sheen = json!({ "KHR_materials_sheen": {}, "KHR_materials_unlit": {} });
    doc.json["materials"] = json!([{ "name": "a", "extensions": sheen }, { "name": "b", "extensions": sheen }]);
    doc.primitive(json!({ "attributes": { "POSITION": 0 }, "indices": 2, "material": 1 }));
    doc.json["extensionsUsed"] = json!(["KHR_materials_sheen", "KHR_materials_unlit", "KHR_materials_variants"]);
    doc.json["extensionsRequired"] = json!(["KHR_materials_unlit"]);
    let reading = doc.read().unwrap();
    for extension in ["KHR_materials_sheen", "KHR_materials_unlit"] {
        assert_warns(&reading, &[extension, "ignored", "\"a\", \"b\""]);
        assert_eq!(warnings(&reading).matches(extension).count(), 1);
    }
    assert_warns(&reading, &["KHR_materials_variants"]);
}

#[test]
fn reflectance_is_clamped_as_far_as_the_texture_demands() {
    let mut doc = Doc::square();
    doc.json["materials"] = json!([
        { "name": "white" }, { "name": "grey", "pbrMetallicRoughness": { "baseColorFactor": [0.98, 0.5, 0.1, 1] } },
        { "name": "red", "pbrMetallicRoughness": { "baseColorFactor": [1.0, 0.5, 0.1, 1] } },
    ]);
    for i in 1..3 {
        doc.primitive(json!({ "attributes": { "POSITION": 0 }, "indices": 2, "material": i }));
    }
    let reading = doc.read().unwrap();
    let factors: Vec<Rgb> = reading.scene.materials.iter().map(|m| colour(&m.surface).factor).collect();
    assert_eq!(factors, [Rgb::grey(0.98), Rgb::new(0.98, 0.5, 0.1), Rgb::new(0.98, 0.5, 0.1)]);
    assert_warns(&reading, &["2 materials brought down to 0.98", "\"white\", \"red\""]);

    // A texture that stays below 0.98 anyway (code 200 is 0.578) keeps its factor of 1; a white one does not.
    for (code, factor) in [(200, 1.0), (255, 0.98)] {
        let mut doc = Doc::square();
        doc.texture(&png(&[[code, 0, 0], [10, 10, 10]]));
        doc.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 0 } });
        assert_eq!(colour(&doc.scene().materials[0].surface).factor, Rgb::new(factor, 1.0, 1.0), "code {code}");
    }
}

#[test]
fn values_out_of_range_or_of_another_type_are_replaced() {
    let mut doc = Doc::square();
    let pbr = &mut doc.json["materials"][0]["pbrMetallicRoughness"];
    pbr["metallicFactor"] = json!(7);
    pbr["roughnessFactor"] = json!("rough");
    pbr["baseColorFactor"] = json!([0.5, 0.5]);
    doc.json["materials"][0]["emissiveFactor"] = json!([-1, 0, 0]);
    let reading = doc.read().unwrap();
    let Surface::MetallicRoughness { base_color, metallic, roughness, .. } = &reading.scene.materials[0].surface else {
        panic!()
    };
    assert_eq!((base_color.factor, *metallic, *roughness), (Rgb::grey(0.98), 1.0, 1.0));
    assert!(reading.scene.materials[0].emission.is_black());
    for (key, value) in [
        ("metallicFactor", "7"),
        ("roughnessFactor", "\"rough\""),
        ("baseColorFactor", "array of 2"),
        ("emissiveFactor", "-1"),
    ] {
        assert_warns(&reading, &["materials[0] \"paint\"", key, value]);
    }
}

/// A patch keeps its emission in single precision, and sums of its square.
#[test]
fn emission_beyond_all_bounds_is_brought_down() {
    let mut doc = Doc::square();
    let material = &mut doc.json["materials"][0];
    material["emissiveFactor"] = json!([7e77, 1.0, 0.5]);
    material["extensions"] = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 1e9 } });
    let reading = doc.read().unwrap();
    assert_eq!(reading.scene.materials[0].emission, Rgb::new(1e12, 1e9, 5e8));
    assert_warns(&reading, &["paint", "emission", "brought down to 1e12"]);
    doc.json["materials"][0]["emissiveFactor"] = json!([1e300, 1.0, 0.0]);
    doc.json["materials"][0]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = json!(1e300);
    assert_eq!(doc.scene().materials[0].emission, Rgb::new(1e12, 1e12, 0.0));
}
