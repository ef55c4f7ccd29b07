//! A sensor that has moved to another address is followed there.

use clino_codec::isu::eeprom::Change as Eeprom;
use clino_commissioning::{Change, Report};

use super::Slot;
use crate::task::{News, isu, t7};
use crate::{SlotConfig, Source};

impl Slot {
    /// How the slot is to be set if its sensor is the one that has moved.
    pub fn follow(&self, news: &News) -> Option<SlotConfig> {
        let source = match (*news, self.config.source) {
            (
                News::T7(t7::News::Address(Report { change: Change::Changed { from, to }, .. })),
                Source::T7 { address, axis },
            ) if address == from => Source::T7 { address: to, axis },
            (
                News::Isu(isu::News::Programmed(Report {
                    change:
                        Change::Changed { from: Eeprom::ModuleAddress(from), to: Eeprom::ModuleAddress(to) },
                    ..
                })),
                Source::Isu { address },
            ) if address == from => Source::Isu { address: to },
            _ => return None,
        };
        Some(SlotConfig { source, ..self.config })
    }
}
