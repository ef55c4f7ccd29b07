//! Whom the console talks to.

/// Who reads the answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Audience {
    /// A person at a terminal: echo, prompt, tables.
    People,
    /// A program: JSON lines.
    Programs,
}
