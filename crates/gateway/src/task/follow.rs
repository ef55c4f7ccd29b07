//! What a task has done to a sensor, the slots that read it take over.
//!
//! A slot follows a sensor that has moved to another address. A sensor that was made to read zero as it stands reads zero in
//! its slots, too: the zero they have subtracted until then goes.

use clino_codec::angle::Angle;
use clino_codec::isu::eeprom::Change as Eeprom;
use clino_commissioning::{Report, SettingChange};

use super::{Claim, TaskEvent, isu, t7};
use crate::{SlotConfig, Source};

/// How a slot is to be set after a task that has ended like this, if otherwise than now.
pub(crate) fn followed(config: &SlotConfig, claim: Claim, news: &TaskEvent) -> Option<SlotConfig> {
    let source = match (*news, config.source) {
        (
            TaskEvent::T7(t7::TaskEvent::Address(Report {
                change: SettingChange::Changed { from, to }, ..
            })),
            Source::T7 { address, axis },
        ) if address == from => Source::T7 { address: to, axis },
        (
            TaskEvent::Isu(isu::TaskEvent::Programmed(Report {
                change:
                    SettingChange::Changed { from: Eeprom::ModuleAddress(from), to: Eeprom::ModuleAddress(to) },
                ..
            })),
            Source::Isu { address },
        ) if address == from => Source::Isu { address: to },
        (TaskEvent::T7(t7::TaskEvent::Zeroed(_)) | TaskEvent::Isu(isu::TaskEvent::Nulled(_)), source)
            if claim == Claim::Zero(source) && config.soft_zero != Angle::ZERO =>
        {
            return Some(SlotConfig { soft_zero: Angle::ZERO, ..*config });
        }
        _ => return None,
    };
    Some(SlotConfig { source, ..*config })
}
