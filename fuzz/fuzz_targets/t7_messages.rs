//! Whatever decodes, encodes to the bytes it came from.
#![no_main]

use clino_codec::checks::Checks;
use clino_codec::t7::{Answer, EncodeError, Request};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(command) = Request::decode(bytes) {
        match command.request.encode(command.address) {
            Ok(frame) => assert_eq!(frame.as_bytes(), bytes),
            // Can be heard, must not be sent.
            Err(error) => assert!(matches!(error, EncodeError::NotForAll { .. }) && bytes[0] == 126),
        }
    }
    if let Ok(answer) = Answer::decode(bytes) {
        assert_eq!(answer.encode().as_bytes(), bytes);
        assert!(bytes.iter().fold(0_u8, |sum, &byte| sum.wrapping_add(byte)) == 0);
    }
    // With every check off, whatever is long enough has a meaning or an error, and never a panic.
    let _ = Answer::decode_with(bytes, Checks::NONE);
});
