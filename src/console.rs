//! The console's USART: a queue of characters in each direction, moved by its interrupt.
//!
//! Writing waits for room, and only the people level writes: nothing else depends on it. What is received and not
//! fetched in time is lost and counted: a terminal is not flow-controlled, and the buses come first.

use core::cell::{Cell, RefCell};
use core::convert::Infallible;

use clino_recovery::Duty;
use critical_section::Mutex;
use embedded_io::{ErrorType, Write};
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::pac::{self, interrupt};

use crate::params::CONSOLE_LOW_WATER;
use crate::{shared, uart, watchdog};

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
    incoming: Queue<u8, INCOMING>,
}

impl Queues {
    pub const fn new() -> Queues {
        Queues { outgoing: Queue::new(), incoming: Queue::new() }
    }
}

struct Port {
    uart: pac::USART2,
    outgoing: Consumer<'static, u8>,
    incoming: Producer<'static, u8>,
}

static PORT: Mutex<RefCell<Option<Port>>> = Mutex::new(RefCell::new(None));
static WRITER: Mutex<RefCell<Option<Producer<'static, u8>>>> = Mutex::new(RefCell::new(None));
static LOST: Mutex<Cell<u32>> = Mutex::new(Cell::new(0));

/// Takes over a USART whose clock is on. Returns the reading end; the writing end is [`Console`].
pub fn start(uart: pac::USART2, divider: u16, queues: &'static mut Queues) -> Consumer<'static, u8> {
    uart::set_up(&uart, divider);
    uart.cr1().modify(|_, w| w.re().set_bit().rxneie().set_bit());
    let (writer, outgoing) = queues.outgoing.split();
    let (incoming, reader) = queues.incoming.split();
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
                watchdog::check_in(Duty::Console);
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

/// Received characters that nobody fetched in time, since reset.
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
        if status.rxne().bit_is_set() || status.ore().bit_is_set() {
            // Reading the data register clears every receive flag (RM0090 section 30.6.1).
            let byte = uart.dr().read().dr().bits() as u8;
            // A spoilt character is no character: a command with one in it would not be what was typed.
            let whole = status.fe().bit_is_clear() && status.nf().bit_is_clear();
            let lost =
                u32::from(!whole || incoming.enqueue(byte).is_err()) + u32::from(status.ore().bit_is_set());
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
