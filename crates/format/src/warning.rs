//! What a reader changed, ignored or guessed, in words for the author of the file.
//!
//! Lives here: the warning and the list that collects them without growing past a bound, whatever the file does.
//! Not here: faults that end the reading (`error`).

use std::collections::HashSet;
use std::fmt;

/// Something the reader changed, ignored or guessed. The scene beside it is usable.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Warning {
    /// Name of the file concerned.
    pub file: String,
    /// Path of the element inside the file, or its line.
    pub element: String,
    /// What was done and why.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}", self.file, self.element, self.message)
    }
}

/// More than anybody reads; a hostile file must not fill memory with complaints.
const MAX_WARNINGS: usize = 200;

/// Warnings in order of appearance, equal ones once.
#[derive(Default)]
pub(crate) struct Warnings {
    list: Vec<Warning>,
    /// Those of the list, since a file may have as many causes for the same one as it has lines.
    seen: HashSet<Warning>,
    left_out: usize,
}

impl Warnings {
    pub(crate) fn push(&mut self, file: &str, element: impl Into<String>, message: impl Into<String>) {
        if self.list.len() >= MAX_WARNINGS {
            self.left_out += 1;
            return;
        }
        let warning = Warning { file: file.to_owned(), element: element.into(), message: message.into() };
        if self.seen.insert(warning.clone()) {
            self.list.push(warning);
        }
    }

    /// A warning that sums up many cases: room is kept for it, however many others there were.
    pub(crate) fn push_summary(&mut self, file: &str, element: impl Into<String>, message: impl Into<String>) {
        let warning = Warning { file: file.to_owned(), element: element.into(), message: message.into() };
        self.list.push(warning);
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Warning> {
        self.list.iter()
    }

    pub(crate) fn finish(mut self, file: &str) -> Vec<Warning> {
        if self.left_out > 0 {
            let message = format!("{} more warnings are left out", self.left_out);
            self.list.push(Warning { file: file.to_owned(), element: "warnings".to_owned(), message });
        }
        self.list
    }
}

/// `names` for a message: quoted, at most eight of them, then a count.
pub(crate) fn name_list<S: AsRef<str>>(names: &[S]) -> String {
    const SHOWN: usize = 8;
    let mut text = names.iter().take(SHOWN).map(|n| format!("\"{}\"", n.as_ref())).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}
