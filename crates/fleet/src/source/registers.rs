//! Registers of a gateway. Source: `docs/modbus.md`; the addresses are restated here, the map says that it is the one meant.

use std::sync::Arc;

use crate::hub::Start;

/// The first block: identity of the gateway, layout of the map, state of the gateway as a whole.
pub const GATEWAY: (u16, u16) = (0x0000, 0x20);
/// Angles of slots 0 to 31, then their ages.
pub const FAST: (u16, u16) = (0x0020, 96);
/// Angles of slots 32 to 47, their ages, and the status of all 48.
pub const FAST2: (u16, u16) = (0x0080, 96);
/// Cause, number and mode of the starts, unique number of the chip, number of power-ups.
pub const START: (u16, u16) = (0x0980, 48);
/// "INCL".
const MAGIC: [u16; 2] = [0x494E, 0x434C];
/// The version of the map that is described here.
const MAP_VERSION: u16 = 2;
/// Slots of the first fast block.
const FAST_SLOTS: usize = 32;
/// All slots.
pub const SLOTS: usize = 48;
/// An angle that is not there.
const NO_ANGLE: u32 = 0x8000_0000;
/// An age that is not there, or beyond the range.
const NO_AGE: u16 = 0xFFFF;
/// Names of the status codes, by code.
const STATUSES: [&str; 15] = [
    "never_read",
    "ok",
    "stale",
    "no_answer",
    "bad_answer",
    "device_error",
    "out_of_range",
    "not_sent",
    "no_signal",
    "stuck_low",
    "stuck_high",
    "bad_period",
    "suspect",
    "disabled",
    "config_fault",
];
/// Names of the bits of *gateway status*.
const SIGNALS: [&str; 14] = [
    "t7_bus_dead",
    "isu_bus_dead",
    "driver_forced",
    "unsaved",
    "command",
    "safe_mode",
    "internal_clock",
    "crashed",
    "t7_bus_fault",
    "isu_bus_fault",
    "slot_fault",
    "health",
    "task",
    "alarm",
];
/// Names of the modes of a start, by code.
const MODES: [&str; 3] = ["normal", "safe", "bare"];
/// Names of the causes of a start, by code.
const CAUSES: [&str; 16] = [
    "unknown",
    "power_on",
    "brown_out",
    "pin",
    "software",
    "watchdog",
    "window_watchdog",
    "low_power",
    "stalled",
    "panic",
    "hard_fault",
    "memory_fault",
    "bus_fault",
    "usage_fault",
    "stack_overflow",
    "clock_failed",
];
const KINDS: [&str; 4] = ["off", "t7", "isu", "pwm"];

/// What the first block says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of the firmware.
    pub version: String,
    /// Seconds since reset.
    pub uptime_s: u32,
    /// What the gateway declares of itself.
    pub signals: Vec<Arc<str>>,
    /// A bit for each slot with an alarm that is not quiet.
    pub alarms: u64,
}

/// A value of a slot in the fast blocks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FastValue {
    /// In millidegrees, if there is one.
    pub angle_mdeg: Option<i32>,
    /// In milliseconds, if the gateway tells it.
    pub age_ms: Option<u16>,
}

fn wide(registers: &[u16], at: usize) -> Option<u32> {
    Some(u32::from(*registers.get(at)?) << 16 | u32::from(*registers.get(at + 1)?))
}

/// Reads the first block.
///
/// # Errors
/// It is no clino gateway, or one with another map.
pub fn identity(registers: &[u16]) -> Result<Identity, String> {
    if registers.get(..2) != Some(&MAGIC) {
        return Err(format!(
            "registers 0 and 1 are {:04X?}, expected {MAGIC:04X?}: this is no clino gateway",
            registers.get(..2)
        ));
    }
    let at = |register: usize| registers.get(register).copied().unwrap_or_default();
    if at(2) != MAP_VERSION {
        return Err(format!("the map has version {}, expected {MAP_VERSION}", at(2)));
    }
    let status = at(0x0A);
    let signals = SIGNALS
        .iter()
        .enumerate()
        .filter(|(bit, _)| status >> bit & 1 != 0)
        .map(|(_, name)| Arc::from(*name));
    Ok(Identity {
        version: format!("{}.{}.{}", at(6) >> 8, at(6) & 0xFF, at(7)),
        uptime_s: wide(registers, 8).unwrap_or_default(),
        signals: signals.collect(),
        alarms: u64::from(wide(registers, 0x1C).unwrap_or_default())
            | u64::from(wide(registers, 0x1E).unwrap_or_default()) << 32,
    })
}

/// Reads the block about the start.
pub fn start(registers: &[u16], identity: &Identity) -> Start {
    let number = |at| wide(registers, at).unwrap_or_default();
    let mode = registers.get(1).copied().unwrap_or_default();
    Start {
        version: identity.version.clone(),
        power_ups: number(0x2E),
        boots: number(4),
        // As the console writes it: the highest word first.
        uid: [0x2C, 0x2A, 0x28].map(|at| format!("{:08x}", number(at))).concat(),
        cause: registers
            .first()
            .and_then(|code| CAUSES.get(usize::from(*code)))
            .map_or("unknown", |name| name)
            .into(),
        crashes: number(6),
        mode: MODES.get(usize::from(mode)).map_or_else(|| format!("mode_{mode}"), |name| (*name).to_owned()),
    }
}

/// The name of a status code. An unknown one survives as its number.
pub fn status(code: u16) -> Arc<str> {
    STATUSES.get(usize::from(code)).map_or_else(|| format!("status_{code}").into(), |name| Arc::from(*name))
}

/// The name of a kind of source.
pub fn kind(code: u16) -> Arc<str> {
    KINDS.get(usize::from(code)).map_or_else(|| format!("kind_{code}").into(), |name| Arc::from(*name))
}

/// Angle and age of each slot of the first fast block, or of the second one.
pub fn values(registers: &[u16], is_second: bool) -> Vec<FastValue> {
    let slots = if is_second { SLOTS - FAST_SLOTS } else { FAST_SLOTS };
    let of = |slot: usize| {
        let angle = wide(registers, 2 * slot)?;
        let age = *registers.get(2 * slots + slot)?;
        Some(FastValue {
            angle_mdeg: (angle != NO_ANGLE).then_some(angle.cast_signed()),
            age_ms: (age != NO_AGE).then_some(age),
        })
    };
    (0..slots).map_while(of).collect()
}

/// The status codes of all slots, from the second fast block.
pub fn statuses(registers: &[u16]) -> &[u16] {
    let first = 3 * (SLOTS - FAST_SLOTS);
    registers.get(first..).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gateway_is_known_by_its_magic_and_its_map() {
        let mut block = vec![0; 32];
        assert!(identity(&block).is_err());
        block[..3].copy_from_slice(&[0x494E, 0x434C, 2]);
        block[6] = 0x0001;
        block[0x0A] = 0x2401;
        block[0x1C] = 0x8000;
        block[0x1F] = 0x0001;
        let known = identity(&block).expect("it is one");
        assert_eq!(known.signals, ["t7_bus_dead", "slot_fault", "alarm"].map(Arc::from));
        assert_eq!((known.version.as_str(), known.alarms), ("0.1.0", 1 << 31 | 1 << 32));
        block[2] = 3;
        assert!(identity(&block).is_err());
    }

    #[test]
    fn angles_and_ages_belong_together() {
        let mut block = vec![0; 96];
        (block[2], block[3], block[65]) = (0xFFFF, 0xCFC7, 7);
        (block[4], block[5], block[66]) = (0x8000, 0, 0xFFFF);
        let read = values(&block, false);
        assert_eq!(read.len(), 32);
        assert_eq!(read[1], FastValue { angle_mdeg: Some(-12_345), age_ms: Some(7) });
        assert_eq!(read[2], FastValue { angle_mdeg: None, age_ms: None });
        let mut block = vec![0; 96];
        (block[31], block[47], block[48 + 47]) = (45, 9, 14);
        let read = values(&block, true);
        assert_eq!((read.len(), read[15].angle_mdeg, read[15].age_ms), (16, Some(45), Some(9)));
        assert_eq!(statuses(&block).len(), 48);
        assert_eq!(&*status(statuses(&block)[47]), "config_fault");
        assert_eq!(&*status(99), "status_99");
    }
}
