//! Documents with baked light: what is not baked stays as it was, to the bit.
//!
//! Files are looked into by `Glb`, a reader of the tests' own that knows chunks, views and accessors and nothing else.

use std::collections::BTreeSet;
use std::io;
use std::path::Path;

use glam::DVec3;
use serde_json::{Value, json};
use twinray_format::{
    FormatError, Ktx2Format, Ktx2Packing, Limits, Lit, LitGlb, LitMaterial, LitPage, LitPicture, LitSurface, LitVertex,
    Origin, Reading, read_scene, write_glb, write_ktx2, write_lit_glb,
};
use twinray_scene::{Material, Scene, builtin};

use crate::real::{files_below, shared_scenes};
use crate::support::{self, Doc, png, world_triangles};

/// A binary glTF file taken apart.
struct Glb {
    json: Value,
    binary: Vec<u8>,
}

impl Glb {
    fn new(bytes: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let length = word(12);
        if let Some(rest) = bytes.get(20 + length..28 + length) {
            assert_eq!(&rest[4..], b"BIN\0");
            assert_eq!(28 + length + word(20 + length), bytes.len());
        }
        assert!(length.is_multiple_of(4) && bytes.len().is_multiple_of(4), "chunks end at multiples of four bytes");
        let json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let binary = bytes.get(28 + length..).unwrap_or_default().to_vec();
        Self { json, binary }
    }

    fn view(&self, index: &Value) -> &[u8] {
        let view = &self.json["bufferViews"][index.as_u64().unwrap() as usize];
        assert_eq!(view["buffer"], json!(0));
        let (at, length) = (number(&view["byteOffset"]), number(&view["byteLength"]));
        &self.binary[at..at + length]
    }

    /// Elements of an accessor as bytes, sparse ones in place.
    fn elements(&self, index: &Value) -> Vec<Vec<u8>> {
        let accessor = &self.json["accessors"][index.as_u64().unwrap() as usize];
        let width = match number(&accessor["componentType"]) {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            _ => 4,
        };
        let kind = accessor["type"].as_str().unwrap();
        let size = match kind {
            "SCALAR" => width,
            "MAT2" if width == 1 => 8,
            "MAT4" => 16 * width,
            _ => width * (kind.as_bytes()[3] - b'0') as usize,
        };
        let count = number(&accessor["count"]);
        let mut out = vec![vec![0; size]; count];
        if let Some(view) = accessor.get("bufferView") {
            let bytes = &self.view(view)[number(&accessor["byteOffset"])..];
            let stride = self.json["bufferViews"][view.as_u64().unwrap() as usize]["byteStride"].as_u64();
            let stride = stride.map_or(size, |s| s as usize);
            out = (0..count).map(|k| bytes[k * stride..k * stride + size].to_vec()).collect();
        }
        if let Some(sparse) = accessor.get("sparse") {
            let indices = self.view(&sparse["indices"]["bufferView"]);
            let values = self.view(&sparse["values"]["bufferView"]);
            for k in 0..number(&sparse["count"]) {
                out[usize::from(indices[k])] = values[k * size..(k + 1) * size].to_vec();
            }
        }
        out
    }

    fn floats(&self, index: &Value) -> Vec<Vec<f32>> {
        let accessor = &self.json["accessors"][index.as_u64().unwrap() as usize];
        assert_eq!(accessor["componentType"], json!(5126));
        let read = |e: Vec<u8>| e.chunks(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())).collect();
        self.elements(index).into_iter().map(read).collect()
    }

    fn indices(&self, index: &Value) -> Vec<usize> {
        let value = |e: Vec<u8>| e.iter().rev().fold(0, |sum, &b| sum << 8 | usize::from(b));
        self.elements(index).into_iter().map(value).collect()
    }

    fn primitive(&self, mesh: usize, primitive: usize) -> &Value {
        &self.json["meshes"][mesh]["primitives"][primitive]
    }

    /// What every file has to keep: views within the chunk that do not overlap, numbers that point somewhere, nothing that nobody
    /// refers to.
    fn check(&self) {
        let count = |key: &str| self.json[key].as_array().map_or(0, Vec::len);
        let mut views = BTreeSet::new();
        walk(&self.json, &mut |key, value| {
            if key == "bufferView" {
                views.insert(number(value));
            }
        });
        assert_eq!(views.into_iter().collect::<Vec<_>>(), (0..count("bufferViews")).collect::<Vec<_>>());
        let mut end = 0;
        for view in self.json["bufferViews"].as_array().into_iter().flatten() {
            let at = number(&view["byteOffset"]);
            assert!(at >= end && at - end < 8 && at.is_multiple_of(8));
            end = at + number(&view["byteLength"]);
        }
        assert!(end <= self.binary.len() && self.binary.len() - end < 8);
        let mut accessors = BTreeSet::new();
        for mesh in self.json["meshes"].as_array().into_iter().flatten() {
            for primitive in mesh["primitives"].as_array().unwrap() {
                let targets = primitive["targets"].as_array().into_iter().flatten();
                let maps = targets.chain([&primitive["attributes"]]).flat_map(|m| m.as_object().unwrap().values());
                let counts: BTreeSet<usize> = maps
                    .map(|a| {
                        accessors.insert(number(a));
                        self.elements(a).len()
                    })
                    .collect();
                assert_eq!(counts.len(), 1, "{primitive}");
                if let Some(indices) = primitive.get("indices") {
                    accessors.insert(number(indices));
                    assert!(self.indices(indices).iter().all(|i| counts.iter().all(|n| i < n)));
                }
                if let Some(material) = primitive.get("material") {
                    assert!(number(material) < count("materials"));
                }
            }
        }
        for node in self.json["nodes"].as_array().into_iter().flatten() {
            assert!(node.get("mesh").is_none_or(|m| number(m) < count("meshes")));
        }
        assert!(accessors.iter().all(|&a| a < count("accessors")));
        assert!(!self.json.to_string().contains("twinray_new"), "a mark was left");
    }
}

fn number(value: &Value) -> usize {
    value.as_u64().unwrap_or(0) as usize
}

fn walk(value: &Value, each: &mut dyn FnMut(&str, &Value)) {
    match value {
        Value::Object(members) => members.iter().for_each(|(key, member)| {
            each(key, member);
            walk(member, each);
        }),
        Value::Array(items) => items.iter().for_each(|v| walk(v, each)),
        _ => {}
    }
}

/// The whole of an instance, its vertices in another order and one of them doubled, with made-up places on a page.
fn surface(scene: &Scene, instance: usize, page: usize) -> LitSurface {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let n = mesh.positions.len() as u32;
    let vertex = |source: u32| LitVertex { source, texcoord: Some(place(source)), irradiance: None };
    let vertices: Vec<LitVertex> = (0..n).rev().chain([0]).map(vertex).collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|i| n - 1 - i)).collect();
    LitSurface { instance, vertices, triangles, page: Some(page), ..LitSurface::default() }
}

fn place(source: u32) -> [f32; 2] {
    [(source as f32 + 0.5) / 1024.0, 0.25]
}

fn lightmap(name: &str) -> LitPage {
    let bytes = write_ktx2(2, 1, &[[1.0; 3], [2.0; 3]], Ktx2Format::Rgb9e5, Ktx2Packing::Zlib);
    let hdr = LitPicture { name: format!("{name} hdr"), bytes, mime: "image/ktx2" };
    let ldr = LitPicture { name: name.into(), bytes: png(&[[128; 3], [255; 3]]), mime: "image/png" };
    LitPage { name: name.into(), material: LitMaterial::Lightmap { hdr, scale: 1.0, ldr, intensity: 2.0 } }
}

fn everything(scene: &Scene) -> Lit {
    let surfaces = (0..scene.instances.len()).map(|i| surface(scene, i, 0)).collect();
    Lit { surfaces, pages: vec![lightmap("page")], ..Lit::default() }
}

fn write(name: &str, source: &[u8], files: &[(&str, &[u8])], origins: &[Option<Origin>], lit: &Lit) -> LitGlb {
    let mut resolver = |path: &str| {
        let file = files.iter().find(|(name, _)| *name == path);
        file.map(|(_, bytes)| bytes.to_vec()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
    };
    let write = |resolver: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>| {
        write_lit_glb(name, source, resolver, &Limits::default(), origins, lit).unwrap()
    };
    let written = write(&mut resolver);
    assert!(write(&mut resolver).bytes == written.bytes, "the same bytes twice");
    Glb::new(&written.bytes).check();
    written
}

/// A document with light everywhere, and what was read before.
fn lit(doc: &Doc, change: impl Fn(&mut Lit)) -> (Reading, LitGlb) {
    let reading = doc.read().unwrap();
    let mut lit = everything(&reading.scene);
    change(&mut lit);
    let written = write("test.glb", &doc.glb(), &[], &reading.origins, &lit);
    (reading, written)
}

fn warnings(written: &LitGlb) -> String {
    written.warnings.iter().map(|w| format!("{w}\n")).collect()
}

fn reread(written: &LitGlb) -> Reading {
    support::read("lit.glb", &written.bytes).unwrap()
}

/// Triangles of the world with their materials' names and second texture coordinates, for comparison in any order.
type Drawn = ([DVec3; 3], String, Option<[[f32; 2]; 3]>);

fn drawn(scene: &Scene, seconds: impl Fn(usize, u32) -> Option<[f32; 2]>) -> Vec<Drawn> {
    let mut triangles = world_triangles(scene).into_iter();
    let mut out = Vec::new();
    for (k, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh];
        let mirrored = instance.transform.matrix3.determinant() < 0.0;
        for &[a, b, c] in &mesh.triangles {
            let corners = if mirrored { [a, c, b] } else { [a, b, c] };
            let [p, q, r] = corners.map(|i| seconds(k, i));
            let seconds = p.zip(q).zip(r).map(|((p, q), r)| [p, q, r]);
            out.push((triangles.next().unwrap(), material(scene, k).name, seconds));
        }
    }
    out
}

/// The material of an instance; names that the reader made up are left out, since they hold numbers.
fn material(scene: &Scene, instance: usize) -> Material {
    let material = scene.materials[scene.meshes[scene.instances[instance].mesh].material].clone();
    let made_up = material.name == "glTF default" || material.name.starts_with("material ");
    if made_up { Material { name: String::new(), ..material } } else { material }
}

/// Everything but the second texture coordinates and the light is what it was.
fn assert_same(before: &Scene, after: &Scene) {
    let own = |scene: &Scene, k: usize, i: u32| {
        Some(scene.meshes[scene.instances[k].mesh].second_texcoords.as_ref()?[i as usize])
    };
    let wanted = drawn(before, |_, i| Some(place(i)));
    assert_eq!(wanted, drawn(after, |k, i| own(after, k, i)));
    for (a, b) in before.instances.iter().zip(&after.instances) {
        assert_eq!((&a.name, a.transform), (&b.name, b.transform));
    }
    for k in 0..before.instances.len() {
        let [a, b] = [before, after].map(|scene| format!("{:?}", material(scene, k)));
        assert_eq!(a, b);
    }
    assert_eq!(before.cameras, after.cameras);
    assert_eq!(before.images, after.images[..before.images.len()]);
}

#[test]
fn a_lit_document_reads_as_the_same_scene() {
    let (reading, written) = lit(&Doc::square(), |_| {});
    assert_eq!(warnings(&written), "");
    let after = reread(&written).scene;
    assert_same(&reading.scene, &after);

    let glb = Glb::new(&written.bytes);
    let material = &glb.json["materials"][number(&glb.primitive(0, 0)["material"])];
    let moz = json!({ "index": 0, "texCoord": 1, "intensity": 2.0 });
    let ours = json!({ "image": 0, "texCoord": 1, "quantity": "irradiance", "scale": 1.0 });
    assert_eq!(material["extensions"], json!({ "MOZ_lightmap": moz, "TWINRAY_lightmap": ours }));
    assert_eq!(glb.json["extensionsUsed"], json!(["MOZ_lightmap", "TWINRAY_lightmap"]));
    assert_eq!(glb.json["textures"][0]["source"], json!(1));
    assert_eq!(glb.view(&glb.json["images"][1]["bufferView"]), png(&[[128; 3], [255; 3]]));
    assert!(glb.view(&glb.json["images"][0]["bufferView"]).starts_with(b"\xABKTX 20\xBB"));
    // The old primitive's data is gone: positions, two sets, indices, two pictures.
    let count = |key: &str| glb.json[key].as_array().unwrap().len();
    assert_eq!((count("accessors"), count("bufferViews")), (4, 6));
    assert_eq!((glb.json["accessors"][0]["min"].clone(), glb.json["accessors"][0]["max"].clone()), bounds());
}

fn bounds() -> (Value, Value) {
    (json!([0.0, 0.0, 0.0]), json!([1.0, 1.0, 0.0]))
}

#[test]
fn builtin_scenes_keep_their_instances_over_the_round_trip() {
    for (name, _) in builtin::NAMES {
        let scene = builtin::by_name(name).unwrap();
        let glb = write_glb(&scene);
        let reading = support::read("scene.glb", &glb).unwrap();
        assert_eq!(reading.scene.instances.len(), scene.instances.len(), "{name}");
        assert_eq!(reading.origins.len(), scene.instances.len());
        for (k, (a, b)) in scene.instances.iter().zip(&reading.scene.instances).enumerate() {
            let (old, new) = (&scene.meshes[a.mesh], &reading.scene.meshes[b.mesh]);
            assert_eq!((&a.name, a.transform), (&b.name, b.transform), "{name}");
            // Vertices may be numbered anew; what they were is known.
            let origin = reading.origins[k].as_ref().unwrap();
            let positions: Vec<[f32; 3]> = origin.vertices.iter().map(|&v| old.positions[v as usize]).collect();
            assert_eq!(positions, new.positions, "{name}");
            let triangles: Vec<[u32; 3]> =
                new.triangles.iter().map(|t| t.map(|i| origin.vertices[i as usize])).collect();
            assert_eq!(triangles, old.triangles, "{name}");
        }
        let written = write("scene.glb", &glb, &[], &reading.origins, &everything(&reading.scene));
        assert_same(&reading.scene, &reread(&written).scene);
    }
}

#[test]
fn origins_follow_vertices_that_are_dropped_and_meshes_that_are_squashed_flat() {
    let mut doc = Doc::new();
    // Vertex 0 is unused, the first triangle has no area, and along z the second one is nothing but a line.
    let positions = [[9.0; 3], [0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
    let positions = doc.floats(&positions);
    let indices = doc.indices(&[3, 1, 2, 4, 1, 2, 5, 1, 2]);
    doc.primitive(json!({ "attributes": { "POSITION": positions }, "mode": 0 }));
    doc.primitive(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    doc.json["nodes"] = json!([{ "children": [1, 2] }, { "mesh": 0 }, { "mesh": 0, "scale": [1, 1, 0] }]);
    let reading = doc.read().unwrap();
    let origin =
        |node: usize, vertices: &[u32]| Some(Origin { node, mesh: 0, primitive: 1, vertices: vertices.into() });
    assert_eq!(reading.origins, [origin(1, &[1, 2, 4, 5]), origin(2, &[1, 2, 5])]);

    let written = write("test.glb", &doc.glb(), &[], &reading.origins, &everything(&reading.scene));
    assert_same(&reading.scene, &reread(&written).scene);
    // Points stay; the other node got a mesh of its own.
    let glb = Glb::new(&written.bytes);
    assert_eq!([0, 1].map(|m| glb.primitive(m, 0)["mode"].clone()), [json!(0), json!(0)]);
    assert_eq!([1, 2].map(|n| glb.json["nodes"][n]["mesh"].clone()), [json!(0), json!(1)]);
    assert_eq!(support::read("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap().origins, [None]);
}

#[test]
fn nodes_that_shared_a_mesh_get_their_own_where_they_are_lit() {
    let mut doc = Doc::square();
    doc.json["meshes"][0]["extras"] = json!({ "by": "hand" });
    let node = |z: f32| json!({ "mesh": 0, "translation": [0, 0, z], "extras": { "z": z } });
    doc.json["nodes"] = json!([{ "children": [1, 2, 3] }, node(0.0), node(1.0), node(2.0)]);
    let (reading, written) = lit(&doc, |lit| drop(lit.surfaces.remove(1)));
    let glb = Glb::new(&written.bytes);
    // The node that is not lit keeps the mesh.
    assert_eq!([1, 2, 3].map(|n| number(&glb.json["nodes"][n]["mesh"])), [1, 0, 2]);
    assert_eq!(glb.json["nodes"][3]["extras"], json!({ "z": 2.0 }));
    for mesh in 0..3 {
        assert_eq!(glb.json["meshes"][mesh]["name"], json!("mesh"));
        assert_eq!(glb.json["meshes"][mesh]["extras"], json!({ "by": "hand" }));
    }
    assert!(glb.primitive(0, 0)["attributes"].get("TEXCOORD_1").is_none());
    assert_eq!(glb.primitive(0, 0)["material"], json!(0));
    // One copy of the material for both.
    assert_eq!([1, 2].map(|m| glb.primitive(m, 0)["material"].clone()), [json!(1), json!(1)]);
    assert_eq!(world_triangles(&reading.scene), world_triangles(&reread(&written).scene));

    // Where all are lit, none is left over.
    let (_, written) = lit(&doc, |_| {});
    let glb = Glb::new(&written.bytes);
    assert_eq!([1, 2, 3].map(|n| number(&glb.json["nodes"][n]["mesh"])), [0, 1, 2]);
    assert_eq!(glb.json["meshes"].as_array().unwrap().len(), 3);
}

/// A document whose primitive has attributes of all kinds; the last vertex is one that no triangle uses.
fn adorned() -> Doc {
    let mut doc = Doc::square();
    let at = |doc: &Doc| doc.json["accessors"].as_array().unwrap().len();
    let normals = doc.floats(&[[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.6, 0.0, 0.8], [0.0, -0.6, 0.8]]);
    let tangents =
        doc.floats(&[[1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, -1.0], [0.8, 0.0, -0.6, 1.0], [1.0, 0.0, 0.0, 1.0]]);
    let colours = doc.bytes(&[1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 0, 13, 14, 15, 0], "VEC3", 4, 5121);
    doc.json["accessors"][colours]["normalized"] = json!(true);
    let view = number(&doc.json["accessors"][colours]["bufferView"]);
    doc.json["bufferViews"][view]["byteStride"] = json!(4);
    let joints = doc.bytes(&(0..16).collect::<Vec<u8>>(), "VEC4", 4, 5121);
    let weights = doc.bytes(&(0..32).map(|b| b * 7).collect::<Vec<u8>>(), "VEC4", 8, 5123);
    doc.json["accessors"][weights]["normalized"] = json!(true);
    // Columns of a matrix of bytes start at multiples of four.
    let matrices = doc.bytes(&(0..32).collect::<Vec<u8>>(), "MAT2", 8, 5121);
    // Zeros but for elements 1 and 3.
    let places = doc.bytes(&[1, 3], "SCALAR", 1, 5121);
    let values = doc.floats(&[[0.5, 0.25, -1.0], [2.0, 4.0, 8.0]]);
    let views = [places, values].map(|a| doc.json["accessors"][a]["bufferView"].clone());
    let sparse = at(&doc);
    doc.json["accessors"].as_array_mut().unwrap().push(json!({
        "componentType": 5126, "type": "VEC3", "count": 4, "sparse": { "count": 2,
        "indices": { "bufferView": views[0], "componentType": 5121 }, "values": { "bufferView": views[1] } },
    }));
    let turned = doc.floats(&[[0.0, 0.0, 0.5], [0.25, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]);
    let primitive = &mut doc.json["meshes"][0]["primitives"][0];
    for (key, accessor) in [
        ("NORMAL", normals),
        ("TANGENT", tangents),
        ("COLOR_0", colours),
        ("JOINTS_0", joints),
        ("WEIGHTS_0", weights),
        ("_FRAME", matrices),
    ] {
        primitive["attributes"][key] = json!(accessor);
    }
    primitive["targets"] = json!([{ "POSITION": sparse, "NORMAL": turned }]);
    doc.json["meshes"][0]["weights"] = json!([0.0]);
    doc.json["meshes"][0]["extras"] = json!({ "targetNames": ["bend"] });
    doc
}

/// For each vertex of the first lit primitive the element of the source that it was.
fn sources(reading: &Reading, lit: &LitSurface) -> Vec<usize> {
    let origin = reading.origins[lit.instance].as_ref().unwrap();
    lit.vertices.iter().map(|v| origin.vertices[v.source as usize] as usize).collect()
}

#[test]
fn attributes_of_all_kinds_are_copied_to_the_bit() {
    let doc = adorned();
    let (reading, written) = lit(&doc, |_| {});
    assert_eq!(warnings(&written), "");
    let (before, after) = (Glb::new(&doc.glb()), Glb::new(&written.bytes));
    let sources = sources(&reading, &surface(&reading.scene, 0, 0));
    assert_eq!(sources.len(), 5);
    let (old, new) = (before.primitive(0, 0), after.primitive(0, 0));
    let copied = |old: &Value, new: &Value| {
        let elements = before.elements(old);
        assert_eq!(after.elements(new), sources.iter().map(|&s| elements[s].clone()).collect::<Vec<_>>());
        let [a, b] = [(&before, old), (&after, new)].map(|(glb, k)| glb.json["accessors"][number(k)].clone());
        for key in ["type", "componentType", "normalized"] {
            assert_eq!(a.get(key), b.get(key));
        }
    };
    for (key, accessor) in old["attributes"].as_object().unwrap() {
        copied(accessor, &new["attributes"][key]);
    }
    for key in ["POSITION", "NORMAL"] {
        copied(&old["targets"][0][key], &new["targets"][0][key]);
    }
    let target = &after.json["accessors"][number(&new["targets"][0]["POSITION"])];
    assert_eq!((&target["min"], &target["max"]), (&json!([0.0, 0.0, -1.0]), &json!([2.0, 4.0, 8.0])));
    assert_eq!(after.json["meshes"][0]["weights"], json!([0.0]));
    assert_eq!(after.json["meshes"][0]["extras"], json!({ "targetNames": ["bend"] }));
    let places: Vec<Vec<f32>> =
        surface(&reading.scene, 0, 0).vertices.iter().map(|v| v.texcoord.unwrap().to_vec()).collect();
    assert_eq!(after.floats(&new["attributes"]["TEXCOORD_1"]), places);
    assert_eq!(after.json["accessors"][number(&new["indices"])]["componentType"], json!(5123));
}

#[test]
fn the_back_of_a_sheet_is_turned_round() {
    let mut doc = adorned();
    doc.json["materials"][0]["doubleSided"] = json!(true);
    let (reading, written) = lit(&doc, |lit| {
        let mut back = lit.surfaces[0].clone();
        back.back = true;
        back.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        lit.surfaces.push(back);
        lit.surfaces.iter_mut().for_each(|s| s.one_sided = true);
    });
    let (before, after) = (Glb::new(&doc.glb()), Glb::new(&written.bytes));
    let [front, back] = [0, 1].map(|k| after.primitive(0, k));
    assert_eq!(front["material"], back["material"]);
    assert_eq!(after.json["materials"][number(&front["material"])]["doubleSided"], json!(false));
    assert_eq!(after.json["materials"][0]["doubleSided"], json!(true), "the original stays");

    let sources = sources(&reading, &surface(&reading.scene, 0, 0));
    let expected = |accessor: &Value, signs: &[f32]| -> Vec<Vec<f32>> {
        let elements = before.floats(accessor);
        sources.iter().map(|&s| elements[s].iter().zip(signs).map(|(v, sign)| v * sign).collect()).collect()
    };
    let old = before.primitive(0, 0);
    let attribute = |key: &str| after.floats(&back["attributes"][key]);
    assert_eq!(attribute("NORMAL"), expected(&old["attributes"]["NORMAL"], &[-1.0; 3]));
    // Bitangent = sign · normal × tangent stays: the normal turns, so the sign does.
    assert_eq!(attribute("TANGENT"), expected(&old["attributes"]["TANGENT"], &[1.0, 1.0, 1.0, -1.0]));
    assert_eq!(attribute("POSITION"), expected(&old["attributes"]["POSITION"], &[1.0; 3]));
    let target = &old["targets"][0];
    assert_eq!(after.floats(&back["targets"][0]["NORMAL"]), expected(&target["NORMAL"], &[-1.0; 3]));
    assert_eq!(after.floats(&back["targets"][0]["POSITION"]).len(), 5);

    // Front and back, facing each their own way, by corners as by normals.
    let scene = reread(&written).scene;
    let faces: Vec<DVec3> = world_triangles(&scene).into_iter().map(support::normal).collect();
    assert!(faces.iter().map(|n| n.z.signum()).eq([1.0, 1.0, -1.0, -1.0]), "{faces:?}");
    assert!(scene.meshes[1].normals.as_ref().unwrap().iter().all(|n| n[2] <= -0.8));
    assert!(!scene.materials[0].two_sided);
}

#[test]
fn quantized_directions_are_turned_round_without_overflow() {
    let mut doc = Doc::square();
    doc.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    doc.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let bytes: Vec<u8> = [0, 0, 127, 0, 0, 129, 0, 0, 128, 0, 0, 5].into_iter().collect();
    let bytes: Vec<u8> = bytes.chunks(3).flat_map(|c| [c[0], c[1], c[2], 0]).collect();
    let normals = doc.bytes(&bytes, "VEC3", 4, 5120);
    doc.json["accessors"][normals]["normalized"] = json!(true);
    let view = number(&doc.json["accessors"][normals]["bufferView"]);
    doc.json["bufferViews"][view]["byteStride"] = json!(4);
    let positions: Vec<u8> = [[-3i16, 0, 0], [1, 0, 0], [1, 7, 0], [-3, 7, 0]]
        .iter()
        .flat_map(|p| [p[0], p[1], p[2], 0])
        .flat_map(i16::to_le_bytes)
        .collect();
    let positions = doc.bytes(&positions, "VEC3", 8, 5122);
    let view = number(&doc.json["accessors"][positions]["bufferView"]);
    doc.json["bufferViews"][view]["byteStride"] = json!(8);
    let attributes = &mut doc.json["meshes"][0]["primitives"][0]["attributes"];
    (attributes["NORMAL"], attributes["POSITION"]) = (json!(normals), json!(positions));
    let (_, written) = lit(&doc, |lit| lit.surfaces[0].back = true);
    let glb = Glb::new(&written.bytes);
    let attributes = &glb.primitive(0, 0)["attributes"];
    let z: Vec<i8> = glb.elements(&attributes["NORMAL"]).iter().map(|e| e[2] as i8).collect();
    // Of sources 3, 2, 1, 0 and 0 again; −128 has no counterpart, and 127 is as much.
    assert_eq!(z, [-5, 127, 127, -127, -127]);
    let bounds = &glb.json["accessors"][number(&attributes["POSITION"])];
    assert_eq!((&bounds["min"], &bounds["max"]), (&json!([-3, 0, 0]), &json!([1, 7, 0])));
}

#[test]
fn textures_on_the_set_that_is_replaced_move_with_it() {
    let mut doc = Doc::square();
    doc.texture(&png(&[[200, 100, 50]; 2]));
    let second = doc.floats(&[[0.125, 0.0], [0.25, 0.0], [0.5, 0.0], [0.75, 0.0]]);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(second);
    doc.json["materials"][0]["normalTexture"] = json!({ "index": 0, "texCoord": 0 });
    doc.json["materials"][0]["occlusionTexture"] = json!({ "index": 0, "texCoord": 1.0 });
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] =
        json!({ "index": 0, "extensions": { "KHR_texture_transform": { "texCoord": 1, "rotation": 0.5 } } });
    let (reading, written) = lit(&doc, |_| {});
    let (before, after) = (Glb::new(&doc.glb()), Glb::new(&written.bytes));
    let primitive = after.primitive(0, 0);
    let elements = before.floats(&json!(second));
    let expected: Vec<Vec<f32>> =
        sources(&reading, &surface(&reading.scene, 0, 0)).into_iter().map(|s| elements[s].clone()).collect();
    assert_eq!(after.floats(&primitive["attributes"]["TEXCOORD_2"]), expected);
    assert_ne!(after.floats(&primitive["attributes"]["TEXCOORD_1"]), expected);
    let material = &after.json["materials"][number(&primitive["material"])];
    assert_eq!(material["normalTexture"]["texCoord"], json!(0));
    assert_eq!(material["occlusionTexture"]["texCoord"], json!(2));
    let base = &material["pbrMetallicRoughness"]["baseColorTexture"];
    assert_eq!(base["extensions"]["KHR_texture_transform"], json!({ "texCoord": 2, "rotation": 0.5 }));
    assert_eq!(material["extensions"]["MOZ_lightmap"]["texCoord"], json!(1), "ours is the lightmap's");
    assert_eq!(after.json["materials"][0], before.json["materials"][0], "the original stays");

    // Where no texture uses it, it goes.
    doc.json["materials"][0] = json!({});
    let (_, written) = lit(&doc, |_| {});
    let glb = Glb::new(&written.bytes);
    let keys: Vec<&String> = glb.primitive(0, 0)["attributes"].as_object().unwrap().keys().collect();
    assert_eq!(keys, ["POSITION", "TEXCOORD_0", "TEXCOORD_1"]);
}

#[test]
fn variants_of_materials_are_lit_too() {
    let mut doc = Doc::square();
    doc.json["materials"] = json!([{ "name": "a" }, { "name": "b" }, { "name": "c" }]);
    doc.json["extensions"] = json!({ "KHR_materials_variants": { "variants": [{ "name": "x" }, { "name": "y" }] } });
    doc.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    let mappings = json!([{ "material": 2, "variants": [0] }, { "material": 0, "variants": [1] }]);
    doc.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_materials_variants": { "mappings": mappings } });
    let (_, written) = lit(&doc, |_| {});
    let glb = Glb::new(&written.bytes);
    let primitive = glb.primitive(0, 0);
    let name = |k: &Value| glb.json["materials"][number(k)]["name"].clone();
    let mappings = &primitive["extensions"]["KHR_materials_variants"]["mappings"];
    assert_eq!(
        [&primitive["material"], &mappings[0]["material"], &mappings[1]["material"]],
        [&json!(3), &json!(4), &json!(3)]
    );
    assert_eq!((name(&json!(3)), name(&json!(4))), (json!("a"), json!("c")));
}

#[test]
fn light_at_vertices_is_exact_beside_its_colours() {
    let doc = adorned();
    let values = [[0.5f32, 1.0, 0.0], [3.0, 2.0, 1.0], [0.1, 0.2, 0.3], [8.0, 4.0, 0.7], [1.0, 1.0, 1.0]];
    let (_, written) = lit(&doc, |lit| {
        lit.surfaces[0].page = None;
        for (vertex, value) in lit.surfaces[0].vertices.iter_mut().zip(values) {
            (vertex.texcoord, vertex.irradiance) = (None, Some(value));
        }
    });
    let (before, after) = (Glb::new(&doc.glb()), Glb::new(&written.bytes));
    let primitive = after.primitive(0, 0);
    let attributes = &primitive["attributes"];
    assert_eq!(after.floats(&attributes["_IRRADIANCE"]), values.map(|v| v.to_vec()));
    assert_eq!(after.json["meshes"][0]["extras"], json!({ "targetNames": ["bend"], "twinray_irradiance_scale": 8.0 }));
    for (element, value) in after.elements(&attributes["COLOR_0"]).iter().zip(values) {
        let colour: Vec<f32> =
            element.chunks(2).map(|c| f32::from(u16::from_le_bytes([c[0], c[1]])) / 65535.0).collect();
        assert_eq!(colour[3], 1.0);
        assert!((0..3).all(|c| (colour[c] * 8.0 - value[c]).abs() <= 8.0 / 65535.0), "{colour:?} {value:?}");
    }
    let colour = &after.json["accessors"][number(&attributes["COLOR_0"])];
    assert_eq!((&colour["type"], &colour["normalized"]), (&json!("VEC4"), &json!(true)));
    // The old colours are kept, and the author hears of it.
    let old = before.elements(&before.primitive(0, 0)["attributes"]["COLOR_0"]);
    assert!(after.elements(&attributes["COLOR_1"]).iter().all(|e| old.contains(e)));
    assert!(warnings(&written).contains("COLOR_0: gives its place to irradiance"), "{}", warnings(&written));
    assert!(attributes.get("TEXCOORD_1").is_none());
    assert_eq!(primitive["material"], json!(0));
}

/// Baked again, a document has the new light alone: it is what it was, however often.
#[test]
fn light_of_an_earlier_bake_leaves() {
    let doc = adorned();
    let bake = |source: &[u8], at_vertices: bool| {
        let reading = support::read("again.glb", source).unwrap();
        let mut lit = everything(&reading.scene);
        lit.about = json!({ "rays": 1 });
        for surface in &mut lit.surfaces {
            let mesh = &reading.scene.meshes[reading.scene.instances[surface.instance].mesh];
            let vertex = |source: u32| LitVertex {
                source,
                texcoord: (!at_vertices).then(|| place(source)),
                irradiance: at_vertices.then_some([1.0, 0.5, source as f32]),
            };
            surface.vertices = (0..mesh.positions.len() as u32).map(vertex).collect();
            surface.triangles = mesh.triangles.clone();
            surface.page = (!at_vertices).then_some(0);
        }
        if at_vertices {
            lit.pages.clear();
        }
        write("again.glb", source, &[], &reading.origins, &lit).bytes
    };
    let [lightmap, vertices] = [false, true].map(|at_vertices| bake(&doc.glb(), at_vertices));
    // Of the first bake, both sets of coordinates are one.
    let again = bake(&lightmap, false);
    assert!(bake(&again, false) == again);
    let count = |bytes: &[u8]| Glb::new(bytes).json["images"].as_array().unwrap().len();
    assert_eq!(count(&again), count(&lightmap));
    for key in ["textures", "samplers", "materials", "extensionsUsed"] {
        assert_eq!(Glb::new(&again).json[key], Glb::new(&lightmap).json[key], "{key}");
    }
    assert!(bake(&vertices, true) == vertices);
    let changed = Glb::new(&bake(&lightmap, true)).json;
    let text = changed.to_string();
    assert!(!text.contains("lightmap") && text.contains("_IRRADIANCE"), "{text}");
    assert!(changed["images"].is_null() && changed["textures"].is_null(), "{text}");
    // Colours of the author are the first again; the coordinates of the charts stay.
    let back = Glb::new(&bake(&vertices, false)).json;
    let attributes = &back["meshes"][0]["primitives"][0]["attributes"];
    assert!(attributes["COLOR_0"].is_u64() && attributes["COLOR_1"].is_null() && attributes["_IRRADIANCE"].is_null());
    // A document that nobody has baked keeps what looks like it.
    let mut foreign = doc.json.clone();
    foreign["images"] = json!([{ "uri": "data:image/png;base64,AAAA" }]);
    let foreign = Doc { json: foreign, ..doc };
    assert!(Glb::new(&bake(&foreign.glb(), true)).json["images"].is_array());
}

#[test]
fn pages_beside_the_file_and_colours_without_light() {
    let mut doc = Doc::square();
    doc.json["materials"][0] = json!({
        "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [1, 1, 1], "extras": "dark green",
        "extensions": { "KHR_materials_ior": { "ior": 1.2 } }, "doubleSided": true,
    });
    doc.json["extensionsUsed"] = json!(["KHR_materials_ior"]);
    let about = json!({ "uri": "a-0.exr", "page": 0, "texCoord": 1, "quantity": "irradiance" });
    let page = LitPage { name: "0".into(), material: LitMaterial::Beside(about.clone()) };
    let (_, written) = lit(&doc, |lit| lit.pages = vec![page.clone()]);
    let glb = Glb::new(&written.bytes);
    // Extras may be anything; what they were stays within them.
    assert_eq!(glb.json["materials"][1]["extras"], json!({ "value": "dark green", "twinray_lightmap": about }));
    assert_eq!(glb.json["extensionsUsed"], json!(["KHR_materials_ior"]));
    assert!(glb.json.get("images").is_none());

    let picture = LitPicture { name: "light".into(), bytes: png(&[[1, 2, 3]]), mime: "image/png" };
    let page = LitPage { name: "0".into(), material: LitMaterial::Unlit(picture) };
    let (_, written) = lit(&doc, |lit| lit.pages = vec![page.clone()]);
    let glb = Glb::new(&written.bytes);
    let base = json!({ "index": 0, "texCoord": 1 });
    assert_eq!(
        glb.json["materials"][1],
        json!({
            "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25, "extras": "dark green", "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorTexture": base, "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "extensions": { "KHR_materials_unlit": {} },
        })
    );
    assert_eq!(glb.json["extensionsUsed"], json!(["KHR_materials_ior", "KHR_materials_unlit"]));
}

#[test]
fn lights_leave_and_their_nodes_stay() {
    let mut doc = Doc::square();
    doc.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    doc.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    let light = json!({ "light": 0 });
    doc.json["nodes"] = json!([
        { "mesh": 0, "children": [1, 2] },
        { "name": "lamp", "extensions": { "KHR_lights_punctual": light } },
        { "extensions": { "KHR_lights_punctual": light, "ACME_other": {} } },
    ]);
    let (reading, written) = lit(&doc, |lit| lit.drop_lights = true);
    assert_eq!(reading.scene.lights.len(), 2);
    assert_eq!(reread(&written).scene.lights.len(), 0);
    let glb = Glb::new(&written.bytes);
    assert_eq!(glb.json["nodes"][1], json!({ "name": "lamp" }));
    assert_eq!(glb.json["nodes"][2], json!({ "extensions": { "ACME_other": {} } }));
    assert_eq!(glb.json["extensionsUsed"], json!(["MOZ_lightmap", "TWINRAY_lightmap"]));
    assert!(glb.json.get("extensions").is_none());
    let (_, written) = lit(&doc, |_| {});
    assert_eq!(reread(&written).scene.lights, reading.scene.lights);
}

#[test]
fn everything_else_of_the_document_stays() {
    let mut doc = adorned();
    let inverse: Vec<u8> = (0..64u8).collect();
    let inverse = doc.bytes(&inverse, "MAT4", 64, 5126);
    let times = doc.floats(&[[0.0], [1.0]]);
    let places = doc.floats(&[[0.0f32, 0.0, 0.0], [5.0, 0.0, 0.0]]);
    doc.json["asset"]["copyright"] = json!("somebody");
    doc.json["nodes"] =
        json!([{ "mesh": 0, "skin": 0, "children": [1], "extras": [1, 2] }, { "name": "bone", "camera": 0 }]);
    doc.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }]);
    doc.json["skins"] = json!([{ "joints": [1], "inverseBindMatrices": inverse }]);
    doc.json["animations"] = json!([{ "name": "walk",
        "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
        "samplers": [{ "input": times, "output": places }] }]);
    let (_, written) = lit(&doc, |lit| lit.about = json!({ "rays": 5 }));
    let (before, after) = (Glb::new(&doc.glb()), Glb::new(&written.bytes));
    assert_eq!(
        after.json["asset"],
        json!({ "version": "2.0", "copyright": "somebody", "extras": { "twinray_bake": { "rays": 5 } } })
    );
    for key in ["nodes", "cameras", "scenes", "scene"] {
        assert_eq!(after.json[key], before.json[key], "{key}");
    }
    assert_eq!(after.json["animations"][0]["channels"], before.json["animations"][0]["channels"]);
    let sampler = &after.json["animations"][0]["samplers"][0];
    assert_eq!(after.floats(&sampler["input"]), [[0.0], [1.0]]);
    assert_eq!(after.floats(&sampler["output"]), [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]);
    let bind = &after.json["skins"][0]["inverseBindMatrices"];
    assert_eq!(after.elements(bind), before.elements(&json!(inverse)));
    assert_eq!(after.json["accessors"][number(bind)]["type"], json!("MAT4"));
}

#[test]
fn extensions_that_nobody_knows_keep_their_data() {
    let mut doc = Doc::square();
    let spare = doc.floats(&[[1.0, 2.0]]);
    doc.json["extensionsUsed"] = json!(["ACME_paths"]);
    doc.json["extensions"] = json!({ "ACME_paths": { "points": spare, "table": { "bufferView": 3 } } });
    let reading = doc.read().unwrap();
    let mut resolver = |_: &str| Err(io::ErrorKind::NotFound.into());
    let all = everything(&reading.scene);
    let written =
        write_lit_glb("test.glb", &doc.glb(), &mut resolver, &Limits::default(), &reading.origins, &all).unwrap();
    let (before, after) = (Glb::new(&doc.glb()), Glb::new(&written.bytes));
    let list = |glb: &Glb, key: &str| glb.json[key].as_array().unwrap().clone();
    let accessors = list(&before, "accessors");
    assert_eq!(list(&after, "accessors")[..accessors.len()], accessors);
    for k in 0..list(&before, "bufferViews").len() {
        assert_eq!(before.view(&json!(k)), after.view(&json!(k)));
    }
    assert_eq!(after.json["extensions"], before.json["extensions"]);
    assert_same(&reading.scene, &support::read("a.glb", &written.bytes).unwrap().scene);
}

#[test]
fn files_beside_a_text_document_are_put_into_it() {
    let mut doc = Doc::square();
    let picture = png(&[[200, 100, 50]; 3]);
    doc.json["buffers"][0]["uri"] = json!("a%20b.bin");
    doc.json["images"] = json!([{ "uri": "t.png" }, { "uri": "gone.png" }, { "uri": data_uri(&picture) }]);
    doc.json["textures"] = json!([{ "source": 0 }, { "source": 2 }]);
    doc.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    doc.json["materials"][0]["emissiveTexture"] = json!({ "index": 1 });
    doc.json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    let text = doc.json.to_string().into_bytes();
    let files: [(&str, &[u8]); 2] = [("a b.bin", &doc.binary), ("t.png", &picture)];
    let reading = support::read_with("a.gltf", &text, &files).unwrap();
    let written = write("a.gltf", &text, &files, &reading.origins, &everything(&reading.scene));
    let glb = Glb::new(&written.bytes);
    for k in [0, 2] {
        assert_eq!(glb.view(&glb.json["images"][k]["bufferView"]), picture);
        assert_eq!((&glb.json["images"][k]["mimeType"], glb.json["images"][k].get("uri")), (&json!("image/png"), None));
    }
    assert_eq!(glb.json["images"][0]["name"], json!("t.png"));
    assert_eq!(glb.json["images"][1], json!({ "uri": "gone.png" }));
    assert!(warnings(&written).contains("images[1]"), "{}", warnings(&written));
    assert_eq!(glb.json["buffers"], json!([{ "byteLength": glb.binary.len() }]));
    assert_same(&reading.scene, &reread(&written).scene);
}

fn data_uri(bytes: &[u8]) -> String {
    // Base64 of whole groups of three bytes, and the rest.
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::from("data:image/png;base64,");
    for group in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |w, k| w << 8 | u32::from(group.get(k).copied().unwrap_or(0)));
        let digits = [18, 12, 6, 0].map(|shift| DIGITS[(word >> shift & 63) as usize] as char);
        text.extend(&digits[..=group.len()]);
        text.extend(std::iter::repeat_n('=', 3 - group.len()));
    }
    text
}

#[test]
fn a_packed_form_beside_a_primitive_goes_with_the_old_geometry() {
    let mut doc = Doc::square();
    doc.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    doc.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    let (reading, written) = lit(&doc, |_| {});
    assert!(Glb::new(&written.bytes).primitive(0, 0).get("extensions").is_none());
    assert_same(&reading.scene, &reread(&written).scene);
}

#[test]
fn a_mesh_without_texture_coordinates_gets_the_first_set_with_the_second() {
    let mut doc = Doc::square();
    doc.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    let (_, written) = lit(&doc, |_| {});
    let glb = Glb::new(&written.bytes);
    let attributes = &glb.primitive(0, 0)["attributes"];
    assert_eq!(attributes["TEXCOORD_0"], attributes["TEXCOORD_1"]);
}

#[test]
fn a_broken_attribute_is_left_out_with_a_word() {
    let mut doc = Doc::square();
    let short = doc.floats(&[[0.0, 0.0, 1.0]]);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(short);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["_ODD"] = json!(99);
    doc.json["meshes"][0]["primitives"][0]["attributes"]["_NONE"] = Value::Null;
    let (reading, written) = lit(&doc, |_| {});
    let text = warnings(&written);
    assert!(text.contains("NORMAL") && text.contains("_ODD") && !text.contains("_NONE"), "{text}");
    assert_same(&reading.scene, &reread(&written).scene);
}

#[test]
fn members_of_the_wrong_kind_make_no_panic() {
    let reading = Doc::square().read().unwrap();
    let mut all = everything(&reading.scene);
    all.about = json!({ "rays": 1 });
    all.drop_lights = true;
    all.surfaces[0].vertices.iter_mut().for_each(|v| v.irradiance = Some([1.0; 3]));
    let odd = [json!(null), json!("x"), json!(7), json!([1]), json!({ "a": 1 })];
    let paths = [
        "/extras",
        "/asset",
        "/asset/extras",
        "/nodes",
        "/nodes/0",
        "/nodes/0/mesh",
        "/nodes/0/extensions",
        "/meshes",
        "/meshes/0",
        "/meshes/0/extras",
        "/meshes/0/primitives",
        "/meshes/0/primitives/0",
        "/meshes/0/primitives/0/material",
        "/meshes/0/primitives/0/targets",
        "/meshes/0/primitives/0/attributes",
        "/meshes/0/primitives/0/extensions",
        "/materials",
        "/materials/0",
        "/materials/0/extras",
        "/materials/0/extensions",
        "/images",
        "/textures",
        "/samplers",
        "/accessors",
        "/accessors/0",
        "/accessors/0/type",
        "/bufferViews",
        "/bufferViews/0",
        "/buffers",
        "/buffers/0",
        "/extensionsUsed",
        "/extensions",
        "/skins",
        "/animations",
    ];
    for (path, value) in paths.iter().flat_map(|p| odd.iter().map(move |v| (p, v))) {
        let mut doc = Doc::square();
        let (owner, key) = path.rsplit_once('/').unwrap();
        match doc.json.pointer_mut(owner).unwrap() {
            Value::Array(items) => items[0] = value.clone(),
            Value::Object(members) => drop(members.insert(key.to_owned(), value.clone())),
            _ => unreachable!(),
        }
        let mut resolver = |_: &str| Err(io::ErrorKind::NotFound.into());
        // Origins of the file as it was: those of the changed one may be none.
        let result = write_lit_glb("t.glb", &doc.glb(), &mut resolver, &Limits::default(), &reading.origins, &all);
        if let (Ok(reading), Ok(written)) = (doc.read(), &result) {
            let again = support::read("t.glb", &written.bytes);
            assert!(again.is_ok(), "{path} {value}: {:?}", again.err());
            assert_eq!(world_triangles(&reading.scene), world_triangles(&again.unwrap().scene), "{path} {value}");
        }
        assert!(doc.read().is_err() || result.is_ok(), "{path} {value}: {:?}", result.err());
    }
    // Surfaces that point nowhere.
    let mut resolver = |_: &str| Err(io::ErrorKind::NotFound.into());
    let far = Origin { node: 9, mesh: 9, primitive: 9, vertices: [0, 9, 9, 9].into() };
    let origins = [far.clone(), Origin { node: 0, ..far.clone() }, Origin { node: 0, mesh: 0, ..far.clone() }];
    for origin in origins.into_iter().chain([Origin { node: 0, mesh: 0, primitive: 0, ..far }]) {
        let _ = write_lit_glb("t", &Doc::square().glb(), &mut resolver, &Limits::default(), &[Some(origin)], &all);
    }
    all.surfaces[0].page = Some(7);
    all.surfaces[0].instance = 5;
    write_lit_glb("t", &Doc::square().glb(), &mut resolver, &Limits::default(), &reading.origins, &all).unwrap();
}

#[test]
fn packed_meshes_are_refused_by_the_reader() {
    for extension in ["KHR_draco_mesh_compression", "EXT_meshopt_compression"] {
        let mut doc = Doc::square();
        doc.json["extensionsUsed"] = json!([extension]);
        doc.json["extensionsRequired"] = json!([extension]);
        assert!(matches!(doc.read(), Err(FormatError::Unsupported { .. })), "{extension}");
    }
}

/// Of each scene's file: the light put in is read with the same triangles and materials.
#[test]
fn real_documents_survive_it() {
    let Some(root) = shared_scenes() else { return };
    let (mut tried, mut survived) = (0, 0);
    let mut faults = Vec::new();
    for path in files_below(&root, &["gltf", "glb"]) {
        let (bytes, folder) = (std::fs::read(&path).unwrap(), path.parent().unwrap());
        // Those of some hundred thousand triangles take their time.
        if bytes.len() > 60 << 20 {
            println!("passed over, {} MB: {}", bytes.len() >> 20, path.display());
            continue;
        }
        let name = path.file_name().unwrap().display().to_string();
        let mut resolver = |file: &str| std::fs::read(folder.join(file));
        let Ok(reading) = read_scene(&name, &bytes, &mut resolver, &Limits::default()) else { continue };
        tried += 1;
        let all = everything(&reading.scene);
        match write_lit_glb(&name, &bytes, &mut resolver, &Limits::default(), &reading.origins, &all) {
            Ok(written) => {
                faults.extend(differences(&reading, &written).map(|f| format!("{}: {f}", path.display())));
                keep(&root, &path, &written.bytes);
                survived += 1;
            }
            Err(error) => faults.push(format!("{}: {error}", path.display())),
        }
    }
    println!("{survived} of {tried} documents");
    assert!(tried > 20 && faults.is_empty(), "{} of {tried}:\n{}", faults.len(), faults.join("\n"));
}

fn differences(reading: &Reading, written: &LitGlb) -> Option<String> {
    let after = match support::read("lit.glb", &written.bytes) {
        Ok(after) => after.scene,
        Err(error) => return Some(error.to_string()),
    };
    let before = &reading.scene;
    let names = |scene: &Scene| (0..scene.instances.len()).map(|k| material(scene, k).name).collect::<Vec<_>>();
    if world_triangles(before) != world_triangles(&after) {
        return Some("other triangles".into());
    }
    if names(before) != names(&after) {
        return Some("other materials".into());
    }
    let seconds = |scene: &Scene| scene.meshes.iter().all(|m| m.second_texcoords.is_some());
    (!seconds(&after)).then(|| "no second texture coordinates".into())
}

/// Keeps a file for validators, where the environment asks for it.
fn keep(root: &Path, path: &Path, bytes: &[u8]) {
    if let Some(folder) = std::env::var_os("TWINRAY_KEEP_LIT") {
        let name = path.strip_prefix(root).unwrap().display().to_string().replace(['/', ' '], "_");
        std::fs::write(Path::new(&folder).join(name + ".glb"), bytes).unwrap();
    }
}
