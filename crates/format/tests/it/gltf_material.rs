//! Materials, textures and the warnings about them.

use serde_json::json;
use twinray_scene::{Opacity, Rgb, Surface, TextureRef, Wrap};

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
fn other_texture_sets_and_transforms_are_named() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[10, 20, 30]]));
    let slot = |doc: &mut Doc, slot| doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = slot;
    slot(&mut doc, json!({ "index": 0, "texCoord": 1 }));
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["materials[0] \"paint\".pbrMetallicRoughness.baseColorTexture", "TEXCOORD_1"]);
    assert!(colour(&reading.scene.materials[0].surface).texture.is_none());
    slot(&mut doc, json!({ "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } }));
    let reading = doc.read().unwrap();
    assert_warns(&reading, &["baseColorTexture", "KHR_texture_transform"]);
    assert!(colour(&reading.scene.materials[0].surface).texture.is_some());
}

#[test]
fn alpha_and_transmission() {
    let mut doc = Doc::square();
    doc.json["materials"][0]["alphaMode"] = json!("MASK");
    assert_eq!(doc.scene().materials[0].opacity, Opacity::Mask { cutoff: 0.5 });
    doc.json["materials"][0]["alphaCutoff"] = json!(0.25);
    assert_eq!(doc.scene().materials[0].opacity, Opacity::Mask { cutoff: 0.25 });
    doc.json["materials"][0]["alphaMode"] = json!("BLEND");
    doc.json["materials"][0]["extensions"] = json!({ "KHR_materials_transmission": { "transmissionFactor": 0.5 } });
    let reading = doc.read().unwrap();
    assert_eq!(reading.scene.materials[0].opacity, Opacity::Blend);
    assert!(reading.scene.materials[0].transmission.is_some());
    assert_warns(&reading, &["transmission", "\"paint\""]);
    doc.json["materials"][0]["extensions"] = json!({ "KHR_materials_transmission": { "transmissionFactor": 0 } });
    assert!(!doc.scene().materials[0].transmission.is_some());
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
