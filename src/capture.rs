//! PWM input: a 32-bit timer that measures a signal's period and high time in ticks of its own clock.
//!
//! The timer runs in PWM-input mode (RM0090 section 18.3.6): the rising edge captures the counter into one
//! channel (the period) and resets it; the falling edge captures it into the other channel (the high time).
//! Each rising edge interrupts and yields one cycle.
//!
//! Not yielded as a cycle: the first capture after a start or a silence (the counter did not start at an
//! edge), a capture that overwrote one that was not read (a lost edge), and one during which the counter came
//! round (51 s at 84 MHz). No edge for [`PWM_NO_SIGNAL`] yields the level the pin sits at.

use core::ops::Deref;

use clino_bus::Instant;
use clino_codec::pwm::Ticks;
use clino_gateway::Capture;
use embedded_hal::digital::InputPin;
use heapless::spsc::Producer;
use stm32f4xx_hal::pac::tim2;

use crate::clock;
use crate::params::{CAPTURE_FILTER, PWM_NO_SIGNAL};

/// Which of the timer's first two inputs the signal is on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum TimerInput {
    Ti1,
    Ti2,
}

/// A timer in PWM-input mode and the pin it listens to, which is also read as a level.
pub struct PwmCapture<T, P> {
    timer: T,
    input: TimerInput,
    pin: P,
    captures: Producer<'static, Capture>,
    /// When there was last a cycle, or a report that there is none.
    last: Instant,
    /// The next capture did not begin at an edge.
    discard: bool,
}

/// Bits of TIMx_CCMR1 in input mode (RM0090 section 18.4.7).
mod ccmr1 {
    /// Capture/compare 1 selection: the channel's own input, or the other one.
    pub const CC1S_TI1: u32 = 0b01;
    pub const CC1S_TI2: u32 = 0b10;
    pub const IC1F: u32 = 4;
    pub const CC2S_TI2: u32 = 0b01 << 8;
    pub const CC2S_TI1: u32 = 0b10 << 8;
    pub const IC2F: u32 = 12;
}

/// Bits of TIMx_CCER: enable and, for an input, polarity (P = 1, NP = 0: falling; RM0090 section 18.4.9).
mod ccer {
    pub const CC1E: u32 = 1 << 0;
    pub const CC1_FALLING: u32 = 1 << 1;
    pub const CC2E: u32 = 1 << 4;
    pub const CC2_FALLING: u32 = 1 << 5;
}

/// Bits of TIMx_SMCR: reset mode, triggered by a filtered input (RM0090 section 18.4.3).
mod smcr {
    pub const SMS_RESET: u32 = 0b100;
    pub const TS_TI1FP1: u32 = 0b101 << 4;
    pub const TS_TI2FP2: u32 = 0b110 << 4;
}

impl<T: Deref<Target = tim2::RegisterBlock>, P: InputPin> PwmCapture<T, P> {
    /// Sets the timer up and starts it. Its clock has to be on.
    pub fn new(timer: T, input: TimerInput, pin: P, captures: Producer<'static, Capture>) -> Self {
        let filter = u32::from(CAPTURE_FILTER) << ccmr1::IC1F | u32::from(CAPTURE_FILTER) << ccmr1::IC2F;
        let (select, polarity, trigger) = match input {
            TimerInput::Ti1 => (ccmr1::CC1S_TI1 | ccmr1::CC2S_TI1, ccer::CC2_FALLING, smcr::TS_TI1FP1),
            TimerInput::Ti2 => (ccmr1::CC1S_TI2 | ccmr1::CC2S_TI2, ccer::CC1_FALLING, smcr::TS_TI2FP2),
        };
        timer.cr1().reset();
        timer.psc().reset();
        // SAFETY (this and the writes below): every bit written is a documented field of the register, named
        // above; the timer is stopped.
        timer.arr().write(|w| unsafe { w.bits(u32::MAX) });
        timer.ccer().reset();
        timer.ccmr1_input().write(|w| unsafe { w.bits(select | filter) });
        timer.ccer().write(|w| unsafe { w.bits(ccer::CC1E | ccer::CC2E | polarity) });
        timer.smcr().write(|w| unsafe { w.bits(trigger | smcr::SMS_RESET) });
        timer.egr().write(|w| w.ug().set_bit());
        timer.sr().reset();
        timer.dier().write(|w| match input {
            TimerInput::Ti1 => w.cc1ie().set_bit(),
            TimerInput::Ti2 => w.cc2ie().set_bit(),
        });
        // The update flag marks only a counter that came round, not the reset at each rising edge.
        timer.cr1().write(|w| w.urs().set_bit().cen().set_bit());
        PwmCapture { timer, input, pin, captures, last: Instant::ZERO, discard: true }
    }

    /// The timer's interrupt: a rising edge. Returns whether there is something for the bus level.
    #[must_use]
    pub fn on_interrupt(&mut self) -> bool {
        let status = self.timer.sr().read();
        let (first, second) = (self.timer.ccr1().read().bits(), self.timer.ccr2().read().bits());
        let (period, high) = match self.input {
            TimerInput::Ti1 => (first, second),
            TimerInput::Ti2 => (second, first),
        };
        let lost = status.cc1of().bit_is_set() || status.cc2of().bit_is_set();
        let came_round = status.uif().bit_is_set();
        // Reading a capture register has cleared its own flag; these have to be cleared one by one, and only
        // when seen, so that none is lost that comes up meanwhile.
        self.timer.sr().write(|w| {
            if status.cc1of().bit_is_set() {
                w.cc1of().clear_bit();
            }
            if status.cc2of().bit_is_set() {
                w.cc2of().clear_bit();
            }
            if came_round {
                w.uif().clear_bit();
            }
            w
        });
        self.last = clock::now();
        if core::mem::take(&mut self.discard) || came_round {
            return false;
        }
        self.report(if lost { Capture::LostEdge } else { Capture::Cycle(Ticks { period, high }) });
        true
    }

    /// Lets time pass: notices that there is no signal. Returns when it wants it again.
    pub fn poll(&mut self, now: Instant) -> Instant {
        if now >= self.last + PWM_NO_SIGNAL {
            self.last = now;
            self.discard = true;
            let high = self.pin.is_high().unwrap_or(false);
            self.report(Capture::NoSignal { high });
        }
        self.last + PWM_NO_SIGNAL
    }

    fn report(&mut self, capture: Capture) {
        // When the bus level is too far behind to fetch it, the next cycle replaces this one.
        _ = self.captures.enqueue(capture);
    }
}
