//! For each kind a scene that has the fault, and one that has not.

use glam::{DAffine3, DVec3};

use super::*;
use crate::authored::{Instance, LightKind, Material, Mesh, PunctualLight, Surface, Texel};
use crate::builtin;
use crate::patch::{PatchBudget, PatchOptions};
use crate::rgb::Rgb;

fn look(scene: &Scene, options: &CheckOptions) -> Vec<Finding> {
    assert_eq!(scene.validate(), []);
    let cut = PatchOptions { budget: PatchBudget::Count(3000), two_sided: false };
    let patches = PatchScene::new(scene, cut).unwrap();
    check(scene, &patches, &scene.cameras, options)
}

#[track_caller]
fn finds(scene: &Scene, kind: Kind) -> Finding {
    let found = look(scene, &CheckOptions::default());
    let first = found.iter().find(|f| f.kind == kind).cloned();
    first.unwrap_or_else(|| panic!("no {} in {found:#?}", kind.id()))
}

#[track_caller]
fn misses(scene: &Scene, kind: Kind) {
    let found: Vec<Finding> = look(scene, &CheckOptions::default()).into_iter().filter(|f| f.kind == kind).collect();
    assert_eq!(found, []);
}

/// A mesh placed as it is.
fn place(scene: &mut Scene, mesh: Mesh) {
    let instance = Instance { name: mesh.name.clone(), mesh: scene.meshes.len(), transform: DAffine3::IDENTITY };
    scene.meshes.push(mesh);
    scene.instances.push(instance);
}

/// A closed, lit room of some metres with a camera.
fn room() -> Scene {
    builtin::doorway()
}

/// An upright sheet of `n` × `n` squares of `size` metres, with a lightmap that fills the middle of the page.
fn sheet(n: u32, size: f32) -> Mesh {
    let (mut positions, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for y in 0..=n {
        for x in 0..=n {
            let [s, t] = [x, y].map(|k| k as f32 / n as f32);
            positions.push([s * size, t * size, 0.0]);
            uvs.push([0.25 + 0.5 * s, 0.25 + 0.5 * t]);
            if x < n && y < n {
                let k = y * (n + 1) + x;
                triangles.push([k, k + 1, k + n + 2]);
                triangles.push([k, k + n + 2, k + n + 1]);
            }
        }
    }
    Mesh { name: "sheet".into(), positions, second_texcoords: Some(uvs), triangles, ..Mesh::default() }
}

fn alone(mesh: Mesh) -> Scene {
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    place(&mut scene, mesh);
    scene
}

/// A cube of `2 × half` with `n` × `n` squares a side, outside in front, every triangle with corners of its own.
fn cube(n: u32, half: f32) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let flat = sheet(n, 2.0 * half);
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let first = positions.len() as u32;
            for [s, t, _] in &flat.positions {
                let mut p = [0.0; 3];
                p[axis] = sign * half;
                p[(axis + 1) % 3] = (s - half) * sign;
                p[(axis + 2) % 3] = t - half;
                positions.push(p);
            }
            triangles.extend(flat.triangles.iter().map(|t| t.map(|k| k + first)));
        }
    }
    Mesh { name: "cube".into(), positions, triangles, ..Mesh::default() }
}

#[test]
fn built_in_scenes_have_nothing_worth_a_warning() {
    for name in ["cornell", "cornell-closed", "doorway", "hall", "hall-diffuse", "furnace", "plates", "cube"] {
        let found = look(&builtin::by_name(name).unwrap(), &CheckOptions::default());
        let bad: Vec<&Finding> = found.iter().filter(|f| f.severity != Severity::Note).collect();
        assert!(bad.is_empty(), "{name}: {bad:#?}");
    }
}

#[test]
fn units() {
    misses(&room(), Kind::Units);
    let mut small = room();
    small.instances.iter_mut().for_each(|i| i.transform = DAffine3::from_scale(DVec3::splat(1e-3)) * i.transform);
    assert_eq!(finds(&small, Kind::Units).worst.unit, "m");
    let mut bright = room();
    bright.materials.iter_mut().for_each(|m| m.emission *= 1e8);
    assert_eq!(finds(&bright, Kind::Units).worst.unit, "lx");
    let mut sun = room();
    sun.lights.push(PunctualLight {
        name: "sun".into(),
        transform: DAffine3::IDENTITY,
        kind: LightKind::Directional,
        intensity: Rgb::grey(683_000.0),
        profile: None,
    });
    assert_eq!(finds(&sun, Kind::Units).element, Element::Light(0, "sun".into()));
}

#[test]
fn rooms_in_centimetres() {
    // A cube of 3 m seen from inside is no kilometre across in centimetres.
    let seen = |half: f32| {
        let mut mesh = cube(1, half);
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let mut scene = alone(mesh);
        scene.cameras.push(Camera::look_at("c", DVec3::ZERO, DVec3::X, DVec3::Y, 90.0));
        scene
    };
    misses(&seen(1.5), Kind::Units);
    // A hall of 50 m is large, and is one.
    misses(&seen(25.0), Kind::Units);
    let found = finds(&seen(150.0), Kind::Units);
    assert!(found.worst.value > 100.0 && found.worst.value < 300.0, "{found:?}");
}

#[test]
fn walls_that_turn_their_backs() {
    misses(&room(), Kind::FlippedNormals);
    let mut scene = room();
    // All of one mesh, so that no neighbour tells.
    let turned = scene.instances[0].mesh;
    scene.meshes[turned].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert_eq!(finds(&scene, Kind::FlippedNormals).severity, Severity::Error);
}

#[test]
fn normals_and_windings_that_disagree() {
    let mut mesh = cube(4, 1.0);
    misses(&alone(mesh.clone()), Kind::FlippedNormals);
    mesh.triangles[5].swap(1, 2);
    let found = finds(&alone(mesh), Kind::FlippedNormals);
    assert_eq!((found.count, &found.triangles[..]), (1, &[5][..]));
    let mut mesh = sheet(2, 1.0);
    mesh.normals = Some(vec![[0.0, 0.0, 1.0]; mesh.positions.len()]);
    misses(&alone(mesh.clone()), Kind::FlippedNormals);
    mesh.normals = Some(vec![[0.0, 0.0, -1.0]; mesh.positions.len()]);
    assert_eq!(finds(&alone(mesh), Kind::FlippedNormals).count, 8);
}

#[test]
fn holes_in_bodies() {
    let mut mesh = cube(8, 1.0);
    misses(&alone(mesh.clone()), Kind::OpenShell);
    mesh.triangles.remove(40);
    let found = finds(&alone(mesh), Kind::OpenShell);
    // Two sides of a square of a quarter metre, and its diagonal.
    assert!((found.worst.value - 0.25 * (2.0 + 2f64.sqrt())).abs() < 1e-6, "{found:?}");
    assert_eq!(found.count, 3);
    // A box without a lid is meant so.
    let mut open = cube(8, 1.0);
    open.triangles.truncate(5 * 128);
    misses(&alone(open), Kind::OpenShell);
}

#[test]
fn light_that_leaks_through_a_slit() {
    misses(&room(), Kind::Leak);
    // A cube seen from inside, one wall moved off by a centimetre.
    let slit = |width: f32| {
        let mut mesh = cube(1, 1.0);
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh.positions[20..24].iter_mut().for_each(|p| p[2] += width);
        let mut scene = alone(mesh);
        scene.cameras.push(Camera::look_at("c", DVec3::ZERO, DVec3::X, DVec3::Y, 90.0));
        scene
    };
    misses(&slit(0.0), Kind::Leak);
    assert_eq!(finds(&slit(0.01), Kind::Leak).severity, Severity::Error);
}

#[test]
fn windows_do_not_leak() {
    // One of many squares of a wall is missing.
    let mut mesh = cube(6, 1.0);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.triangles.drain(28..30);
    let mut scene = alone(mesh);
    scene.cameras.push(Camera::look_at("c", DVec3::ZERO, DVec3::X, DVec3::Y, 90.0));
    misses(&scene, Kind::Leak);
}

/// A cube of 2 m seen from inside; one of its walls has a window of `window` metres a side, and another ends `gap` metres
/// before the edge. Bars of 5 cm stand in the window, `pitch` from each other if that is not 0.
fn glazed(window: f32, gap: f32, pitch: f32) -> Scene {
    let mut mesh = cube(1, 1.0);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    // The last wall, at z = 1, becomes a frame.
    mesh.triangles.truncate(10);
    mesh.positions.truncate(20);
    let mut rectangle = |[x0, y0]: [f32; 2], [x1, y1]: [f32; 2]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[x0, y0, 1.0], [x0, y1, 1.0], [x1, y1, 1.0], [x1, y0, 1.0]]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    let half = 0.5 * window;
    rectangle([-1.0, -1.0], [-half, 1.0]);
    rectangle([half, -1.0], [1.0 - gap, 1.0]);
    rectangle([-half, -1.0], [half, -half]);
    rectangle([-half, half], [half, 1.0]);
    for k in 0..if pitch > 0.0 { (window / pitch) as u32 } else { 0 } {
        let x = -half + pitch * (k + 1) as f32;
        rectangle([x - 0.05, -half], [x, half]);
    }
    let mut scene = alone(mesh);
    scene.cameras.push(Camera::look_at("c", DVec3::ZERO, DVec3::X, DVec3::Y, 90.0));
    scene
}

#[test]
fn slits_beside_windows_leak() {
    for pitch in [0.0, 0.1, 0.2] {
        misses(&glazed(1.0, 0.0, pitch), Kind::Leak);
    }
    let found = finds(&glazed(1.0, 0.02, 0.0), Kind::Leak);
    assert!(found.severity == Severity::Warning && found.worst.value > 0.01, "{found:?}");
}

#[test]
fn surfaces_twice_in_one_place() {
    let mut scene = alone(sheet(2, 1.0));
    misses(&scene, Kind::CoplanarDuplicates);
    // Beside, and on the other side.
    let mut beside = sheet(2, 1.0);
    beside.positions.iter_mut().for_each(|p| p[0] += 1.0);
    place(&mut scene, beside);
    let mut back = sheet(2, 1.0);
    back.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    place(&mut scene, back);
    misses(&scene, Kind::CoplanarDuplicates);
    let mut moved = sheet(1, 1.0);
    moved.positions.iter_mut().for_each(|p| p[0] += 0.5);
    place(&mut scene, moved);
    let area: f64 = look(&scene, &CheckOptions::default())
        .iter()
        .filter(|f| f.kind == Kind::CoplanarDuplicates)
        .map(|f| f.area)
        .sum();
    // Half of the first, half of the second, all of the third.
    assert!((area - 2.0).abs() < 1e-6, "{area}");
    // All of one that is next to nothing in a hall.
    let mut hall = alone(cube(1, 20.0));
    (0..2).for_each(|_| place(&mut hall, sheet(1, 0.02)));
    assert_eq!(finds(&hall, Kind::CoplanarDuplicates).severity, Severity::Note);
}

#[test]
fn white_that_no_paint_has() {
    let mut scene = room();
    misses(&scene, Kind::BrightAlbedo);
    let white = Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(0.95)) };
    let used = scene.meshes[scene.instances[0].mesh].material;
    scene.materials[used].surface = white;
    assert!((finds(&scene, Kind::BrightAlbedo).worst.value - 0.95).abs() < 1e-6);
}

#[test]
fn lamps_of_hardly_any_area() {
    let mut scene = room();
    misses(&scene, Kind::TinyEmitter);
    scene.materials.push(Material { emission: Rgb::grey(1e9), ..Material::default() });
    let mut spark = sheet(1, 1e-3);
    spark.material = scene.materials.len() - 1;
    place(&mut scene, spark);
    assert!(matches!(finds(&scene, Kind::TinyEmitter).element, Element::Instance(_, name) if name == "sheet"));
}

#[test]
fn triangles_without_area() {
    let mut mesh = sheet(2, 1.0);
    misses(&alone(mesh.clone()), Kind::DegenerateTriangles);
    mesh.triangles.push([0, 1, 1]);
    mesh.triangles.push([0, 1, 2]);
    assert_eq!(finds(&alone(mesh), Kind::DegenerateTriangles).count, 2);
}

#[test]
fn second_coordinates_that_are_missing() {
    misses(&alone(sheet(2, 1.0)), Kind::Uv2Missing);
    let bare = Mesh { second_texcoords: None, ..sheet(2, 1.0) };
    // Where nobody has any, nobody meant to use them.
    assert_eq!(finds(&alone(bare.clone()), Kind::Uv2Missing).severity, Severity::Note);
    let mut scene = alone(sheet(2, 1.0));
    place(&mut scene, bare);
    let found = finds(&scene, Kind::Uv2Missing);
    assert_eq!((found.severity, found.element), (Severity::Warning, Element::Mesh(1, "sheet".into())));
}

#[test]
fn charts_on_top_of_each_other() {
    let mesh = sheet(4, 1.0);
    misses(&alone(mesh.clone()), Kind::Uv2Overlap);
    let mut stacked = mesh.clone();
    let (n, uvs) = (mesh.positions.len() as u32, mesh.second_texcoords.clone().unwrap());
    stacked.positions.extend(mesh.positions.iter().map(|[x, y, _]| [*x, *y, 1.0]));
    // Half a chart to the right: half of each is there twice.
    stacked.second_texcoords.as_mut().unwrap().extend(uvs.iter().map(|[u, v]| [u + 0.25, *v]));
    stacked.triangles.extend(mesh.triangles.iter().map(|t| t.map(|k| k + n)));
    let found = finds(&alone(stacked), Kind::Uv2Overlap);
    assert!((found.worst.value - 0.5).abs() < 1e-6, "{found:?}");
}

#[test]
fn coordinates_beyond_the_page_or_without_area() {
    let good = alone(sheet(4, 1.0));
    misses(&good, Kind::Uv2Outside);
    misses(&good, Kind::Uv2Degenerate);
    let mut mesh = sheet(4, 1.0);
    mesh.second_texcoords.as_mut().unwrap().iter_mut().for_each(|uv| uv[0] += 0.5);
    assert!((finds(&alone(mesh), Kind::Uv2Outside).worst.value - 0.25).abs() < 1e-6);
    let mut mesh = sheet(4, 1.0);
    mesh.second_texcoords.as_mut().unwrap().iter_mut().for_each(|uv| uv[0] = 0.5);
    assert_eq!(finds(&alone(mesh), Kind::Uv2Degenerate).count, 32);
}

#[test]
fn charts_without_room_between() {
    let pair = |texels: f32| {
        let mut mesh = sheet(2, 1.0);
        let (n, one) = (mesh.positions.len() as u32, mesh.clone());
        mesh.positions.extend(one.positions.iter().map(|[x, y, _]| [*x, *y, 1.0]));
        let uvs = one.second_texcoords.unwrap();
        mesh.second_texcoords = Some(
            uvs.iter()
                .map(|[u, v]| [0.5 * u, *v])
                .chain(uvs.iter().map(|[u, v]| [0.5 * u + 0.25 + texels / 1024.0, *v]))
                .collect(),
        );
        mesh.triangles.extend(one.triangles.iter().map(|t| t.map(|k| k + n)));
        alone(mesh)
    };
    misses(&pair(4.0), Kind::Uv2Padding);
    let found = finds(&pair(0.5), Kind::Uv2Padding);
    assert!((found.worst.value - 0.5).abs() < 1e-3 && found.severity == Severity::Warning, "{found:?}");
}

#[test]
fn texels_of_uneven_sizes() {
    misses(&alone(sheet(4, 1.0)), Kind::TexelDensity);
    let mut mesh = sheet(4, 1.0);
    // Squares of one size whose texels are fewer the farther up.
    mesh.second_texcoords.as_mut().unwrap().iter_mut().for_each(|uv| uv[1] = uv[1].powi(6));
    assert_eq!(finds(&alone(mesh), Kind::TexelDensity).worst.unit, "ratio");
    // A square metre on half a page of 1024 has 512 texels for a metre.
    let wish = |density| {
        let options = CheckOptions { density: Some(density), ..CheckOptions::default() };
        look(&alone(sheet(4, 1.0)), &options)
            .iter()
            .any(|f| f.severity == Severity::Warning && f.kind == Kind::TexelDensity)
    };
    assert!(!wish(500.0) && wish(1500.0));
}

#[test]
fn threads_do_not_change_findings() {
    let mut scene = room();
    scene.meshes[0].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| look(&scene, &CheckOptions::default()))
    };
    assert_eq!(on(1), on(5));
}
