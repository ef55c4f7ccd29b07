//! A USART with a driver-enable pin: moves the characters of a [`Line`] to and from the registers.
//!
//! DE is what the line says, after every call: without delays it rises just before the first character is written and
//! falls in the transmission-complete interrupt of the last one. The receiver is on all the time, so it is armed long
//! before DE falls. Every received character goes into a queue with the receiver's error flags and the time.
//!
//! Read status, then data, once per interrupt: that is what clears RXNE, ORE, FE, NE and PE (RM0090 section
//! 30.6.1). On an overrun the data register still holds the character that was there first; it is kept, and
//! the flag tells that at least one after it is lost.

use core::ops::Deref;

use clino_bus::line::{LineSettings, LineStep, SubmitError};
use clino_bus::{DriverEnable, Duration, Event, Instant, Line, Timing};
use clino_codec::character::{Character, LineErrors};
use clino_gateway::Action;
use embedded_hal::digital::OutputPin;
use stm32f4xx_hal::pac::usart1::{RegisterBlock, sr};

use crate::events::Producer;
use crate::log::log;
use crate::{board, clock, events};

/// Bits of one character on the line, 8N1.
const CHARACTER_BITS: u32 = 10;

/// The USART of an RS485 bus. `U` is the peripheral, `D` the driver-enable pin.
pub struct Rs485<U, D> {
    uart: U,
    clock_hz: u32,
    de: D,
    /// DE is high.
    raised: bool,
    line: Line,
    /// Longest wait for the line to fall silent.
    line_busy: Duration,
    events: Producer,
    watch: DriverWatch,
    /// Events the bus level did not fetch in time.
    dropped: u32,
    /// An overrun was flagged without a character to carry it.
    overrun: bool,
}

/// Measures the driver enable in core cycles.
struct DriverWatch {
    core_hz: u32,
    cycles_per_character: u32,
    raised: u32,
    first_character: u32,
    figures: DriverEnable,
}

/// The registers of a USART.
pub trait Usart: Deref<Target = RegisterBlock> {}

impl<U: Deref<Target = RegisterBlock>> Usart for U {}

/// The port of a bus, as the bus level sees it.
pub trait BusPort {
    /// Has the line do this: a frame to be sent, or other settings, which come between two exchanges.
    fn act(&mut self, action: Action<'_>);
    /// Lets time pass, if it wants that at `now`; returns when it wants it next.
    fn poll(&mut self, now: Instant) -> Option<Instant>;
}

impl<U: Usart, D: OutputPin> BusPort for Rs485<U, D> {
    fn act(&mut self, action: Action<'_>) {
        match action {
            Action::Send(frame) => {
                if let Err(error) = self.submit(frame) {
                    // The master's own deadline ends the exchange.
                    log!(warn, "frame not accepted: {}", error);
                }
            }
            Action::Run(timing, line) => self.run(&timing, line),
        }
    }

    fn poll(&mut self, now: Instant) -> Option<Instant> {
        let next = self.line.poll_at();
        if next.is_none_or(|at| at > now) {
            return next;
        }
        // The port looks at the clock itself: how long a driver may be on counts from the instant it is switched on.
        Rs485::poll(self);
        self.line.poll_at()
    }
}

impl<U: Usart, D: OutputPin> Rs485<U, D> {
    /// Takes a USART whose clock runs at `clock_hz` and sets it up: 8N1, receiver and its interrupt on.
    pub fn new(uart: U, mut de: D, timing: &Timing, clock_hz: u32, core_hz: u32, events: Producer) -> Self {
        _ = de.set_low();
        let divider = divider(clock_hz, timing.serial.baud);
        set_up(&uart, divider);
        uart.cr1().modify(|_, w| w.re().set_bit().rxneie().set_bit());
        let cycles_per_character = cycles_per_character(divider, clock_hz, core_hz);
        Rs485 {
            uart,
            clock_hz,
            de,
            raised: false,
            line: Line::new(timing.line(), clock::now()),
            line_busy: timing.line_busy,
            events,
            watch: DriverWatch {
                core_hz,
                cycles_per_character,
                raised: 0,
                first_character: 0,
                figures: DriverEnable::default(),
            },
            dropped: 0,
            overrun: false,
        }
    }

    /// Takes a frame to be sent as soon as the guard allows: at once, if it does.
    pub fn submit(&mut self, frame: &[u8]) -> Result<(), SubmitError> {
        let now = clock::now();
        self.line.submit(frame, now + self.line_busy)?;
        self.poll();
        Ok(())
    }

    /// Runs with another bit rate and other waits. A frame in hand is lost; its exchange ends by its deadline.
    pub fn run(&mut self, timing: &Timing, settings: LineSettings) {
        let now = clock::now();
        if self.line.set(settings, now).is_err() {
            self.stop();
            self.line = Line::new(settings, now);
            self.follow();
        }
        let divider = divider(self.clock_hz, timing.serial.baud);
        set_divider(&self.uart, divider);
        self.watch.cycles_per_character = cycles_per_character(divider, self.clock_hz, self.watch.core_hz);
        self.line_busy = timing.line_busy;
    }

    /// Lets time pass: begins a frame, or takes the line back from one that hangs.
    pub fn poll(&mut self) {
        let now = clock::now();
        let step = self.line.poll(now);
        self.follow();
        let Some(step) = step else { return };
        match step {
            LineStep::Begin => self.begin(),
            LineStep::Force => self.stop(),
            LineStep::GiveUp | LineStep::EchoLost => {}
        }
        if let Some(event) = step.event(now) {
            self.report(event);
        }
    }

    /// Whether DE is high.
    pub fn is_driving(&self) -> bool {
        self.raised
    }

    /// How the driver enable behaved since reset.
    pub fn driver_enable(&self) -> DriverEnable {
        self.watch.figures
    }

    /// The USART's interrupt; returns whether there is something for the bus level.
    #[must_use]
    pub fn on_interrupt(&mut self) -> bool {
        let mut is_news = false;
        let status = self.uart.sr().read();
        let control = self.uart.cr1().read();
        if control.tcie().bit_is_set() && status.tc().bit_is_set() {
            // The pin first, everything else after: this is the moment the line has to be let go.
            let now = clock::now();
            let is_out = self.line.transmission_complete(now);
            self.follow();
            self.uart.cr1().modify(|_, w| w.tcie().clear_bit());
            if is_out {
                self.report(Event::Released { at: now });
                is_news = true;
            }
        }
        if control.txeie().bit_is_set() && status.txe().bit_is_set() {
            match self.line.next_character() {
                Some(byte) => self.write(byte),
                None => _ = self.uart.cr1().modify(|_, w| w.txeie().clear_bit().tcie().set_bit()),
            }
        }
        let errors = line_errors(&status);
        if status.rxne().bit_is_set() || errors != LineErrors::NONE {
            let byte = self.uart.dr().read().dr().bits() as u8;
            is_news |= self.received(byte, errors, status.rxne().bit_is_set());
        }
        is_news
    }

    fn received(&mut self, byte: u8, mut errors: LineErrors, fresh: bool) -> bool {
        if !fresh {
            // The data register was read before the flag came up: the next character carries it.
            self.overrun = true;
            return false;
        }
        if core::mem::take(&mut self.overrun) {
            errors = errors.union(LineErrors::OVERRUN);
        }
        let at = clock::now();
        let event = self.line.heard(Character { byte, errors }, at);
        self.follow();
        self.report(event);
        true
    }

    fn begin(&mut self) {
        // Reading the status before writing the data clears the old transmission-complete flag.
        _ = self.uart.sr().read();
        if let Some(byte) = self.line.next_character() {
            self.watch.first_character = board::cycles();
            self.write(byte);
        }
        self.uart.cr1().modify(|_, w| w.txeie().set_bit());
    }

    fn write(&self, byte: u8) {
        self.uart.dr().write(|w| w.dr().set(u16::from(byte)));
    }

    fn stop(&mut self) {
        self.uart.cr1().modify(|_, w| w.txeie().clear_bit().tcie().clear_bit());
    }

    /// DE does what the line says.
    fn follow(&mut self) {
        match (self.line.driving(), self.raised) {
            (true, false) => {
                self.watch.raised = board::cycles();
                _ = self.de.set_high();
                self.raised = true;
            }
            (false, true) => {
                _ = self.de.set_low();
                self.raised = false;
                self.watch.released(self.line.frame_len(), self.line.settings().post_delay);
            }
            _ => {}
        }
    }

    fn report(&mut self, event: Event) {
        if !events::put(&mut self.events, event) {
            // The bus level is too far behind; what follows is incomplete and will fail its checks.
            self.dropped = self.dropped.wrapping_add(1);
            self.overrun = true;
        }
    }
}

impl DriverWatch {
    /// DE has just fallen after a frame of `characters`. The end of the last stop bit is computed from the
    /// instant the first character was written, which is up to one bit before its start bit begins: the figure
    /// can be one bit too large, never too small.
    fn released(&mut self, characters: usize, post_delay: Duration) {
        let now = board::cycles();
        let cycles_per_us = (self.core_hz / 1_000_000).max(1);
        let delay = cycles_per_us.wrapping_mul(post_delay.as_micros());
        let frame = self.cycles_per_character.wrapping_mul(characters as u32);
        let since_stop_bit = now.wrapping_sub(self.first_character).saturating_sub(frame.wrapping_add(delay));
        let high = now.wrapping_sub(self.raised);
        // Whole microseconds and their rest apart: 32 bits are enough then.
        let (us, rest) = (since_stop_bit / cycles_per_us, since_stop_bit % cycles_per_us);
        let release_ns = us.saturating_mul(1_000).saturating_add(rest * 1_000 / cycles_per_us);
        let figures = &mut self.figures;
        figures.release_max_ns = figures.release_max_ns.max(release_ns);
        figures.high_max_us = figures.high_max_us.max(high / cycles_per_us);
    }
}

/// The receiver's error flags in a status that was read.
pub fn line_errors(status: &sr::R) -> LineErrors {
    let flag = |is_set, flag| if is_set { flag } else { LineErrors::NONE };
    flag(status.ore().bit_is_set(), LineErrors::OVERRUN)
        | flag(status.fe().bit_is_set(), LineErrors::FRAMING)
        | flag(status.nf().bit_is_set(), LineErrors::NOISE)
        | flag(status.pe().bit_is_set(), LineErrors::PARITY)
}

/// Transmitter and USART on, 8N1, everything else at its reset value.
pub fn set_up(uart: &RegisterBlock, divider: u16) {
    set_divider(uart, divider);
    uart.cr1().write(|w| w.ue().set_bit().te().set_bit());
}

pub fn set_divider(uart: &RegisterBlock, divider: u16) {
    // SAFETY: USART_BRR takes any 16-bit value but zero (RM0090 section 30.6.3); `divider` is at least 16.
    uart.brr().write(|w| unsafe { w.bits(divider) });
}

/// Core cycles of one character at a divider of the USART's clock.
fn cycles_per_character(divider: u16, clock_hz: u32, core_hz: u32) -> u32 {
    (u64::from(divider) * u64::from(CHARACTER_BITS) * u64::from(core_hz) / u64::from(clock_hz.max(1))) as u32
}

/// USART_BRR for oversampling by 16: the clock over the bit rate, rounded; the last four bits are sixteenths
/// (RM0090 section 30.3.4).
#[inline(never)]
pub fn divider(clock_hz: u32, baud: u32) -> u16 {
    let rounded = (clock_hz + baud / 2) / baud.max(1);
    u16::try_from(rounded.max(16)).unwrap_or(u16::MAX)
}
