//! What the image may take, from `budgets.toml`. Of its tables, the one about the stack is read here.

use serde::Deserialize;

use crate::Error;

/// The table of budgets.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Budgets {
    /// Worst-case stack, all levels together.
    pub stack: Budget,
}

/// One budget, in bytes.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// More than this fails the check.
    pub most: u32,
    /// What the image is to take in the end.
    pub goal: u32,
}

impl Budgets {
    /// Reads the table.
    ///
    /// # Errors
    /// The text is not such a table.
    pub fn parse(text: &str) -> Result<Budgets, Error> {
        toml::from_str(text).map_err(|error| Error::new(error.to_string()))
    }
}
