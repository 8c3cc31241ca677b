//! Lightmaps of scenes whose light is known.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use twinray_bake::{Atlas, AtlasOptions, Layout, Lightmap, LightmapOptions, Quality, SurfaceLight, TexelDensity, bake};
use twinray_scene::{PatchScene, Rgb, Scene, Side, builtin};
use twinray_solve::Solution;

use crate::scenes::{Boxes, at, cut, solve};

fn options(density: f64, quality: Quality) -> LightmapOptions {
    let atlas = AtlasOptions { density: TexelDensity::PerMetre(density), page_size: 512, ..AtlasOptions::default() };
    LightmapOptions { atlas, quality, stitch: true, seed: 1 }
}

/// Irradiance of the lightmap at a point of a face.
fn read(map: &Lightmap, part: usize, face: usize, weights: [f64; 3]) -> Rgb {
    let laid = &map.atlas.parts[part];
    let uv = laid.triangles[face].map(|k| laid.vertices[k as usize].uv);
    let at = |axis: usize| (0..3).map(|k| weights[k] * f64::from(uv[k][axis])).sum::<f64>();
    map.pages[laid.pages[face] as usize].sample(at(0), at(1))
}

/// Mean of the lightmap over the surface, as filters read it, and the solution's.
fn means(map: &Lightmap, patches: &PatchScene, solution: &Solution) -> [f64; 2] {
    let (mut light, mut total) = (0.0, 0.0);
    let mut truth = 0.0;
    for (p, part) in map.parts.iter().enumerate() {
        for (f, face) in part.faces.iter().enumerate() {
            let [a, b, c] = patches.corners(face.triangle);
            let area = 0.5 * (b - a).cross(c - a).length();
            let n = 24;
            let mut mean = 0.0;
            let mut count = 0.0;
            for i in 0..n {
                for j in 0..n - i {
                    let [u, v] = [(f64::from(i) + 0.33) / f64::from(n), (f64::from(j) + 0.33) / f64::from(n)];
                    mean += read(map, p, f, [1.0 - u - v, u, v]).luminance();
                    count += 1.0;
                }
            }
            light += area * mean / count;
            total += area;
        }
    }
    for patch in patches.patches() {
        truth += patches.area(patch) * solution.irradiance(patch).luminance();
    }
    [light / total, truth / total]
}

/// Wherever one is in a furnace the light is the same, so every texel that a filter can read must have it: gaps that
/// were not continued, or texels with something beside the surface in them, would be dark.
#[test]
fn a_furnace_is_even_to_the_rims_of_charts() {
    let scene = builtin::furnace(0.5, 1.0);
    let patches = cut(&scene, f64::INFINITY);
    let solution = solve(&patches, 400_000);
    let map =
        bake(&scene, &patches, &solution, &options(20.0, Quality::Cells), &mut |_, _| Ok(())).expect("a lightmap");
    let expected = solution.irradiance(patches.patches().next().expect("a patch")).luminance();
    for (p, part) in map.parts.iter().enumerate() {
        for f in 0..part.faces.len() {
            for k in 0..=40 {
                let t = f64::from(k) / 40.0;
                for weights in [[1.0 - t, t, 0.0], [0.0, 1.0 - t, t], [t, 0.0, 1.0 - t]] {
                    let found = read(&map, p, f, weights).luminance();
                    assert!((found / expected - 1.0).abs() < 0.02, "face {f}: {found} against {expected}");
                }
            }
        }
    }
}

/// The lightmap has the power of the solution, whichever way its texels were filled.
#[test]
fn no_light_is_lost_or_made() {
    let scene = builtin::cornell(false);
    let patches = cut(&scene, 0.05);
    let solution = solve(&patches, 2_000_000);
    for (quality, tolerance) in [(Quality::Cells, 0.01), (Quality::Smooth, 0.01), (Quality::Gathered(16), 0.015)] {
        let map = bake(&scene, &patches, &solution, &options(20.0, quality), &mut |_, _| Ok(())).expect("a lightmap");
        let [found, truth] = means(&map, &patches, &solution);
        assert!((found / truth - 1.0).abs() < tolerance, "{quality:?}: {found} against {truth}");
    }
}

/// A closed room with walls of 1 cm in bright surroundings stays dark.
#[test]
fn a_room_with_thin_walls_does_not_leak() {
    let mut room = Boxes::new();
    let grey = room.material(0.6, 0.0);
    let (w, t) = (1.5f32, 0.01f32);
    // Six slabs that stand on and beside each other, as people build them.
    room.add([-w - t, -t, -w - t], [w + t, 0.0, w + t], grey, false);
    room.add([-w - t, 2.0, -w - t], [w + t, 2.0 + t, w + t], grey, false);
    room.add([-w - t, 0.0, -w - t], [-w, 2.0, w + t], grey, false);
    room.add([w, 0.0, -w - t], [w + t, 2.0, w + t], grey, false);
    room.add([-w, 0.0, -w - t], [w, 2.0, -w], grey, false);
    room.add([-w, 0.0, w], [w, 2.0, w + t], grey, false);
    let scene = Scene { environment: Some(twinray_scene::Environment::Uniform(Rgb::WHITE)), ..room.0 };
    let patches = cut(&scene, 0.1);
    let solution = solve(&patches, 3_000_000);
    for quality in [Quality::Cells, Quality::Smooth, Quality::Gathered(8)] {
        let map = bake(&scene, &patches, &solution, &options(10.0, quality), &mut |_, _| Ok(())).expect("a lightmap");
        let (mut inside, mut outside) = ([0.0f64; 2], [0.0; 2]);
        for (p, part) in map.parts.iter().enumerate() {
            for (f, face) in part.faces.iter().enumerate() {
                for k in 0..200u32 {
                    let place = |step: f64| (f64::from(k) * step + 0.5).fract();
                    let (mut s, mut r) = (place(0.754_877_666), place(0.569_840_291));
                    if s + r > 1.0 {
                        (s, r) = (1.0 - s, 1.0 - r);
                    }
                    let [u, v] = part.place([1.0 - s - r, s, r]);
                    let point = patches.point_of(face.triangle, u, v) + patches.centre();
                    let is_inside = point.x.abs() < f64::from(w) + 1e-4
                        && point.z.abs() < f64::from(w) + 1e-4
                        && point.y > -1e-4
                        && point.y < 2.0 + 1e-4;
                    let sum = if is_inside { &mut inside } else { &mut outside };
                    sum[0] += read(&map, p, f, [1.0 - s - r, s, r]).luminance();
                    sum[1] += 1.0;
                }
            }
        }
        assert!(inside[1] > 500.0 && outside[1] > 500.0);
        let [inside, outside] = [inside[0] / inside[1], outside[0] / outside[1]];
        assert!(outside > 1.0, "{quality:?}: {outside}");
        assert!(inside / outside < 1e-4, "{quality:?}: {}", inside / outside);
    }
}

/// Tiles of one wall, each a mesh of its own with charts of its own, meet without a line.
#[test]
fn tiles_meet_without_a_line() {
    let mut wall = Boxes::new();
    let (grey, lamp) = (wall.material(0.5, 0.0), wall.material(0.0, 20.0));
    wall.add([0.0, 0.0, 0.0], [0.5, 0.1, 0.5], grey, false);
    let tile = wall.0.instances[0].mesh;
    wall.0.instances.clear();
    for x in 0..4 {
        for z in 0..4 {
            wall.place(tile, at(0.5 * f64::from(x), 0.0, 0.5 * f64::from(z)));
        }
    }
    wall.add([0.2, 1.0, 0.2], [0.6, 1.1, 0.6], lamp, false);
    let patches = cut(&wall.0, 0.05);
    let solution = solve(&patches, 4_000_000);
    let loose = LightmapOptions { stitch: false, ..options(16.0, Quality::Smooth) };
    let map = bake(&wall.0, &patches, &solution, &loose, &mut |_, _| Ok(())).expect("a lightmap");
    let stitched =
        bake(&wall.0, &patches, &solution, &options(16.0, Quality::Smooth), &mut |_, _| Ok(())).expect("a lightmap");
    assert!(map.seams[0].length > 10.0, "{:?}", map.seams);
    assert_eq!(map.seams[0], stitched.seams[0]);
    assert!(stitched.seams[1].rms < 0.003 && stitched.seams[1].p99 < 0.01, "{:?}", stitched.seams);
    // What was moved is little: the light is still that of the solution.
    let [found, truth] = means(&stitched, &patches, &solution);
    assert!((found / truth - 1.0).abs() < 0.02, "{found} against {truth}");
}

/// The back of a leaf absorbs what comes from below; what comes past the leaf still lights the ground under it.
#[test]
fn the_ground_under_a_leaf_is_lit_from_the_sides() {
    let (a, h) = (0.1f32, 0.15f32);
    let mut garden = Boxes::new();
    let (grey, black) = (garden.material(0.5, 0.0), garden.material(0.0, 0.0));
    garden.add([-1.0, -0.1, -1.0], [1.0, 0.0, 1.0], grey, false);
    garden.add([-a, h - 0.1, -a], [a, h, a], black, false);
    let leaf = garden.0.meshes.last_mut().expect("a mesh");
    leaf.triangles.retain(|t| t.iter().all(|&k| leaf.positions[k as usize][1] == h));
    let scene = Scene { environment: Some(twinray_scene::Environment::Uniform(Rgb::WHITE)), ..garden.0 };
    let patches = cut(&scene, 0.04);
    let solution = solve(&patches, 4_000_000);
    // The form factor of a parallel square from below its middle, as four of its corner (Siegel and Howell, configuration B-4).
    let x = f64::from(a / h);
    let root = (1.0 + x * x).sqrt();
    let expected = PI * (1.0 - 4.0 * 2.0 * x / root * (x / root).atan() / (2.0 * PI));
    let from = DVec3::new(0.011, 0.001, 0.007) - patches.centre();
    let below = patches.trace(from, DVec3::NEG_Y).expect("the ground");
    for quality in [Quality::Cells, Quality::Smooth, Quality::Gathered(4096)] {
        let light = SurfaceLight::new(&patches, &solution, quality, 1);
        let found = light.at(below.triangle, below.side, [below.u, below.v], 7, 0..light.rays()).expect("light");
        assert!((found.luminance() / expected - 1.0).abs() < 0.06, "{quality:?}: {found:?} against {expected}");
    }
}

/// Cells that walls divide have no more light than fell on them, on whichever side of the wall it did.
#[test]
fn cells_between_slats_keep_their_light() {
    let mut blinds = Boxes::new();
    let (grey, black) = (blinds.material(0.5, 0.0), blinds.material(0.0, 0.0));
    blinds.add([0.0, -0.1, 0.0], [1.0, 0.0, 1.0], grey, false);
    for k in 0..19 {
        let x = 0.05 * (k + 1) as f32 + 0.013;
        blinds.add([x, 0.0, 0.0], [x + 0.002, 0.06, 1.0], black, false);
    }
    let scene = Scene { environment: Some(twinray_scene::Environment::Uniform(Rgb::WHITE)), ..blinds.0 };
    let patches = cut(&scene, 0.1);
    let solution = solve(&patches, 2_000_000);
    let smooth = SurfaceLight::new(&patches, &solution, Quality::Smooth, 1);
    let [mut arrived, mut found] = [0.0; 2];
    for i in 0..60 {
        for j in 0..60 {
            let place = |k: i32| 0.1 + 0.8 * (f64::from(k) + 0.5) / 60.0;
            let above = DVec3::new(place(i), 0.001, place(j)) - patches.centre();
            let Some(hit) = patches.trace(above, DVec3::NEG_Y) else { continue };
            let Some(light) = smooth.at(hit.triangle, hit.side, [hit.u, hit.v], 7, 0..1) else { continue };
            let patch = patches.patch_at(hit.triangle, hit.side, hit.u, hit.v).expect("the ground's cell");
            arrived += solution.irradiance(patch).luminance();
            found += light.luminance();
        }
    }
    // What stands under slats gets no light: a twenty-fifth of the ground.
    assert!((0.96 * found / arrived - 1.0).abs() < 0.03, "{found} against {arrived}");
}

/// A partition that stands in the middle of cells of a floor that runs on under it keeps light on its side.
#[test]
fn light_stays_on_its_side_of_a_partition() {
    let mut hall = Boxes::new();
    let (grey, lamp, black) = (hall.material(0.5, 0.0), hall.material(0.0, 20.0), hall.material(0.0, 0.0));
    hall.add([-2.0, 0.0, -1.0], [2.0, 2.0, 1.0], grey, true);
    hall.add([0.02, 0.0, -1.0], [0.04, 2.0, 1.0], black, false);
    hall.add([-1.2, 1.8, -0.2], [-0.8, 1.9, 0.2], lamp, false);
    let patches = cut(&hall.0, 0.1);
    let solution = solve(&patches, 4_000_000);
    let smooth = SurfaceLight::new(&patches, &solution, Quality::Smooth, 1);
    let cells = SurfaceLight::new(&patches, &solution, Quality::Cells, 1);
    let mean = |light: &SurfaceLight<'_>, x: f64| {
        let at = |k: i32| {
            let above = DVec3::new(x, 0.001, -0.8 + 0.04 * f64::from(k)) - patches.centre();
            let hit = patches.trace(above, DVec3::NEG_Y).expect("the floor");
            light.at(hit.triangle, hit.side, [hit.u, hit.v], 7, 0..1).expect("light").luminance()
        };
        (0..40).map(at).sum::<f64>() / 40.0
    };
    let bright = mean(&cells, -0.15);
    // The cells under the partition are bright on both sides of it.
    assert!(mean(&cells, 0.06) > 0.1 * bright);
    for x in [0.045, 0.06, 0.1, 0.2] {
        assert!(mean(&smooth, x) < 0.003 * bright, "{x}: {} of {bright}", mean(&smooth, x));
    }
    // Nor do they leave a dark rim where they are bright.
    assert!((mean(&smooth, 0.01) / bright - 1.0).abs() < 0.1, "{} of {bright}", mean(&smooth, 0.01));
}

/// A sheet that is lit on both sides has both lights.
#[test]
fn sheets_have_two_sides() {
    let mut scene = Boxes::new();
    let (sheet, lamp) = (scene.material(0.5, 0.0), scene.material(0.0, 10.0));
    scene.0.materials[sheet].two_sided = true;
    scene.add([-1.0, -1.0, 0.0], [1.0, 1.0, 0.001], sheet, false);
    // Only one face of the box is left: a sheet.
    let mesh = scene.0.meshes.last_mut().expect("a mesh");
    mesh.triangles.retain(|t| t.iter().all(|&k| mesh.positions[k as usize][2] == 0.0));
    scene.add([-0.5, -0.5, 1.0], [0.5, 0.5, 1.1], lamp, false);
    scene.add([-0.5, -0.5, -3.0], [0.5, 0.5, -2.9], lamp, false);
    let patches = cut(&scene.0, 0.1);
    let solution = solve(&patches, 2_000_000);
    let map =
        bake(&scene.0, &patches, &solution, &options(10.0, Quality::Smooth), &mut |_, _| Ok(())).expect("a lightmap");
    let mean = |side: Side| {
        let part = map.parts.iter().position(|p| p.instance == 0 && p.side == side).expect("a side");
        assert!(map.parts[part].one_sided);
        (0..2).map(|f| read(&map, part, f, [1.0 / 3.0; 3]).luminance()).sum::<f64>() / 2.0
    };
    let [front, back] = [mean(Side::Front), mean(Side::Back)];
    // The nearer lamp is on one side, the farther on the other.
    let (near, far) = (front.max(back), front.min(back));
    assert!(near > 3.0 * far && far > 0.0, "{front} {back}");
}

/// The author's coordinates are kept where they are sound, and the reason is known where they are not.
#[test]
fn authored_coordinates_are_kept_if_they_are_sound() {
    let mut scene = builtin::cornell(false);
    let patches = cut(&scene, 0.2);
    let solution = solve(&patches, 100_000);
    let atlas_of = |scene: &Scene| {
        bake(scene, &patches, &solution, &options(10.0, Quality::Cells), &mut |_, _| Ok(())).expect("a lightmap").atlas
    };
    // Coordinates of a bake are sound.
    let mut single = options(10.0, Quality::Cells);
    single.atlas.page_size = 1024;
    let map = bake(&scene, &patches, &solution, &single, &mut |_, _| Ok(())).expect("a lightmap");
    assert_eq!(map.pages.len(), 1);
    for (part, laid) in map.parts.iter().zip(&map.atlas.parts) {
        let mesh = scene.instances[part.instance].mesh;
        // Each mesh is placed once; its vertices are those of the atlas now.
        let old = scene.meshes[mesh].clone();
        let new = &mut scene.meshes[mesh];
        new.positions = laid.vertices.iter().map(|v| old.positions[v.source as usize]).collect();
        new.normals = old.normals.as_ref().map(|n| laid.vertices.iter().map(|v| n[v.source as usize]).collect());
        new.texcoords = None;
        new.tangents = None;
        new.second_texcoords = Some(laid.vertices.iter().map(|v| v.uv).collect());
        new.triangles = laid.triangles.clone();
    }
    let kept = atlas_of(&scene);
    assert_eq!(kept.layout, Layout::Authored);
    assert_eq!(kept.pages, vec![[512, 512]]);
    // All charts in one place are not.
    for mesh in &mut scene.meshes {
        mesh.second_texcoords.iter_mut().flatten().for_each(|t| *t = t.map(|c| (8.0 * c).fract()));
    }
    let Layout::Unwrapped { fault: Some(_), .. } = atlas_of(&scene).layout else { panic!("overlaps were not seen") };
}

#[test]
fn mirrored_instances_are_drawn_from_their_front() {
    let mut scene = Boxes::new();
    let (grey, lamp) = (scene.material(0.5, 0.0), scene.material(0.0, 10.0));
    scene.add([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], grey, false);
    scene.0.instances.clear();
    scene.place(0, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
    scene.add([0.0, 3.0, 0.0], [1.0, 3.1, 1.0], lamp, false);
    let patches = cut(&scene.0, 0.2);
    let solution = solve(&patches, 200_000);
    let map =
        bake(&scene.0, &patches, &solution, &options(10.0, Quality::Cells), &mut |_, _| Ok(())).expect("a lightmap");
    let part = map.parts.iter().find(|p| p.instance == 0).expect("the box");
    assert!(part.mirrored);
    for (face, original) in part.faces.iter().zip(&scene.0.meshes[0].triangles) {
        let drawn = part.drawn(face.corners);
        let turned = (0..3).any(|k| [drawn[k], drawn[(k + 1) % 3], drawn[(k + 2) % 3]] == *original);
        assert!(turned, "{drawn:?} against {original:?}");
    }
}

/// Thousands of charts are put in rows instead of being nested; they keep their distance like others.
#[test]
fn many_charts_keep_their_distance() {
    let mut room = Boxes::new();
    let (glowing, grey) = (room.material(0.5, 1.0), room.material(0.5, 0.0));
    room.add([0.0; 3], [3.2, 3.2, 3.2], glowing, true);
    room.add([0.1; 3], [0.15, 0.16, 0.17], grey, false);
    for k in 1..1000 {
        let [x, y, z] = [k % 10, k / 10 % 10, k / 100].map(|c| 0.3 * f64::from(c));
        room.place(1, DAffine3::from_translation(DVec3::new(x, y, z)));
    }
    let scene = room.0;
    let patches = cut(&scene, 1.0);
    let parts = twinray_bake::parts(&scene, &patches, &solve(&patches, 400_000));
    let padding = 2;
    let options = AtlasOptions { page_size: 1024, padding, ..AtlasOptions::default() };
    let atlas = Atlas::new(&scene, &patches, &parts, &options).expect("charts");
    assert!(atlas.charts > Some(5000), "{:?}", atlas.charts);
    let [width, height] = atlas.pages[0].map(i64::from);
    let mut owner = vec![None; (width * height) as usize];
    let mut number = 0;
    for laid in &atlas.parts {
        // Two triangles of one side of a box make a chart.
        for pair in laid.triangles.chunks_exact(2) {
            let texels = |axis: usize, size: i64| {
                let at = pair.iter().flatten().map(|&k| f64::from(laid.vertices[k as usize].uv[axis]) * size as f64);
                let (low, high) = at.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
                // Roundings of half a thousandth of a texel are no texel.
                ((low + 5e-4).floor() as i64 - i64::from(padding)).max(0)
                    ..((high - 5e-4).ceil() as i64 + i64::from(padding)).min(size)
            };
            for y in texels(1, height) {
                for x in texels(0, width) {
                    let owner = &mut owner[(y * width + x) as usize];
                    assert_eq!(*owner.get_or_insert(number), number, "charts meet at {x}, {y}");
                }
            }
            number += 1;
        }
    }
}
