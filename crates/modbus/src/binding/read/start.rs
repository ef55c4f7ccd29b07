//! How the gateway has started, as the map tells it.

use clino_recovery::{Crash, Start, StartCause};

use crate::map::StartItem;

/// A number of the start; `None` if there was no crash, or if that is not known of it.
pub fn number(start: &Start, item: StartItem, index: usize) -> Option<u32> {
    match item {
        StartItem::Cause => Some(start.cause as u32),
        StartItem::Mode => Some(start.mode as u32),
        StartItem::Clock => Some(start.clock as u32),
        StartItem::PowerUps => Some(start.power_ups),
        StartItem::Boots => Some(start.boots),
        StartItem::Crashes => Some(start.crashes),
        StartItem::Uid => start.uid.0.get(index).copied(),
        StartItem::File => Some(start.crash.map_or(0, |crash| characters(&crash, index))),
        _ => of_crash(start.crash.as_ref()?, item),
    }
}

fn of_crash(crash: &Crash, item: StartItem) -> Option<u32> {
    let fault = Some(crash.fault).filter(|fault| fault.is_fault());
    Some(match item {
        StartItem::CrashCause => crash.cause as u32,
        StartItem::CrashBoot => crash.boot,
        StartItem::CrashUptime => crash.uptime_ms,
        StartItem::CrashDetail => {
            return Some(crash.detail)
                .filter(|_| matches!(crash.cause, StartCause::Stalled | StartCause::Panic));
        }
        StartItem::Exception => crash.registers?.exception.into(),
        StartItem::Pc => crash.registers?.pc,
        StartItem::Lr => crash.registers?.lr,
        StartItem::Sp => crash.registers?.sp,
        StartItem::Cfsr => fault?.cfsr,
        StartItem::Hfsr => fault?.hfsr,
        StartItem::Address => return fault?.known_address(),
        _ => return None,
    })
}

/// Two characters of the name of the file, the first in the high byte; zeros behind its end.
fn characters(crash: &Crash, index: usize) -> u32 {
    let name = crash.file().unwrap_or_default().as_bytes();
    let at = |place: usize| name.get(place).copied().unwrap_or(0);
    let first = index.wrapping_mul(2);
    u32::from(u16::from_be_bytes([at(first), at(first.wrapping_add(1))]))
}
