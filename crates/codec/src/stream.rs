//! Finding frames in a stream of characters: one engine for every protocol of this crate.
//!
//! The engine keeps the characters that may still belong to a frame. The protocol examines what starts at the
//! oldest of them; the engine waits until that candidate is complete, and when it comes to nothing moves on
//! by one byte only, so that a good frame that began among the bad bytes is found. While it waits for
//! another node's frame, which may be long or imaginary, it checks at every character whether a wanted frame
//! ends there. Together: stray bytes before a good frame never delay or cost it, unless these bytes and the frame's
//! first bytes form a good frame of their own.
//!
//! The engine knows neither frames nor errors, so that there is one copy of it: the protocol's examination
//! keeps what it found, and the engine says whether that counts.

use crate::bytes::put;
use crate::character::{Character, LineErrors};

/// What the oldest bytes are.
#[derive(Clone, Copy)]
pub(crate) enum Verdict {
    /// Nothing can start with the first byte.
    Discard,
    /// With fewer bytes than this there is nothing to say.
    Incomplete(usize),
    /// Another node's frame has begun.
    IncompleteForeign,
    /// This many bytes are worth a report (none: they count as discarded), and a frame may have begun among them.
    Bad(usize),
    /// This many bytes are a wanted frame.
    Frame(usize),
}

/// Says what starts with these bytes, of which there is at least one, and keeps what it found. The errors of
/// the same characters are left out when there are none.
pub(crate) type Examine<'a> = &'a mut dyn FnMut(&[u8], &[LineErrors]) -> Verdict;

/// Characters that may still belong to a frame, oldest first; `N` is the longest frame.
#[derive(Clone, Debug)]
pub(crate) struct Stream<const N: usize> {
    bytes: [u8; N],
    errors: [LineErrors; N],
    state: State,
}

#[derive(Clone, Debug)]
struct State {
    length: usize,
    /// How many of the oldest bytes belong to a frame that was reported: they are not discarded.
    reported: usize,
    discarded: u32,
    /// A kept character has, or had, a receiver error.
    dirty: bool,
    /// With fewer bytes than this there is nothing to say.
    look_at: usize,
    /// No wanted frame ends among this many of the oldest bytes.
    searched: usize,
}

impl State {
    const NEW: Self = Self { length: 0, reported: 0, discarded: 0, dirty: false, look_at: 0, searched: 0 };
}

impl<const N: usize> Stream<N> {
    pub(crate) const fn new() -> Self {
        Self { bytes: [0; N], errors: [LineErrors::NONE; N], state: State::NEW }
    }

    /// Forgets everything.
    pub(crate) const fn restart(&mut self) {
        self.state = State::NEW;
    }

    /// Bytes that belonged to no frame, good or reported.
    pub(crate) const fn discarded(&self) -> u32 {
        self.state.discarded
    }

    /// Bytes that may still become a frame.
    pub(crate) const fn pending(&self) -> usize {
        self.state.length.saturating_sub(self.state.reported)
    }

    /// Takes one character. When this is false there is nothing to say yet; otherwise [`look`](Self::look).
    #[inline]
    pub(crate) fn push(&mut self, character: Character) -> bool {
        // The oldest candidate needs at most `N` bytes and is incomplete: there is room.
        put(&mut self.bytes, self.state.length, character.byte);
        put(&mut self.errors, self.state.length, character.errors);
        self.state.dirty |= !character.errors.is_none();
        self.state.length = self.state.length.wrapping_add(1);
        self.state.length >= self.state.look_at
    }

    /// All bytes, if they are exactly what was waited for, with no receiver error.
    #[inline]
    pub(crate) fn complete(&self) -> Option<&[u8]> {
        let complete = self.state.length == self.state.look_at && !self.state.dirty;
        if complete { self.bytes.get(..self.state.length) } else { None }
    }

    /// Nothing more to say with fewer bytes than this.
    #[inline]
    pub(crate) fn wait(&mut self, look_at: usize) {
        self.state.look_at = look_at;
    }

    /// All bytes were a good frame.
    #[inline]
    pub(crate) fn clear(&mut self) {
        (self.state.length, self.state.reported, self.state.searched) = (0, 0, 0);
    }

    /// Whether what was examined last counts: a frame, or a report. When the line is `silent`, nothing
    /// incomplete will become complete.
    pub(crate) fn look(&mut self, silent: bool, wanted: &[usize], examine: Examine<'_>) -> bool {
        Kept { bytes: &mut self.bytes, errors: &mut self.errors, state: &mut self.state }
            .look(silent, wanted, examine)
    }
}

/// A stream without the length of its longest frame in its type.
struct Kept<'a> {
    bytes: &'a mut [u8],
    errors: &'a mut [LineErrors],
    state: &'a mut State,
}

impl Kept<'_> {
    #[inline(never)]
    fn look(&mut self, silent: bool, wanted: &[usize], examine: Examine<'_>) -> bool {
        while self.state.length != 0 {
            match self.examine(0, examine) {
                Verdict::Frame(length) => {
                    self.report(length, length);
                    return true;
                }
                Verdict::Bad(length) => {
                    self.report(length, 1);
                    return true;
                }
                Verdict::Incomplete(need) if !silent => {
                    self.state.look_at = need;
                    return false;
                }
                Verdict::IncompleteForeign if !silent => return self.wanted_within(wanted, examine),
                _ => self.discard(1),
            }
        }
        false
    }

    /// The first frame of one of the wanted lengths, whatever came before it. Usually it would end with the
    /// newest byte; a report before this look can have left more bytes to search.
    fn wanted_within(&mut self, wanted: &[usize], examine: Examine<'_>) -> bool {
        while self.state.searched < self.state.length {
            self.state.searched = self.state.searched.wrapping_add(1);
            for &length in wanted {
                let Some(start) = self.state.searched.checked_sub(length) else { continue };
                if matches!(self.examine(start, examine), Verdict::Frame(whole) if whole == length) {
                    self.discard(start);
                    self.report(length, length);
                    return true;
                }
            }
        }
        false
    }

    fn examine(&self, start: usize, examine: Examine<'_>) -> Verdict {
        let end = if self.state.dirty { self.state.length } else { start };
        let bytes = self.bytes.get(start..self.state.length).unwrap_or(&[]);
        examine(bytes, self.errors.get(start..end).unwrap_or(&[]))
    }

    /// The first `reported` of the oldest bytes are accounted for; the first `done` of them are dropped.
    fn report(&mut self, reported: usize, done: usize) {
        self.state.reported = self.state.reported.max(reported);
        self.discard(done);
    }

    /// Drops the oldest bytes; those that belong to no reported frame count as discarded.
    fn discard(&mut self, count: usize) {
        let state = &mut *self.state;
        let discarded = count.saturating_sub(state.reported);
        state.discarded = state.discarded.saturating_add(discarded as u32);
        state.reported = state.reported.saturating_sub(count);
        state.searched = state.searched.saturating_sub(count);
        state.length = state.length.saturating_sub(count);
        state.dirty &= state.length != 0;
        state.look_at = 0;
        for to in 0..state.length {
            let from = to.wrapping_add(count);
            put(self.bytes, to, self.bytes.get(from).copied().unwrap_or(0));
            put(self.errors, to, self.errors.get(from).copied().unwrap_or(LineErrors::NONE));
        }
    }
}
