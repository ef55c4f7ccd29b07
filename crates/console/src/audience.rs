//! Audience of the console: a person or a program.

/// The reader of the answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Audience {
    /// A person at a terminal: echo, prompt, tables.
    People,
    /// A program: JSON lines.
    Programs,
}
