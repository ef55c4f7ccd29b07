//! The name of a gateway: a level of a topic, a tag, a label.

use std::fmt;

use serde::{Deserialize, Serialize};

/// 1 to 64 letters, digits, `-`, `_` and `.`: what MQTT, Sparkplug, InfluxDB and Home Assistant all take as they are.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(try_from = "String")]
pub struct Name(String);

const LONGEST: usize = 64;

impl TryFrom<String> for Name {
    type Error = String;

    fn try_from(text: String) -> Result<Name, String> {
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_.".contains(letter);
        if text.is_empty() || text.len() > LONGEST || !text.chars().all(is_plain) {
            return Err(format!("name {text:?}, expected 1 to {LONGEST} letters, digits, `-`, `_`, `.`"));
        }
        Ok(Name(text))
    }
}

impl Name {
    /// As text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
