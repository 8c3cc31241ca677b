//! OBJ and MTL: numbers, polygons, materials, light conventions, faults.

use glam::dvec3;
use twinray_format::FormatError;
use twinray_scene::{Opacity, Rgb, Surface, TextureRef, Volume};

use crate::support::{assert_says, assert_warns, colour, normal, png, read, read_with, warnings, world_triangles};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn faces_of_all_sizes_become_triangles() {
    let text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 1 3 0\nf 1 2 3\nf -5 -4 -3 -2\nf 1 2 3 5 4\n";
    let reading = read("a.obj", text.as_bytes()).unwrap();
    // 1 + 2 + 3 triangles; the first of each fan is the same triangle, kept once.
    assert_eq!(reading.scene.meshes[0].triangles.len(), 4);
    assert_warns(&reading, &["2 of 6", "copies"]);
    assert!(world_triangles(&reading.scene).iter().all(|t| normal(*t).z > 0.0));
    assert!(reading.scene.cameras.is_empty());
}

#[test]
fn concave_faces_keep_their_area() {
    // An L of three unit squares, written as one face from a corner where a fan would leave the shape.
    let text = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nf 1 2 3 4 5 6\n";
    let triangles = world_triangles(&read("a.obj", text.as_bytes()).unwrap().scene);
    let area: f64 = triangles.iter().map(|t| normal(*t).z / 2.0).sum();
    let absolute: f64 = triangles.iter().map(|t| normal(*t).length() / 2.0).sum();
    assert_eq!((triangles.len(), area, absolute), (4, 3.0, 3.0));
}

#[test]
fn coordinates_far_away_keep_their_digits() {
    // Survey coordinates: a millimetre at ten million metres is lost in f32.
    let text = "v 10000000.001 5000000 0\nv 10000001.001 5000000 0\nv 10000000.001 5000001 0\nf 1 2 3\n";
    let triangle = world_triangles(&read("a.obj", text.as_bytes()).unwrap().scene)[0];
    assert!((triangle[0] - dvec3(10_000_000.001, 5_000_000.0, 0.0)).length() < 1e-6, "{}", triangle[0]);
    // Objects share their origin: a common vertex is the same point in both.
    let text = "v 100 0 0\nv 101 0 0\nv 100 1 0\nv 103.3 3.3 0\no a\nf 1 2 3\no b\nf 3 2 4\n";
    let scene = read("a.obj", text.as_bytes()).unwrap().scene;
    assert_eq!(scene.instances[0].transform, scene.instances[1].transform);
    let near = read("a.obj", format!("{TRIANGLE}f 1 2 3").as_bytes()).unwrap().scene;
    assert_eq!(near.instances[0].transform, glam::DAffine3::IDENTITY);
}

#[test]
fn winding_follows_the_authors_normals() {
    let text = format!("{TRIANGLE}vn 0 0 -1\nf 1//1 2//1 3//1\n");
    let reading = read("a.obj", text.as_bytes()).unwrap();
    assert!(normal(world_triangles(&reading.scene)[0]).z < 0.0);
    assert_warns(&reading, &["a.obj", "turned round", ": 1"]);
    assert_eq!(reading.scene.meshes[0].normals.as_deref(), Some(&[[0.0, 0.0, -1.0]; 3][..]));
    let text = format!("{TRIANGLE}vn 0 0 1\nf 1//1 2//1 3//1\n");
    assert!(normal(world_triangles(&read("a.obj", text.as_bytes()).unwrap().scene)[0]).z > 0.0);
}

#[test]
fn texture_coordinates_count_from_the_top() {
    let text = format!("{TRIANGLE}vt 0 0\nvt 1 0\nvt 0 0.75\nf 1/1 2/2 3/3\n");
    let scene = read("a.obj", text.as_bytes()).unwrap().scene;
    assert_eq!(scene.meshes[0].texcoords.as_deref(), Some(&[[0.0, 1.0], [1.0, 1.0], [0.0, 0.25]][..]));
}

#[test]
fn materials_become_lambertian_phong_and_veils() {
    let obj = format!(
        "mtllib my file.mtl\n{TRIANGLE}v 0 0 1\nusemtl matt\nf 1 2 3\nusemtl shiny\nf 1 2 4\nusemtl lamp\nf 1 3 4\nusemtl veil\nf 2 3 4\n"
    );
    let mtl = b"newmtl matt\nKd 0.5 0.25 0.125\n\nnewmtl shiny\nKd 0.6 0.2 0.2\nKs 0.5 0.5 0.1\nNs 30\nillum 2\n\
        newmtl lamp\nKe 10 20 30\n  newmtl veil\n\tKd 1 1 1\nd 0.25\nKs 1 1 1\nNs 100\nillum 1\n";
    let reading = read_with("a.obj", obj.as_bytes(), &[("my file.mtl", mtl)]).unwrap();
    let materials = &reading.scene.materials;
    let names: Vec<_> = materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["matt", "shiny", "lamp", "veil"]);
    assert!(materials.iter().all(|m| m.two_sided));
    assert!(
        matches!(&materials[0].surface, Surface::Lambertian { reflectance } if reflectance.factor == Rgb::new(0.5, 0.25, 0.125))
    );
    // Ks is cut to what Kd leaves of 0.98.
    let Surface::Phong { diffuse, specular, exponent } = &materials[1].surface else { panic!() };
    assert_eq!((diffuse.factor, *exponent), (Rgb::new(0.6, 0.2, 0.2), 30.0));
    assert!((specular.r - 0.38).abs() < 1e-12 && specular.g == 0.5 && specular.b == 0.1, "{specular:?}");
    assert_warns(&reading, &["Kd + Ks", "\"shiny\""]);
    assert_eq!(materials[2].emission, Rgb::new(10.0, 20.0, 30.0));
    assert_eq!(colour(&materials[2].surface).factor, Rgb::BLACK, "a lamp without Kd reflects nothing");
    assert_eq!((&materials[3].transmission, materials[3].opacity), (&None, Opacity::Blend));
    assert_eq!(colour(&materials[3].surface).alpha, 0.25);
    assert!(matches!(materials[3].surface, Surface::Lambertian { .. }), "illum 1 has no highlight");
}

/// Models 6 and 7 refract; 4 and 9 are panes if anything else says so; others are never glass.
#[test]
fn illumination_models_of_glass() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let read = |mtl: &str| {
        let mtl = format!("newmtl m\nKd 0.5 0.5 0.5\n{mtl}");
        let reading = read_with("a.obj", obj.as_bytes(), &[("a.mtl", mtl.as_bytes())]).unwrap();
        reading.scene.materials[0].clone()
    };
    let body = Some(Volume { attenuation: Rgb::BLACK });
    for (mtl, expected) in [
        ("illum 7\nNi 1.4\nTf 0.9 0.8 0.7", Some((1.0, body, 1.4, Rgb::new(0.9, 0.8, 0.7)))),
        ("illum 6\nNi 1.33", Some((1.0, body, 1.33, Rgb::WHITE))),
        // Nothing bends, so that nothing is inside.
        ("illum 7\nNi 1\nd 0.1", Some((0.9, None, 1.0, Rgb::grey(0.5)))),
        ("illum 7\nNi 77", Some((1.0, body, 1.5, Rgb::WHITE))),
        ("illum 4\nd 0.25", Some((0.75, None, 1.5, Rgb::grey(0.5)))),
        ("illum 9\nTr 0.75\nTf 1 1 1", Some((0.75, None, 1.5, Rgb::WHITE))),
        ("illum 4\nd 1", None),
        ("illum 9\nTf 0 0 0", None),
        ("illum 2\nTf 1 1 1\nNi 1.5", None),
        ("illum 5\nd 1", None),
        ("Ni 1.5", None),
    ] {
        let material = read(mtl);
        let found = material.transmission.as_ref().map(|t| {
            let Surface::MetallicRoughness { base_color, ior, .. } = &material.surface else { panic!("{mtl}") };
            (t.factor, t.volume, *ior, base_color.factor)
        });
        assert_eq!(found, expected, "{mtl}");
        assert_eq!(material.opacity, Opacity::Opaque, "{mtl}");
    }
    // Roughness of the lobe of exponent 30 is (2/32)^¼.
    for (exponent, roughness) in [("30", 0.5), ("250", 0.0), ("0", 0.0)] {
        let Surface::MetallicRoughness { roughness: found, .. } = read(&format!("illum 7\nNs {exponent}")).surface
        else {
            panic!()
        };
        assert_eq!(found, roughness);
    }
}

#[test]
fn masks_and_bumps() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n");
    let (red, mask, wide) = (png(&[[100, 0, 0], [100, 0, 0]]), png(&[[0; 3], [255; 3]]), png(&[[255; 3]; 3]));
    let read = |mtl: &str| {
        let mtl = format!("newmtl m\n{mtl}\n");
        let files: [(&str, &[u8]); 4] =
            [("a.mtl", mtl.as_bytes()), ("red.png", &red), ("mask.png", &mask), ("wide.png", &wide)];
        read_with("a.obj", obj.as_bytes(), &files).unwrap()
    };
    let texels = |mtl: &str| {
        let reading = read(mtl);
        let material = &reading.scene.materials[0];
        assert_eq!(material.opacity, Opacity::Mask { cutoff: 0.5 }, "{}", warnings(&reading));
        reading.scene.images[colour(&material.surface).texture.as_ref().unwrap().image].rgba.clone()
    };
    // By brightness, as no texel of the mask says anything by its alpha; over the colours, or over white.
    assert_eq!(texels("map_Kd red.png\nmap_d mask.png"), [100, 0, 0, 0, 100, 0, 0, 255]);
    assert_eq!(texels("Kd 0.5 0.5 0.5\nmap_d mask.png"), [255, 255, 255, 0, 255, 255, 255, 255]);
    for other in ["wide.png", "-s 2 2 2 mask.png"] {
        let reading = read(&format!("map_Kd red.png\nmap_d {other}"));
        assert_warns(&reading, &["\"m\"", "map_d is ignored"]);
        assert_eq!(reading.scene.materials[0].opacity, Opacity::Opaque);
    }
    // A mask that cannot be had leaves what d says.
    let reading = read("d 0.5\nmap_d gone.png");
    assert_eq!(reading.scene.materials[0].opacity, Opacity::Blend);

    let reading = read("norm -bm 0.5 red.png\nmap_Bump -bm 2 mask.png");
    let normal_map = reading.scene.materials[0].normal_map.as_ref().unwrap();
    assert_eq!((normal_map.scale, &normal_map.texture), (0.5, &TextureRef::of(0)));
    assert_warns(&reading, &["bump maps are ignored", "\"m\""]);
    assert_eq!(reading.scene.images.len(), 1);
}

/// OBJ counts v from below: at the lower left corner (our v is 1) the look-up is at `o` from the left and from below.
#[test]
fn maps_are_moved_and_scaled() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n");
    let mtl = b"newmtl m\nmap_Kd -s 2 3 1 -o 0.25 0.5 a.png\n";
    let picture = png(&[[1, 2, 3]]);
    let files: [(&str, &[u8]); 2] = [("a.mtl", mtl), ("a.png", &picture)];
    let reading = read_with("a.obj", obj.as_bytes(), &files).unwrap();
    assert!(!warnings(&reading).contains("a.mtl"), "{}", warnings(&reading));
    let transform = colour(&reading.scene.materials[0].surface).texture.as_ref().unwrap().transform;
    assert_eq!(transform.apply([0.0, 1.0]), [0.25, 0.5]);
    assert_eq!(transform.apply([1.0, 0.0]), [2.25, 0.5 - 3.0]);
}

#[test]
fn ambient_light_counts_only_where_nothing_else_emits() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl Light1\nf 1 2 3\n");
    let emission = |mtl: &str| {
        let reading = read_with("a.obj", obj.as_bytes(), &[("a.mtl", mtl.as_bytes())]).unwrap();
        (reading.scene.materials[0].emission, warnings(&reading))
    };
    let (lit, message) = emission("newmtl Light1\nKa 20 10 5\nKd 1 1 1\n");
    assert_eq!(lit, Rgb::new(20.0, 10.0, 5.0));
    assert_says(&message, &["Ka is taken as the emission", "\"Light1\""]);
    assert!(emission("newmtl Light1\nKa 20 20 20\nnewmtl other\nKe 1 1 1\n").0.is_black());
    let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl wall\nf 1 2 3\n");
    let reading = read_with("a.obj", obj.as_bytes(), &[("a.mtl", b"newmtl wall\nKa 1 1 1\n")]).unwrap();
    assert!(reading.scene.materials[0].emission.is_black());
}

#[test]
fn textures_are_read_with_their_options() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n");
    let mtl =
        b"newmtl m\nmap_Kd -clamp on -bm 0.5 -t 1 1 1 tex\\my wood.png\nmap_d tex\\my wood.png\nmap_Ke glow.png\n";
    let (wood, glow) = (png(&[[100, 0, 0]]), png(&[[255, 255, 255]]));
    let files: [(&str, &[u8]); 3] = [("a.mtl", mtl), ("tex/my wood.png", &wood), ("glow.png", &glow)];
    let reading = read_with("a.obj", obj.as_bytes(), &files).unwrap();
    let material = &reading.scene.materials[0];
    let texel = colour(&material.surface);
    assert_eq!(reading.scene.images[texel.texture.as_ref().unwrap().image].rgba[..3], [100, 0, 0]);
    assert_eq!(texel.factor, Rgb::WHITE, "code 100 needs no clamping");
    assert_eq!(texel.texture.as_ref().unwrap().wrap, [twinray_scene::Wrap::Clamp; 2]);
    assert_eq!((material.emission, material.emission_texture.is_some()), (Rgb::WHITE, true));
    assert_eq!(material.opacity, Opacity::Mask { cutoff: 0.5 });
    assert_warns(&reading, &["a.mtl: line 2", "-t"]);
}

#[test]
fn missing_files_leave_grey() {
    let obj = format!("mtllib gone.mtl ../up.mtl\n{TRIANGLE}usemtl stone\nf 1 2 3\n");
    let reading = read("a.obj", obj.as_bytes()).unwrap();
    assert_warns(&reading, &["a.obj: line 1: mtllib", "gone.mtl", "cannot be read"]);
    assert_warns(&reading, &["a.obj: line 1: mtllib", "../up.mtl", "leaves the scene's folder"]);
    assert_warns(&reading, &["grey", "\"stone\""]);
    assert_eq!(colour(&reading.scene.materials[0].surface).factor, Rgb::grey(0.5));
    // Broken lines of an MTL file are named, and the rest counts.
    let mtl = b"newmtl stone\nKd 0.1\nKs 1 2\nNs many\nmap_Kd\nmap_Kd - a\nmap_Kd -bm\nKe 1 1 1\n";
    let files: [(&str, &[u8]); 1] = [("a.mtl", mtl)];
    let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl stone\nf 1 2 3\n");
    let reading = read_with("a.obj", obj.as_bytes(), &files).unwrap();
    for line in ["a.mtl: line 3", "a.mtl: line 4", "a.mtl: line 5", "a.mtl: line 6", "a.mtl: line 7"] {
        assert_warns(&reading, &[line]);
    }
    assert_eq!(colour(&reading.scene.materials[0].surface).factor, Rgb::grey(0.1));
    assert_eq!(reading.scene.materials[0].emission, Rgb::WHITE);
}

#[test]
fn groups_of_one_material_become_one_mesh() {
    let obj =
        format!("{TRIANGLE}v 0 0 1\no a\nusemtl x\nf 1 2 3\nusemtl y\nf 1 2 4\nusemtl x\nf 1 3 4\no b\nf 2 3 4\n");
    let scene = read("a.obj", obj.as_bytes()).unwrap().scene;
    let meshes: Vec<_> = scene.meshes.iter().map(|m| (m.name.as_str(), m.material, m.triangles.len())).collect();
    assert_eq!(meshes, [("a", 0, 2), ("a", 1, 1), ("b", 0, 1)]);
}

#[test]
fn text_in_its_variants_is_read() {
    let cases = [
        "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
        "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 \\\r\n 2 3\r\n",
        "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",
        "v 0 0 0 1\nv .1e1 0 0\nv 0\t1.0 0 # comment\nf 1 2\\\n3\n",
        "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nf 1/ 2/ 3/\n",
        // Faces before their vertices are not allowed, and harmless.
        "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",
    ];
    for text in cases {
        let reading = read("a.obj", text.as_bytes()).unwrap_or_else(|e| panic!("{text:?}: {e}"));
        assert_eq!(world_triangles(&reading.scene).len(), 1, "{text:?}");
    }
    let latin1 = b"o caf\xe9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert!(read("a.obj", latin1).is_ok());
}

#[test]
fn faults_name_their_line() {
    let cases = [
        ("v 0 0\n", &["a.obj: line 1", "found \"0 0\"", "3 numbers after v"][..]),
        ("\n\nv 0 x 0\n", &["a.obj: line 3", "found \"0 x 0\""]),
        ("v 0 0 0\\\n 1\nvn 1\n", &["a.obj: line 3", "vn"]),
        ("v 0 0 0\nf 1 2 3\n", &["a.obj: line 2", "vertex 3", "1 to 1"]),
        ("v 0 0 0\nf 1 1 0\n", &["a.obj: line 2", "corner \"0\""]),
        ("v 0 0 0\nf 1 1 -2\n", &["a.obj: line 2", "corner \"-2\""]),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", &["a.obj: line 2", "corner \"1/1/1/1\""]),
    ];
    for (text, says) in cases {
        let error = read("a.obj", text.as_bytes()).unwrap_err();
        assert!(matches!(error, FormatError::Invalid { .. }), "{text:?}: {error}");
        assert_says(&error.to_string(), says);
    }
    assert!(matches!(read("a.obj", b"\xff\xfev\0"), Err(FormatError::Unreadable { .. })));
    assert!(matches!(read("a.obj", b"v 0 0 0\0\n"), Err(FormatError::Unreadable { .. })));
    assert!(matches!(read("a.obj", b""), Err(FormatError::Unsupported { .. })));
    let reading =
        read("a.obj", format!("{TRIANGLE}v nan 0 0\nf 1 2 3\nf 1 2 4\nf 1 2\nl 1 2\nfoo\n").as_bytes()).unwrap();
    assert_eq!(world_triangles(&reading.scene).len(), 1);
    for says in ["not a number", "fewer than three corners", "no area: ignored", "\"foo\""] {
        assert_warns(&reading, &[says]);
    }
}
