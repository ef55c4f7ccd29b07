//! Finding frames in a stream of characters: one engine for every protocol of this crate.
//!
//! The engine keeps the characters that may still belong to a frame. A [`Grammar`] says what can start at the
//! oldest of them; the engine waits until that candidate is complete, has it judged, and on failure moves on
//! by one byte only, so that a good frame that began among the bad bytes is found. While it waits for
//! somebody else's frame, which may be long or imaginary, it looks at every character whether a wanted frame
//! ends here. Together: junk before a good frame never delays or costs it, unless the junk and the frame's
//! first bytes form a good frame of their own.

use crate::Progress;
use crate::bytes::put;
use crate::character::{Character, LineErrors};

/// What can start at the first byte of some bytes.
pub(crate) enum Front<E> {
    /// Nothing.
    Junk,
    /// Something so close to a wanted frame that it is worth a report.
    Refused(E),
    /// A wanted frame of so many bytes.
    Wanted(usize),
    /// Somebody else's frame of so many bytes.
    Foreign(usize),
}

/// What the engine needs to know about a protocol.
pub(crate) trait Grammar {
    type Frame;
    type Error;

    /// How many bytes it takes to tell what starts with them.
    const HEADER: usize;

    /// Classifies the start of `bytes`, which are at least [`HEADER`](Self::HEADER).
    fn front(&self, bytes: &[u8]) -> Front<Self::Error>;

    /// What is wrong with a frame whose characters had these receiver errors, if they matter.
    fn dirty(&self, errors: LineErrors) -> Option<Self::Error>;

    /// Decodes a complete wanted frame.
    fn judge(&mut self, bytes: &[u8]) -> Result<Self::Frame, Self::Error>;

    /// The report that an intact foreign frame is worth; `None` when it is damaged.
    fn foreign(&self, bytes: &[u8], errors: LineErrors) -> Option<Self::Error>;

    /// Every length that a wanted frame can have; zero is skipped.
    fn wanted_lengths(&self) -> [usize; 3];
}

/// What the oldest kept byte is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Candidate {
    Unknown,
    Wanted,
    Foreign,
}

/// Characters that may still belong to a frame, oldest first; `N` is the longest frame.
#[derive(Clone, Debug)]
pub(crate) struct Stream<const N: usize> {
    bytes: [u8; N],
    /// Those of `bytes`; none behind its last.
    errors: [LineErrors; N],
    length: usize,
    /// How many of the oldest bytes belong to a frame that was reported: they are not junk.
    reported: usize,
    junk: u32,
    /// All receiver errors of the kept bytes.
    any_errors: LineErrors,
    candidate: Candidate,
    /// Bytes that the candidate needs to be complete.
    need: usize,
    /// With fewer bytes than this there is nothing to say.
    look_at: usize,
}

impl<const N: usize> Stream<N> {
    pub(crate) const fn new() -> Self {
        Self {
            bytes: [0; N],
            errors: [LineErrors::NONE; N],
            length: 0,
            reported: 0,
            junk: 0,
            any_errors: LineErrors::NONE,
            candidate: Candidate::Unknown,
            need: 0,
            look_at: 0,
        }
    }

    /// Bytes that belonged to no frame, good or reported.
    pub(crate) const fn junk(&self) -> u32 {
        self.junk
    }

    /// Bytes that may still become a frame.
    pub(crate) const fn pending(&self) -> usize {
        self.length.saturating_sub(self.reported)
    }

    #[inline]
    pub(crate) fn push<G: Grammar>(
        &mut self,
        grammar: &mut G,
        character: Character,
    ) -> Progress<G::Frame, G::Error> {
        // The oldest candidate needs at most `N` bytes and is incomplete: there is room.
        put(&mut self.bytes, self.length, character.byte);
        if !character.errors.is_none() {
            put(&mut self.errors, self.length, character.errors);
            self.any_errors |= character.errors;
        }
        self.length = self.length.wrapping_add(1);
        if self.length < self.look_at {
            return Progress::More;
        }
        // The usual course of things, apart from the rest because every answer pays for it.
        if self.candidate == Candidate::Wanted && self.any_errors.is_none() {
            let bytes = self.bytes.get(..self.length);
            if let Some(frame) = bytes.and_then(|bytes| grammar.judge(bytes).ok()) {
                (self.length, self.reported) = (0, 0);
                (self.candidate, self.look_at) = (Candidate::Unknown, G::HEADER);
                return Progress::Frame(frame);
            }
        }
        if self.candidate == Candidate::Unknown
            && self.length == G::HEADER
            && let Front::Wanted(need) = grammar.front(self.bytes(G::HEADER))
            && need > G::HEADER
        {
            (self.candidate, self.need, self.look_at) = (Candidate::Wanted, need, need);
            return Progress::More;
        }
        self.look(grammar)
    }

    /// There may be something to say, and it is not simple.
    #[inline(never)]
    fn look<G: Grammar>(&mut self, grammar: &mut G) -> Progress<G::Frame, G::Error> {
        let progress = match self.resolve(grammar) {
            Progress::More if self.candidate == Candidate::Foreign => self.wanted_at_end(grammar),
            progress => progress,
        };
        // A wanted frame can end with any byte while a foreign one is awaited.
        self.look_at = match self.candidate {
            Candidate::Unknown => G::HEADER,
            Candidate::Wanted => self.need,
            Candidate::Foreign => 0,
        };
        progress
    }

    /// The line is silent: nothing incomplete will become complete.
    pub(crate) fn idle<G: Grammar>(&mut self, grammar: &mut G) -> Progress<G::Frame, G::Error> {
        while self.length != 0 {
            match self.resolve(grammar) {
                Progress::More => self.discard(1),
                progress => return progress,
            }
        }
        Progress::More
    }

    /// Looks at the oldest candidate, and at the next one when that comes to nothing.
    fn resolve<G: Grammar>(&mut self, grammar: &mut G) -> Progress<G::Frame, G::Error> {
        loop {
            if self.candidate == Candidate::Unknown {
                if self.length < G::HEADER {
                    return Progress::More;
                }
                match grammar.front(self.bytes(self.length)) {
                    Front::Junk => {
                        self.discard(1);
                        continue;
                    }
                    Front::Refused(error) => {
                        self.discard(1);
                        return Progress::Bad(error);
                    }
                    Front::Wanted(need) => (self.candidate, self.need) = (Candidate::Wanted, need),
                    Front::Foreign(need) => (self.candidate, self.need) = (Candidate::Foreign, need),
                }
            }
            if self.length < self.need {
                return Progress::More;
            }
            let need = self.need;
            let (bytes, errors) = (self.bytes(need), self.errors(0, need));
            if self.candidate == Candidate::Wanted {
                match grammar.dirty(errors).map_or_else(|| grammar.judge(bytes), Err) {
                    Ok(frame) => {
                        self.reported = self.reported.max(need);
                        self.discard(need);
                        return Progress::Frame(frame);
                    }
                    Err(error) => {
                        self.report(need);
                        return Progress::Bad(error);
                    }
                }
            }
            if let Some(error) = grammar.foreign(bytes, errors) {
                self.report(need);
                return Progress::Bad(error);
            }
            self.discard(1);
        }
    }

    /// A wanted frame that ends with the newest byte, whatever came before it.
    fn wanted_at_end<G: Grammar>(&mut self, grammar: &mut G) -> Progress<G::Frame, G::Error> {
        for length in grammar.wanted_lengths() {
            let Some(start) = self.length.checked_sub(length.max(G::HEADER)) else { continue };
            let bytes = self.bytes.get(start..self.length).unwrap_or(&[]);
            let starts_here = matches!(grammar.front(bytes), Front::Wanted(need) if need == bytes.len());
            if !starts_here {
                continue;
            }
            let dirty = grammar.dirty(self.errors(start, self.length));
            if let Ok(frame) = dirty.map_or_else(|| grammar.judge(bytes), Err) {
                self.discard(start);
                self.reported = self.length;
                self.discard(self.length);
                return Progress::Frame(frame);
            }
        }
        Progress::More
    }

    fn bytes(&self, length: usize) -> &[u8] {
        self.bytes.get(..length).unwrap_or(&[])
    }

    /// All receiver errors between two positions.
    fn errors(&self, start: usize, end: usize) -> LineErrors {
        if self.any_errors.is_none() {
            return LineErrors::NONE;
        }
        let flags = self.errors.get(start..end).unwrap_or(&[]);
        flags.iter().fold(LineErrors::NONE, |all, &one| all | one)
    }

    /// The oldest bytes are accounted for, but a frame may have begun among them.
    fn report(&mut self, length: usize) {
        self.reported = self.reported.max(length);
        self.discard(1);
    }

    /// Drops the oldest bytes; those that belong to no reported frame are junk.
    fn discard(&mut self, count: usize) {
        let junk = count.saturating_sub(self.reported);
        self.junk = self.junk.saturating_add(junk as u32);
        self.reported = self.reported.saturating_sub(count);
        shift(self.bytes.get_mut(..self.length).unwrap_or(&mut []), count, 0);
        if !self.any_errors.is_none() {
            shift(&mut self.errors, count, LineErrors::NONE);
            self.any_errors = self.errors.iter().fold(LineErrors::NONE, |all, &one| all | one);
        }
        self.length = self.length.saturating_sub(count);
        self.candidate = Candidate::Unknown;
        self.look_at = 0;
    }
}

/// Moves all items to the front by `count` places.
fn shift<T: Copy>(items: &mut [T], count: usize, empty: T) {
    for to in 0..items.len() {
        let moved = items.get(to.wrapping_add(count)).copied().unwrap_or(empty);
        put(items, to, moved);
    }
}
