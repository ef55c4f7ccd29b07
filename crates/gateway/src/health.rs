//! Signals of a slot beside its value, from the cross-checks of `slot/checks.rs`. They do not change a value's status.

/// Signals of a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Health(u8);

impl Health {
    /// All is well.
    pub const WELL: Health = Health(0);
    /// The PWM output and the serial line of the same ISU say different angles.
    pub const DISAGREES: Health = Health(1 << 0);
    /// The accelerations do not add up to 1 g.
    pub const GRAVITY: Health = Health(1 << 1);
    /// More than one request in 200 fails: too many for 8-bit checksums to be relied upon.
    pub const NOISY: Health = Health(1 << 2);

    const NAMES: [(Health, &'static str); 3] =
        [(Health::DISAGREES, "disagrees"), (Health::GRAVITY, "gravity"), (Health::NOISY, "noisy")];

    /// Whether this signal is among them.
    pub const fn has(self, signal: Health) -> bool {
        self.0 & signal.0 != 0
    }

    /// As bits, in the order of the constants from bit 0.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// From [`Health::bits`]; others fall away.
    pub const fn from_bits(bits: u8) -> Health {
        Health(bits & (Health::DISAGREES.0 | Health::GRAVITY.0 | Health::NOISY.0))
    }

    /// The names used in every text interface.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Health::NAMES.iter().filter(move |(signal, _)| self.has(*signal)).map(|(_, name)| *name)
    }

    pub(crate) fn set(&mut self, signal: Health, on: bool) {
        self.0 = if on { self.0 | signal.0 } else { self.0 & !signal.0 };
    }
}
