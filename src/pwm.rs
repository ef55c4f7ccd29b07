//! The ports of the PWM inputs: a timer each.

use clino_gateway::Capture;
use heapless::spsc::Producer;
use stm32f4xx_hal::rcc::Rcc;

use crate::board::{Pwm1Line, Pwm1Pin, Pwm1Timer, Pwm2Line, Pwm2Pin, Pwm2Timer};
use crate::capture::{PwmCapture, TimerInput};

pub type Port1 = PwmCapture<Pwm1Timer, Pwm1Pin>;
pub type Port2 = PwmCapture<Pwm2Timer, Pwm2Pin>;

/// Takes both into service.
pub fn start(
    line1: Pwm1Line,
    line2: Pwm2Line,
    rcc: &mut Rcc,
    captures1: Producer<'static, Capture>,
    captures2: Producer<'static, Capture>,
) -> (Port1, Port2) {
    let (timer, pin) = line1.start(rcc);
    let port1 = PwmCapture::new(timer, TimerInput::Ti2, pin, captures1);
    let (timer, pin) = line2.start(rcc);
    (port1, PwmCapture::new(timer, TimerInput::Ti1, pin, captures2))
}
