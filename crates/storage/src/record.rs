//! The record: the whole configuration in a few hundred bytes.
//!
//! ```text
//! ┌─────────┬──────┬────────────────────────────────────────────────────────┬────────┐
//! │ version │ kind │ T7 bus │ ISU bus │ Modbus │ console │ count │ slots …  │ CRC-32 │
//! └─────────┴──────┴────────────────────────────────────────────────────────┴────────┘
//!   1 byte    1 byte                                                          4 bytes, little-endian, of all before it
//! ```
//!
//! | version | |
//! |---|---|
//! | 1 | without the Modbus port; see `record/old.rs` |
//! | 2 | with it |
//! | 3 | this one: by the tables of settings |
//!
//! The first byte and the last four are there in every version, so that a record of a newer one is known for what it is:
//! [`Reject::Newer`]. Kind 0 is a configuration, kind 1 ends here and stands for the factory's settings.
//!
//! Buses, Modbus port and console are each written as their differences from the usual. A slot is a byte for
//! its kind, a byte for its address if there is a kind, and its differences from the slot of `record/base.rs`.
//!
//! Numbers are LEB128: seven bits a byte, the lowest first, the top bit says that more follow. Nothing is trusted: decoding
//! refuses what [`Order::check`] would refuse.

mod base;
mod bytes;
mod differences;
mod old;
mod slot;
#[cfg(test)]
mod tests;

use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::settings::{self, Shown, Tabled};
use clino_gateway::{Bus, BusSettings, Configuration, MAX_SLOTS, SlotConfig};

use bytes::Reader;
pub(crate) use bytes::{Compare, Fill, Sink, Writer};

/// The version that is written.
pub const VERSION: u8 = 3;
/// The first version, without the Modbus port.
const WITHOUT_MODBUS: u8 = 1;
/// The last version that was not written by the tables.
const WITHOUT_TABLES: u8 = 2;

/// There is a configuration.
const CONFIGURATION: u8 = 0;
/// There is none: the factory's settings are asked for.
const FACTORY: u8 = 1;

/// The buses, as they follow each other.
const BUSES: [Bus; 2] = [Bus::T7, Bus::Isu];

/// Bytes of the checksum.
const CRC: usize = 4;

/// Longest record, in whole words: both buses, the Modbus port, the console and every slot at their longest; version, kind
/// and count.
pub const LONGEST: usize = {
    let slots = slot::LONGEST.saturating_mul(MAX_SLOTS);
    let t7 = differences::longest(&settings::bus::table(Bus::T7));
    let isu = differences::longest(&settings::bus::table(Bus::Isu));
    let port = differences::longest(&settings::port::TABLE);
    let console = differences::longest(&settings::console::TABLE);
    let rest = t7.saturating_add(isu).saturating_add(port).saturating_add(console);
    slots.saturating_add(rest).saturating_add(CRC + 3).next_multiple_of(crate::pages::WORD)
};

/// Why a record is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reject {
    /// It ends too early.
    Short,
    /// This many bytes are left over.
    Surplus(u16),
    /// Its checksum is wrong.
    Checksum {
        /// As stored.
        stored: u32,
        /// Of what is there.
        computed: u32,
    },
    /// A newer firmware wrote it.
    Newer {
        /// Its version.
        version: u8,
    },
    /// Nothing has this code.
    Code {
        /// What was to be read.
        what: &'static str,
        /// What was there.
        code: u8,
    },
    /// A number that does not fit.
    Number {
        /// What was to be read.
        what: &'static str,
    },
    /// A configuration that the gateway would not take.
    Refused(Refusal),
}

/// A part of a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part<'a> {
    /// How a bus runs.
    Bus(Bus, &'a BusSettings),
    /// How the Modbus port runs.
    Modbus(clino_modbus::Settings),
    /// How the console behaves.
    Console(ConsoleSettings),
    /// What a slot reads.
    Slot(u8, &'a SlotConfig),
}

/// What to store.
#[derive(Clone, Copy)]
pub(crate) enum Content<'a> {
    /// A configuration.
    Configuration(&'a dyn Configuration, &'a clino_modbus::Settings),
    /// The factory's settings.
    Factory,
}

/// What was stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A configuration, by this version.
    Configuration(u8),
    /// The factory's settings are asked for.
    Factory,
}

/// Whether the configuration can be carried out.
pub(crate) fn check(
    configuration: &dyn Configuration,
    modbus: &clino_modbus::Settings,
) -> Result<(), Reject> {
    checked(configuration, modbus).map_err(Reject::Refused)
}

fn checked(configuration: &dyn Configuration, modbus: &clino_modbus::Settings) -> Result<(), Refusal> {
    for bus in BUSES {
        bus_order(bus, &configuration.bus(bus))?;
    }
    settings::port::check(modbus)?;
    settings::console::check(&configuration.console())?;
    slots(configuration).try_for_each(settings::slot::check)
}

/// All slots of a record.
fn slots(configuration: &dyn Configuration) -> impl Iterator<Item = &SlotConfig> {
    (0..MAX_SLOTS).map(|slot| configuration.slot(slot).unwrap_or(&SlotConfig::OFF))
}

fn bus_order(bus: Bus, settings: &BusSettings) -> Result<(), Refusal> {
    Order::Bus { bus, change: settings.into() }.check()
}

/// Writes what differs from the usual.
fn plain(of: &dyn Shown, usual: &dyn Shown, writer: &mut Writer<'_>) {
    differences::encode(of, &|place, _| of.value(place) != usual.value(place), writer);
}

/// Writes the record. What [`check`] finds nothing wrong with can be read again.
pub(crate) fn encode(content: Content<'_>, sink: &mut dyn Sink) {
    let mut writer = Writer::new(sink);
    writer.byte(VERSION);
    match content {
        Content::Factory => writer.byte(FACTORY),
        Content::Configuration(configuration, modbus) => {
            writer.byte(CONFIGURATION);
            for bus in BUSES {
                let settings = &configuration.bus(bus);
                let first = &BusSettings::first(bus);
                let usual = &BusSettings::usual(bus, settings.timing.serial.baud);
                // The bit rate is a difference from the first one; the rest from what is usual at the bit rate.
                let by_table = |settings| Tabled::new(settings::bus::settings(bus), settings);
                let (of, first, usual) = (by_table(settings), by_table(first), by_table(usual));
                let differs = |place, id| {
                    let from = if id == settings::bus::id::BAUD { &first } else { &usual };
                    of.value(place) != from.value(place)
                };
                differences::encode(&of, &differs, &mut writer);
            }
            let port = |settings| Tabled::new(&settings::port::SETTINGS, settings);
            plain(&port(modbus), &port(&clino_modbus::Settings::DEFAULT), &mut writer);
            let console = |settings| Tabled::new(&settings::console::SETTINGS, settings);
            plain(&console(&configuration.console()), &console(&ConsoleSettings::DEFAULT), &mut writer);
            writer.byte(MAX_SLOTS as u8);
            slots(configuration).for_each(|config| slot::encode(config, &mut writer));
        }
    }
    writer.finish();
}

/// Reads the record, part by part. After an error the parts seen so far are worth nothing: read it once without taking
/// them.
pub(crate) fn decode(record: &[u8], take: &mut dyn FnMut(Part<'_>)) -> Result<Kind, Reject> {
    let (bytes, stored) = record.split_last_chunk::<CRC>().ok_or(Reject::Short)?;
    let (stored, computed) = (u32::from_le_bytes(*stored), bytes::CHECKSUM.checksum(bytes));
    if stored != computed {
        return Err(Reject::Checksum { stored, computed });
    }
    let reader = &mut Reader::new(bytes);
    content(reader, take).ok_or_else(|| reader.reject())
}

fn content(reader: &mut Reader<'_>, take: &mut dyn FnMut(Part<'_>)) -> Option<Kind> {
    let version = reader.byte()?;
    if version > VERSION {
        return reader.refuse(Reject::Newer { version });
    }
    if version < WITHOUT_MODBUS {
        return reader.refuse(Reject::Code { what: "version", code: version });
    }
    let kind = match reader.byte()? {
        CONFIGURATION => {
            parts(version, reader, take)?;
            Kind::Configuration(version)
        }
        FACTORY => Kind::Factory,
        code => return reader.refuse(Reject::Code { what: "kind", code }),
    };
    reader.end()?;
    Some(kind)
}

fn parts(version: u8, reader: &mut Reader<'_>, take: &mut dyn FnMut(Part<'_>)) -> Option<()> {
    let is_old = version <= WITHOUT_TABLES;
    for bus in BUSES {
        let settings = match is_old {
            true => old::bus(bus, reader)?,
            false => {
                let mut settings = BusSettings::first(bus);
                differences::decode(&mut Tabled::new(settings::bus::settings(bus), &mut settings), reader)?;
                settings
            }
        };
        reader.accepted(bus_order(bus, &settings))?;
        take(Part::Bus(bus, &settings));
    }
    let mut modbus = clino_modbus::Settings::DEFAULT;
    match version {
        // Before it was a setting, the port ran like this.
        WITHOUT_MODBUS => {}
        WITHOUT_TABLES => modbus = old::port(reader)?,
        _ => differences::decode(&mut Tabled::new(&settings::port::SETTINGS, &mut modbus), reader)?,
    }
    reader.accepted(settings::port::check(&modbus))?;
    take(Part::Modbus(modbus));
    let mut console = ConsoleSettings::DEFAULT;
    if !is_old {
        differences::decode(&mut Tabled::new(&settings::console::SETTINGS, &mut console), reader)?;
    }
    take(Part::Console(console));
    let count = reader.byte()?;
    if usize::from(count) > MAX_SLOTS {
        return reader.refuse(Reject::Code { what: "slots", code: count });
    }
    for slot in 0..MAX_SLOTS as u8 {
        // A record of a gateway with fewer slots says nothing of the others.
        let config = match (slot < count, is_old) {
            (false, _) => SlotConfig::OFF,
            (true, true) => old::slot(reader)?,
            (true, false) => slot::decode(reader)?,
        };
        reader.accepted(settings::slot::check(&config))?;
        take(Part::Slot(slot, &config));
    }
    Some(())
}
