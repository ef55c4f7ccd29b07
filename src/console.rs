//! The console's USART: a queue of characters in each direction, moved by its interrupt.
//!
//! Writing waits for room (`foreground.rs`), and only the main loop writes: nothing else depends on it.
//!
//! A terminal is not flow-controlled, and the buses come first: characters that are not fetched in time are lost. A loss keeps
//! its place: the next character that gets into the queue tells how many were lost before it ([`Received::lost`]), whether
//! the queue was full or the receiver overran, as it does while a sector of flash is erased. A character that the receiver
//! complained about goes into the queue with the complaint; the console judges what that means for its line.
//!
//! The port does not receive before the start: a first character that follows it at once may be the rest of a line.

use clino_bus::Instant;
use clino_codec::character::LineErrors;
use clino_console::Received;
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::rcc::Rcc;

use crate::board::{ConsoleLine, ConsoleUsart};
use crate::params::{CONSOLE, CONSOLE_LOW_WATER, CONSOLE_START};
use crate::{clock, shared, uart};

/// Characters that can wait to be sent: more than the longest line on top of the low-water mark.
pub const OUTGOING: usize = 256;
const _: () = assert!(OUTGOING > clino_console::MAX_LINE + CONSOLE_LOW_WATER);

/// Characters that can wait to be read: two lines pasted at once.
pub const INCOMING: usize = 192;

/// The queues between the interrupt and the main loop.
pub struct Queues {
    outgoing: Queue<u8, OUTGOING>,
    incoming: Queue<Received, INCOMING>,
}

impl Queues {
    pub const fn new() -> Queues {
        Queues { outgoing: Queue::new(), incoming: Queue::new() }
    }
}

pub struct Port {
    uart: ConsoleUsart,
    outgoing: Consumer<'static, u8>,
    incoming: Incoming,
    lost: u32,
}

/// The writing end of the queue of received characters.
struct Incoming {
    queue: Producer<'static, Received>,
    /// Characters lost since the last one that got into the queue.
    lost: u8,
    /// When the receiver was switched on, until the first character has come.
    started: Option<Instant>,
}

impl Incoming {
    fn lose(&mut self) -> u32 {
        self.lost = self.lost.saturating_add(1);
        1
    }

    /// Takes a character; returns how many were lost with that.
    fn take(&mut self, byte: u8, is_flawed: bool) -> u32 {
        if let Some(started) = self.started.take()
            && clock::now().since(started) < CONSOLE_START
        {
            self.lose();
        }
        match self.queue.enqueue(Received::new(byte, is_flawed, self.lost)) {
            Ok(()) => {
                self.lost = 0;
                0
            }
            Err(_) => self.lose(),
        }
    }
}

/// Characters received.
pub type Keys = Consumer<'static, Received>;
/// Text to be printed.
pub type Writer = Producer<'static, u8>;

/// Takes the line into service. Returns its port, the reading end and the writing end.
pub fn start(line: ConsoleLine, rcc: &mut Rcc, queues: &'static mut Queues) -> (Port, Keys, Writer) {
    let (uart, clock_hz) = line.start(rcc);
    let divider = uart::divider(clock_hz, CONSOLE.baud);
    uart::set_up(&uart, divider);
    uart.cr1().modify(|_, w| w.re().set_bit().rxneie().set_bit());
    let (writer, outgoing) = queues.outgoing.split();
    let (queue, reader) = queues.incoming.split();
    let incoming = Incoming { queue, lost: 0, started: Some(clock::now()) };
    (Port { uart, outgoing, incoming, lost: 0 }, reader, writer)
}

impl Port {
    /// There is more to send.
    pub fn go_on(&mut self) {
        self.uart.cr1().modify(|_, w| w.txeie().set_bit());
    }

    /// Received characters that were lost, since reset: overruns, and what found the queue full.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Whether everything that was written is out, its last stop bit included.
    pub fn is_drained(&self) -> bool {
        self.outgoing.is_empty() && self.uart.sr().read().tc().bit_is_set()
    }

    /// The USART's interrupt.
    pub fn on_interrupt(&mut self) {
        let Port { uart, outgoing, incoming, lost: all } = self;
        let status = uart.sr().read();
        let (full, overrun) = (status.rxne().bit_is_set(), status.ore().bit_is_set());
        if full || overrun {
            // Reading the data register clears every receive flag (RM0090 section 30.6.1).
            let byte = uart.dr().read().dr().bits() as u8;
            let mut lost = 0;
            if full {
                let flaws = uart::line_errors(&status).without(LineErrors::OVERRUN);
                lost += incoming.take(byte, !flaws.is_none());
            }
            if overrun {
                // The register kept its character; what came behind it is lost.
                lost += incoming.lose();
            }
            *all = all.wrapping_add(lost);
            shared::note_work();
        }
        if status.txe().bit_is_set() && uart.cr1().read().txeie().bit_is_set() {
            match outgoing.dequeue() {
                Some(byte) => uart.dr().write(|w| w.dr().set(u16::from(byte))),
                None => uart.cr1().modify(|_, w| w.txeie().clear_bit()),
            };
            // Once a line: the search for the next line looks at all slots.
            if outgoing.len() == CONSOLE_LOW_WATER - 1 {
                shared::note_work();
            }
        }
    }
}
