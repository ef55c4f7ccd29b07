//! The data kept from one start to the next.

use crate::cause::{ResetSource, StartCause};
use crate::crash::Crash;
use crate::start::{BARE_AFTER, Clock, FAST_MS, Mode, SAFE_AFTER, Start};

/// What a start leaves for the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Journal {
    /// Starts since power-up; wraps.
    pub(crate) boots: u32,
    /// Crashes since power-up; wraps.
    pub(crate) crashes: u32,
    /// Fast crashes in a row.
    pub(crate) fast_crashes: u8,
    /// The crystal has stopped since power-up, or since the last requested restart.
    pub(crate) crystal_stopped: bool,
    /// What is to be made of the next reset.
    pub(crate) ending: Ending,
    /// The last crash.
    pub(crate) crash: Option<Crash>,
}

/// How a time has ended, as far as it could say itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Ending {
    /// Not known.
    #[default]
    Unsaid,
    /// With the crash that is noted.
    Crash,
    /// With safe mode over.
    Retry,
}

impl Journal {
    /// Begins a start.
    ///
    /// `before`: what was found in the memory; `None` if it was spoilt. `reset`: what the reset controller says.
    /// `uptime_ms`: how long the time before lasted, if that was found.
    #[must_use]
    pub fn begin(before: Option<Journal>, reset: ResetSource, uptime_ms: Option<u32>) -> (Journal, Start) {
        let before = match reset {
            // Whatever is found after this was never written.
            ResetSource::PowerOn => None,
            _ => before,
        };
        let mut journal = before.unwrap_or_default();
        let ending = core::mem::take(&mut journal.ending);
        journal.boots = journal.boots.wrapping_add(1);
        let cause = match (reset, ending) {
            (ResetSource::Software, Ending::Crash) => {
                let crash = journal.crash.unwrap_or_default();
                journal.count(&crash);
                crash.cause
            }
            (ResetSource::Software, Ending::Retry) => {
                journal.fast_crashes = SAFE_AFTER.saturating_sub(1);
                StartCause::Software
            }
            // A crash that could note itself but not reset: the watchdog did.
            (ResetSource::Watchdog, Ending::Crash) => {
                let crash = journal.crash.unwrap_or_default();
                journal.count(&crash);
                crash.cause
            }
            (ResetSource::Watchdog | ResetSource::WindowWatchdog, _) => {
                let crash = Crash {
                    cause: reset.into(),
                    boot: journal.boots.wrapping_sub(1),
                    uptime_ms: uptime_ms.unwrap_or(0),
                    ..Crash::default()
                };
                journal.count(&crash);
                journal.crash = Some(crash);
                crash.cause
            }
            _ => {
                journal.fast_crashes = 0;
                journal.crystal_stopped = false;
                reset.into()
            }
        };
        let start = Start {
            cause,
            power_ups: 0,
            boots: journal.boots,
            crashes: journal.crashes,
            mode: Mode::after(journal.fast_crashes),
            clock: if journal.crystal_stopped { Clock::Fallback } else { Clock::Crystal },
            crash: journal.crash,
            ..Start::default()
        };
        (journal, start)
    }

    fn count(&mut self, crash: &Crash) {
        self.crashes = self.crashes.wrapping_add(1);
        if crash.cause == StartCause::ClockFailed {
            // The next start is without the crystal: no need for less.
            self.crystal_stopped = true;
        } else if crash.uptime_ms < FAST_MS {
            // No further than it matters.
            self.fast_crashes = self.fast_crashes.saturating_add(1).min(BARE_AFTER);
        } else {
            self.fast_crashes = 0;
        }
    }

    /// Safe mode is over; a reset follows.
    pub fn retry(&mut self) {
        self.ending = Ending::Retry;
    }
}
