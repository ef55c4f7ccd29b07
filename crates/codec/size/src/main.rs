//! One T7 command, host side: the request for an angle, and the answer, decoded as its characters come in.
//!
//! The program has no vectors and no start-up: what it takes is the codec, with `memcpy` and the like where that needs them.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;
use core::ptr;

use clino_codec::character::Character;
use clino_codec::checks::Checks;
use clino_codec::t7::{Address, AnswerDecoder, Axis, DecodeProgress, Request, Response};

/// Where a UART of the STM32F4 has its data (USART1, RM0090 section 30.6.2).
const DATA: *mut u8 = 0x4001_1004 as *mut u8;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {}
}

// SAFETY: the linker's entry point; nothing else has this name.
#[unsafe(no_mangle)]
extern "C" fn _start() -> ! {
    let device = Address::FACTORY;
    let request = Request::GetAngle(Axis::Two);
    if let Ok(frame) = request.encode(device) {
        // SAFETY: the data register of a UART takes bytes.
        frame.as_bytes().iter().for_each(|&byte| unsafe { ptr::write_volatile(DATA, byte) });
    }
    let mut decoder = AnswerDecoder::new(request.expected(device), Checks::ALL);
    loop {
        // SAFETY: the data register of a UART can be read.
        let byte = unsafe { ptr::read_volatile(DATA) };
        if let DecodeProgress::Frame(answer) = decoder.push(Character::clean(byte))
            && let Response::GetAngle { angle, .. } = answer.response
        {
            black_box(angle.angle().map(|angle| angle.udeg()));
        }
    }
}
