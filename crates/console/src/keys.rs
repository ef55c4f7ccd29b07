//! Keys of terminals: what the bytes mean that a terminal sends for a key.
//!
//! | key | bytes |
//! |---|---|
//! | Enter | CR; LF; CR LF and CR NUL are one Enter; `ESC O M` |
//! | Backspace | 0x08 (Windows Terminal with Ctrl, miniterm), 0x7F (PuTTY, picocom, screen, tio, minicom) |
//! | arrows | `ESC [ A` to `D`; `ESC O A` to `D` (application cursor keys); with modifiers `ESC [ 1 ; 5 C` |
//! | Home, End | `ESC [ H`, `F`; `ESC O H`, `F`; `ESC [ 1 ~`, `4 ~` (PuTTY, screen, linux); `ESC [ 7 ~`, `8 ~` (rxvt) |
//! | Delete | `ESC [ 3 ~` |
//! | keypad | `ESC O j` to `y` (application keypad): the character on the key |
//! | bracketed paste | `ESC [ 200 ~` to `ESC [ 201 ~`: no key edits within; a control character there spoils the line |
//! | as in Emacs, readline, tcsh | Ctrl-A E B F P N: start, end, back, forward, older, newer; Ctrl-D deletes; Ctrl-U K W kill to the start, to the end, the word; Ctrl-L draws anew; Ctrl-C drops the line |
//!
//! Function keys and other sequences of a known form are consumed whole and do nothing. What has no such form may have
//! swallowed text: it spoils the line ([`Reason::Sequence`]), but what follows is taken as it comes, a line end above all. A
//! lone ESC before the first character of a line does nothing.
//!
//! Without editing (programs, answers to questions) line ends and Ctrl-C are the only keys.
//!
//! Sources: ECMA-48 section 5.4 (control sequences); xterm control sequences, "PC-Style Function Keys"; the terminals' own.

use crate::line::Reason;
use crate::received::INTERRUPT;

const BS: u8 = 0x08;
const LF: u8 = b'\n';
const CR: u8 = b'\r';
const XON: u8 = 0x11;
const XOFF: u8 = 0x13;
const ESC: u8 = 0x1B;
const DEL: u8 = 0x7F;

/// Longest control sequence, without its introducer: a mouse report of a large screen.
const LONGEST_SEQUENCE: u8 = 20;
/// Modifier parameter of Alt and of Ctrl: the key, plus one.
const WORDWISE: [u8; 2] = [3, 5];

/// What a key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A printable ASCII character.
    Character(u8),
    Enter,
    /// Ctrl-C.
    Interrupt,
    Tab,
    Backspace,
    /// Deletes the character under the cursor.
    Delete,
    /// Ctrl-D: the same, or in an empty line the end of the session.
    DeleteOrLeave,
    Left,
    Right,
    WordLeft,
    WordRight,
    Home,
    End,
    Older,
    Newer,
    KillToStart,
    KillToEnd,
    KillWord,
    Redraw,
}

/// What a byte led to: maybe the end of a sequence that was none, and maybe a key.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decoded {
    pub spoilt: Option<Reason>,
    pub key: Option<Key>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Ground,
    /// A carriage return was the last: a line feed, or NUL, belongs to it.
    Return,
    Escape,
    /// After `ESC [` or `ESC O`: the parameters so far.
    Sequence {
        introducer: u8,
        length: u8,
        /// A marker of private use: an answer of the terminal, no key.
        private: bool,
        /// The first number, and the one that is being read; which one that is.
        first: u8,
        last: u8,
        field: u8,
    },
    /// After `ESC [ [`, with which the Linux console begins F1 to F5.
    Linux,
}

/// Takes bytes, gives keys.
pub struct Keys {
    state: State,
    pasting: bool,
}

impl Keys {
    /// No byte was taken.
    pub const fn new() -> Keys {
        Keys { state: State::Ground, pasting: false }
    }

    /// Forgets what has begun, a paste, too.
    pub fn reset(&mut self) {
        *self = Keys::new();
    }

    /// Whether a byte is but the rest of the line end before it.
    pub fn is_rest_of_end(&mut self, byte: u8) -> bool {
        let returned = core::mem::replace(&mut self.state, State::Ground) == State::Return;
        returned && matches!(byte, LF | 0)
    }

    /// The next byte is typed, not pasted.
    pub fn end_paste(&mut self) {
        self.pasting = false;
    }

    /// A byte was lost, or cannot be read: what has begun cannot be finished.
    pub fn interrupt(&mut self) {
        self.state = State::Ground;
    }

    /// Takes a byte. `edits`: keys edit; `fresh`: nothing stands in the line.
    pub fn take(&mut self, byte: u8, edits: bool, fresh: bool) -> Decoded {
        let state = core::mem::replace(&mut self.state, State::Ground);
        let cut = match state {
            State::Ground => None,
            State::Return if matches!(byte, LF | 0) => return Decoded::default(),
            State::Return => None,
            State::Escape => match byte {
                b'[' | b'O' => {
                    let (introducer, private) = (byte, false);
                    self.state =
                        State::Sequence { introducer, length: 0, private, first: 0, last: 0, field: 0 };
                    return Decoded::default();
                }
                ESC => {
                    self.state = State::Escape;
                    return Decoded::default();
                }
                // Alt-Backspace.
                BS | DEL if !self.pasting => return key(Key::KillWord),
                // Alone it has swallowed nothing; but in a line it may stand for a character that was something else.
                _ => (!fresh).then_some(Reason::Sequence),
            },
            State::Linux => match byte {
                b'A'..=b'E' => return Decoded::default(),
                _ => Some(Reason::Sequence),
            },
            State::Sequence { introducer, length, mut private, mut first, mut last, mut field } => match byte
            {
                b' '..=b'?' if length < LONGEST_SEQUENCE => {
                    match byte {
                        b'0'..=b'9' => {
                            last = last.saturating_mul(10).saturating_add(byte.wrapping_sub(b'0'));
                            first = if field == 0 { last } else { first };
                        }
                        b';' => (field, last) = (field.saturating_add(1), 0),
                        b'<'..=b'?' => private = true,
                        _ => {}
                    }
                    let length = length.saturating_add(1);
                    self.state = State::Sequence { introducer, length, private, first, last, field };
                    return Decoded::default();
                }
                b'[' if introducer == b'[' && length == 0 => {
                    self.state = State::Linux;
                    return Decoded::default();
                }
                b'@'..=b'~' => {
                    let ended = end(introducer, byte, private, first, last);
                    return self.within_paste(ended);
                }
                _ => Some(Reason::Sequence),
            },
        };
        let decoded = self.ground(byte, edits && !self.pasting);
        Decoded { spoilt: cut.or(decoded.spoilt), key: decoded.key }
    }

    /// In a paste the only sequence is its end.
    fn within_paste(&mut self, ended: Ended) -> Decoded {
        match ended {
            Ended::Paste(pasting) => {
                self.pasting = pasting;
                Decoded::default()
            }
            Ended::Nothing if !self.pasting => Decoded::default(),
            Ended::Key(pressed) if !self.pasting => key(pressed),
            Ended::Nothing | Ended::Key(_) => spoilt(Reason::Control),
            Ended::Unknown => spoilt(Reason::Sequence),
        }
    }

    fn ground(&mut self, byte: u8, edits: bool) -> Decoded {
        match byte {
            b' '..=b'~' => return key(Key::Character(byte)),
            CR => {
                self.state = State::Return;
                return key(Key::Enter);
            }
            LF => return key(Key::Enter),
            INTERRUPT => return key(Key::Interrupt),
            ESC if edits || self.pasting => {
                self.state = State::Escape;
                return Decoded::default();
            }
            0x80.. => return spoilt(Reason::NotAscii),
            XON | XOFF => return spoilt(Reason::FlowControl),
            _ if !edits => return spoilt(Reason::Control),
            _ => {}
        }
        key(match byte {
            0x01 => Key::Home,
            0x02 => Key::Left,
            0x04 => Key::DeleteOrLeave,
            0x05 => Key::End,
            0x06 => Key::Right,
            BS | DEL => Key::Backspace,
            b'\t' => Key::Tab,
            0x0B => Key::KillToEnd,
            0x0C => Key::Redraw,
            0x0E => Key::Newer,
            0x10 => Key::Older,
            0x15 => Key::KillToStart,
            0x17 => Key::KillWord,
            _ => return spoilt(Reason::Control),
        })
    }
}

const fn key(key: Key) -> Decoded {
    Decoded { spoilt: None, key: Some(key) }
}

const fn spoilt(reason: Reason) -> Decoded {
    Decoded { spoilt: Some(reason), key: None }
}

/// What a whole control sequence is.
enum Ended {
    Key(Key),
    /// A key that does nothing here, or an answer of the terminal.
    Nothing,
    /// A paste begins, or ends.
    Paste(bool),
    /// No key sends it: it has swallowed text.
    Unknown,
}

fn end(introducer: u8, byte: u8, private: bool, first: u8, last: u8) -> Ended {
    let wordwise = WORDWISE.contains(&last);
    let pressed = match (introducer, byte) {
        _ if private => return Ended::Nothing,
        (_, b'A') => Key::Older,
        (_, b'B') => Key::Newer,
        (_, b'C') if wordwise => Key::WordRight,
        (_, b'C') => Key::Right,
        (_, b'D') if wordwise => Key::WordLeft,
        (_, b'D') => Key::Left,
        (_, b'H') => Key::Home,
        (_, b'F') => Key::End,
        (b'[', b'~') => match first {
            1 | 7 => Key::Home,
            4 | 8 => Key::End,
            3 => Key::Delete,
            200 => return Ended::Paste(true),
            201 => return Ended::Paste(false),
            _ => return Ended::Nothing,
        },
        (b'O', b'M') => Key::Enter,
        // The application keypad: 0x40 above the character on the key.
        (b'O', b'j'..=b'y') => Key::Character(byte.wrapping_sub(0x40)),
        (_, b'A'..=b'Z' | b'^' | b'@') => return Ended::Nothing,
        _ => return Ended::Unknown,
    };
    Ended::Key(pressed)
}
