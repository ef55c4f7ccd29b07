//! What the tests share besides the examples' board: lines on it, and figures from its log.
#![allow(dead_code, reason = "each test uses a part")]

use clino_drivers::codec::t7::Address;
use clino_drivers::rs485::{PortSettings, Rs485};
use clino_drivers::uart::{Io, Nb};
use clino_drivers::{Serial, Timing, UsDigitalT7};
use clino_segment::log::{Fate, LineEvent, Talker};
use clino_sim::node::Ns;

use crate::common::{Board, De, Delay, Uart};

pub const US: Ns = 1_000;
pub const MS: Ns = 1_000_000;

/// The factory's bit rate.
pub const SERIAL: Serial = Serial { baud: 115_200 };
/// A character at 115200 bit/s, rounded up.
pub const CHARACTER: Ns = 86_806;

pub type NbLine = Rs485<Nb<Uart>, De, Delay>;
pub type IoLine = Rs485<Io<Uart>, De, Delay>;

pub fn nb_line(board: &Board, settings: PortSettings) -> NbLine {
    Rs485::new(Nb::new(board.uart()), board.de(), board.delay(), settings)
}

pub fn io_line(board: &Board, settings: PortSettings) -> IoLine {
    Rs485::new(Io::new(board.uart()), board.de(), board.delay(), settings)
}

/// A driver over `nb` with everything as usual.
pub fn nb_t7(board: &Board) -> UsDigitalT7<NbLine> {
    UsDigitalT7::new(nb_line(board, PortSettings::new(SERIAL)), Timing::t7(SERIAL))
}

pub fn address(number: u8) -> Address {
    Address::new(number).unwrap()
}

/// What the wire says about the driver-enable pin.
#[derive(Debug)]
pub struct Turns {
    /// The characters that the master's UART sent, with what became of them.
    pub sent: Vec<(u8, Fate)>,
    /// Times that DE was raised.
    pub count: usize,
    /// DE high to the first start bit: the shortest and the longest.
    pub lead: (Ns, Ns),
    /// Last stop bit to DE low: the shortest and the longest.
    pub hold: (Ns, Ns),
    /// How it is at the end.
    pub high: bool,
}

impl Turns {
    pub fn all_clean(&self) -> bool {
        self.sent.iter().all(|&(_, fate)| fate == Fate::Clean)
    }

    pub fn bytes(&self) -> Vec<u8> {
        self.sent.iter().map(|&(byte, _)| byte).collect()
    }
}

/// Reads them off the log. Turns in which no character ended count for the number of turns only.
pub fn turns(board: &Board) -> Turns {
    let log = board.log();
    let log = log.lock().unwrap();
    let mut turns = Turns { sent: Vec::new(), count: 0, lead: (Ns::MAX, 0), hold: (Ns::MAX, 0), high: false };
    let mut characters: Vec<(Ns, Ns)> = Vec::new();
    let mut edges: Vec<(Ns, bool)> = Vec::new();
    for event in &log.events {
        match *event {
            LineEvent::Char { who: Talker::Gateway, start, end, word, fate, .. } => {
                turns.sent.push((word as u8, fate));
                characters.push((start, end));
            }
            LineEvent::De { at, high } => edges.push((at, high)),
            _ => {}
        }
    }
    turns.high = edges.last().is_some_and(|&(_, high)| high);
    turns.count = edges.iter().filter(|&&(_, high)| high).count();
    for pair in edges.windows(2) {
        let &[(up, true), (down, false)] = pair else { continue };
        let inside: Vec<_> = characters.iter().filter(|&&(start, _)| (up..down).contains(&start)).collect();
        if let (Some(&&(start, _)), Some(&&(_, end))) = (inside.first(), inside.last()) {
            let widen = |(least, most): (Ns, Ns), value: Ns| (least.min(value), most.max(value));
            turns.lead = widen(turns.lead, start - up);
            turns.hold = widen(turns.hold, down.saturating_sub(end));
        }
    }
    turns
}
