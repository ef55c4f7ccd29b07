//! Duties: what has to go on, and how long each may be silent.
//!
//! Any level of the program checks in for its duty with one store; one context alone lets time pass.

use core::sync::atomic::{AtomicU8, Ordering};

/// Milliseconds from one tick to the next.
pub const TICK_MS: u32 = 10;

/// Something that has to go on. The numbers never change their meaning: they are told upstream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Duty {
    /// The T7 bus keeps its own deadlines.
    T7Bus = 1,
    /// The ISU bus does.
    IsuBus = 2,
    /// Captured PWM cycles are fetched.
    Pwm = 3,
    /// The Modbus server runs.
    Modbus = 4,
    /// The console's loop goes round, or its characters go out.
    Console = 5,
    /// Storing ends.
    Storage = 6,
}

impl Duty {
    /// All of them, by number.
    pub const ALL: [Duty; 6] =
        [Duty::T7Bus, Duty::IsuBus, Duty::Pwm, Duty::Modbus, Duty::Console, Duty::Storage];

    /// Its name in JSON and in the documentation.
    pub const fn name(self) -> &'static str {
        match self {
            Duty::T7Bus => "t7_bus",
            Duty::IsuBus => "isu_bus",
            Duty::Pwm => "pwm",
            Duty::Modbus => "modbus",
            Duty::Console => "console",
            Duty::Storage => "storage",
        }
    }

    /// What goes on while it checks in, for the documentation.
    pub const fn meaning(self) -> &'static str {
        match self {
            Duty::T7Bus => "the T7 bus keeps its own deadlines",
            Duty::IsuBus => "the ISU bus keeps its own deadlines",
            Duty::Pwm => "captured PWM cycles are fetched",
            Duty::Modbus => "the Modbus server runs",
            Duty::Console => "the console's loop goes round, or its characters go out",
            Duty::Storage => "storing ends",
        }
    }

    /// The duty of this number.
    pub fn from_number(number: u32) -> Option<Duty> {
        Duty::ALL.into_iter().find(|duty| *duty as u32 == number)
    }

    /// Longest silence in milliseconds.
    ///
    /// The clock wakes the bus and Modbus levels every 65.5 ms at least; seven of these may be lost. The console may have to
    /// wait for a few long lines of the levels above, and storing takes up to 0.52 s with its longest erase, of which
    /// nobody hears a tick.
    pub const fn longest_silence_ms(self) -> u32 {
        match self {
            Duty::T7Bus | Duty::IsuBus | Duty::Pwm | Duty::Modbus => 500,
            Duty::Console | Duty::Storage => 900,
        }
    }

    const fn most_ticks(self) -> u8 {
        // At most 90.
        (self.longest_silence_ms() / TICK_MS) as u8
    }
}

/// A duty that has nothing to do.
const RESTING: u8 = u8::MAX;

/// How long each duty has been silent.
#[derive(Debug)]
pub struct Duties {
    /// Ticks since it checked in, by [`Duty::ALL`].
    silence: [AtomicU8; Duty::ALL.len()],
}

impl Duties {
    /// All rest.
    pub const fn new() -> Duties {
        Duties { silence: [const { AtomicU8::new(RESTING) }; Duty::ALL.len()] }
    }

    /// The duty goes on. From here on it is expected to.
    pub fn check_in(&self, duty: Duty) {
        self.set(duty, 0);
    }

    /// The duty has nothing to do until it checks in again.
    pub fn rest(&self, duty: Duty) {
        self.set(duty, RESTING);
    }

    fn set(&self, duty: Duty, ticks: u8) {
        for (silence, other) in self.silence.iter().zip(Duty::ALL) {
            if other == duty {
                silence.store(ticks, Ordering::Relaxed);
            }
        }
    }

    /// Lets [`TICK_MS`] pass; names the first duty that has been silent for too long. For one context only, which nobody
    /// who checks in interrupts.
    pub fn tick(&self) -> Option<Duty> {
        let stalled = self.stalled();
        for silence in &self.silence {
            let ticks = silence.load(Ordering::Relaxed);
            if ticks < RESTING {
                // Every deadline is below the last number before `RESTING`.
                silence.store(ticks.saturating_add(1).min(RESTING.saturating_sub(1)), Ordering::Relaxed);
            }
        }
        stalled
    }

    /// The first duty that has been silent for too long.
    pub fn stalled(&self) -> Option<Duty> {
        self.silence.iter().zip(Duty::ALL).find_map(|(silence, duty)| {
            let ticks = silence.load(Ordering::Relaxed);
            (ticks != RESTING && ticks >= duty.most_ticks()).then_some(duty)
        })
    }
}

impl Default for Duties {
    fn default() -> Duties {
        Duties::new()
    }
}
