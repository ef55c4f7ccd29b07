//! Why the gateway has started. The numbers are told upstream: they never change their meaning.

/// What the reset controller says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The power came.
    PowerOn,
    /// It was too low for a while.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The program asked for it.
    Software,
    /// The independent watchdog.
    Watchdog,
    /// The window watchdog.
    WindowWatchdog,
    /// Low-power management.
    LowPower,
    /// Nothing.
    Unknown,
}

/// What ended the time before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Cause {
    /// Nobody says.
    #[default]
    Unknown = 0,
    /// The power came.
    PowerOn = 1,
    /// The supply was too low for a while.
    BrownOut = 2,
    /// The reset pin.
    Pin = 3,
    /// Somebody has asked for it, at the console or from safe mode.
    Software = 4,
    /// The watchdog was not fed, and nobody could say why: interrupts were held off, or the core was locked up.
    Watchdog = 5,
    /// The window watchdog, which this firmware does not use.
    WindowWatchdog = 6,
    /// Low-power management, which it does not use either.
    LowPower = 7,
    /// A monitored task has not checked in.
    Stalled = 8,
    /// The program has found itself to be wrong.
    Panic = 9,
    /// A fault of no particular kind.
    HardFault = 10,
    /// An access that is not allowed.
    MemoryFault = 11,
    /// An access to nothing.
    BusFault = 12,
    /// An instruction that is none.
    UsageFault = 13,
    /// The stack ran out of its memory.
    StackOverflow = 14,
    /// The crystal has stopped.
    ClockFailed = 15,
}

impl Cause {
    /// All of them, by number, with their names and meanings.
    pub const ALL: [(Cause, &'static str, &'static str); 16] = [
        (Cause::Unknown, "unknown", "not known"),
        (Cause::PowerOn, "power_on", "the power came"),
        (Cause::BrownOut, "brown_out", "the supply was too low for a while"),
        (Cause::Pin, "pin", "the reset pin"),
        (Cause::Software, "software", "it was ordered, or safe mode has ended"),
        (Cause::Watchdog, "watchdog", "the watchdog was not fed; the cause was not recorded"),
        (Cause::WindowWatchdog, "window_watchdog", "the window watchdog, which is not used"),
        (Cause::LowPower, "low_power", "low-power management, which is not used"),
        (Cause::Stalled, "stalled", "a monitored task has not checked in"),
        (Cause::Panic, "panic", "the program has found itself to be wrong"),
        (Cause::HardFault, "hard_fault", "a fault of no particular kind"),
        (Cause::MemoryFault, "memory_fault", "an access that is not allowed"),
        (Cause::BusFault, "bus_fault", "an access to nothing"),
        (Cause::UsageFault, "usage_fault", "an instruction that is none"),
        (Cause::StackOverflow, "stack_overflow", "the stack ran out of its memory"),
        (Cause::ClockFailed, "clock_failed", "the crystal has stopped"),
    ];

    /// Its name in JSON and in the documentation.
    pub fn name(self) -> &'static str {
        Cause::ALL.into_iter().find(|(cause, ..)| *cause == self).map_or("unknown", |(_, name, _)| name)
    }

    /// Whether something went wrong with the gateway itself.
    pub const fn is_crash(self) -> bool {
        self as u8 >= Cause::Stalled as u8 || matches!(self, Cause::Watchdog | Cause::WindowWatchdog)
    }

    /// The cause of this number.
    pub fn from_number(number: u8) -> Cause {
        Cause::ALL
            .into_iter()
            .map(|(cause, ..)| cause)
            .find(|cause| *cause as u8 == number)
            .unwrap_or_default()
    }
}

impl From<Reset> for Cause {
    fn from(reset: Reset) -> Cause {
        match reset {
            Reset::PowerOn => Cause::PowerOn,
            Reset::BrownOut => Cause::BrownOut,
            Reset::Pin => Cause::Pin,
            Reset::Software => Cause::Software,
            Reset::Watchdog => Cause::Watchdog,
            Reset::WindowWatchdog => Cause::WindowWatchdog,
            Reset::LowPower => Cause::LowPower,
            Reset::Unknown => Cause::Unknown,
        }
    }
}
