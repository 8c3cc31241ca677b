//! Light at vertices.

use crate::scenes::{Boxes, cut, solve};
use twinray_bake::{Quality, SurfaceLight, bake_vertices};
use twinray_scene::{Mesh, Rgb, Scene};

/// Values at vertices have the power of the solution, and are nowhere negative.
#[test]
fn vertices_have_the_power_of_the_solution() {
    // Nothing stands on anything: what is covered has no light of its own, and would count here. Walls glow: near a small lamp
    // the best fit is held at 0 in places, and has more power than the light.
    let mut room = Boxes::new();
    let (glowing, grey) = (room.material(0.6, 1.0), room.material(0.3, 0.0));
    room.add([0.0, 0.0, 0.0], [4.0, 2.5, 3.0], glowing, true);
    room.add([1.0, 1.8, 1.0], [1.5, 2.1, 1.5], grey, false);
    room.add([2.0, 0.5, 1.0], [2.5, 1.0, 1.5], grey, false);
    let scene = room.0;
    let patches = cut(&scene, 0.1);
    let solution = solve(&patches, 2_000_000);
    let baked = bake_vertices(&scene, &patches, &solution, Quality::Smooth, 1, &mut |_, _| Ok(())).expect("light");
    let (mut found, mut truth, mut area_of_parts) = (0.0, 0.0, 0.0);
    for (part, values) in baked.parts.iter().zip(&baked.irradiance) {
        for face in &part.faces {
            let [a, b, c] = patches.corners(face.triangle);
            let area = 0.5 * (b - a).cross(c - a).length();
            let luminance = |k: u32| {
                let [r, g, b] = values[k as usize].map(f64::from);
                assert!(r >= 0.0 && g >= 0.0 && b >= 0.0);
                0.2126 * r + 0.7152 * g + 0.0722 * b
            };
            found += area * face.corners.map(luminance).iter().sum::<f64>() / 3.0;
            area_of_parts += area;
        }
    }
    for patch in patches.patches() {
        truth += patches.area(patch) * solution.irradiance(patch).luminance();
    }
    assert!((area_of_parts / patches.total_area() - 1.0).abs() < 1e-6);
    assert!((found / truth - 1.0).abs() < 0.005, "{found} against {truth}");
}

/// What is said of the error of interpolation is what is found at points between the vertices.
#[test]
fn the_error_of_interpolation_is_known() {
    let mut room = Boxes::new();
    let (white, lamp) = (room.material(0.6, 0.0), room.material(0.0, 10.0));
    room.add([0.0, 0.0, 0.0], [4.0, 2.5, 3.0], white, true);
    room.add([1.5, 2.0, 1.0], [2.0, 2.1, 1.5], lamp, false);
    // Large walls under a small lamp, and the same ones of triangles that are small enough.
    let coarse = check_error(&room.0);
    room.0.meshes.iter_mut().for_each(|mesh| (0..4).for_each(|_| refine(mesh)));
    let fine = check_error(&room.0);
    assert!(coarse > 0.2 && fine < 0.1 * coarse, "{coarse}, {fine}");
}

/// Every triangle in four.
fn refine(mesh: &mut Mesh) {
    let old = std::mem::take(&mut mesh.triangles);
    let normals = mesh.normals.as_mut().expect("normals");
    for [a, b, c] in old {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[k, l]| {
            let [p, q] = [k, l].map(|k| mesh.positions[k as usize]);
            mesh.positions.push([0, 1, 2].map(|axis| 0.5 * (p[axis] + q[axis])));
            normals.push(normals[k as usize]);
            mesh.positions.len() as u32 - 1
        });
        mesh.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
}

/// Compares, and gives the error at points that the bake did not take.
fn check_error(scene: &Scene) -> f64 {
    let patches = cut(scene, 0.1);
    let solution = solve(&patches, 2_000_000);
    let baked = bake_vertices(scene, &patches, &solution, Quality::Smooth, 1, &mut |_, _| Ok(())).expect("light");
    let light = SurfaceLight::new(&patches, &solution, Quality::Smooth, 1);
    let [mut area, mut mean, mut off] = [0.0; 3];
    for (part, values) in baked.parts.iter().zip(&baked.irradiance) {
        for face in part.faces.iter().filter(|f| !f.dark) {
            let [a, b, c] = patches.corners(face.triangle);
            let n = if part.faces.len() > 100 { 8 } else { 40 };
            let each = (b - a).cross(c - a).length() / f64::from(n * n);
            for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
                let [u, v] = [i, j].map(|k| (f64::from(k) + 1.0 / 3.0) / f64::from(n));
                let place = part.place([1.0 - u - v, u, v]);
                let Some(there) = light.at(face.triangle, part.side, place, 0, 0..1) else { continue };
                let corner = face.corners.map(|k| Rgb::from_f32(values[k as usize]).luminance());
                let interpolated = (1.0 - u - v) * corner[0] + u * corner[1] + v * corner[2];
                area += each;
                mean += each * there.luminance();
                off += each * (interpolated - there.luminance()).powi(2);
            }
        }
    }
    let expected = (off / area).sqrt() / (mean / area);
    assert!((baked.off / expected - 1.0).abs() < 0.05, "{} against {expected}", baked.off);
    expected
}
