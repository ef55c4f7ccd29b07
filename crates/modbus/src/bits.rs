//! The bits of the map's status words. Those of the gateway as a whole are the gateway's own.

/// The bits of a slot's *flags*.
pub mod slot_bits {
    /// The value is the previous one, read again: the sensor had no new one.
    pub const REPEATED: u16 = 1 << 0;
    /// The value waits for a second reading before it is published.
    pub const UNCONFIRMED: u16 = 1 << 1;
    /// A second source of the angle disagrees with it.
    pub const CROSS_CHECK: u16 = 1 << 2;
    /// The slot is asked less often because it does not answer.
    pub const QUARANTINE: u16 = 1 << 3;
    /// The accelerations of a T7 do not add up to 1 g.
    pub const GRAVITY: u16 = 1 << 4;
    /// More than one request in 200 fails: checksums of eight bits are not reliable.
    pub const NOISY: u16 = 1 << 5;
    /// The bits with names and meanings, for the documentation.
    pub const ALL: [(u16, &str, &str); 6] = [
        (REPEATED, "repeated", "the value is the previous one, read again: the sensor had no new one"),
        (UNCONFIRMED, "unconfirmed", "the value waits for a second reading before it is published"),
        (CROSS_CHECK, "cross_check", "a second source of the angle disagrees with it"),
        (QUARANTINE, "quarantine", "the slot is asked less often because it does not answer"),
        (GRAVITY, "gravity", "the accelerations of a T7 do not add up to 1 g"),
        (NOISY, "noisy", "more than one request in 200 fails: checksums of eight bits are not reliable"),
    ];
}
