//! Registers of a gateway, by the map's version of `clino_modbus` and with the gateway's own names. Source: `docs/modbus.md`.
//!
//! A code or bit without a name survives as its number.

use std::sync::Arc;

use clino_codec::angle::Angle;
use clino_gateway::config::Kind;
use clino_gateway::summary::Signals;
use clino_gateway::{MAX_SLOTS, Status};
use clino_modbus::map::{MAGIC, VERSION};
use clino_recovery::{Mode, StartCause};

use crate::hub::Start;
use crate::sensor::TURN_MDEG;

/// The first block: identity of the gateway, layout of the map, state of the gateway as a whole.
pub const GATEWAY: (u16, u16) = (0x0000, 0x20);
/// Angles of slots 0 to 31, then their ages.
pub const FAST: (u16, u16) = (0x0020, 96);
/// Angles of slots 32 to 47, their ages, and the status of all 48.
pub const FAST2: (u16, u16) = (0x0080, 96);
/// Cause, number and mode of the starts, unique number of the chip, number of power-ups.
pub const START: (u16, u16) = (0x0980, 48);
/// Slots of the first fast block.
const FAST_SLOTS: usize = 32;
/// An age that is not there, or beyond the range.
const NO_AGE: u16 = 0xFFFF;

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
    /// If there is one.
    pub angle: Option<Angle>,
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
    let magic = wide(registers, 0);
    if magic != Some(MAGIC) {
        return Err(format!(
            "registers 0 and 1 are {magic:08X?}, expected {MAGIC:08X}: this is no clino gateway"
        ));
    }
    let at = |register: usize| registers.get(register).copied().unwrap_or_default();
    if at(2) != VERSION {
        return Err(format!("the map has version {}, expected {VERSION}", at(2)));
    }
    let status = at(0x0A);
    let signals = (0..u16::BITS)
        .filter(|bit| status >> bit & 1 != 0)
        .map(|bit| named("signal", bit, Signals::ALL.get(bit as usize).map(|(_, name, _)| *name)));
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
    let code = |at: usize| registers.get(at).copied().unwrap_or_default();
    Start {
        version: identity.version.clone(),
        power_ups: number(0x2E),
        boots: number(4),
        // As the console writes it: the highest word first.
        uid: [0x2C, 0x2A, 0x28].map(|at| format!("{:08x}", number(at))).concat(),
        cause: named("cause", code(0), StartCause::ALL.get(usize::from(code(0))).map(|(_, name, _)| *name))
            .as_ref()
            .into(),
        crashes: number(6),
        mode: named("mode", code(1), Mode::ALL.get(usize::from(code(1))).map(|(mode, _)| mode.name()))
            .as_ref()
            .into(),
    }
}

fn named(what: &str, code: impl std::fmt::Display, name: Option<&str>) -> Arc<str> {
    name.map_or_else(|| format!("{what}_{code}").into(), Arc::from)
}

/// The name of a status code.
pub fn status(code: u16) -> Arc<str> {
    let known = Status::ALL.into_iter().find(|status| u16::from(status.code()) == code);
    named("status", code, known.map(Status::name))
}

/// The name of a kind of source.
pub fn kind(code: u16) -> Arc<str> {
    named("kind", code, u8::try_from(code).ok().and_then(Kind::from_code).map(Kind::name))
}

/// Angle and age of each slot of the first fast block, or of the second one.
pub fn values(registers: &[u16], is_second: bool) -> Vec<FastValue> {
    let slots = if is_second { MAX_SLOTS - FAST_SLOTS } else { FAST_SLOTS };
    let of = |slot: usize| {
        let mdeg = wide(registers, 2 * slot)?.cast_signed();
        let age = *registers.get(2 * slots + slot)?;
        Some(FastValue {
            // What stands for "none" is beyond a turn, and so would be an answer that was altered.
            angle: Angle::from_mdeg(mdeg).filter(|_| mdeg.unsigned_abs() < TURN_MDEG.unsigned_abs()),
            age_ms: (age != NO_AGE).then_some(age),
        })
    };
    (0..slots).map_while(of).collect()
}

/// The status codes of all slots, from the second fast block.
pub fn statuses(registers: &[u16]) -> &[u16] {
    let first = 3 * (MAX_SLOTS - FAST_SLOTS);
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
        // 360.000°, which no gateway publishes.
        (block[6], block[7], block[67]) = (0x0005, 0x7E40, 7);
        let read = values(&block, false);
        assert_eq!(read.len(), 32);
        assert_eq!(read[1], FastValue { angle: Angle::from_mdeg(-12_345), age_ms: Some(7) });
        assert_eq!(read[2], FastValue { angle: None, age_ms: None });
        assert_eq!(read[3], FastValue { angle: None, age_ms: Some(7) });
        let mut block = vec![0; 96];
        (block[31], block[47], block[48 + 47]) = (45, 9, 14);
        let read = values(&block, true);
        assert_eq!((read.len(), read[15].angle, read[15].age_ms), (16, Angle::from_mdeg(45), Some(9)));
        assert_eq!(statuses(&block).len(), 48);
        assert_eq!(&*status(statuses(&block)[47]), "config_fault");
        assert_eq!(&*status(99), "status_99");
    }
}
