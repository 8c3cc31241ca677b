//! What every reader carries along: the file's name, limits, account, warnings and the way to other files.
//!
//! Not here: anything about one format. Made by `read_scene`, used by `gltf` and `obj`.

use std::collections::HashMap;
use std::rc::Rc;

use crate::error::FormatError;
use crate::limits::{Budget, Limits};
use crate::read::Resolver;
use crate::reference::safe_path;
use crate::warning::Warnings;

/// State of one call of `read_scene`.
pub(crate) struct Context<'a> {
    pub(crate) file: &'a str,
    pub(crate) limits: &'a Limits,
    pub(crate) budget: Budget,
    pub(crate) warnings: Warnings,
    resolver: &'a mut Resolver<'a>,
    fetched: HashMap<String, Rc<[u8]>>,
}

impl<'a> Context<'a> {
    pub(crate) fn new(file: &'a str, limits: &'a Limits, resolver: &'a mut Resolver<'a>) -> Self {
        let (budget, warnings) = (Budget::new(limits), Warnings::default());
        Self { file, limits, budget, warnings, resolver, fetched: HashMap::new() }
    }

    /// Notes something about the main file.
    pub(crate) fn warn(&mut self, element: impl Into<String>, message: impl Into<String>) {
        self.warnings.push(self.file, element, message);
    }

    /// Notes something that sums up the main file; called a fixed number of times per reading.
    pub(crate) fn sum_up(&mut self, element: impl Into<String>, message: impl Into<String>) {
        self.warnings.push_summary(self.file, element, message);
    }

    /// Asks for memory on behalf of `element` of the main file.
    pub(crate) fn charge(&mut self, bytes: u64, element: &str) -> Result<(), FormatError> {
        self.budget.charge(bytes, self.file, element)
    }

    /// The bytes of a referenced file, `reference` being percent-decoded. Fetched once, however often asked:
    /// a thousand buffers may name one file.
    pub(crate) fn fetch(&mut self, element: &str, reference: &str) -> Result<Rc<[u8]>, FormatError> {
        let fail = |reason: String, hint: &str| FormatError::Reference {
            file: self.file.to_owned(),
            element: element.to_owned(),
            reference: reference.chars().take(200).collect(),
            reason,
            hint: hint.to_owned(),
        };
        let path = safe_path(reference, self.limits.allow_outside).map_err(|reason| {
            fail(reason.to_owned(), "Put the file into the scene's folder and refer to it by a relative path")
        })?;
        if let Some(bytes) = self.fetched.get(&path) {
            return Ok(bytes.clone());
        }
        let bytes = (self.resolver)(&path).map_err(|error| {
            fail(format!("cannot be read ({error})"), "Put it beside the scene, under exactly this name")
        })?;
        self.check_size(bytes.len(), &path)?;
        self.budget.add_input(bytes.len());
        self.charge(0, element)?;
        let bytes: Rc<[u8]> = bytes.into();
        self.fetched.insert(path, bytes.clone());
        Ok(bytes)
    }

    /// Refuses a file that is larger than the limits allow.
    pub(crate) fn check_size(&self, bytes: usize, file: &str) -> Result<(), FormatError> {
        if bytes as u64 <= self.limits.max_file_bytes {
            return Ok(());
        }
        Err(FormatError::OverLimit {
            file: file.to_owned(),
            element: "file".to_owned(),
            limit: "max_file_bytes",
            needed: format!("{bytes} bytes"),
            allowed: self.limits.max_file_bytes,
        })
    }
}
