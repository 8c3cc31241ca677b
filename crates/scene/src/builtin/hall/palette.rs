//! The hall's materials. Called by `hall` once; its parts take indices from here.

use crate::authored::{Material, Surface, Texel};
use crate::builtin::mesh::Builder;
use crate::rgb::Rgb;

/// Indices of the materials.
pub(super) struct Palette {
    pub(super) floor: usize,
    pub(super) inlay: usize,
    pub(super) plaster: usize,
    pub(super) skirting: usize,
    pub(super) ceiling: usize,
    pub(super) terracotta: usize,
    pub(super) column: usize,
    pub(super) stair: usize,
    pub(super) parapet: usize,
    pub(super) oak: usize,
    pub(super) boards: usize,
    pub(super) metal: usize,
    pub(super) cushion: usize,
    pub(super) pot: usize,
    pub(super) soil: usize,
    pub(super) bark: usize,
    pub(super) leaves: usize,
    pub(super) window: usize,
    pub(super) panel: usize,
    pub(super) downlight: usize,
    pub(super) sconce: usize,
}

impl Palette {
    pub(super) fn new(builder: &mut Builder, glossy: bool) -> Self {
        let warm = |nit: f64| nit_of(Rgb::new(1.0, 0.82, 0.58), nit);
        let neutral = |nit: f64| nit_of(Rgb::new(0.96, 1.0, 1.0), nit);
        Self {
            floor: stone_floor(builder, "floor", Rgb::new(0.44, 0.42, 0.38), glossy),
            inlay: stone_floor(builder, "floor inlay", Rgb::new(0.20, 0.19, 0.18), glossy),
            plaster: builder.matte("plaster", Rgb::new(0.75, 0.73, 0.68)),
            skirting: builder.matte("skirting", Rgb::new(0.30, 0.28, 0.26)),
            ceiling: builder.matte("ceiling", Rgb::new(0.80, 0.79, 0.77)),
            terracotta: builder.matte("terracotta", Rgb::new(0.60, 0.28, 0.17)),
            column: builder.matte("column stone", Rgb::new(0.70, 0.66, 0.58)),
            stair: builder.matte("stair stone", Rgb::new(0.58, 0.56, 0.52)),
            parapet: builder.matte("parapet", Rgb::new(0.34, 0.42, 0.50)),
            oak: builder.matte("oak", Rgb::new(0.44, 0.27, 0.14)),
            boards: builder.matte("gallery floor", Rgb::new(0.50, 0.36, 0.22)),
            metal: builder.matte("dark metal", Rgb::new(0.16, 0.16, 0.17)),
            cushion: builder.matte("cushion", Rgb::new(0.22, 0.31, 0.40)),
            pot: builder.matte("pot", Rgb::new(0.55, 0.52, 0.49)),
            soil: builder.matte("soil", Rgb::new(0.09, 0.06, 0.04)),
            bark: builder.matte("bark", Rgb::new(0.20, 0.13, 0.08)),
            leaves: builder.matte("leaves", Rgb::new(0.12, 0.28, 0.08)),
            window: builder.lamp("window panel", Rgb::grey(0.6), neutral(900.0)),
            panel: builder.lamp("ceiling panel", Rgb::grey(0.6), warm(1500.0)),
            downlight: builder.lamp("downlight", Rgb::grey(0.6), warm(1200.0)),
            sconce: builder.lamp("sconce", Rgb::grey(0.6), warm(1000.0)),
        }
    }
}

/// A radiance of `nit` in the given colour.
fn nit_of(colour: Rgb, nit: f64) -> Rgb {
    colour * (nit / colour.luminance())
}

fn stone_floor(builder: &mut Builder, name: &str, colour: Rgb, glossy: bool) -> usize {
    if !glossy {
        return builder.matte(name, colour);
    }
    builder.material(Material {
        name: name.to_owned(),
        surface: Surface::MetallicRoughness {
            base_color: Texel::constant(colour),
            metallic: 0.0,
            roughness: 0.38,
            metallic_roughness_texture: None,
            specular_texture: None,
            specular_color_texture: None,
            specular: 1.0,
            specular_color: Rgb::WHITE,
            ior: 1.5,
        },
        ..Material::default()
    })
}
