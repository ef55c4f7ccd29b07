//! After any bytes and silence, a good answer comes out at its last byte; before, only good ones do.
//!
//! Input: a command, its length first, then the stream.
#![no_main]

use clino_codec::character::Character;
use clino_codec::checks::Checks;
use clino_codec::isu::{Address, Answer, AnswerDecoder, DecodeProgress, Request};
use libfuzzer_sys::fuzz_target;

/// Address 3 says 180°.
const GOOD: [u8; 6] = [0x04, 0x35, 0x58, 0x80, 0x00, 0x0D];

fuzz_target!(|input: &[u8]| {
    let [length, rest @ ..] = input else { return };
    let length = usize::from(*length).min(rest.len());
    let (command, stream) = rest.split_at(length);
    let (request, address) = match Request::decode(command) {
        Ok(command) => (command.request, command.address),
        Err(_) => (Request::READ_ANGLE, Address::new(3).unwrap()),
    };
    let expected = request.expected(address);
    let mut decoder = AnswerDecoder::new(expected, Checks::ALL);
    for &byte in stream {
        if let DecodeProgress::Frame(answer) = decoder.push(Character::clean(byte)) {
            let frame = answer.encode();
            assert!(expected.check(frame.as_bytes(), Checks::ALL).is_ok());
            assert!(stream.windows(frame.as_bytes().len()).any(|window| window == frame.as_bytes()));
        }
    }
    while decoder.idle() != DecodeProgress::More {}
    assert_eq!(decoder.pending(), 0);
    assert!(decoder.discarded() as usize <= stream.len());
    if request == Request::READ_ANGLE && address.get() == 3 {
        let last = GOOD.map(|byte| decoder.push(Character::clean(byte)))[5];
        assert_eq!(last, DecodeProgress::Frame(Answer::decode(&GOOD).unwrap()));
    }
});
