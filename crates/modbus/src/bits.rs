//! The bits of the map's status words.

/// The bits of *gateway_status*.
pub mod gateway_bits {
    /// No enabled slot of the T7 bus answers.
    pub const T7_BUS_DEAD: u16 = 1 << 0;
    /// No enabled slot of the ISU bus answers.
    pub const ISU_BUS_DEAD: u16 = 1 << 1;
    /// A line driver had to be switched off by force since reset.
    pub const DRIVER_FORCED: u16 = 1 << 2;
    /// The configuration in force is not the one that is stored.
    pub const UNSAVED: u16 = 1 << 3;
    /// A command is under way.
    pub const COMMAND: u16 = 1 << 4;
    /// Safe mode: no bus is served.
    pub const SAFE_MODE: u16 = 1 << 5;
    /// Time and bit rates come from the internal oscillator.
    pub const INTERNAL_CLOCK: u16 = 1 << 6;
    /// The time before ended in a crash.
    pub const CRASHED: u16 = 1 << 7;
    /// The bits with names and meanings, for the documentation.
    pub const ALL: [(u16, &str, &str); 8] = [
        (T7_BUS_DEAD, "t7_bus_dead", "no enabled slot of the T7 bus answers"),
        (ISU_BUS_DEAD, "isu_bus_dead", "no enabled slot of the ISU bus answers"),
        (DRIVER_FORCED, "driver_forced", "a line driver had to be switched off by force since reset"),
        (UNSAVED, "unsaved", "the configuration in force is not the one that is stored"),
        (COMMAND, "command", "a command is under way"),
        (SAFE_MODE, "safe_mode", "safe mode: no bus is served; see *start_mode*"),
        (
            INTERNAL_CLOCK,
            "internal_clock",
            "time and bit rates come from the internal oscillator, up to 8 % off",
        ),
        (CRASHED, "crashed", "the time before ended in a crash; see *start_cause*"),
    ];
}

/// The bits of a slot's *flags*.
pub mod slot_bits {
    /// The value is the one before, read again: the sensor had no new one.
    pub const REPEATED: u16 = 1 << 0;
    /// A second reading is awaited before the value is published.
    pub const UNCONFIRMED: u16 = 1 << 1;
    /// A second way to know the angle disagrees with it.
    pub const CROSS_CHECK: u16 = 1 << 2;
    /// The slot is asked less often because it does not answer.
    pub const QUARANTINE: u16 = 1 << 3;
    /// The accelerations of a T7 do not add up to 1 g.
    pub const GRAVITY: u16 = 1 << 4;
    /// So many requests fail that checksums of eight bits are not to be relied upon.
    pub const NOISY: u16 = 1 << 5;
    /// The bits with names and meanings, for the documentation.
    pub const ALL: [(u16, &str, &str); 6] = [
        (REPEATED, "repeated", "the value is the one before, read again: the sensor had no new one"),
        (UNCONFIRMED, "unconfirmed", "a second reading is awaited before the value is published"),
        (CROSS_CHECK, "cross_check", "a second way to know the angle disagrees with it"),
        (QUARANTINE, "quarantine", "the slot is asked less often because it does not answer"),
        (GRAVITY, "gravity", "the accelerations of a T7 do not add up to 1 g"),
        (
            NOISY,
            "noisy",
            "more than one request in 200 fails: checksums of eight bits are not to be relied upon",
        ),
    ];
}
