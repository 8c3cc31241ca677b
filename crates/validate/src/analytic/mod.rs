//! Scenes whose light is known in closed form, or from energy conservation alone.

mod cube;
mod exchange;
mod furnace;
mod illuminance;
mod room;
mod sphere;

use crate::case::{Case, Effort};

pub(crate) use room::closed_room;

/// All of them.
pub fn cases(effort: Effort) -> Vec<Case> {
    vec![
        furnace::furnace(effort),
        sphere::integrating(effort),
        sphere::concentric(effort),
        sphere::two_rooms(effort),
        exchange::form_factors(effort),
        exchange::points(effort),
        illuminance::direct(effort),
        cube::cube(effort),
        room::room(effort),
    ]
}
