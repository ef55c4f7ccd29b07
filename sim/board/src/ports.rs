//! The circuits at the chip's pins: the four serial ports and the two PWM inputs.
//!
//! The DE pins, interrupts and clock enables of the ports are in `board.machine`; alternate functions are from
//! the datasheets (DS8626 rev 9, table 9; DS10693, table 11).

use crate::model::BoardModel;
use crate::pwm::{PwmWaveform, Unconnected};
use crate::usart::Pin;
use clino_segment::wire::{Format, Received, Sent, Wire};
use clino_sim::node::Ns;
use rsemu::dev::stm32::ClockOutput;

const GPIOA: u64 = 0x4002_0000;
const GPIOB: u64 = 0x4002_0400;
const GPIOC: u64 = 0x4002_0800;
const GPIOD: u64 = 0x4002_0c00;

/// A serial port of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SerialPort {
    /// T7 bus: USART1.
    T7,
    /// ISU bus: USART3.
    Isu,
    /// Console: USART2.
    Console,
    /// Modbus uplink: USART6.
    Modbus,
}

impl SerialPort {
    /// All four.
    pub const ALL: [SerialPort; 4] =
        [SerialPort::T7, SerialPort::Isu, SerialPort::Console, SerialPort::Modbus];

    /// The name that the board text and the bus log use.
    pub const fn name(self) -> &'static str {
        match self {
            SerialPort::T7 => "t7",
            SerialPort::Isu => "isu",
            SerialPort::Console => "console",
            SerialPort::Modbus => "modbus",
        }
    }
}

/// Something of each of the two ports that people and programs talk to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HostPorts<T> {
    /// The console's.
    pub console: T,
    /// The Modbus port's.
    pub modbus: T,
}

/// Everything outside the chip.
pub struct Ports {
    /// T7 bus: USART1, TX PB6, RX PB7, DE PB8.
    pub t7: Box<dyn Wire>,
    /// ISU bus: USART3, TX PD8, RX PD9, DE PD10; on a Nucleo PC10, PC11, PC12.
    pub isu: Box<dyn Wire>,
    /// Console: USART2, TX PA2, RX PA3.
    pub console: Box<dyn Wire>,
    /// Modbus uplink: USART6, TX PC6, RX PC7, DE PC8; on a black board PD11.
    pub modbus: Box<dyn Wire>,
    /// PWM inputs: PA1 (TIM5 channel 2) and PA15 (TIM2 channel 1).
    pub pwm: [Box<dyn PwmWaveform>; 2],
}

impl Ports {
    /// Nothing connected: silent lines, both PWM inputs at the level of their pull resistors.
    pub fn open() -> Ports {
        Ports {
            t7: Box::new(Open),
            isu: Box::new(Open),
            console: Box::new(Open),
            modbus: Box::new(Open),
            pwm: [Box::new(Unconnected), Box::new(Unconnected)],
        }
    }
}

/// Bus clock and pins of the port that the board text calls `name`.
pub(crate) fn pins(model: BoardModel, name: &str) -> Option<(ClockOutput, Pin, Pin)> {
    let pin = |port, number, function| Pin { port, number, function };
    let (isu, isu_tx, isu_rx) = model.isu_pins();
    let isu = if isu == 'c' { GPIOC } else { GPIOD };
    Some(match name {
        "t7" => (ClockOutput::PCLK2, pin(GPIOB, 6, 7), pin(GPIOB, 7, 7)),
        "console" => (ClockOutput::PCLK1, pin(GPIOA, 2, 7), pin(GPIOA, 3, 7)),
        "isu" => (ClockOutput::PCLK1, pin(isu, isu_tx, 7), pin(isu, isu_rx, 7)),
        "modbus" => (ClockOutput::PCLK2, pin(GPIOC, 6, 8), pin(GPIOC, 7, 8)),
        _ => return None,
    })
}

/// The pin of a PWM input: GPIO port and number.
pub(crate) fn pwm_pin(channel: u64) -> (u64, u32) {
    if channel == 1 { (GPIOA, 1) } else { (GPIOA, 15) }
}

/// A line with nothing on it.
struct Open;

impl Wire for Open {
    fn set_receiver(&mut self, _now: Ns, _format: Option<Format>) {}

    fn send(&mut self, _sent: Sent) {}

    fn drive_enable(&mut self, _now: Ns, _high: bool) {}

    fn next_event(&self) -> Option<Ns> {
        None
    }

    fn advance(&mut self, _now: Ns) {}

    fn take_received(&mut self) -> Option<Received> {
        None
    }
}
