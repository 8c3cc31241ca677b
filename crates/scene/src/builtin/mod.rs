//! Built-in scenes, drawn in code: rooms with known answers, the Cornell box, two rooms and a door, a hall.
//!
//! Not here: files (format) and checks of a scene (`validate`). `by_name` serves the command, the functions with
//! parameters serve tests. Every closed scene is one-sided and sealed: no light can meet a back face.

mod blocks;
mod cornell;
mod cube;
mod doorway;
mod furnace;
mod hall;
mod mesh;
mod plates;
#[cfg(test)]
mod tests;
mod uneven;

pub use cornell::cornell;
pub use cube::cube;
pub use doorway::doorway;
pub use furnace::furnace;
pub use hall::{hall, hall_with};
pub use plates::plates;
pub use uneven::uneven;

use crate::authored::Scene;

/// Names and one-line descriptions of the built-in scenes.
pub const NAMES: &[(&str, &str)] = &[
    ("furnace", "a room that glows evenly; radiosity is 2 everywhere"),
    ("plates", "two unit squares face to face, one of them glows; form factor 0.1998"),
    ("cube", "the unit cube, its floor glows, albedo 0.5"),
    ("cornell", "the Cornell box, open in front"),
    ("cornell-closed", "the Cornell box with a white front wall, seen from inside"),
    ("doorway", "a dark room, lit through a door by the lamp of the next one"),
    ("hall", "a hall with columns, a gallery, stairs and a polished stone floor"),
    ("hall-diffuse", "the hall with a matte floor"),
    ("uneven", "a room of few large and many tiny triangles, areas from square metres to square millimetres"),
    ("uneven-glowing", "the uneven room without a lamp: its walls glow"),
];

/// The built-in scene called `name`, one of `NAMES`.
pub fn by_name(name: &str) -> Option<Scene> {
    let scene = match name {
        "furnace" => furnace(0.5, 1.0),
        "plates" => plates(1.0),
        "cube" => cube(0.5),
        "cornell" => cornell(false),
        "cornell-closed" => cornell(true),
        "doorway" => doorway(),
        "hall" => hall(),
        "hall-diffuse" => hall_with(false),
        "uneven" => uneven(false),
        "uneven-glowing" => uneven(true),
        _ => return None,
    };
    Some(scene)
}
