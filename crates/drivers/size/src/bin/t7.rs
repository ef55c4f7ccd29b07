//! One angle of a T7.
#![no_std]
#![no_main]

#[path = "../board.rs"]
mod board;

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::{Serial, Timing, UsDigitalT7};
use panic_halt as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    let serial = Serial::T7_DEFAULT;
    let mut t7 = UsDigitalT7::new(board::line(serial), Timing::t7(serial));
    loop {
        let angle = t7.angle(Address::FACTORY, Axis::Two).map_or(i32::MIN, |angle| angle.mdeg());
        core::hint::black_box(angle);
    }
}
