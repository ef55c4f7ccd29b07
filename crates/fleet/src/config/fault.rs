//! What is wrong with a file, and where.

use std::ops::Range;

use toml::Spanned;

/// A fault. Its text has the place, its key and what was expected; of the file itself nothing else, as that may be a secret.
pub struct Fault {
    place: Option<Range<usize>>,
    why: String,
}

impl Fault {
    /// Of the file as a whole.
    pub fn new(why: impl Into<String>) -> Fault {
        Fault { place: None, why: why.into() }
    }

    /// Of this value.
    pub fn at<T>(value: &Spanned<T>, why: impl Into<String>) -> Fault {
        Fault { place: Some(value.span()), why: why.into() }
    }

    /// For people who have this text before them.
    pub fn told(&self, text: &str) -> String {
        let Some(before) = self.place.as_ref().and_then(|place| text.get(..place.start)) else {
            return self.why.clone();
        };
        let number = before.matches('\n').count() + 1;
        let line = text.lines().nth(number - 1).unwrap_or_default();
        let key = line.split_once('=').map_or(line, |(key, _)| key).trim();
        if key.is_empty() || self.why.contains(&format!("`{key}`")) {
            format!("line {number}: {}", self.why)
        } else {
            format!("line {number}, `{key}`: {}", self.why)
        }
    }
}

impl From<toml::de::Error> for Fault {
    fn from(error: toml::de::Error) -> Fault {
        Fault { place: error.span(), why: error.message().trim().replace('\n', ", ") }
    }
}
