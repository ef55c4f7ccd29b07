//! Former lines of a person, newest first: as many as fit.
//!
//! Only lines that were carried out get in, so that none comes back that was not typed whole.

use crate::line::Line;

/// Characters of former lines that are kept, one of them an end mark for each. An index into them is a `u8` that comes round.
const KEPT: usize = 256;
/// Ends a line; no line contains it.
const END: u8 = 0;

/// Former lines, one behind the other in a ring; the oldest is overwritten.
pub struct History {
    ring: [u8; KEPT],
    /// Where the next line begins.
    next: u8,
    /// Which of them stands in the line; 0 is none, 1 the newest.
    recalled: u8,
}

impl History {
    /// No lines.
    pub const fn new() -> History {
        History { ring: [END; KEPT], next: 0, recalled: 0 }
    }

    /// Takes a line; one that is there already as the newest is not taken twice. A function of its own: its stack is not below
    /// the commands.
    #[inline(never)]
    pub fn take(&mut self, text: &str) {
        self.recalled = 0;
        if self.line(1).is_some_and(|at| self.text(at).eq(text.bytes())) {
            return;
        }
        for byte in text.bytes().chain([END]) {
            self.put(byte);
        }
        // The rest of a line that was overwritten in part.
        let mut at = self.next;
        while at != self.next.wrapping_sub(1) && self.at(at) != END {
            if let Some(place) = self.ring.get_mut(usize::from(at)) {
                *place = END;
            }
            at = at.wrapping_add(1);
        }
    }

    /// The line is a new one.
    pub fn rewind(&mut self) {
        self.recalled = 0;
    }

    /// Puts the one before into the line.
    pub fn older(&mut self, line: &mut Line) {
        let older = self.recalled.saturating_add(1);
        if let Some(at) = self.line(older) {
            self.recalled = older;
            self.recall(at, line);
        }
    }

    /// Puts the one after it into the line; after the newest comes an empty line.
    pub fn newer(&mut self, line: &mut Line) {
        self.recalled = self.recalled.saturating_sub(1);
        line.remove(0, line.length());
        if let Some(at) = self.line(self.recalled) {
            self.recall(at, line);
        }
    }

    fn recall(&self, at: u8, line: &mut Line) {
        line.remove(0, line.length());
        self.text(at).for_each(|byte| line.insert(byte));
    }

    /// Where the line of this number begins.
    fn line(&self, number: u8) -> Option<u8> {
        let mut at = self.next;
        let mut last = None;
        for _ in 0..number {
            // Its end mark, then its text.
            let end = at.wrapping_sub(1);
            at = end;
            while at != self.next && self.at(at.wrapping_sub(1)) != END {
                at = at.wrapping_sub(1);
            }
            if at == self.next || at == end {
                return None;
            }
            last = Some(at);
        }
        last
    }

    fn text(&self, from: u8) -> impl Iterator<Item = u8> + '_ {
        (0..=u8::MAX).map(move |n| self.at(from.wrapping_add(n))).take_while(|&byte| byte != END)
    }

    fn at(&self, at: u8) -> u8 {
        self.ring.get(usize::from(at)).copied().unwrap_or(END)
    }

    fn put(&mut self, byte: u8) {
        if let Some(place) = self.ring.get_mut(usize::from(self.next)) {
            *place = byte;
        }
        self.next = self.next.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    use std::format;
    use std::string::{String, ToString as _};
    use std::vec::Vec;

    use super::History;
    use crate::line::Line;

    fn older(history: &mut History, line: &mut Line) -> String {
        history.older(line);
        line.text().to_string()
    }

    #[test]
    fn former_lines_come_back_newest_first_and_the_oldest_are_forgotten() {
        for length in 1..=80 {
            let (mut history, mut line) = (History::new(), Line::new());
            let lines: Vec<String> = (0..40).map(|n| format!("{n:0length$}")).collect();
            lines.iter().for_each(|line| history.take(line));
            let kept = 255 / (length.max(2) + 1);
            for (age, expected) in lines.iter().rev().enumerate().take(kept.min(10)) {
                assert_eq!(older(&mut history, &mut line), *expected, "length {length}, age {age}");
            }
        }
    }

    #[test]
    fn what_is_recalled_was_taken_whole() {
        let (mut history, mut line) = (History::new(), Line::new());
        let mut state = 7_usize;
        let mut taken = Vec::new();
        for n in 0..500 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let width = 1 + (state >> 33) % 80;
            let text = format!("{n:>width$}");
            history.take(&text);
            taken.push(text);
            history.rewind();
            line.clear();
            let mut expected = taken.iter().rev();
            for _ in 0..300 {
                let before = line.text().to_string();
                let found = older(&mut history, &mut line);
                if found == before {
                    break;
                }
                assert_eq!(Some(&found), expected.next(), "after {n}");
            }
        }
    }

    #[test]
    fn after_the_newest_comes_an_empty_line() {
        let (mut history, mut line) = (History::new(), Line::new());
        ["one", "two", "two"].iter().for_each(|line| history.take(line));
        assert_eq!(older(&mut history, &mut line), "two");
        assert_eq!(older(&mut history, &mut line), "one");
        assert_eq!(older(&mut history, &mut line), "one");
        history.newer(&mut line);
        assert_eq!(line.text(), "two");
        history.newer(&mut line);
        assert_eq!(line.text(), "");
    }
}
