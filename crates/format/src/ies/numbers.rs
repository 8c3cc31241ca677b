//! Numbers of a text, one after another, with the lines on which they stand.

use crate::error::FormatError;

/// What is left of a text.
pub(super) struct Numbers<'a> {
    file: &'a str,
    rest: &'a str,
    /// Of the number that was read last.
    line: usize,
}

impl<'a> Numbers<'a> {
    /// The numbers of `text`, which begins after line `line` of the file.
    pub(super) fn new(file: &'a str, text: &'a str, line: usize) -> Self {
        Self { file, rest: text, line: line + 1 }
    }

    /// The next number, which is finite.
    pub(super) fn next(&mut self, what: &str) -> Result<f64, FormatError> {
        let is_gap = |c: char| c.is_whitespace() || c == ',';
        let start = self.rest.find(|c| !is_gap(c)).unwrap_or(self.rest.len());
        self.line += self.rest[..start].bytes().filter(|&b| b == b'\n').count();
        self.rest = &self.rest[start..];
        let end = self.rest.find(is_gap).unwrap_or(self.rest.len());
        let word = &self.rest[..end];
        self.rest = &self.rest[end..];
        if word.is_empty() {
            return Err(self.invalid("the end of the file", what));
        }
        let number = word.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| self.invalid(format!("{:?}", word.chars().take(40).collect::<String>()), what))
    }

    /// The next number, which is more than 0.
    pub(super) fn positive(&mut self, what: &str) -> Result<f64, FormatError> {
        let value = self.next(what)?;
        if value > 0.0 { Ok(value) } else { Err(self.invalid(value.to_string(), format!("{what}, more than 0"))) }
    }

    /// The next number, a whole one from 1 to `most`.
    pub(super) fn count(&mut self, what: &str, most: usize) -> Result<usize, FormatError> {
        let value = self.next(what)?;
        if value.fract() == 0.0 && value >= 1.0 && value <= most as f64 {
            return Ok(value as usize);
        }
        Err(self.invalid(value.to_string(), format!("{what}, a whole number from 1 to {most}")))
    }

    /// The next `count` numbers.
    pub(super) fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, FormatError> {
        // A number and its gap are two bytes at least: no count may ask for more memory than that.
        let mut list = Vec::with_capacity(count.min(self.most()));
        for k in 0..count {
            list.push(self.next(&format!("{what}: number {} of {count}", k + 1))?);
        }
        Ok(list)
    }

    /// More numbers than are left.
    pub(super) fn most(&self) -> usize {
        self.rest.len() / 2 + 1
    }

    /// Where the last number stands.
    pub(super) fn place(&self) -> String {
        format!("line {}", self.line)
    }

    pub(super) fn invalid(&self, found: impl Into<String>, expected: impl Into<String>) -> FormatError {
        FormatError::invalid(self.file, &self.place(), found, expected)
    }
}
