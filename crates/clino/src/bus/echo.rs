//! Our own frame among what is read: as many characters as were sent, the first ones.
//!
//! A port does not tell when a character was on the pair, so that order decides. Nothing else is on the pair before a frame is
//! out, so its echo comes before any answer. Where it is not known whether there is an echo, characters are held back as long
//! as they are those of the frame; the first that is not proves that there is none, and the whole frame that there is one.
//!
//! Limit: an answer that is the frame, byte by byte, is taken for its echo while that is not known. A T7's answer to Set Angle
//! Output Range can be that; every operation reads before it writes, and what it reads is longer than its request.

use clino_bus::Instant;
use clino_codec::character::Character;

/// What is known of the echo of the last frame.
#[derive(Debug, Default)]
pub struct Echo {
    frame: Vec<u8>,
    state: State,
    /// When the frame began: no answer can be that early.
    began: Instant,
    /// An echo that is not back by then is lost.
    late: Instant,
    held: Vec<Character>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// None is to come, or all of it has come.
    #[default]
    Over,
    /// There is one: this many characters have come.
    Coming(usize),
    /// There may be one.
    Unknown,
}

/// Whose characters these are.
#[derive(Debug, PartialEq, Eq)]
pub enum Whose {
    /// It is not known yet.
    Held,
    /// Our own, sent since that instant.
    Ours(Vec<Character>, Instant),
    /// Those of others.
    Others(Vec<Character>),
}

impl Echo {
    /// A frame begins. `known`: whether the port returns what it sends.
    pub fn begin(frame: Vec<u8>, known: Option<bool>, began: Instant, late: Instant) -> Self {
        let state = match known {
            Some(false) => State::Over,
            Some(true) => State::Coming(0),
            None => State::Unknown,
        };
        Self { frame, state, began, late, held: Vec::new() }
    }

    /// Until when an echo may still come; `None` if none is to come.
    pub fn until(&self) -> Option<Instant> {
        matches!(self.state, State::Coming(_)).then_some(self.late)
    }

    /// Whether nothing more of an echo comes.
    pub fn is_over(&self) -> bool {
        self.state == State::Over
    }

    /// The next character that is read.
    pub fn judge(&mut self, character: Character) -> Whose {
        match self.state {
            State::Over => Whose::Others(vec![character]),
            State::Coming(come) => {
                let come = come + 1;
                self.state = if come < self.frame.len() { State::Coming(come) } else { State::Over };
                Whose::Ours(vec![character], self.began)
            }
            State::Unknown => {
                let fits =
                    self.frame.get(self.held.len()) == Some(&character.byte) && character.errors.is_none();
                self.held.push(character);
                if !fits {
                    return Whose::Others(self.give_up());
                }
                if self.held.len() < self.frame.len() {
                    return Whose::Held;
                }
                self.state = State::Over;
                Whose::Ours(std::mem::take(&mut self.held), self.began)
            }
        }
    }

    /// What was held back is no echo: nothing more came in time.
    pub fn give_up(&mut self) -> Vec<Character> {
        if self.state == State::Unknown {
            self.state = State::Over;
        }
        std::mem::take(&mut self.held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: [u8; 3] = [0x05, 0x01, 0x83];
    const BEGAN: Instant = Instant::from_micros(1_000);

    fn echo(known: Option<bool>) -> Echo {
        Echo::begin(FRAME.to_vec(), known, BEGAN, Instant::from_micros(9_000))
    }

    fn characters(bytes: &[u8]) -> Vec<Character> {
        bytes.iter().map(|&byte| Character::clean(byte)).collect()
    }

    fn judge(echo: &mut Echo, byte: u8) -> Whose {
        echo.judge(Character::clean(byte))
    }

    #[test]
    fn a_whole_frame_is_its_echo_and_what_follows_is_not() {
        let mut echo = echo(None);
        assert_eq!(judge(&mut echo, 0x05), Whose::Held);
        assert_eq!(judge(&mut echo, 0x01), Whose::Held);
        assert_eq!(judge(&mut echo, 0x83), Whose::Ours(characters(&FRAME), BEGAN));
        assert!(echo.is_over());
        assert_eq!(judge(&mut echo, 0x05), Whose::Others(characters(&[0x05])));
    }

    #[test]
    fn an_answer_that_begins_like_the_frame_is_no_echo() {
        let mut echo = echo(None);
        assert_eq!(judge(&mut echo, 0x05), Whose::Held);
        assert_eq!(judge(&mut echo, 0x06), Whose::Others(characters(&[0x05, 0x06])));
        assert_eq!(judge(&mut echo, 0x83), Whose::Others(characters(&[0x83])));
    }

    #[test]
    fn what_is_held_back_is_not_lost_when_nothing_follows() {
        let mut echo = echo(None);
        assert_eq!(judge(&mut echo, 0x05), Whose::Held);
        assert_eq!(echo.give_up(), characters(&[0x05]));
        assert_eq!(echo.give_up(), []);
        assert_eq!(judge(&mut echo, 0x01), Whose::Others(characters(&[0x01])));
    }

    #[test]
    fn a_known_echo_is_ours_even_if_it_is_damaged_and_a_known_silence_is_not() {
        let mut known = echo(Some(true));
        assert_eq!(known.until(), Some(Instant::from_micros(9_000)));
        for byte in [0x05, 0x81, 0x83] {
            assert_eq!(judge(&mut known, byte), Whose::Ours(characters(&[byte]), BEGAN));
        }
        assert_eq!((known.is_over(), known.until()), (true, None));
        let mut none = echo(Some(false));
        assert_eq!(judge(&mut none, 0x05), Whose::Others(characters(&[0x05])));
    }
}
