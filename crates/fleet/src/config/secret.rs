//! A password or token: from a file or the environment, never from the configuration itself, never in a log.

use std::{env, fmt, fs};

use serde::Deserialize;

/// Where a secret is.
#[derive(Clone, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Secret {
    /// The first line of this file.
    File(std::path::PathBuf),
    /// This variable of the environment.
    Env(String),
}

impl Secret {
    /// Reads it.
    ///
    /// # Errors
    /// It is not there, or empty. The message has the place, not the secret.
    pub fn read(&self) -> Result<String, String> {
        let text = match self {
            Secret::File(path) => {
                fs::read_to_string(path).map_err(|why| format!("{}: {why}", path.display()))?
            }
            Secret::Env(name) => {
                env::var(name).map_err(|why| format!("environment variable {name}: {why}"))?
            }
        };
        let line = text.lines().next().unwrap_or_default().trim();
        if line.is_empty() { Err(format!("{self:?} is empty")) } else { Ok(line.to_owned()) }
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Secret::File(path) => write!(f, "file {}", path.display()),
            Secret::Env(name) => write!(f, "environment variable {name}"),
        }
    }
}
