//! The report of an operation that changes a setting.

/// The old and the new value of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SettingChange<T> {
    /// It was as wished; nothing was written.
    Unchanged(T),
    /// It was written, and reads back as wished.
    Changed {
        /// As first read.
        from: T,
        /// As read back.
        to: T,
    },
}

/// A change, and what it cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Report<T> {
    /// What became of the setting.
    pub change: SettingChange<T>,
    /// Commands sent that write non-volatile memory, whether or not they arrived.
    pub writes: u8,
}

impl<T: PartialEq> Report<T> {
    pub(crate) fn new(from: T, to: T, writes: u8) -> Self {
        let change =
            if from == to { SettingChange::Unchanged(to) } else { SettingChange::Changed { from, to } };
        Report { change, writes }
    }
}
