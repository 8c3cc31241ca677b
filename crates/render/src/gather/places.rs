//! What is known of places of the film: which lamps light them, from where light comes, and how noisy they are.
//!
//! A place is a square of pixels. Which lamps light it, and how much of them gets there, is learnt from the shadow rays
//! themselves, directions from gather rays, pass by pass; a pass looks at what earlier ones learnt, so that threads change nothing.

use std::ops::Range;

use glam::DVec3;

use super::guide::{self, CELLS, Guide};
use crate::direct::Shadows;
use crate::film::Crop;
use crate::lights::{Choice, Lights};

/// Pixels along a side of a place.
pub(super) const EDGE: usize = 16;
/// Shadow rays before a place trusts what it has learnt.
const LESSONS: u64 = 512;
/// The share of shadow rays that go by power and evenly all the same: what was overlooked is found.
const UNLEARNT: f64 = 0.2;

/// The places of a window of the film, row by row.
pub(super) struct Places {
    window: Crop,
    columns: usize,
    rows: usize,
    lamps: usize,
    /// Per place and lamp: Σ of the light that it gave; per place, the number of shadow rays.
    lessons: Lessons,
    choices: Vec<Option<Choice>>,
    guides: Vec<Option<Guide>>,
}

/// What shadow rays taught of some places.
#[derive(Clone, Debug, Default)]
pub(super) struct Lessons {
    given: Vec<f64>,
    rays: Vec<u64>,
    /// Per place and cell of directions: Σ of the square of the light that gather rays into it brought, over their
    /// density; per place, the number of gather rays.
    squares: Vec<f64>,
    gathered: Vec<u64>,
    /// Per place: Σ of what was reflected, and of what was expected.
    reflected: Vec<[f64; 2]>,
}

/// What a ray taught.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lesson {
    /// A shadow ray brought so much light of a lamp.
    Lamp(usize, f64),
    /// A camera ray's point reflected so much, where so much was expected; luminance.
    Reflected(f64, f64),
    /// A gather ray in this direction brought light whose square over its density is this.
    Direction(DVec3, f64),
}

impl Places {
    pub fn new(window: Crop, lights: &Lights) -> Self {
        let count = |pixels: u32| (pixels as usize).div_ceil(EDGE);
        let (columns, rows, lamps) = (count(window.width), count(window.height), lights.len());
        let lessons = Lessons::new(columns * rows, lamps);
        Self {
            window,
            columns,
            rows,
            lamps,
            lessons,
            choices: vec![None; columns * rows],
            guides: vec![None; columns * rows],
        }
    }

    /// Columns and rows of places.
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }

    /// The place of a pixel of the window.
    pub fn of(&self, x: usize, y: usize) -> usize {
        y / EDGE * self.columns + x / EDGE
    }

    /// Columns and rows of the window that belong to a place.
    pub fn pixels(&self, place: usize) -> [Range<usize>; 2] {
        let range = |k: usize, end: u32| k * EDGE..((k + 1) * EDGE).min(end as usize);
        [range(place % self.columns, self.window.width), range(place / self.columns, self.window.height)]
    }

    /// How shadow rays choose lamps there; `otherwise` where too little was learnt.
    pub fn shadows<'s>(&'s self, place: usize, otherwise: Shadows<'s>) -> Shadows<'s> {
        self.choices[place].as_ref().map_or(otherwise, |choice| Shadows { choice, candidates: 1 })
    }

    /// What was reflected over what was expected, at least 1.
    pub fn usual(&self, place: usize) -> f64 {
        let [brought, expected] = self.lessons.reflected[place];
        if expected > 0.0 { (brought / expected).max(1.0) } else { 1.0 }
    }

    /// Whence light comes to a place, if that is known.
    pub fn guide(&self, place: usize) -> Option<&Guide> {
        self.guides[place].as_ref()
    }

    /// Nothing learnt yet of the places in so many rows.
    pub fn lessons_of(&self, rows: Range<usize>) -> Lessons {
        Lessons::new(self.columns * rows.len(), self.lamps)
    }

    /// Adds what was learnt in places from the first of `row` on.
    pub fn learn(&mut self, row: usize, lessons: &Lessons) {
        let first = row * self.columns;
        let given = self.lessons.given[first * self.lamps..].iter_mut();
        given.zip(&lessons.given).for_each(|(sum, more)| *sum += more);
        self.lessons.rays[first..].iter_mut().zip(&lessons.rays).for_each(|(sum, more)| *sum += more);
        let squares = self.lessons.squares[first * CELLS..].iter_mut();
        squares.zip(&lessons.squares).for_each(|(sum, more)| *sum += more);
        for (sum, more) in self.lessons.reflected[first..].iter_mut().zip(&lessons.reflected) {
            (0..2).for_each(|k| sum[k] += more[k]);
        }
        self.lessons.gathered[first..].iter_mut().zip(&lessons.gathered).for_each(|(sum, more)| *sum += more);
    }

    /// Makes choices of what was learnt.
    pub fn conclude(&mut self, lights: &Lights) {
        for (place, guide) in self.guides.iter_mut().enumerate() {
            if self.lessons.gathered[place] >= LESSONS {
                *guide = Guide::learnt(&self.lessons.squares[place * CELLS..(place + 1) * CELLS]);
            }
        }
        let power = lights.by_power();
        for (place, choice) in self.choices.iter_mut().enumerate() {
            let given = &self.lessons.given[place * self.lamps..(place + 1) * self.lamps];
            let total: f64 = given.iter().sum();
            if self.lessons.rays[place] < LESSONS || !(total > 0.0 && total.is_finite()) {
                continue;
            }
            let weight = |(lamp, given): (usize, &f64)| {
                let unlearnt = 0.5 * (power.probability(lamp) + 1.0 / self.lamps as f64);
                UNLEARNT * unlearnt + (1.0 - UNLEARNT) * given / total
            };
            *choice = Choice::new(&given.iter().enumerate().map(weight).collect::<Vec<f64>>());
        }
    }
}

impl Lessons {
    fn new(places: usize, lamps: usize) -> Self {
        Self {
            given: vec![0.0; places * lamps],
            rays: vec![0; places],
            squares: vec![0.0; places * CELLS],
            gathered: vec![0; places],
            reflected: vec![[0.0; 2]; places],
        }
    }

    /// Adds what a ray of a place taught.
    pub fn add(&mut self, place: usize, lesson: Lesson) {
        match lesson {
            Lesson::Lamp(lamp, light) => {
                let lamps = self.given.len() / self.rays.len();
                self.given[place * lamps + lamp] += light;
                self.rays[place] += 1;
            }
            Lesson::Reflected(brought, expected) => {
                self.reflected[place][0] += brought;
                self.reflected[place][1] += expected;
            }
            Lesson::Direction(direction, square) => {
                self.squares[place * CELLS + guide::cell_of(direction)] += square;
                self.gathered[place] += 1;
            }
        }
    }
}
