//! The half-duplex line: when the driver is on, the next character to send, when the line is free again.
//!
//! ```text
//!            submit            guard over          pre-delay over          no character left
//!  Listening ──────▶ Turnaround ────────▶ PreDelay ──────────────▶ Sending ────────────────▶ Draining
//!      ▲                │ (driver off)      (driver on)              (driver on)               │ (driver on)
//!      │                │                                                                      │ transmission
//!      │                ▼ line not silent: given up                      post-delay over       ▼ complete
//!      └────────────────┴──────────────────────────────────────────────────────────────── PostDelay
//!                              from all states with the driver on: held too long: forced     (driver on)
//! ```
//!
//! | | |
//! |---|---|
//! | driver | DE is [`Line::driving`], after every call. Released on *transmission complete* of the last character, never when it was merely accepted by the UART, plus the post-delay. |
//! | listening | A line that is not sending listens, always: for an answer, in the quiet after a failure, or idle; the [`Master`](crate::Master) knows which. |
//! | early answer | The frame counts as out with its last stop bit. What is heard from then on is handed over, even while the post-delay still holds the driver, and ends it. |
//! | echo | Own characters that come back are verified and removed, see [`EchoMode`]; the rule is in `line/echo.rs`. |
//! | stray characters | They delay the next frame by the guard, and have no other effect. |
//!
//! Limits: one frame of at most [`MAX_FRAME`] characters at a time; the driver is never held longer than the
//! frame needs plus [`HOLD_MARGIN`] of its length, plus both delays.

use clino_codec::character::Character;
use heapless::Vec;

use crate::{Duration, Instant, Serial};

mod echo;
mod event;
mod settings;

pub use echo::{EchoTracker, EchoVerdict};
pub use event::{Event, LineStep, SubmitError};
pub use settings::{EchoMode, LineSettings};

/// Longest frame that is sent: the longest write to the places in an ISU's EEPROM that its document names (16 words)
/// takes 36 characters; the T7's longest command has 10.
pub const MAX_FRAME: usize = 40;

/// The driver may be on for the frame's own time plus this part of it (numerator, denominator), at least one
/// character: an interrupt held off that long is a fault, not jitter.
pub const HOLD_MARGIN: (u32, u32) = (1, 4);

/// For this many bits after our last stop bit, a received character is still our own late echo: half a character,
/// in which no node can have sent a whole one.
const ECHO_BITS: u32 = 5;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Listening,
    Turnaround { give_up: Instant },
    PreDelay { until: Instant, release_by: Instant },
    Sending { next: usize, release_by: Instant },
    Draining { release_by: Instant },
    PostDelay { until: Instant },
}

/// A half-duplex line. See the module documentation.
#[derive(Debug)]
pub struct Line {
    settings: LineSettings,
    /// Half a bit: a division that is not done for each character that comes in.
    half_bit: Duration,
    /// [`ECHO_BITS`]: one that is not done while the line waits to be let go.
    echo_tail: Duration,
    state: State,
    frame: Vec<u8, MAX_FRAME>,
    /// No DE before this instant: the end of the last thing heard or sent, plus the guard.
    clear_at: Instant,
    echo: EchoTracker,
    /// Until then a character heard may be our own.
    echo_until: Instant,
}

impl Line {
    /// A listening line. A UART whose transmitter was switched on at `started` first sends one idle character
    /// without being told (RM0090 section 30.3.2); DE must not rise before its end.
    pub fn new(settings: LineSettings, started: Instant) -> Line {
        let clear_at = started + settings.guard.max(settings.serial.characters(1));
        Line {
            settings,
            half_bit: settings.serial.half_bit(),
            echo_tail: settings.serial.bits(ECHO_BITS),
            state: State::Listening,
            frame: Vec::new(),
            clear_at,
            echo: EchoTracker::new(settings.echo),
            echo_until: Instant::ZERO,
        }
    }

    /// Changes the settings, bit rate included, of a line that has no frame in hand.
    ///
    /// # Errors
    /// [`SubmitError::Busy`]; nothing has changed then.
    pub fn set(&mut self, settings: LineSettings, now: Instant) -> Result<(), SubmitError> {
        if self.state != State::Listening {
            return Err(SubmitError::Busy);
        }
        // What comes from now on is not the echo of what was sent before.
        _ = self.echo.end();
        if settings.echo != self.settings.echo {
            self.echo = EchoTracker::new(settings.echo);
        }
        self.settings = settings;
        self.half_bit = settings.serial.half_bit();
        self.echo_tail = settings.serial.bits(ECHO_BITS);
        self.clear_at = self.clear_at.max(now + settings.guard);
        Ok(())
    }

    /// The settings in force.
    pub fn settings(&self) -> &LineSettings {
        &self.settings
    }

    /// Whether our own characters come back; `None` while that is not known.
    pub fn has_echo(&self) -> Option<bool> {
        self.echo.present()
    }

    /// Takes a frame to be sent as soon as the guard allows, and to be dropped if it does not by `give_up`.
    ///
    /// # Errors
    /// [`SubmitError`]; the frame will not be sent then.
    pub fn submit(&mut self, bytes: &[u8], give_up: Instant) -> Result<(), SubmitError> {
        if self.state != State::Listening {
            return Err(SubmitError::Busy);
        }
        match Vec::from_slice(bytes) {
            Ok(frame) if !frame.is_empty() => self.frame = frame,
            _ => return Err(SubmitError::Length(bytes.len())),
        }
        // What has not come back of the last frame will not do so any more.
        _ = self.echo.end();
        self.state = State::Turnaround { give_up };
        Ok(())
    }

    /// Lets time pass. Call it until it returns `None`; DE may have changed even then.
    pub fn poll(&mut self, now: Instant) -> Option<LineStep> {
        match self.state {
            State::Turnaround { .. } if now >= self.clear_at => {
                self.echo.begin();
                self.echo_until = Instant::NEVER;
                let release_by = now + self.longest_drive();
                if self.settings.pre_delay == Duration::ZERO {
                    self.state = State::Sending { next: 0, release_by };
                    return Some(LineStep::Begin);
                }
                self.state = State::PreDelay { until: now + self.settings.pre_delay, release_by };
                None
            }
            State::Turnaround { give_up } if now >= give_up => {
                self.state = State::Listening;
                Some(LineStep::GiveUp)
            }
            State::PreDelay { release_by, .. }
            | State::Sending { release_by, .. }
            | State::Draining { release_by }
                if now >= release_by =>
            {
                self.listen(now);
                // What the UART holds still runs out of it, behind the closed driver.
                self.clear_at = self.clear_at.max(now + self.settings.serial.characters(2));
                // A frame that was never sent is no node's fault.
                _ = self.echo.end();
                Some(LineStep::Force)
            }
            State::PreDelay { until, release_by } if now >= until => {
                self.state = State::Sending { next: 0, release_by };
                Some(LineStep::Begin)
            }
            State::PostDelay { until } if now >= until => {
                self.listen(now);
                None
            }
            _ if self.echo.is_missed() && now > self.echo_until => {
                self.echo.end().then_some(LineStep::EchoLost)
            }
            _ => None,
        }
    }

    /// When [`Line::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Instant> {
        let state = match self.state {
            State::Listening => None,
            State::Turnaround { give_up } => Some(self.clear_at.min(give_up)),
            State::PreDelay { until, release_by } => Some(until.min(release_by)),
            State::Sending { release_by, .. } | State::Draining { release_by } => Some(release_by),
            State::PostDelay { until } => Some(until),
        };
        let echo = (self.echo.is_missed() && self.frame_is_out())
            .then_some(self.echo_until + Duration::from_micros(1));
        crate::earliest(state, echo)
    }

    /// The transmit register is empty: the next character, or `None` when the last one is already in it and
    /// only *transmission complete* is left to wait for.
    pub fn next_character(&mut self) -> Option<u8> {
        let State::Sending { next, release_by } = self.state else { return None };
        match self.frame.get(next) {
            Some(&byte) => {
                self.state = State::Sending { next: next.saturating_add(1), release_by };
                Some(byte)
            }
            None => {
                self.state = State::Draining { release_by };
                None
            }
        }
    }

    /// Transmission complete. `true` when this was the end of the frame, to be reported as [`Event::Released`].
    /// `false` when it was not ours to act on (the transmitter ran dry in the middle of a frame, or a stale flag).
    #[must_use]
    pub fn transmission_complete(&mut self, now: Instant) -> bool {
        if !matches!(self.state, State::Draining { .. }) {
            return false;
        }
        self.echo_until = now + self.echo_tail;
        match self.settings.post_delay {
            Duration::ZERO => self.listen(now),
            delay => self.state = State::PostDelay { until: now + delay },
        }
        true
    }

    /// A character was received; `at` is the centre of its stop bit. Whose it is, is in the event.
    pub fn heard(&mut self, character: Character, at: Instant) -> Event {
        let end_of_stop_bit = at + self.half_bit;
        self.clear_at = self.clear_at.max(end_of_stop_bit + self.settings.guard);
        let sent = match self.state {
            State::PreDelay { .. } | State::Turnaround { .. } => 0,
            State::Sending { next, .. } => next,
            _ => self.frame.len(),
        };
        let verdict = if at <= self.echo_until {
            self.echo.judge(character, &self.frame, sent)
        } else {
            EchoVerdict::Foreign
        };
        match verdict {
            EchoVerdict::Own => Event::Echo { at },
            EchoVerdict::Contention => Event::Contention { at },
            EchoVerdict::Foreign => {
                if matches!(self.state, State::PostDelay { .. }) {
                    self.listen(at);
                }
                Event::Heard { character, at }
            }
        }
    }

    /// Whether the driver is to be on.
    pub fn driving(&self) -> bool {
        !matches!(self.state, State::Listening | State::Turnaround { .. })
    }

    /// Characters of the frame in hand.
    pub fn frame_len(&self) -> usize {
        self.frame.len()
    }

    /// The longest time for which the driver may be on for the frame in hand.
    pub fn longest_hold(&self) -> Duration {
        self.longest_drive() + self.settings.post_delay
    }

    fn frame_is_out(&self) -> bool {
        matches!(self.state, State::Listening | State::PostDelay { .. } | State::Turnaround { .. })
    }

    fn listen(&mut self, now: Instant) {
        self.state = State::Listening;
        self.clear_at = self.clear_at.max(now + self.settings.guard);
    }

    /// From DE high to the latest transmission complete.
    fn longest_drive(&self) -> Duration {
        let serial: Serial = self.settings.serial;
        let frame = serial.characters(self.frame.len() as u32);
        let (numerator, denominator) = HOLD_MARGIN;
        let margin =
            Duration::from_micros(frame.times(numerator).as_micros().checked_div(denominator).unwrap_or(0));
        self.settings.pre_delay + frame + margin.max(serial.characters(1))
    }
}

#[cfg(test)]
mod tests;
