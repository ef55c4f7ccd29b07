//! A gateway as it is written, and what it means.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::fault::Fault;
use super::{Bus, Endpoint, Gateway, MODBUS_EVERY_MS, Make, Modbus, ModbusEndpoint, Name, Parity, Source};

/// A gateway as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GatewayTable {
    pub name: Spanned<Name>,
    console: Option<Spanned<Endpoint>>,
    modbus: Option<Spanned<ModbusEndpoint>>,
    unit: Option<Spanned<u8>>,
    parity: Option<Spanned<Parity>>,
    every_ms: Option<Spanned<u32>>,
    bus: Option<Spanned<Make>>,
    port: Option<Spanned<String>>,
    addresses: Option<Spanned<Vec<u8>>>,
    baud: Option<Spanned<u32>>,
    #[serde(default)]
    sensors: BTreeMap<Spanned<String>, String>,
}

/// Slots of a gateway.
const SLOTS: u16 = clino_gateway::MAX_SLOTS as u16;
const MODBUS_UNITS: RangeInclusive<u8> = 1..=247;
/// The gateway's own ages reach as far as a u16 of milliseconds: a slower reader could miss that a value is new.
const EVERY_MS: RangeInclusive<u32> = 10..=60_000;
/// Bit rates of the sensors as they leave the factory.
const T7_BAUD: u32 = 115_200;
const ISU_BAUD: u32 = 9_600;

/// What a table means.
///
/// # Errors
/// Keys that do not go with each other, values out of range.
pub fn read(table: Spanned<GatewayTable>) -> Result<Gateway, Fault> {
    let place = Spanned::new(table.span(), ());
    let mut table = table.into_inner();
    let mut sensors = BTreeMap::new();
    for (slot, name) in std::mem::take(&mut table.sensors) {
        let number = slot.get_ref().parse().ok().filter(|number| *number < SLOTS);
        let number = number.ok_or_else(|| {
            let why = format!("`{}` in `sensors`, expected a slot from 0 to {}", slot.get_ref(), SLOTS - 1);
            Fault::at(&slot, why)
        })?;
        sensors.insert(number, name);
    }
    let name = table.name.get_ref().clone();
    let source = match (&table.console, &table.modbus, &table.bus) {
        (Some(console), None, None) => {
            table.refuse(&["unit", "parity", "every_ms", "port", "addresses", "baud"], "console")?;
            Source::Console(console.get_ref().clone())
        }
        (None, Some(port), None) => {
            table.refuse(&["port", "addresses"], "modbus")?;
            Source::Modbus(table.modbus(port.get_ref())?)
        }
        (None, None, Some(make)) => {
            table.refuse(&["unit", "parity", "every_ms"], "bus")?;
            Source::Bus(table.bus(make)?)
        }
        (None, None, None) => {
            return Err(Fault::at(&place, "a gateway needs one of `console`, `modbus`, `bus`"));
        }
        _ => return Err(Fault::at(&place, "a gateway has only one of `console`, `modbus`, `bus`")),
    };
    Ok(Gateway { name, source, sensors })
}

/// A value that may be left out, or the usual one.
fn or<T: Clone>(value: &Option<Spanned<T>>, usual: T) -> T {
    value.as_ref().map_or(usual, |value| value.get_ref().clone())
}

impl GatewayTable {
    /// Refuses keys that another one makes meaningless.
    fn refuse(&self, keys: &[&str], with: &str) -> Result<(), Fault> {
        fn place<T>(value: &Option<Spanned<T>>) -> Option<Spanned<()>> {
            value.as_ref().map(|value| Spanned::new(value.span(), ()))
        }
        let written = [
            ("unit", place(&self.unit)),
            ("parity", place(&self.parity)),
            ("every_ms", place(&self.every_ms)),
            ("port", place(&self.port)),
            ("addresses", place(&self.addresses)),
            ("baud", place(&self.baud)),
        ];
        for (key, place) in written {
            if let Some(place) = place.filter(|_| keys.contains(&key)) {
                return Err(Fault::at(&place, format!("`{key}` does not go with `{with}`")));
            }
        }
        Ok(())
    }

    fn modbus(&self, port: &ModbusEndpoint) -> Result<Modbus, Fault> {
        let usual = Modbus::at(port.clone());
        if let Some(unit) = self.unit.as_ref().filter(|unit| !MODBUS_UNITS.contains(unit.get_ref())) {
            return Err(Fault::at(unit, format!("`unit` is {}, expected 1 to 247", unit.get_ref())));
        }
        if let Some(every) = self.every_ms.as_ref().filter(|every| !EVERY_MS.contains(every.get_ref())) {
            let (least, most) = (EVERY_MS.start(), EVERY_MS.end());
            let why = format!("`every_ms` is {}, expected {least} to {most}", every.get_ref());
            return Err(Fault::at(every, why));
        }
        Ok(Modbus {
            unit: or(&self.unit, usual.unit),
            baud: or(&self.baud, usual.baud),
            parity: or(&self.parity, usual.parity),
            every: Duration::from_millis(or(&self.every_ms, MODBUS_EVERY_MS).into()),
            ..usual
        })
    }

    fn bus(&self, make: &Spanned<Make>) -> Result<Bus, Fault> {
        let needs = |key: &str| Fault::at(make, format!("`bus` needs `{key}`"));
        let port = self.port.as_ref().ok_or_else(|| needs("port"))?;
        let addresses = self.addresses.as_ref().ok_or_else(|| needs("addresses"))?;
        let make = *make.get_ref();
        let (is_valid, expected): (fn(&u8) -> bool, _) = match make {
            Make::T7 => (|address| matches!(address, 1..=100 | 127), "1 to 100, or 127"),
            Make::Isu => (|address| matches!(address, 1..=14), "1 to 14"),
        };
        let count = addresses.get_ref().len();
        if count == 0 || count > usize::from(SLOTS) {
            return Err(Fault::at(addresses, format!("{count} `addresses`, expected 1 to {SLOTS}")));
        }
        if let Some(address) = addresses.get_ref().iter().find(|address| !is_valid(address)) {
            return Err(Fault::at(addresses, format!("`addresses` has {address}, expected {expected}")));
        }
        Ok(Bus {
            make,
            port: port.get_ref().clone(),
            addresses: addresses.get_ref().clone(),
            baud: or(&self.baud, if make == Make::T7 { T7_BAUD } else { ISU_BAUD }),
        })
    }
}
