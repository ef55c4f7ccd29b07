//! The console's USART: a queue of characters in each direction, moved by its interrupt.
//!
//! Writing waits for room, and only the people level writes: nothing else depends on it.
//!
//! A terminal is not flow-controlled, and the buses come first: characters that are not fetched in time are lost. A loss keeps
//! its place: the next character that gets into the queue tells how many were lost before it ([`Received::lost`]), whether
//! the queue was full or the receiver overran, as it does while a sector of flash is erased. A character that the receiver
//! complained about goes into the queue with the complaint; what that means for its line is for the console to judge.
//!
//! Nobody has listened before the start: a first character that follows it at once may be the rest of a line.

use core::cell::{Cell, RefCell};
use core::convert::Infallible;

use clino_bus::Micros;
use clino_codec::character::LineErrors;
use clino_console::Received;
use clino_recovery::MonitoredTask;
use critical_section::Mutex;
use embedded_io::{ErrorType, Write};
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::pac::{self, interrupt};

use crate::params::{CONSOLE_LOW_WATER, CONSOLE_START};
use crate::{clock, shared, uart, watchdog};

/// Characters that can wait to be sent: more than the longest line on top of the low-water mark.
pub const OUTGOING: usize = 256;
const _: () = assert!(OUTGOING > clino_gateway::json::MAX_LINE + CONSOLE_LOW_WATER);

/// Characters that are put into the queue in one critical section: half a microsecond.
const AT_ONCE: usize = 8;

/// Characters that can wait to be read: two lines pasted at once.
pub const INCOMING: usize = 192;

/// The queues between the interrupt and the people level.
pub struct Queues {
    outgoing: Queue<u8, OUTGOING>,
    incoming: Queue<Received, INCOMING>,
}

impl Queues {
    pub const fn new() -> Queues {
        Queues { outgoing: Queue::new(), incoming: Queue::new() }
    }
}

struct Port {
    uart: pac::USART2,
    outgoing: Consumer<'static, u8>,
    incoming: Incoming,
}

/// The writing end of what is received.
struct Incoming {
    queue: Producer<'static, Received>,
    /// Characters lost since the last one that got into the queue.
    lost: u8,
    /// When the receiver was switched on, until the first character has come.
    started: Option<Micros>,
}

impl Incoming {
    fn lose(&mut self) -> u32 {
        self.lost = self.lost.saturating_add(1);
        1
    }

    /// Takes a character; returns how many were lost with that.
    fn take(&mut self, byte: u8, errors: LineErrors) -> u32 {
        if let Some(started) = self.started.take()
            && clock::now().since(started) < CONSOLE_START
        {
            self.lose();
        }
        match self.queue.enqueue(Received { byte, errors, lost: self.lost }) {
            Ok(()) => {
                self.lost = 0;
                0
            }
            Err(_) => self.lose(),
        }
    }
}

static PORT: Mutex<RefCell<Option<Port>>> = Mutex::new(RefCell::new(None));
static WRITER: Mutex<RefCell<Option<Producer<'static, u8>>>> = Mutex::new(RefCell::new(None));
static LOST: Mutex<Cell<u32>> = Mutex::new(Cell::new(0));

/// Takes over a USART whose clock is on. Returns the reading end; the writing end is [`Console`].
pub fn start(uart: pac::USART2, divider: u16, queues: &'static mut Queues) -> Consumer<'static, Received> {
    uart::set_up(&uart, divider);
    uart.cr1().modify(|_, w| w.re().set_bit().rxneie().set_bit());
    let (writer, outgoing) = queues.outgoing.split();
    let (queue, reader) = queues.incoming.split();
    let incoming = Incoming { queue, lost: 0, started: Some(clock::now()) };
    critical_section::with(|cs| {
        PORT.replace(cs, Some(Port { uart, outgoing, incoming }));
        WRITER.replace(cs, Some(writer));
    });
    reader
}

/// The writing end of the console.
#[derive(Clone, Copy)]
pub struct Console;

impl Console {
    /// Whether the next line may be printed: little is waiting, so it will be out soon.
    pub fn has_room(self) -> bool {
        with_writer(|queue| queue.len() < CONSOLE_LOW_WATER)
    }
}

impl ErrorType for Console {
    type Error = Infallible;
}

impl Write for Console {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        loop {
            // A few at a time: interrupts wait meanwhile.
            let few = bytes.iter().take(AT_ONCE);
            let taken = with_writer(|queue| few.take_while(|&&byte| queue.enqueue(byte).is_ok()).count());
            critical_section::with(|cs| {
                if let Some(port) = PORT.borrow_ref(cs).as_ref() {
                    port.uart.cr1().modify(|_, w| w.txeie().set_bit());
                }
            });
            if taken > 0 || bytes.is_empty() {
                // A long answer is no hang for as long as its characters go out.
                watchdog::check_in(MonitoredTask::Console);
                return Ok(taken);
            }
            // The next character that goes out ends the sleep.
            cortex_m::asm::wfi();
        }
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Received characters that were lost, since reset: overruns, and what found the queue full.
pub fn lost() -> u32 {
    critical_section::with(|cs| LOST.borrow(cs).get())
}

/// Waits until everything that was written is out, its last stop bit included.
pub fn drain() {
    while !critical_section::with(|cs| match PORT.borrow_ref(cs).as_ref() {
        Some(port) => port.outgoing.is_empty() && port.uart.sr().read().tc().bit_is_set(),
        None => true,
    }) {}
}

fn with_writer<R: Default>(work: impl FnOnce(&mut Producer<'static, u8>) -> R) -> R {
    critical_section::with(|cs| WRITER.borrow_ref_mut(cs).as_mut().map(work)).unwrap_or_default()
}

#[interrupt]
fn USART2() {
    critical_section::with(|cs| {
        let mut port = PORT.borrow_ref_mut(cs);
        let Some(Port { uart, outgoing, incoming }) = port.as_mut() else { return };
        let status = uart.sr().read();
        let (full, overrun) = (status.rxne().bit_is_set(), status.ore().bit_is_set());
        if full || overrun {
            // Reading the data register clears every receive flag (RM0090 section 30.6.1).
            let byte = uart.dr().read().dr().bits() as u8;
            let mut lost = 0;
            if full {
                let flags = uart::line_errors(&status);
                lost += incoming.take(byte, flags.without(LineErrors::OVERRUN));
            }
            if overrun {
                // The register kept its character; what came behind it is lost.
                lost += incoming.lose();
            }
            LOST.borrow(cs).set(LOST.borrow(cs).get().wrapping_add(lost));
            shared::note_work();
        }
        if status.txe().bit_is_set() && uart.cr1().read().txeie().bit_is_set() {
            match outgoing.dequeue() {
                Some(byte) => uart.dr().write(|w| w.dr().set(u16::from(byte))),
                None => uart.cr1().modify(|_, w| w.txeie().clear_bit()),
            };
            // Once a line: who looks for the next one looks at all slots.
            if outgoing.len() == CONSOLE_LOW_WATER - 1 {
                shared::note_work();
            }
        }
    });
}
