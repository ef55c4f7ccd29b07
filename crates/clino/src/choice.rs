//! Arguments that are one of a few names.

use std::fmt::Display;

/// The one of `all` that `text` names. Case does not matter, nor `-` for `_`.
///
/// # Errors
/// The names there are.
pub fn choose<T: Copy, N: Display>(
    text: &str,
    all: impl IntoIterator<Item = T>,
    name: impl Fn(T) -> N,
) -> Result<T, String> {
    let wanted = comparable(text);
    let mut names = Vec::new();
    for candidate in all {
        let name = name(candidate).to_string();
        if comparable(&name) == wanted {
            return Ok(candidate);
        }
        names.push(name);
    }
    names.dedup();
    Err(format!("not one of {}", names.join(", ")))
}

fn comparable(name: &str) -> String {
    name.to_ascii_lowercase().replace('-', "_")
}
