//! The line editor: effect of a key on the line, and drawing.
//!
//! The editor draws with printable characters and backspaces only, which every terminal knows; but for Ctrl-L, which needs the
//! control sequences of ECMA-48.
//!
//! Why not `embedded-cli` 0.2, used before: it swallows a line end after `ESC [`, takes 0x7F for a letter, and cuts a long line
//! without telling. The invariant of `line.rs` needs to know of everything that is dropped.
//!
//! Limit: a line longer than the terminal is wide is not redrawn beyond its last row.

use crate::complete::complete;
use crate::history::History;
use crate::keys::{Key, Keys};
use crate::line::{Line, NOT_SAVED, PROMPT, Reason};
use crate::out::{Out, repeat};
use crate::received::Received;
use crate::split::split_before;

/// Most keys of one line. A person does not press as many; a port that echoes does.
const MOST_KEYS: u16 = 1_000;
/// Draws the screen anew: home, erase all (ECMA-48, CUP and ED).
const CLEAR_SCREEN: &[u8] = b"\x1b[H\x1b[2J";
const BACK: u8 = 0x08;

/// How characters are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Manner {
    /// Keys edit the line.
    pub edits: bool,
    /// Typed characters are shown.
    pub shows: bool,
}

impl Manner {
    /// A person at the prompt.
    pub const PROMPT: Manner = Manner { edits: true, shows: true };
    /// A person who types ahead while something is printed.
    pub const AHEAD: Manner = Manner { edits: true, shows: false };
    /// A person who answers a question.
    pub const ANSWER: Manner = Manner { edits: false, shows: true };
    /// A program.
    pub const PROGRAM: Manner = Manner { edits: false, shows: false };
}

/// What a character led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The line is at its end, whatever it is worth. [`Editor::begin`] begins the next.
    Line,
    /// Ctrl-C: the line is dropped.
    Interrupt,
    /// Ctrl-D in an empty line.
    Leave,
    /// More keys than anybody presses in a line.
    Endless,
}

/// The line that is being typed, and the former ones.
pub struct Editor {
    pub line: Line,
    keys: Keys,
    history: History,
    pressed: u16,
    /// The prompt says that the settings in force are not saved.
    pub is_unsaved: bool,
}

impl Editor {
    /// Nothing was typed.
    pub const fn new() -> Editor {
        Editor {
            line: Line::new(),
            keys: Keys::new(),
            history: History::new(),
            pressed: 0,
            is_unsaved: false,
        }
    }

    /// Begins the next line.
    pub fn begin(&mut self) {
        if self.line.is_damaged() {
            // The end of a paste may be among what was lost.
            self.keys.end_paste();
        }
        self.line.clear();
        self.history.rewind();
        self.pressed = 0;
    }

    /// Whether a character is but the rest of the line end before it: LF after CR.
    pub fn is_rest_of_end(&mut self, received: Received) -> bool {
        received == Received::clean(received.byte) && self.keys.is_rest_of_end(received.byte)
    }

    /// Keeps the line, to be recalled.
    pub fn keep(&mut self) {
        self.history.take(self.line.text());
    }

    /// Takes a character.
    pub fn take(&mut self, received: Received, manner: Manner, out: &mut dyn Out) -> Option<Event> {
        if received.lost() > 0 {
            self.keys.interrupt();
            self.line.spoil(Reason::Lost, received.lost().into());
        }
        if received.is_flawed() {
            self.keys.interrupt();
            self.line.spoil(Reason::Receiver, 1);
            return None;
        }
        let decoded = self.keys.take(received.byte, manner.edits, self.line.is_untouched());
        if let Some(reason) = decoded.spoilt {
            self.line.spoil(reason, 1);
        }
        match decoded.key? {
            Key::Enter => Some(Event::Line),
            Key::Interrupt => {
                self.keys.reset();
                self.begin();
                Some(Event::Interrupt)
            }
            Key::DeleteOrLeave if self.line.is_untouched() => Some(Event::Leave),
            key => {
                self.pressed = self.pressed.saturating_add(1);
                self.edit(key, manner, out);
                (manner.edits && self.pressed >= MOST_KEYS).then_some(Event::Endless)
            }
        }
    }

    fn edit(&mut self, key: Key, manner: Manner, out: &mut dyn Out) {
        let (length, cursor) = (self.line.length(), self.line.cursor());
        let line = &mut self.line;
        // Where the text begins to differ from what is drawn, if it does.
        let mut from = Some(cursor);
        match key {
            Key::Character(byte) => line.insert(byte),
            Key::Tab => complete(line),
            Key::Backspace => {
                let before = cursor.saturating_sub(1);
                line.remove(before, cursor);
                from = Some(before);
            }
            Key::Delete | Key::DeleteOrLeave => line.remove(cursor, cursor.saturating_add(1)),
            Key::KillToStart => {
                line.remove(0, cursor);
                from = Some(0);
            }
            Key::KillToEnd => line.remove(cursor, length),
            Key::KillWord => {
                let begin = word_begin(line);
                line.remove(begin, cursor);
                from = Some(begin);
            }
            Key::Older | Key::Newer => {
                match key {
                    Key::Older => self.history.older(line),
                    _ => self.history.newer(line),
                }
                from = Some(0);
            }
            Key::Redraw if manner == Manner::PROMPT => {
                out.put(CLEAR_SCREEN);
                return self.draw(out);
            }
            _ => {
                line.go(match key {
                    Key::Left => cursor.saturating_sub(1),
                    Key::Right => cursor.saturating_add(1),
                    Key::WordLeft => word_begin(line),
                    Key::WordRight => word_end(line),
                    Key::Home => 0,
                    Key::End => length,
                    _ => cursor,
                });
                from = None;
            }
        }
        match key {
            _ if manner == Manner::PROMPT => self.redraw((length, cursor), from, out),
            Key::Character(byte) if manner.shows => out.put(&[byte]),
            _ => {}
        }
    }

    /// Draws prompt and line.
    pub fn draw(&self, out: &mut dyn Out) {
        out.put(if self.is_unsaved { NOT_SAVED.as_bytes() } else { b"" });
        out.put(PROMPT.as_bytes());
        out.put(self.line.text().as_bytes());
        back(out, self.line.length().saturating_sub(self.line.cursor()));
    }

    /// Draws what has changed since the line had this length and cursor: the text from `from` on, or only the cursor.
    fn redraw(&self, (length, cursor): (usize, usize), from: Option<usize>, out: &mut dyn Out) {
        let line = &self.line;
        let mut drawn = cursor;
        if let Some(from) = from {
            back(out, cursor.saturating_sub(from));
            out.put(line.text().get(from..).unwrap_or("").as_bytes());
            repeat(out, b' ', length.saturating_sub(line.length()));
            drawn = length.max(line.length());
        }
        back(out, drawn.saturating_sub(line.cursor()));
        out.put(line.text().get(drawn..line.cursor()).unwrap_or("").as_bytes());
    }
}

fn back(out: &mut dyn Out, columns: usize) {
    repeat(out, BACK, columns);
}

/// Where the word before the cursor begins.
fn word_begin(line: &Line) -> usize {
    let before = line.before_cursor().trim_ascii_end();
    let word = before.bytes().rev().take_while(|&byte| byte != b' ').count();
    before.len().saturating_sub(word)
}

/// Where the word after the cursor ends.
fn word_end(line: &Line) -> usize {
    let rest = line.text().get(line.cursor()..).unwrap_or("");
    let (_, behind) = split_before(rest.trim_ascii_start(), b' ');
    line.length().saturating_sub(behind.len())
}
