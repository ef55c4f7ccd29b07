//! A simulated T7 as the command line describes it.

use clino_segment::chance::{Chance, Topic};
use clino_segment::{Faults, Station};
use clino_sim::t7::{
    BAUD_RATES, DAMPING_MS, DEFAULT_ADDRESS, Damping, Flash, GET_LIMIT, Identity, Model, Options,
    OutputRange, SET_LIMIT, SETTABLE_ADDRESSES, StoredSettings,
};

use super::value::{self, Every, of_key};
use crate::choice::choose;
use crate::number::within;

/// Bit rate as from the factory, in bit/s.
pub const DEFAULT_BAUD: u32 = BAUD_RATES[0];

/// Serial number of the first sensor that is not given one.
const FIRST_SERIAL: u32 = 1_001;

/// What is known of a T7 before its place on the bus is.
#[derive(Clone, Debug)]
pub struct T7 {
    model: Model,
    serial: Option<u32>,
    settings: StoredSettings,
    options: Options,
    fault: Option<Every>,
    flash: Flash,
}

impl T7 {
    /// From `ADDRESS[,KEY=VALUE]…`.
    ///
    /// # Errors
    /// What is wrong, and the limits.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (address, words) = value::words(text);
        let mut t7 = Self {
            model: Model::T71,
            serial: None,
            settings: StoredSettings { address: self::address(address)?, ..StoredSettings::default() },
            options: Options::default(),
            fault: None,
            flash: Flash::default(),
        };
        for (key, value) in words {
            t7.set(key, value).map_err(|why| of_key(key, value, &why))?;
        }
        Ok(t7)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "angle" => self.options.motion.fill(value::motion(value)?),
            "angle0" => self.options.motion[0] = value::motion(value)?,
            "angle1" => self.options.motion[1] = value::motion(value)?,
            "angle2" => self.options.motion[2] = value::motion(value)?,
            "model" => self.model = choose(value, [Model::T71, Model::T73], model)?,
            "serial" => self.serial = Some(within(value, u32::MIN..=u32::MAX)?),
            "baud" => {
                let (index, _) = choose(value, (0..).zip(BAUD_RATES), |(_, rate)| rate)?;
                self.settings.baud_index = index;
            }
            "damping" => {
                self.settings.damping_ms = within(value, DAMPING_MS)?;
                self.options.damping = Damping::Averaged;
            }
            "range" => {
                let ranges = [OutputRange::Bidirectional, OutputRange::Unidirectional];
                self.settings.range = choose(value, ranges, range)?;
            }
            "latency" => self.options.get_latency = value::latency(value, GET_LIMIT)?,
            "set-latency" => self.options.set_latency = value::latency(value, SET_LIMIT)?,
            "length-quirk" => {
                value::nothing(value)?;
                self.options.length_quirk = true;
            }
            "flash" => {
                let failures = [Flash::Fails, Flash::EraseFails, Flash::ProgramFails];
                self.flash = choose(value, failures, flash)?;
            }
            "fault" => self.fault = Some(value::fault(value)?),
            _ => return Err("no such key of a T7".to_owned()),
        }
        Ok(())
    }

    /// The sensor at its place on the bus, the first being 0.
    ///
    /// # Errors
    /// There cannot be such a sensor.
    pub fn station(&self, place: u32, chance: Chance) -> Result<Station, String> {
        let address = self.settings.address;
        let serial = self.serial.unwrap_or(FIRST_SERIAL.saturating_add(place));
        let identity =
            Identity { model: self.model, serial, product: product(self.model), ..Identity::default() };
        let seed = chance.roll(Topic::Seed, u64::from(place), u64::from(address));
        let options = Options { seed, ..self.options.clone() };
        let mut t7 = clino_sim::t7::T7::new(identity, self.settings.clone(), options)
            .map_err(|why| format!("--t7 {address}: {why}"))?;
        t7.faults.every.clone_from(&self.fault);
        t7.flash = self.flash;
        let name = format!("{} {address} (serial {serial})", model(self.model));
        Ok(Station { name, node: Box::new(t7), faults: Faults::default() })
    }
}

fn address(text: &str) -> Result<u8, String> {
    within(text, u8::MIN..=u8::MAX)
        .ok()
        .filter(|address| SETTABLE_ADDRESSES.contains(address) || *address == DEFAULT_ADDRESS)
        .ok_or_else(|| format!("address '{text}': not in 1..=100, nor 127 (factory)"))
}

fn model(model: Model) -> &'static str {
    match model {
        Model::T71 => "t7-1",
        Model::T73 => "t7-3",
    }
}

/// Product type in the device information.
fn product(model: Model) -> [u8; 6] {
    match model {
        Model::T71 => *b"T7-1  ",
        Model::T73 => *b"T7-3  ",
    }
}

fn flash(flash: Flash) -> &'static str {
    match flash {
        Flash::Sound => "sound",
        Flash::Fails => "fails",
        Flash::EraseFails => "erase-fails",
        Flash::ProgramFails => "program-fails",
    }
}

fn range(range: OutputRange) -> &'static str {
    match range {
        OutputRange::Bidirectional => "bidirectional",
        OutputRange::Unidirectional => "unidirectional",
    }
}

#[cfg(test)]
mod tests {
    use clino_sim::motion::Motion;

    use super::*;

    #[test]
    fn every_key_does_its_part() {
        let t7 = T7::parse(
            "100,angle=1,angle1=2,model=t7-3,serial=0x61C9,baud=9600,damping=500,range=unidirectional,\
             latency=1ms,set-latency=5ms..20ms,length-quirk,fault=silent/3",
        )
        .unwrap();
        assert_eq!(t7.options.motion, [1, 2, 1].map(|degrees| Motion::Constant(degrees * 1_000_000)));
        assert_eq!(
            (t7.model, t7.serial, t7.fault.as_ref().map(|fault| fault.0)),
            (Model::T73, Some(25_033), Some(3))
        );
        let settings = &t7.settings;
        assert_eq!((settings.address, settings.baud_index, settings.damping_ms), (100, 4, 500));
        assert_eq!((settings.range, t7.options.damping), (OutputRange::Unidirectional, Damping::Averaged));
        assert_eq!((t7.options.get_latency.max, t7.options.set_latency.min), (1_000_000, 5_000_000));
        assert!(t7.options.length_quirk);
        let station = t7.station(0, Chance::new(0)).unwrap();
        assert_eq!((station.name.as_str(), station.node.baud()), ("t7-3 100 (serial 25033)", 9_600));
    }
}
