//! Triangles that cannot carry light: left out and counted, never a panic; needles stay.

use glam::{DAffine3, DVec3};
use twinray_scene::{PatchBudget, PatchError, PatchOptions, PatchScene, Scene};

use super::{cut, scene_of};

const GOOD: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn separate(triangles: &[[[f32; 3]; 3]]) -> Scene {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    scene_of(triangles.concat(), indices, DAffine3::IDENTITY)
}

#[test]
fn what_has_no_area_or_is_no_number_is_left_out_and_counted() {
    let mut triangles = vec![GOOD];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for place in 0..9 {
            let mut triangle = GOOD;
            triangle[place / 3][place % 3] = bad;
            triangles.push(triangle);
        }
    }
    triangles.push([GOOD[1]; 3]);
    triangles.push([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]]);
    let scene = cut(&separate(&triangles), 10);
    assert_eq!((scene.triangle_count(), scene.degenerate_triangles()), (1, triangles.len() - 1));
    assert!((scene.total_area() - 0.5).abs() < 1e-12, "{}", scene.total_area());
    assert!(scene.radius().is_finite() && scene.centre().is_finite());
    let hit = scene.trace(DVec3::new(0.2, 0.2, 1.0) - scene.centre(), DVec3::NEG_Z);
    assert!(hit.is_some_and(|hit| hit.triangle == 0));
}

#[test]
fn nothing_but_bad_triangles_is_an_error() {
    for triangle in [[[f32::NAN; 3]; 3], [[f32::INFINITY; 3]; 3], [GOOD[0]; 3]] {
        let options = PatchOptions { budget: PatchBudget::Count(10), two_sided: false };
        assert_eq!(PatchScene::new(&separate(&[triangle]), options).unwrap_err(), PatchError::Empty);
    }
}

/// What the ray kernel cannot hit must not be a patch: it would shine and never be seen.
#[test]
fn every_patch_can_be_hit() {
    // Beyond 1e18 the kernel leaves triangles out; a transform can get there from any file.
    let mut scene = separate(&[GOOD]);
    scene.instances[0].transform = DAffine3::from_scale(DVec3::splat(1e19));
    let options = PatchOptions { budget: PatchBudget::Count(10), two_sided: false };
    assert_eq!(PatchScene::new(&scene, options).unwrap_err(), PatchError::Empty);
    // A placing that flattens a mesh leaves nothing, one that shrinks it to 1e-12 m leaves it all.
    scene.instances[0].transform = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    assert_eq!(PatchScene::new(&scene, options).unwrap_err(), PatchError::Empty);
    scene.instances[0].transform = DAffine3::from_scale(DVec3::splat(1e-12));
    let small = PatchScene::new(&scene, options).unwrap();
    for patch in small.patches() {
        let centre = small.cell_centre(patch);
        let hit = small.trace(centre + DVec3::new(0.0, 0.0, 1e-12), DVec3::NEG_Z).expect("a hit");
        assert_eq!(small.patch_of(&hit), Some(patch));
    }
}

#[test]
fn exact_copies_do_not_disturb_each_other() {
    let scene = cut(&separate(&[GOOD; 5]), 100);
    assert_eq!(scene.triangle_count(), 5);
    // The first one is met, by whatever ray.
    let hit = scene.trace(DVec3::new(0.3, 0.3, 1.0) - scene.centre(), DVec3::NEG_Z).unwrap();
    assert_eq!(hit.triangle, 0);
    for patch in scene.patches() {
        let point = scene.cell_centre(patch);
        assert!(scene.trace_from(patch, point, DVec3::Z).is_none(), "rays from a copy meet no other copy");
    }
}

/// A needle of 1 : 1e6 is cut along its length, keeps its area, and rays find it.
#[test]
fn needles_stay() {
    let needle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 1e-6, 0.0]];
    let scene = cut(&separate(&[needle, GOOD.map(|[x, y, z]| [x, y, z - 1.0])]), 5000);
    assert_eq!(scene.triangle_count(), 2);
    let exact = 0.5 + 0.5 * f64::from(1e-6f32);
    assert!((scene.total_area() / exact - 1.0).abs() < 1e-6, "{}", scene.total_area());
    let mut found = 0;
    let patches: Vec<_> = scene.patches().filter(|&p| scene.triangle_of(p) == 0).collect();
    for &patch in &patches {
        let centre = scene.cell_centre(patch);
        let hit = scene.trace(centre + DVec3::Z * 0.5, DVec3::NEG_Z);
        found += usize::from(hit.is_some_and(|hit| hit.triangle == 0));
    }
    // The centre of a needle's cell is half its height, 5e-7, from an edge; coordinates round to 3e-8.
    assert!(found as f64 >= 0.9 * patches.len() as f64, "{found} of {}", patches.len());
}
