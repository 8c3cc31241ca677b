//! Tables of cells for other programs, read back with other people's readers.

use std::collections::BTreeMap;
use std::io::{self, Cursor, Read, Write};

use glam::{DAffine3, DVec3};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use twinray_format::{CellTable, Method, Provenance, write_csv, write_npz, write_ply, write_vtu};
use twinray_scene::authored::{Instance, Material, Mesh};
use twinray_scene::{PatchBudget, PatchOptions, PatchScene, Rgb, Scene, Surface, Texel, builtin};
use twinray_solve::{Params, Solution, Solver};
use vtkio::model::{Attribute, CellType, DataSet, Piece, VertexNumbers};

/// Cornell's box with a shining floor, two-sided, far away, beside a sliver whose cells have from three to six corners.
fn far_away() -> Scene {
    let mut scene = builtin::cornell(false);
    scene.materials.push(Material {
        name: "lacquer".into(),
        surface: Surface::Phong { diffuse: Texel::constant(Rgb::grey(0.3)), specular: Rgb::grey(0.4), exponent: 20.0 },
        two_sided: true,
        ..Material::default()
    });
    scene.meshes.push(Mesh {
        positions: vec![[-0.5, 0.3, 0.5], [0.9, 0.3, 0.5], [0.3, 0.66, 0.5]],
        triangles: vec![[0, 1, 2]],
        material: scene.materials.len() - 1,
        ..Mesh::default()
    });
    let mesh = scene.meshes.len() - 1;
    scene.instances.push(Instance { name: "sliver".into(), mesh, transform: DAffine3::IDENTITY });
    for instance in &mut scene.instances {
        instance.transform.translation += DVec3::new(1e6, -2e6, 3e5);
    }
    scene
}

fn cut(scene: &Scene, patches: usize) -> PatchScene {
    PatchScene::new(scene, PatchOptions { budget: PatchBudget::Count(patches), two_sided: false }).unwrap()
}

fn solve(scene: &PatchScene, rays: u64) -> Solution {
    let mut solver = Solver::new(scene, Params::default_preset(1), None).unwrap();
    solver.run(rays);
    solver.solution()
}

/// Texts that are awkward in every format: a comment's end, a line's end, letters beyond ASCII.
fn provenance() -> Provenance {
    Provenance {
        software: "twinray 0.1.0".into(),
        method: Method::Solve,
        scene: "Fürth --> \n<end_header>".into(),
        fingerprint: 0xfe,
        rays: 20_000,
        seed: 1,
        seeds: vec![1],
        settings: vec![("preset".into(), "default".into())],
        relative_error: 0.25,
        ..crate::twin::small().provenance
    }
}

/// Runs a test on the same small solution.
fn with_table(check: impl FnOnce(&CellTable, &Solution)) {
    let scene = cut(&far_away(), 700);
    let solution = solve(&scene, 20_000);
    check(&CellTable::new(&scene, &solution, &provenance()), &solution);
}

fn bytes(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Vec<u8> {
    let mut out = Vec::new();
    write(&mut out).unwrap();
    out
}

/// Columns as a reader found them, a number for each component of each cell; all kinds of number fit into f64 exactly.
type Columns = BTreeMap<String, Vec<Vec<f64>>>;

/// Every number is that of the solution and the scene, to the bit.
#[track_caller]
fn assert_is_the_table(found: &Columns, table: &CellTable, solution: &Solution) {
    let scene = table.scene;
    let names: Vec<&str> = found.keys().map(String::as_str).collect();
    let expected = ["area", "centre", "emits", "hits", "irradiance", "normal", "radiosity", "standard_error"];
    assert_eq!(names, expected);
    let floats = |v: &[f32]| v.iter().map(|x| f64::from(*x)).collect::<Vec<_>>();
    for p in scene.patches() {
        let row = |name: &str| found[name][p.index()].clone();
        assert_eq!(row("area"), [scene.area(p)]);
        assert_eq!(row("centre"), (scene.cell_centre(p) + scene.centre()).to_array());
        assert_eq!(row("emits"), [f64::from(u8::from(!scene.emission(p).is_black()))]);
        assert_eq!(row("hits"), [f64::from(solution.hits(p))]);
        assert_eq!(row("irradiance"), solution.irradiance(p).to_array());
        assert_eq!(row("normal"), floats(&scene.normal(p).as_vec3().to_array()));
        assert_eq!(row("radiosity"), floats(&table.radiosity[p.index()]));
        assert_eq!(row("standard_error"), [solution.standard_error(p)]);
    }
    assert!(found.values().all(|rows| rows.len() == scene.len()));
    // The same numbers summed in the same order.
    let power: Rgb = (0..scene.len())
        .map(|k| Rgb::from_array([0, 1, 2].map(|c| found["irradiance"][k][c])) * found["area"][k][0])
        .sum();
    let expected = solution.arriving_power(scene);
    assert_eq!(power, expected, "Σ A E");
}

/// The polygons are those of the cells: area, side, and the centre inside.
#[track_caller]
fn assert_are_the_cells(polygons: &[Vec<DVec3>], table: &CellTable) {
    let scene = table.scene;
    assert_eq!(polygons.len(), scene.len());
    for (p, polygon) in scene.patches().zip(polygons) {
        // World coordinates of 2e6 m have a rounding of 2.4e-10 m, a corner's part in the area is its side times that.
        let around: f64 = (0..polygon.len()).map(|i| polygon[i].distance(polygon[(i + 1) % polygon.len()])).sum();
        let tolerance = 5e-10 * around;
        let fan: Vec<DVec3> =
            polygon[1..].windows(2).map(|w| 0.5 * (w[0] - polygon[0]).cross(w[1] - polygon[0])).collect();
        let area: DVec3 = fan.iter().sum();
        assert!((area - scene.normal(p) * scene.cell_area(p)).length() < tolerance, "{p:?}: {area}");
        let centre = scene.cell_centre(p) + scene.centre();
        let holds = |w: &[DVec3]| {
            let [a, b, c] = [polygon[0], w[0], w[1]];
            [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (b - a).cross(centre - a).dot(scene.normal(p)) > -tolerance)
        };
        assert!(polygon[1..].windows(2).any(holds), "{p:?}: {centre} is outside {polygon:?}");
    }
    let corners: Vec<usize> = (3..=6).map(|n| polygons.iter().filter(|c| c.len() == n).count()).collect();
    assert!(corners.iter().all(|&n| n > 0), "the scene has cells of three, four, five and six corners: {corners:?}");
}

#[test]
fn npz_comes_back() {
    with_table(|table, solution| {
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes(|out| write_npz(table, out)))).unwrap();
        let mut columns = Columns::new();
        for k in 0..archive.len() {
            let mut entry = archive.by_index(k).unwrap();
            assert_eq!(entry.last_modified(), Some(zip::DateTime::default()), "no date");
            let name = entry.name().unwrap().strip_suffix(".npy").unwrap().to_owned();
            let mut file = Vec::new();
            entry.read_to_end(&mut file).unwrap();
            let (head, data) = npy(&file);
            if name == "provenance" {
                let longest =
                    "fe".len().max("metres, W/m2 (or lux where radiance is in nit); colours are linear Rec. 709".len());
                assert_eq!(head, format!("{{'descr': '<U{longest}', 'fortran_order': False, 'shape': (11, 2), }}"));
                let texts: Vec<String> = data.chunks(4 * longest).map(utf_32).collect();
                assert_eq!(texts[..4], ["software", "twinray 0.1.0", "scene", "Fürth --> \n<end_header>"]);
                assert_eq!(texts[18..20], ["preset", "default"]);
                continue;
            }
            let (kind, width) = match name.as_str() {
                "centre" => ("<f8", 3),
                "normal" | "irradiance" | "radiosity" => ("<f4", 3),
                "area" => ("<f8", 1),
                "standard_error" => ("<f4", 1),
                "emits" => ("|b1", 1),
                _ => ("<u4", 1),
            };
            let shape = if width == 3 { format!("({}, 3)", table.len()) } else { format!("({},)", table.len()) };
            assert_eq!(head, format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"));
            let numbers: Vec<f64> = match kind {
                "<f8" => data.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect(),
                "<f4" => data.chunks(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect(),
                "<u4" => data.chunks(4).map(|b| f64::from(u32::from_le_bytes(b.try_into().unwrap()))).collect(),
                _ => data.iter().map(|b| f64::from(*b)).collect(),
            };
            columns.insert(name, numbers.chunks(width).map(<[f64]>::to_vec).collect());
        }
        assert_is_the_table(&columns, table, solution);
    });
}

/// Head and numbers of a `.npy` file of version 1.0.
fn npy(file: &[u8]) -> (String, &[u8]) {
    assert_eq!(file[..8], *b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([file[8], file[9]]));
    assert_eq!(end % 64, 0);
    let head = std::str::from_utf8(&file[10..end]).unwrap();
    assert!(head.ends_with('\n'));
    (head.trim_end().to_owned(), &file[end..])
}

fn utf_32(bytes: &[u8]) -> String {
    let codes = bytes.chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap()));
    codes.take_while(|&c| c != 0).map(|c| char::from_u32(c).unwrap()).collect()
}

#[test]
fn csv_comes_back() {
    with_table(|table, solution| {
        let text = bytes(|out| write_csv(table, out));
        let mut reader = csv::Reader::from_reader(&text[..]);
        let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
        let header = "cell,centre_x,centre_y,centre_z,normal_x,normal_y,normal_z,area,emits,irradiance_r,irradiance_g,\
            irradiance_b,radiosity_r,radiosity_g,radiosity_b,standard_error,hits";
        assert_eq!(names.join(","), header);
        let mut columns = Columns::new();
        for (k, record) in reader.records().enumerate() {
            let record = record.unwrap();
            assert_eq!(record[0], k.to_string());
            for (name, field) in names.iter().zip(&record).skip(1) {
                // Single precision is written so that it comes back as such.
                let is_double = name.starts_with("centre") || name == "area";
                let value = if is_double { field.parse() } else { field.parse::<f32>().map(f64::from) };
                let rows = columns.entry(without_component(name)).or_default();
                if rows.len() <= k {
                    rows.push(Vec::new());
                }
                rows[k].push(value.unwrap());
            }
        }
        assert_is_the_table(&columns, table, solution);
    });
}

/// `irradiance_r` belongs to `irradiance`, `standard_error` to itself.
fn without_component(name: &str) -> String {
    let base = name.rsplit_once('_').filter(|(_, last)| last.len() == 1).map_or(name, |(base, _)| base);
    base.to_owned()
}

#[test]
fn ply_comes_back() {
    with_table(|table, solution| {
        let file = bytes(|out| write_ply(table, out));
        let ply = Parser::<DefaultElement>::new().read_ply(&mut Cursor::new(&file)).unwrap();
        assert_eq!(ply.header.comments[0], "software twinray 0.1.0");
        assert_eq!(ply.header.comments[1], "scene F?rth --> ?<end_header>");
        let (vertices, faces) = (&ply.payload["vertex"], &ply.payload["face"]);
        let (mut columns, mut polygons) = (Columns::new(), Vec::new());
        for (k, face) in faces.iter().enumerate() {
            let Property::ListInt(corners) = &face["vertex_indices"] else { panic!("indices of a face") };
            let corners: Vec<&DefaultElement> = corners.iter().map(|&i| &vertices[i as usize]).collect();
            for colour in ["red", "green", "blue"] {
                assert!(corners.iter().all(|c| c[colour] == face[colour]), "face and corners have one colour");
            }
            polygons.push(corners.iter().map(|c| DVec3::from_array(["x", "y", "z"].map(|i| number(&c[i])))).collect());
            let names = &ply.header.elements["face"].properties;
            for name in names.keys().filter(|n| !["vertex_indices", "red", "green", "blue"].contains(&n.as_str())) {
                let rows = columns.entry(without_component(name)).or_default();
                if rows.len() <= k {
                    rows.push(Vec::new());
                }
                rows[k].push(number(&face[name.as_str()]));
            }
        }
        assert_is_the_table(&columns, table, solution);
        assert_are_the_cells(&polygons, table);
        assert_eq!(vertices.len(), polygons.iter().map(Vec::len).sum::<usize>());

        // The lamp is white, the red wall is red.
        let colour = |k: usize| ["red", "green", "blue"].map(|c| number(&faces[k][c]));
        let lamp = table.light.emits.iter().position(|e| *e).unwrap();
        assert_eq!(colour(lamp), [255.0; 3]);
        let share = |k: &usize| table.radiosity[*k][0] / table.radiosity[*k].iter().sum::<f32>();
        let red = (0..table.len()).filter(|k| table.light.hits[*k] > 20).max_by(|a, b| share(a).total_cmp(&share(b)));
        let [r, g, b] = colour(red.unwrap());
        assert!(r > 1.3 * g && r > 1.3 * b, "{r} {g} {b}");
    });
}

fn number(property: &Property) -> f64 {
    match property {
        Property::UChar(x) => f64::from(*x),
        Property::UInt(x) => f64::from(*x),
        Property::Float(x) => f64::from(*x),
        Property::Double(x) => *x,
        other => panic!("{other:?} is of no kind that is written"),
    }
}

#[test]
fn vtu_comes_back() {
    with_table(|table, solution| {
        let file = bytes(|out| write_vtu(table, out));
        let text = std::str::from_utf8(&file).unwrap();
        assert!(text.contains("<!-- software: twinray 0.1.0 -->\n<!-- scene: F?rth - -> ?<end_header> -->\n"));
        let DataSet::UnstructuredGrid { pieces, .. } = vtkio::Vtk::parse_xml(&file[..]).unwrap().data else {
            panic!("an unstructured grid");
        };
        let [Piece::Inline(piece)] = &pieces[..] else { panic!("one piece") };
        let points: Vec<f64> = piece.points.cast_into().unwrap();
        let points: Vec<DVec3> = points.chunks(3).map(DVec3::from_slice).collect();
        let VertexNumbers::XML { connectivity, offsets } = &piece.cells.cell_verts else { panic!("offsets") };
        let starts = std::iter::once(&0).chain(offsets);
        let polygons: Vec<Vec<DVec3>> = starts
            .zip(offsets)
            .map(|(a, b)| connectivity[*a as usize..*b as usize].iter().map(|&i| points[i as usize]).collect())
            .collect();
        assert_are_the_cells(&polygons, table);
        for (kind, polygon) in piece.cells.types.iter().zip(&polygons) {
            let expected = [CellType::Triangle, CellType::Quad, CellType::Polygon, CellType::Polygon];
            assert_eq!(*kind, expected[polygon.len() - 3]);
        }
        let mut columns = Columns::new();
        for attribute in &piece.data.cell {
            let Attribute::DataArray(array) = attribute else { panic!("{attribute:?}") };
            let values: Vec<f64> = array.data.cast_into().unwrap();
            let rows = values.chunks(values.len() / table.len()).map(<[f64]>::to_vec).collect();
            columns.insert(array.name.clone(), rows);
        }
        assert_is_the_table(&columns, table, solution);
    });
}

/// Of a path tracer only the light of the patches is known.
#[test]
fn light_alone_makes_a_table() {
    with_table(|table, solution| {
        let alone = CellTable::of_light(table.scene, solution.patch_light(table.scene), &provenance());
        let scene = table.scene;
        for p in scene.patches() {
            let found = alone.radiosity[p.index()];
            let reflected = solution.irradiance(p) * scene.brdf(p).mean_albedo() / std::f64::consts::PI;
            assert_eq!(found, ((scene.emission(p) + reflected) * std::f64::consts::PI).to_f32());
            assert!(scene.is_glossy(p) || found == table.radiosity[p.index()]);
        }
        assert_eq!((alone.light, alone.provenance), (table.light.clone(), table.provenance.clone()));
    });
}

/// What leaves a patch is what it emits and what it reflects of what arrives; all of it is 2 in the furnace.
#[test]
fn radiosity_is_emission_and_reflection() {
    with_table(|table, solution| {
        let scene = table.scene;
        for p in scene.patches().filter(|&p| !scene.is_glossy(p)) {
            let expected =
                scene.emission(p) * std::f64::consts::PI + solution.irradiance(p) * scene.brdf(p).mean_albedo();
            let found = Rgb::from_f32(table.radiosity[p.index()]);
            // One rounding to f32.
            let off = (found - expected).map(f64::abs).max_channel();
            assert!(off <= 6e-8 * expected.max_channel(), "{p:?}: {found:?}, {expected:?}");
        }
        assert!(scene.patches().any(|p| scene.is_glossy(p)));
    });
    let scene = cut(&builtin::by_name("furnace").unwrap(), 300);
    let solution = solve(&scene, 100_000);
    let table = CellTable::new(&scene, &solution, &provenance());
    let area: f64 = scene.total_area();
    let power: f64 = scene.patches().map(|p| scene.area(p) * f64::from(table.radiosity[p.index()][1])).sum();
    // Every ray carries the whole power of a grey furnace, so the mean has no noise to speak of; what is left is the bias
    // of low-discrepancy numbers, 2e-5 / (1 − ρ) with ρ = 0.5 (docs/paper.md).
    println!("furnace: radiosity {}", power / area);
    assert!((power / area / 2.0 - 1.0).abs() < 4e-5, "{}", power / area);
}

#[test]
fn equal_tables_give_equal_bytes() {
    let files = || {
        let mut files = Vec::new();
        with_table(|table, _| {
            files = vec![
                bytes(|out| write_npz(table, out)),
                bytes(|out| write_csv(table, out)),
                bytes(|out| write_ply(table, out)),
                bytes(|out| write_vtu(table, out)),
            ];
        });
        files
    };
    assert!(files() == files());
}

/// A place that has no room left.
struct Full {
    written: usize,
    room: usize,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.written += bytes.len();
        if self.written > self.room { Err(io::ErrorKind::StorageFull.into()) } else { Ok(bytes.len()) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error() {
    with_table(|table, _| {
        type Writer = fn(&CellTable, &mut Full) -> io::Result<()>;
        let writers: [Writer; 4] = [
            |table, out| write_npz(table, out),
            |table, out| write_csv(table, out),
            |table, out| write_ply(table, out),
            |table, out| write_vtu(table, out),
        ];
        for (k, write) in writers.iter().enumerate() {
            let mut all = Full { written: 0, room: usize::MAX };
            write(table, &mut all).unwrap();
            for room in [0, 100, all.written / 2, all.written - 1, all.written] {
                let outcome = write(table, &mut Full { written: 0, room });
                assert_eq!(outcome.is_ok(), room == all.written, "writer {k}, room {room} of {}", all.written);
            }
        }
    });
}
