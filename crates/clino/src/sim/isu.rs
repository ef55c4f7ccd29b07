//! A simulated ISU as the command line describes it.

use clino_segment::chance::{Chance, Topic};
use clino_segment::{Faults, Station};
use clino_sim::isu::{ChecksumScope, Content, Eeprom, Options, RxLow, location};
use clino_sim::node::{Node, Ns};

use super::value::{self, Every, of_key};
use crate::number::within;

/// Addresses of modules on a shared bus. Source: AN #201 §4.
const ADDRESSES: core::ops::RangeInclusive<u8> = 1..=14;
/// Longest latency; the document knows no limit, but the master has to: its own timeout for commands is as long.
const LONGEST_LATENCY: Ns = 400_000_000;
/// A bit of the stored checksum.
const CHECKSUM_BIT: u16 = 1;

/// What is known of an ISU before its place on the bus is.
#[derive(Clone, Debug)]
pub struct Isu {
    address: u8,
    options: Options,
    fault: Option<Every>,
    prints: bool,
    hard_error: bool,
}

impl Isu {
    /// From `ADDRESS[,KEY=VALUE]…`.
    ///
    /// # Errors
    /// What is wrong, and the limits.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (address, words) = value::words(text);
        let mut isu = Self {
            address: within(address, ADDRESSES).map_err(|limits| format!("address '{address}': {limits}"))?,
            options: Options::default(),
            fault: None,
            prints: false,
            hard_error: false,
        };
        for (key, value) in words {
            isu.set(key, value).map_err(|why| of_key(key, value, &why))?;
        }
        Ok(isu)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "angle" => self.options.motion = value::motion(value)?,
            "latency" => self.options.latency = value::latency(value, LONGEST_LATENCY)?,
            "fault" => self.fault = Some(value::fault(value)?),
            "ascii" => {
                value::nothing(value)?;
                self.prints = true;
            }
            "hard-error" => {
                value::nothing(value)?;
                self.hard_error = true;
            }
            _ => return Err("no such key of an ISU".to_owned()),
        }
        Ok(())
    }

    /// It sends lines and hears nothing.
    pub fn prints(&self) -> bool {
        self.prints
    }

    /// The sensor at its place on the bus, the first being 0.
    pub fn station(&self, place: u32, chance: Chance) -> Station {
        let seed = chance.roll(Topic::Seed, u64::from(place), u64::from(self.address));
        let content = Content { address: self.address, ..Content::default() };
        let mut eeprom = Eeprom::factory(content, ChecksumScope::default(), seed);
        if self.hard_error {
            let word = eeprom.word(location::CHECKSUM);
            eeprom.set_word(location::CHECKSUM, word ^ CHECKSUM_BIT);
        }
        let mut isu = clino_sim::isu::Isu::new(eeprom, Options { seed, ..self.options.clone() });
        isu.faults.every.clone_from(&self.fault);
        let node: Box<dyn Node> = if self.prints { Box::new(RxLow::new(isu)) } else { Box::new(isu) };
        Station { name: format!("isu {}", self.address), node, faults: Faults::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_does_its_part() {
        let isu = Isu::parse("14,angle=90,latency=3ms,fault=silent/2,ascii,hard-error").unwrap();
        assert_eq!((isu.address, isu.prints, isu.hard_error), (14, true, true));
        assert_eq!((isu.options.latency.max, isu.fault.as_ref().map(|fault| fault.0)), (3_000_000, Some(2)));
        assert_eq!(isu.options.motion.at(0), 90_000_000);
        assert_eq!(isu.station(0, Chance::new(0)).name, "isu 14");
    }
}
