//! Whatever decodes, encodes to the bytes it came from.
#![no_main]

use clino_codec::checks::Checks;
use clino_codec::isu::{Answer, Request};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(command) = Request::decode(bytes)
        // Transfers of nothing, and beyond the end of memory, can be received but are never sent.
        && let Ok(frame) = command.request.encode_even_if_it_bricks_the_module(command.address)
    {
        assert_eq!(frame.as_bytes(), bytes);
    }
    if let Ok(answer) = Answer::decode(bytes) {
        assert_eq!(answer.encode().as_bytes(), bytes);
    }
    let _ = Answer::decode_with(bytes, Checks::NONE);
});
