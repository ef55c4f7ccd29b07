//! One angle of a T7 and one of an ISU, on one UART whose bit rate is switched by another.
#![no_std]
#![no_main]

#[path = "../board.rs"]
mod board;

use clino_drivers::codec::{isu, t7};
use clino_drivers::{PortSettings, Serial, SttIsu, Timing, UsDigitalT7};
use panic_halt as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    let serial = Serial::T7_DEFAULT;
    let mut line = board::line(serial);
    loop {
        line.set_settings(PortSettings::new(serial));
        let mut t7 = UsDigitalT7::new(line, Timing::t7(serial));
        let angle = t7.angle(t7::Address::FACTORY, t7::Axis::Two).map_or(i32::MIN, |angle| angle.mdeg());
        core::hint::black_box(angle);
        line = t7.release();
        line.set_settings(PortSettings::new(Serial::ISU));
        let mut isu = SttIsu::single(line, Timing::isu());
        let angle = isu.angle(isu::Address::ANY).map_or(i32::MIN, |angle| angle.mdeg());
        core::hint::black_box(angle);
        line = isu.release();
    }
}
