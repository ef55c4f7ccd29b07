//! One angle of an ISU.
#![no_std]
#![no_main]

#[path = "../board.rs"]
mod board;

use clino_drivers::codec::isu::Address;
use clino_drivers::{Serial, SttIsu, Timing};
use panic_halt as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut isu = SttIsu::single(board::line(Serial::ISU), Timing::isu());
    loop {
        let angle = isu.angle(Address::ANY).map_or(i32::MIN, |angle| angle.mdeg());
        core::hint::black_box(angle);
    }
}
