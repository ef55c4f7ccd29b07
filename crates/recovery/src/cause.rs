//! Why the gateway has started. The numbers never change their meaning: Modbus masters read them.

/// What the reset controller says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetSource {
    /// Power-up.
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

/// What ended the previous run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum StartCause {
    /// Not known.
    #[default]
    Unknown = 0,
    /// Power-up.
    PowerOn = 1,
    /// The supply was too low for a while.
    BrownOut = 2,
    /// The reset pin.
    Pin = 3,
    /// Requested, or safe mode has ended.
    Software = 4,
    /// The watchdog was not fed, for a reason not recorded: interrupts were masked, or the core was locked up.
    Watchdog = 5,
    /// The window watchdog, which this firmware does not use.
    WindowWatchdog = 6,
    /// Low-power management, which it does not use either.
    LowPower = 7,
    /// A monitored task has not checked in.
    Stalled = 8,
    /// The program detected an internal error.
    Panic = 9,
    /// A fault without a more specific kind.
    HardFault = 10,
    /// An access that is not allowed.
    MemoryFault = 11,
    /// An access to an address without memory or peripheral.
    BusFault = 12,
    /// An undefined instruction.
    UsageFault = 13,
    /// The stack ran out of its memory.
    StackOverflow = 14,
    /// The crystal has stopped.
    ClockFailed = 15,
}

impl StartCause {
    /// All of them, by number, with their names and meanings.
    pub const ALL: [(StartCause, &'static str, &'static str); 16] = [
        (StartCause::Unknown, "unknown", "not known"),
        (StartCause::PowerOn, "power_on", "power-up"),
        (StartCause::BrownOut, "brown_out", "the supply was too low for a while"),
        (StartCause::Pin, "pin", "the reset pin"),
        (StartCause::Software, "software", "it was ordered, or safe mode has ended"),
        (StartCause::Watchdog, "watchdog", "the watchdog was not fed; the cause was not recorded"),
        (StartCause::WindowWatchdog, "window_watchdog", "the window watchdog, which is not used"),
        (StartCause::LowPower, "low_power", "low-power management, which is not used"),
        (StartCause::Stalled, "stalled", "a monitored task has not checked in"),
        (StartCause::Panic, "panic", "the program detected an internal error"),
        (StartCause::HardFault, "hard_fault", "a fault without a more specific kind"),
        (StartCause::MemoryFault, "memory_fault", "an access that is not allowed"),
        (StartCause::BusFault, "bus_fault", "an access to an address without memory or peripheral"),
        (StartCause::UsageFault, "usage_fault", "an undefined instruction"),
        (StartCause::StackOverflow, "stack_overflow", "the stack ran out of its memory"),
        (StartCause::ClockFailed, "clock_failed", "the crystal has stopped"),
    ];

    /// Its name in JSON and in the documentation.
    pub fn name(self) -> &'static str {
        NAMES.get(self as usize).copied().unwrap_or("unknown")
    }

    /// Whether something went wrong with the gateway itself.
    pub const fn is_crash(self) -> bool {
        self as u8 >= StartCause::Stalled as u8
            || matches!(self, StartCause::Watchdog | StartCause::WindowWatchdog)
    }

    /// The cause of this number.
    pub fn from_number(number: u8) -> StartCause {
        CAUSES.get(usize::from(number)).copied().unwrap_or_default()
    }
}

/// The causes by their numbers, and their names: what they mean is for documents, and not in the image.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
static CAUSES: [StartCause; StartCause::ALL.len()] = {
    let mut causes = [StartCause::Unknown; StartCause::ALL.len()];
    let mut at = 0;
    while at < causes.len() {
        causes[at] = StartCause::ALL[at].0;
        at += 1;
    }
    causes
};
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
static NAMES: [&str; StartCause::ALL.len()] = {
    let mut names = [""; StartCause::ALL.len()];
    let mut at = 0;
    while at < names.len() {
        names[at] = StartCause::ALL[at].1;
        at += 1;
    }
    names
};

impl From<ResetSource> for StartCause {
    fn from(reset: ResetSource) -> StartCause {
        match reset {
            ResetSource::PowerOn => StartCause::PowerOn,
            ResetSource::BrownOut => StartCause::BrownOut,
            ResetSource::Pin => StartCause::Pin,
            ResetSource::Software => StartCause::Software,
            ResetSource::Watchdog => StartCause::Watchdog,
            ResetSource::WindowWatchdog => StartCause::WindowWatchdog,
            ResetSource::LowPower => StartCause::LowPower,
            ResetSource::Unknown => StartCause::Unknown,
        }
    }
}
