//! Cases 5.6 to 5.8: light reflected by a diffuse surface, past an obstruction, and in a closed room.
//!
//! The lamp stands below the floor's plane and in the plane of the first sensors, so that no sensor sees it: all that
//! arrives has been reflected once by the lit wall, and there is nothing else that reflects.

use glam::DVec3;
use twinray::solve::{Params, Shares};

use crate::analytic::closed_room;
use crate::case::{Case, Effort, Row};
use crate::factors::{point_to_polygon, through};
use crate::rig::{Rectangle, Rig, sensor_params, sequence_bias, unreflected_share};

const REFLECTANCE: f64 = 0.5;
/// Exitance of the lamp, lm/m².
const LAMP: f64 = 1e5;

fn lamp() -> Rectangle {
    Rectangle::new([0.0, -2.0, 1.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
}

fn lit_wall() -> Rectangle {
    Rectangle::new([4.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 3.0, 0.0])
}

fn tiles() -> [(&'static str, Rectangle); 5] {
    let parallel = |y: f64, z: f64| Rectangle::new([0.0, y, z], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let floor = |x: f64, z: f64| Rectangle::new([x, 0.0, z], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    [
        ("parallel, middle", parallel(1.0, 1.5)),
        ("parallel, upper corner", parallel(2.0, 0.0)),
        ("parallel, lower edge", parallel(0.0, 1.5)),
        ("perpendicular, near", floor(3.0, -1.5)),
        ("perpendicular, far", floor(1.0, 4.5)),
    ]
}

/// Illuminance of the lit wall's cells, n × m of them, exactly averaged.
fn lit_cells(cuts: [usize; 2]) -> Vec<(Vec<DVec3>, f64)> {
    let source = lamp().polygon();
    let cell = |c: Rectangle| (c.polygon(), LAMP * c.mean(3, |p, n| point_to_polygon(p, n, &source)));
    lit_wall().cut(cuts).into_iter().map(cell).collect()
}

/// Mean illuminance of a tile by reflection: ρ Σ E_k F(point → visible part of cell k).
fn reflected(tile: &Rectangle, cells: &[(Vec<DVec3>, f64)], obstacle: Option<&[DVec3]>) -> f64 {
    // A shadow's border has a kink in it: more points than the smooth case needs.
    tile.mean(if obstacle.is_some() { 12 } else { 5 }, |p, n| {
        let factor = |polygon: &[DVec3]| {
            let whole = point_to_polygon(p, n, polygon);
            whole - obstacle.map_or(0.0, |o| point_to_polygon(p, n, &through(p, polygon, o)))
        };
        REFLECTANCE * cells.iter().map(|(polygon, illuminance)| illuminance * factor(polygon)).sum::<f64>()
    })
}

fn rows(effort: Effort, obstacle: Option<Rectangle>) -> Vec<Row> {
    let mut rig = Rig::default();
    let (source, wall) = (rig.group(), rig.group());
    let (glowing, grey, black) = (rig.material(0.0, LAMP), rig.material(REFLECTANCE, 0.0), rig.material(0.0, 0.0));
    rig.rectangle(source, glowing, &lamp(), [1, 1]);
    rig.rectangle(wall, grey, &lit_wall(), [16, 12]);
    if let Some(obstacle) = obstacle {
        // Back to back, so that both sides are black surfaces.
        let group = rig.group();
        rig.rectangle(group, black, &obstacle, [1, 1]);
        rig.rectangle(group, black, &obstacle.flipped(), [1, 1]);
    }
    let groups = tiles().map(|(_, tile)| {
        let group = rig.group();
        rig.rectangle(group, black, &tile, [8, 8]);
        group
    });
    let rays = effort.rays(1 << 22);
    let measured = rig.measure(&Params { shares: Some(Shares::even(0.6, 0.05)), ..sensor_params(1100) }, rays);
    // The solver's wall has one illuminance per patch: the difference from a wall of a quarter of the cell size is more
    // than what it misses.
    let (as_cut, smooth) = (lit_cells([16, 12]), lit_cells([32, 24]));
    let shadow = obstacle.map(|o| o.polygon());
    let row = |((name, tile), group): ((&'static str, Rectangle), _)| {
        let expected = reflected(&tile, &smooth, shadow.as_deref());
        let cells = (reflected(&tile, &as_cut, shadow.as_deref()) - expected).abs();
        let model = 1.5 * cells + unreflected_share(rig.len(), rays) * expected;
        Row::statistical(name, expected, &measured[group], model, effort.resolution(2.5e-2))
    };
    tiles().into_iter().zip(groups).map(row).collect()
}

const SCENE: &str = "A lamp of 1 × 1 m and 10⁵ lm/m² lights a wall of 4 × 3 m and reflectance 0.5 (384 patches) at 4 m; nothing else \
    reflects. Black tiles of 1 × 1 m stand parallel to it and perpendicular to it where the lamp is behind their plane, so that all \
    their light has been reflected once. Expected: ρ Σ E F over the wall's cells, E and F by contour integrals. Allowed beside \
    noise: what cells of a quarter of the size change, and the first wave, which knows no reflected light. 2²² rays, sensor \
    settings with a gather share of 0.6.";

/// Case 5.6.
pub fn diffuse(effort: Effort) -> Case {
    Case {
        title: "Case 5.6, light reflected by a diffuse surface",
        story: SCENE.to_owned(),
        quantity: "illuminance, lx",
        rows: rows(effort, None),
    }
}

/// Case 5.7.
pub fn obstructed(effort: Effort) -> Case {
    let screen = Rectangle::new([2.0, 1.2, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]);
    Case {
        title: "Case 5.7, reflection with an internal obstruction",
        story: "As 5.6, with a black screen of 2 × 1 m half way between wall and tiles (outside the lamp's light). Expected as \
                before, with the part of each cell that the screen hides clipped away."
            .to_owned(),
        quantity: "illuminance, lx",
        rows: rows(effort, Some(screen)),
    }
}

/// Case 5.8.
pub fn internal(effort: Effort) -> Case {
    let flux = 10_000.0;
    let mut rows = Vec::new();
    for albedo in effort.thin(&[0.1, 0.3, 0.5, 0.7, 0.9, 0.95]) {
        let mut rig = Rig::default();
        let (wall, lamp) = (rig.material(albedo, 0.0), rig.material(albedo, flux));
        let groups = closed_room(&mut rig, [6.0, 3.0, 4.5], wall, lamp);
        let areas = rig.areas();
        let surface: f64 = groups.iter().map(|&g| areas[g]).sum();
        let measured = rig.measure(&Params::default_preset(1200), effort.rays(1 << 18));
        let reflected: Vec<f64> = measured.mean_of(&groups, &areas).iter().map(|e| e - flux / surface).collect();
        let rho = f64::from(albedo as f32);
        let expected = flux / surface * rho / (1.0 - rho);
        let rounding = 1e-6 * flux / surface + sequence_bias(albedo) * expected;
        let resolution = effort.resolution(if albedo > 0.85 { 8e-3 } else { 2e-3 });
        rows.push(Row::statistical(format!("ρ = {albedo}"), expected, &reflected, rounding, resolution));
    }
    Case {
        title: "Case 5.8, internal reflected component",
        story: format!(
            "A closed room of 6 × 4.5 × 3 m of one reflectance ρ and a ceiling lamp of 1 m², 10 000 lm: mean reflected illuminance \
             Φρ/(S(1−ρ)), S = {} m². 792 patches, 2¹⁸ rays, default preset.",
            2.0 * (6.0 * 4.5 + 6.0 * 3.0 + 4.5 * 3.0)
        ),
        quantity: "illuminance, lx",
        rows,
    }
}
