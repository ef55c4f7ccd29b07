//! The Modbus port's USART and its driver-enable pin: characters in, answers out.
//!
//! The transceiver's receiver is off while its driver is on (one pin is DE and R̅E̅), so nothing of an answer comes back. DE
//! falls in the transmission-complete interrupt of the last character.

use clino_bus::Event;
use clino_codec::character::{Character, LineErrors};
use clino_modbus::settings::{Parity, StopBits};
use clino_modbus::{MAX_FRAME, Settings};
use heapless::Vec;

use super::Lines;
use crate::board::{ModbusDe, ModbusUsart};
use crate::{clock, events, uart};

/// Characters that can wait for the Modbus level: 2.7 ms of them at 115200 bit/s.
const EVENTS: usize = 32;

/// What passes between the interrupt and the Modbus level.
pub struct Queues {
    events: events::Queue<EVENTS>,
    answer: Answer,
}

/// The answer that goes out.
struct Answer {
    frame: Vec<u8, MAX_FRAME>,
    /// Characters of it that are out, or in the USART.
    taken: usize,
}

impl Answer {
    const fn none() -> Answer {
        Answer { frame: Vec::new(), taken: 0 }
    }

    fn next(&mut self) -> Option<u8> {
        let byte = self.frame.get(self.taken).copied()?;
        self.taken = self.taken.saturating_add(1);
        Some(byte)
    }
}

impl Queues {
    pub const fn new() -> Queues {
        Queues { events: events::Queue::new(), answer: Answer::none() }
    }
}

pub struct Port {
    uart: ModbusUsart,
    clock_hz: u32,
    de: ModbusDe,
    events: events::Producer,
    answer: &'static mut Answer,
    /// An event found no room, or an overrun came without a character: the next one carries it.
    overrun: bool,
}

/// Takes over a USART whose clock runs at `clock_hz`.
pub fn start(
    uart: ModbusUsart,
    de: ModbusDe,
    clock_hz: u32,
    settings: &Settings,
    queues: &'static mut Queues,
) -> (Port, Lines) {
    let (event_in, events) = queues.events.split();
    let mut port = Port { uart, clock_hz, de, events: event_in, answer: &mut queues.answer, overrun: false };
    port.set_up(settings);
    (port, Lines { events })
}

impl Port {
    /// Whether an answer is going out.
    pub fn is_driving(&self) -> bool {
        self.de.is_set_high()
    }

    /// Runs the port like this. An answer that is going out is cut short.
    pub fn set_up(&mut self, settings: &Settings) {
        self.de.set_low();
        self.answer.frame.clear();
        let parity = settings.parity != Parity::None;
        let two = settings.stop_bits == StopBits::Two;
        // The word length counts the parity bit (RM0090 section 30.3.7). Switched off before it is changed.
        self.uart.cr1().modify(|_, w| w.ue().clear_bit());
        // SAFETY: 0 is one stop bit, 2 is two (RM0090 section 30.6.5).
        self.uart.cr2().write(|w| unsafe { w.stop().bits(if two { 0b10 } else { 0b00 }) });
        uart::set_divider(&self.uart, uart::divider(self.clock_hz, settings.baud));
        self.uart.cr1().write(|w| {
            w.m().bit(parity).pce().bit(parity).ps().bit(settings.parity == Parity::Odd);
            w.te().set_bit().re().set_bit().rxneie().set_bit().ue().set_bit()
        });
    }

    /// Sends an answer; the one before is out. A copy of it, at once: put into a queue character by character, a long one
    /// took as long as it is to find.
    pub fn send(&mut self, answer: &[u8]) {
        self.answer.taken = 0;
        self.answer.frame.clear();
        // There is room for the longest frame.
        _ = self.answer.frame.extend_from_slice(answer);
        let Some(byte) = self.answer.next() else { return };
        self.de.set_high();
        // Reading the status before writing the data clears the old transmission-complete flag.
        _ = self.uart.sr().read();
        self.write(byte);
        self.uart.cr1().modify(|_, w| w.txeie().set_bit());
    }

    fn write(&self, byte: u8) {
        self.uart.dr().write(|w| w.dr().set(u16::from(byte)));
    }

    /// The USART's interrupt; returns whether there is something for the Modbus level.
    #[must_use]
    pub fn on_interrupt(&mut self) -> bool {
        let mut is_news = false;
        let status = self.uart.sr().read();
        let control = self.uart.cr1().read();
        if control.tcie().bit_is_set() && status.tc().bit_is_set() {
            self.uart.cr1().modify(|_, w| w.tcie().clear_bit());
            self.de.set_low();
            self.report(Event::Released { at: clock::now() });
            is_news = true;
        }
        if control.txeie().bit_is_set() && status.txe().bit_is_set() {
            match self.answer.next() {
                Some(byte) => self.write(byte),
                None => _ = self.uart.cr1().modify(|_, w| w.txeie().clear_bit().tcie().set_bit()),
            }
        }
        let errors = uart::line_errors(&status);
        if status.rxne().bit_is_set() || errors != LineErrors::NONE {
            let byte = self.uart.dr().read().dr().bits() as u8;
            let lost = core::mem::take(&mut self.overrun);
            if !status.rxne().bit_is_set() {
                // The data register was read before the flag came up.
                self.overrun = true;
                return is_news;
            }
            let errors = if lost { errors.union(LineErrors::OVERRUN) } else { errors };
            self.report(Event::Heard { character: Character { byte, errors }, at: clock::now() });
            is_news = true;
        }
        is_news
    }

    fn report(&mut self, event: Event) {
        self.overrun |= !events::put(&mut self.events, event);
    }
}
