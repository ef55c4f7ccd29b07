//! The echo of our own characters.

use clino_codec::character::Character;

use super::Echo;

/// Compares an echo with its frame.
pub(super) struct EchoCheck<'a> {
    /// What has still to come back.
    rest: &'a [u8],
    heard: usize,
    difference: Option<Difference>,
}

/// The first character that came back otherwise than it was sent.
#[derive(Clone, Copy)]
pub(super) struct Difference {
    pub(super) index: usize,
    pub(super) sent: u8,
    pub(super) heard: Option<Character>,
}

impl<'a> EchoCheck<'a> {
    pub(super) fn new(echo: Echo, frame: &'a [u8]) -> Self {
        let rest = match echo {
            Echo::Off => &[],
            Echo::Expected => frame,
        };
        Self { rest, heard: 0, difference: None }
    }

    /// How many characters have still to come back.
    pub(super) fn pending(&self) -> usize {
        self.rest.len()
    }

    /// Whether more has to come back.
    pub(super) fn is_pending(&self) -> bool {
        !self.rest.is_empty()
    }

    pub(super) fn take(&mut self, character: Character) {
        let Some((&sent, rest)) = self.rest.split_first() else { return };
        if character != Character::clean(sent) && self.difference.is_none() {
            self.difference = Some(Difference { index: self.heard, sent, heard: Some(character) });
        }
        self.rest = rest;
        self.heard = self.heard.saturating_add(1);
    }

    /// Nothing more comes back.
    pub(super) fn give_up(&mut self) {
        let missing = self.rest.first().map(|&sent| Difference { index: self.heard, sent, heard: None });
        self.difference = self.difference.or(missing);
        self.rest = &[];
    }

    /// The verdict.
    pub(super) fn finish(mut self) -> Result<(), Difference> {
        self.give_up();
        self.difference.map_or(Ok(()), Err)
    }
}
