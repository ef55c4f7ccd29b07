//! Settings of the console.

use super::setting::{Definition, Form, Named, Setting, Shown, Tabled, change, names};
use crate::refusal::Refusal;

/// The settings' numbers in the stored record. A number is never given to another setting.
pub mod id {
    #![allow(missing_docs, reason = "the table says what each is")]
    pub const IDLE: u8 = 1;
}

/// How the console behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ConsoleSettings {
    /// Seconds at an empty prompt after which the stream goes on; zero is never.
    pub idle_s: u32,
}

/// A day.
const LONGEST_IDLE: i64 = 86_400;

impl ConsoleSettings {
    /// A minute: longer than a person hesitates between two commands, and a logger misses no more.
    pub const DEFAULT: ConsoleSettings = ConsoleSettings { idle_s: 60 };

    /// Time at an empty prompt after which the stream goes on, if it ever does, in milliseconds: a day is more than a
    /// [`Duration`](clino_bus::Duration) holds.
    pub fn idle_ms(&self) -> Option<u32> {
        (self.idle_s > 0).then(|| self.idle_s.saturating_mul(1_000))
    }
}

/// The table, for use in constants.
pub const TABLE: [Setting<ConsoleSettings>; 1] = [Setting {
    definition: Definition {
        id: id::IDLE,
        name: "idle",
        unit: "s",
        form: Form::number(0, LONGEST_IDLE, 0),
        text: "time at an empty prompt after which the stream goes on; 0: never",
    },
    get: |s| s.idle_s.into(),
    set: |s, v| s.idle_s = v as u32,
}];

/// The table.
pub static SETTINGS: [Setting<ConsoleSettings>; 1] = TABLE;

/// The names of the table's settings, in its order.
pub static NAMES: [&str; 1] = names(&TABLE);

/// The console that comes of a change.
///
/// # Errors
/// A value that its setting does not have.
pub fn changed(now: &ConsoleSettings, named: Named<'_>) -> Result<ConsoleSettings, Refusal> {
    let mut settings = *now;
    change(&mut Tabled::new(&SETTINGS, &mut settings), named)?;
    Ok(settings)
}

/// Whether the console can behave like this.
///
/// # Errors
/// What cannot be.
pub fn check(of: &ConsoleSettings) -> Result<(), Refusal> {
    let values: &dyn Shown = &Tabled::new(&SETTINGS, of);
    values.check()
}
