//! The console: a queue of characters in front of a USART, emptied by its interrupt.

use core::cell::RefCell;

use critical_section::Mutex;
use heapless::spsc::{Consumer, Producer};
use stm32f4xx_hal::pac::{self, interrupt};

use crate::params::CONSOLE_LOW_WATER;
use crate::{shared, uart};

/// Characters that can wait: more than the longest line on top of the low-water mark.
pub const QUEUE: usize = 256;
const _: () = assert!(QUEUE > clino_gateway::json::MAX_LINE + CONSOLE_LOW_WATER);

struct Transmitter {
    uart: pac::USART2,
    queue: Consumer<'static, u8>,
}

static TRANSMITTER: Mutex<RefCell<Option<Transmitter>>> = Mutex::new(RefCell::new(None));

/// The writing end of the console.
pub struct Console {
    queue: Producer<'static, u8>,
}

impl Console {
    /// Takes over a USART whose clock is on.
    pub fn new(
        uart: pac::USART2,
        divider: u16,
        (producer, consumer): (Producer<'static, u8>, Consumer<'static, u8>),
    ) -> Console {
        uart::set_up(&uart, divider);
        critical_section::with(|cs| TRANSMITTER.replace(cs, Some(Transmitter { uart, queue: consumer })));
        Console { queue: producer }
    }

    /// Whether the next line may be printed: little is waiting, so it will be out soon.
    pub fn has_room(&self) -> bool {
        self.queue.len() < CONSOLE_LOW_WATER
    }

    /// Queues a line. What does not fit is lost; with [`Console::has_room`] asked first, everything fits.
    pub fn print(&mut self, line: &[u8]) {
        for &byte in line {
            _ = self.queue.enqueue(byte);
        }
        critical_section::with(|cs| {
            if let Some(transmitter) = TRANSMITTER.borrow_ref(cs).as_ref() {
                transmitter.uart.cr1().modify(|_, w| w.txeie().set_bit());
            }
        });
    }
}

#[interrupt]
fn USART2() {
    critical_section::with(|cs| {
        let mut transmitter = TRANSMITTER.borrow_ref_mut(cs);
        let Some(Transmitter { uart, queue }) = transmitter.as_mut() else { return };
        if uart.sr().read().txe().bit_is_clear() {
            return;
        }
        match queue.dequeue() {
            Some(byte) => uart.dr().write(|w| w.dr().set(u16::from(byte))),
            None => uart.cr1().modify(|_, w| w.txeie().clear_bit()),
        };
        if queue.len() < CONSOLE_LOW_WATER {
            shared::note_work();
        }
    });
}
