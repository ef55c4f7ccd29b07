//! Text in a JSON string.

use core::fmt::{self, Display, Write};

/// Text as it may stand in a JSON string: what would have to be escaped is left out. It is a sensor's own text, or
/// repeats what was typed.
pub struct Plain<'a, T: ?Sized>(pub &'a T);

impl<T: Display + ?Sized> Display for Plain<'_, T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(Filter(out), "{}", self.0)
    }
}

struct Filter<'a, 'b>(&'a mut fmt::Formatter<'b>);

impl Write for Filter<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let plain = |character: &char| !character.is_control() && !matches!(character, '"' | '\\');
        text.chars().filter(plain).try_for_each(|character| self.0.write_char(character))
    }
}
