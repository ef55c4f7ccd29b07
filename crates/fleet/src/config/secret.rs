//! A password or token: from a file or the environment, never from the configuration itself, never in a log.

use std::{env, fmt, fs};

use serde::Deserialize;

/// Where a secret is.
#[derive(Clone, Deserialize)]
#[serde(try_from = "toml::Value")]
pub enum Secret {
    /// The first line of this file.
    File(std::path::PathBuf),
    /// This variable of the environment.
    Env(String),
}

impl TryFrom<toml::Value> for Secret {
    type Error = String;

    /// Not derived: an error would show what was written, which may be the secret itself.
    fn try_from(value: toml::Value) -> Result<Secret, String> {
        let place = value.as_table().filter(|table| table.len() == 1).and_then(|table| {
            let text = |key: &str| table.get(key)?.as_str().map(str::to_owned);
            text("file").map(|path| Secret::File(path.into())).or_else(|| text("env").map(Secret::Env))
        });
        place.ok_or_else(|| "expected { file = \"…\" } or { env = \"…\" }, not the secret itself".to_owned())
    }
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
