//! The object that stands for a bad frame: `{"error":{"kind":…,"message":…,…}}`.
//!
//! `kind` is for programs and does not change; `message` is for people. The rest are the offending values.

use serde::ser::{Serialize, SerializeMap as _, Serializer};

/// What is wrong with a frame.
#[derive(Debug)]
pub struct Bad {
    kind: &'static str,
    message: String,
    values: Vec<(&'static str, Value)>,
}

/// An offending value.
#[derive(Debug)]
pub enum Value {
    Number(i64),
    Text(String),
}

impl Bad {
    pub fn new(kind: &'static str, message: impl ToString) -> Self {
        Self { kind, message: message.to_string(), values: Vec::new() }
    }

    /// Its kind, for programs.
    pub fn kind(&self) -> &'static str {
        self.kind
    }

    /// What is wrong, for people.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Adds an offending value.
    pub fn with(mut self, name: &'static str, value: impl Into<Value>) -> Self {
        self.values.push((name, value.into()));
        self
    }
}

impl Serialize for Bad {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("error", &Inner(self))?;
        object.end()
    }
}

struct Inner<'a>(&'a Bad);

impl Serialize for Inner<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Bad { kind, message, values } = self.0;
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("kind", kind)?;
        object.serialize_entry("message", message)?;
        for (name, value) in values {
            match value {
                Value::Number(number) => object.serialize_entry(name, number)?,
                Value::Text(text) => object.serialize_entry(name, text)?,
            }
        }
        object.end()
    }
}

impl From<u8> for Value {
    fn from(number: u8) -> Self {
        Self::Number(number.into())
    }
}

impl From<i32> for Value {
    fn from(number: i32) -> Self {
        Self::Number(number.into())
    }
}

impl From<u32> for Value {
    fn from(number: u32) -> Self {
        Self::Number(number.into())
    }
}

/// Counts of bytes and positions in a line: far below the limit.
impl From<usize> for Value {
    fn from(number: usize) -> Self {
        Self::Number(i64::try_from(number).unwrap_or(i64::MAX))
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}
