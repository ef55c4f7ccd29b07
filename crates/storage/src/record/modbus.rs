//! How the Modbus port is written: address, bit rate, parity (0 none, 1 even, 2 odd), stop bits less one.

use clino_modbus::settings::{Parity, Settings, StopBits};

use super::Reject;
use super::bytes::{LONGEST_NUMBER, Reader, Writer};

/// Bytes of the longest port.
pub(crate) const LONGEST: usize = LONGEST_NUMBER.saturating_add(3);

const PARITY: [Parity; 3] = [Parity::None, Parity::Even, Parity::Odd];
const STOP_BITS: [StopBits; 2] = [StopBits::One, StopBits::Two];

pub(crate) fn encode(settings: &Settings, writer: &mut Writer<'_>) {
    writer.byte(settings.address);
    writer.number(settings.baud);
    writer.byte(match settings.parity {
        Parity::None => 0,
        Parity::Even => 1,
        Parity::Odd => 2,
    });
    writer.byte(match settings.stop_bits {
        StopBits::One => 0,
        StopBits::Two => 1,
    });
}

pub(crate) fn decode(reader: &mut Reader<'_>) -> Result<Settings, Reject> {
    Ok(Settings {
        address: reader.byte()?,
        baud: reader.number("bit rate")?,
        parity: reader.choice("parity", &PARITY)?,
        stop_bits: reader.choice("stop bits", &STOP_BITS)?,
        ..Settings::DEFAULT
    })
}
