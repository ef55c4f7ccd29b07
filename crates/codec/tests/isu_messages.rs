//! ISU: every function in both directions, the error answers, and the document's contradictions I1–I3, I12,
//! I13. With messages of every length; `short_messages` has what differs without the feature.
#![cfg(feature = "long-messages")]

mod common;

use clino_codec::angle::Angle;
use clino_codec::character::LineErrors;
use clino_codec::checks::{Check, Checks};
use clino_codec::isu::{
    ANGLE_RAM_ADDRESS, Address, Answer, Command, Data, DecodeError, DeviceError, Differs, EncodeError,
    Function, MAX_DATA, MAX_WORDS, Request, Response, Words,
};
use common::{hex, isu_frame};

fn address(number: u8) -> Address {
    Address::new(number).unwrap()
}

fn data(bytes: &[u8]) -> Data {
    Data::new(bytes).unwrap()
}

fn words(words: &[u16]) -> Words {
    Words::new(words).unwrap()
}

/// Each function with the bytes its command must be to address 3, from appendix A.
fn requests() -> Vec<(Request, Vec<u8>)> {
    vec![
        (Request::GoToSoftErrorState, isu_frame(0x30, &[])),
        (Request::ResetModule, isu_frame(0x32, &[])),
        (Request::ReadRam { start: 0x58, count: 2 }, isu_frame(0x34, &[0x58, 2])),
        (Request::ReadRam { start: 0, count: 253 }, isu_frame(0x34, &[0, 253])),
        (Request::WriteRam { start: 0x58, data: data(&[0xAB]) }, isu_frame(0x36, &[0x58, 0xAB])),
        (Request::WriteRam { start: 0x58, data: data(&[1, 2]) }, isu_frame(0x36, &[0x58, 1, 2])),
        (Request::ReadEeprom { start: 0x78, count: 8 }, isu_frame(0x38, &[0x78, 8])),
        (Request::ReadEeprom { start: 0x82, count: 126 }, isu_frame(0x38, &[0x82, 126])),
        (
            Request::WriteEeprom { start: 0x48, words: words(&[0x1234, 0xABCD]) },
            isu_frame(0x3A, &[0x48, 0x12, 0x34, 0xAB, 0xCD]),
        ),
        (Request::ResetNullPosition, isu_frame(0x3C, &[])),
    ]
}

/// Each kind of answer with the bytes it must be from address 14, from appendix A.
fn responses() -> Vec<(Response, Vec<u8>)> {
    let most: Vec<u8> = (0..253).collect();
    vec![
        (Response::GoToSoftErrorState, isu_frame(0xE1, &[])),
        (Response::ResetModule, isu_frame(0xE3, &[])),
        (Response::ReadRam { start: 0x58, data: data(&[0xFF, 0xFF]) }, isu_frame(0xE5, &[0x58, 0xFF, 0xFF])),
        (Response::ReadRam { start: 3, data: data(&most) }, isu_frame(0xE5, &[&[3], &most[..]].concat())),
        (Response::WriteRam { start: 0x58, count_or_first_byte: 2 }, isu_frame(0xE7, &[0x58, 2])),
        (
            Response::ReadEeprom { start: 0x48, words: words(&[0x0102, 0xF0F1]) },
            isu_frame(0xE9, &[0x48, 1, 2, 0xF0, 0xF1]),
        ),
        (Response::WriteEeprom { start: 0x78, count: 8 }, isu_frame(0xEB, &[0x78, 8])),
        (Response::ResetNullPosition, isu_frame(0xED, &[])),
    ]
}

fn errors() -> Vec<(DeviceError, Vec<u8>)> {
    vec![
        (DeviceError::InvalidFunctionCode, hex("01 FF FF")),
        (DeviceError::InvalidChecksum, hex("01 FD FD")),
        (DeviceError::HardwareError { command_byte: 0x00 }, hex("02 F1 00 F1")),
        (DeviceError::HardwareError { command_byte: 0xFF }, hex("02 F1 FF F0")),
    ]
}

#[test]
fn every_command_has_the_bytes_of_its_table_and_comes_back() {
    for (request, bytes) in requests() {
        assert_eq!(request.encode(address(3)).unwrap().as_bytes(), bytes, "{request:?}");
        assert_eq!(Request::decode(&bytes), Ok(Command { address: address(3), request }));
    }
}

#[test]
fn every_answer_has_the_bytes_of_its_table_and_comes_back() {
    for (response, bytes) in responses() {
        assert_eq!(response.encode(address(14)).as_bytes(), bytes, "{response:?}");
        assert_eq!(Answer::decode(&bytes), Ok(Answer { address: address(14), response }));
    }
}

// I1
#[test]
fn the_error_answers_name_no_module() {
    for (error, bytes) in errors() {
        let answer = Answer::decode(&bytes).unwrap();
        assert_eq!(answer, Answer { address: Address::RESERVED, response: Response::Error(error) });
        assert_eq!(answer.response, Response::from(error));
        assert_eq!(answer.response.function(), None);
        assert_eq!(answer.encode().as_bytes(), bytes);
        // It is the answer to the request in flight, whichever module was asked.
        let expected = Request::READ_ANGLE.expected(address(7));
        assert_eq!(expected.check(&bytes, Checks::ALL), Ok(answer));
    }
    // Nothing else may carry address 15.
    for function in Function::ALL {
        let head = 0xF0 | function.get() << 1;
        let reserved = Err(DecodeError::ReservedAddress { head });
        assert_eq!(Request::decode(&isu_frame(head, &[])).map(drop), reserved);
        if function != Function::ResetNullPosition {
            let answer = Answer::decode(&isu_frame(head | 1, &[]));
            assert_eq!(answer.map(drop), Err(DecodeError::ReservedAddress { head: head | 1 }));
        }
    }
    assert_eq!(
        DeviceError::HardwareError { command_byte: 4 }.to_string(),
        "the module is in its hard error state (command byte 04)"
    );
    assert_eq!(DeviceError::InvalidChecksum.to_string(), "the module reports an invalid checksum");
    assert_eq!(DeviceError::InvalidFunctionCode.to_string(), "the module reports an invalid function code");
}

#[test]
fn addresses_are_0_to_14() {
    for number in 0..=u8::MAX {
        assert_eq!(Address::new(number).map(Address::get), (number < 15).then_some(number));
        assert_eq!(Address::try_from(number).map(u8::from).ok(), (number < 16).then_some(number));
    }
    assert!(Address::sweep().map(Address::get).eq(1..=14));
    assert!(Address::ANY.is_any() && !address(1).is_any());
    assert!(Address::RESERVED.is_reserved() && !address(14).is_reserved());
    assert_eq!(Address::try_from(16).unwrap_err().to_string(), "16 is not an ISU address (0-15)");
    assert_eq!(Request::ResetModule.encode(Address::RESERVED), Err(EncodeError::ReservedAddress));
}

#[test]
fn codes_are_those_of_table_2() {
    for (code, function) in (0..).zip(Function::ALL) {
        assert_eq!(function.get(), code);
        assert_eq!(Function::new(code), Some(function));
    }
    for code in 7..=u8::MAX {
        assert_eq!(Function::new(code), None);
    }
    let unknown = DecodeError::UnknownFunction { head: 0x0E };
    assert_eq!(Request::decode(&[0x01, 0x0E, 0x0E]), Err(unknown));
    assert_eq!(Answer::decode(&[0x01, 0x0F, 0x0F]), Err(DecodeError::UnknownFunction { head: 0x0F }));
}

#[test]
fn the_direction_bit_must_be_right() {
    for (_, bytes) in requests() {
        assert_eq!(Answer::decode(&bytes), Err(DecodeError::Direction { head: bytes[1] }));
    }
    for (_, bytes) in responses() {
        assert_eq!(Request::decode(&bytes), Err(DecodeError::Direction { head: bytes[1] }));
    }
}

// I2
#[test]
fn a_write_ram_answer_may_carry_the_count_or_the_first_byte() {
    let expected = Request::WriteRam { start: 0x58, data: data(&[0xAA, 0xBB]) }.expected(address(2));
    let answer = |third| isu_frame(0x27, &[0x58, third]);
    assert!(expected.check(&answer(2), Checks::ALL).is_ok());
    assert!(expected.check(&answer(0xAA), Checks::ALL).is_ok());
    let memory = DecodeError::Memory { received: (0x58, 0xBB), expected: (0x58, 2) };
    assert_eq!(expected.check(&answer(0xBB), Checks::ALL), Err(memory));
    assert!(expected.check(&answer(0xBB), Checks { command: false, ..Checks::ALL }).is_ok());
}

#[test]
fn an_answer_must_be_about_the_memory_that_was_asked_for() {
    let expected = Request::READ_ANGLE.expected(address(2));
    assert_eq!((expected.address(), expected.function()), (address(2), Function::ReadRam));
    assert_eq!(expected.size(), 6);
    let other_place = isu_frame(0x25, &[0x59, 1, 2]);
    let memory = DecodeError::Memory { received: (0x59, 2), expected: (0x58, 2) };
    assert_eq!(expected.check(&other_place, Checks::ALL), Err(memory));
    let longer = isu_frame(0x25, &[0x58, 1, 2, 3]);
    assert_eq!(expected.check(&longer, Checks::ALL), Err(DecodeError::Size { received: 7, expected: 6 }));
    assert!(expected.check(&longer, Checks { length: false, ..Checks::ALL }).is_ok());

    let eeprom = Request::ReadEeprom { start: 0x78, count: 2 }.expected(address(2));
    assert_eq!(eeprom.size(), 8);
    assert!(eeprom.check(&isu_frame(0x29, &[0x78, 1, 2, 3, 4]), Checks::ALL).is_ok());
    let memory = DecodeError::Memory { received: (0x77, 2), expected: (0x78, 2) };
    assert_eq!(eeprom.check(&isu_frame(0x29, &[0x77, 1, 2, 3, 4]), Checks::ALL), Err(memory));

    let write = Request::WriteEeprom { start: 0x48, words: words(&[1, 2]) }.expected(address(2));
    assert!(write.check(&isu_frame(0x2B, &[0x48, 2]), Checks::ALL).is_ok());
    let memory = DecodeError::Memory { received: (0x48, 1), expected: (0x48, 2) };
    assert_eq!(write.check(&isu_frame(0x2B, &[0x48, 1]), Checks::ALL), Err(memory));

    let reset = Request::ResetModule.expected(address(2));
    assert!(reset.check(&isu_frame(0x23, &[]), Checks::ALL).is_ok());
}

#[test]
fn answers_of_others_are_foreign_unless_all_were_asked() {
    let answer = isu_frame(0x35, &[0x58, 1, 2]);
    let differs = |request: Request, number| match request
        .expected(address(number))
        .check(&answer, Checks::ALL)
    {
        Err(DecodeError::Foreign { address, function: Function::ReadRam, differs }) if address.get() == 3 => {
            Some(differs)
        }
        _ => None,
    };
    assert_eq!(differs(Request::READ_ANGLE, 3), None);
    assert_eq!(differs(Request::READ_ANGLE, 0), None);
    assert_eq!(differs(Request::READ_ANGLE, 4), Some(Differs::Address));
    assert_eq!(differs(Request::ResetModule, 3), Some(Differs::Function));
    assert_eq!(differs(Request::ResetModule, 4), Some(Differs::Both));
    let blind = Checks::NONE;
    assert!(Request::ResetModule.expected(address(4)).check(&answer, blind).is_ok());
}

// I12
#[test]
fn the_angle_is_two_bytes_of_ram_from_58() {
    let answer = |start, bytes: &[u8]| Response::ReadRam { start, data: data(bytes) };
    assert_eq!(answer(ANGLE_RAM_ADDRESS, &[0x12, 0x34]).angle_word(), Some(0x1234));
    assert_eq!(answer(0x59, &[0x12, 0x34]).angle_word(), None);
    assert_eq!(answer(0x58, &[0x12]).angle_word(), None);
    assert_eq!(answer(0x58, &[0x12, 0x34, 0x56]).angle_word(), None);
    assert_eq!(Response::ResetModule.angle_word(), None);
    let answer = Answer { address: Address::ANY, response: answer(0x58, &[0x80, 0x00]) };
    assert_eq!(answer.angle(), Some(Angle::from_udeg(180_000_000)));
}

// I13
#[test]
fn writes_outside_the_documented_places_need_the_other_entry_point() {
    let eeprom = |start, count| Request::WriteEeprom { start, words: words(&vec![0; count]) };
    let ram = |start, count| Request::WriteRam { start, data: data(&vec![0; count]) };
    for (request, documented) in [
        (eeprom(0x48, 8), true),
        (eeprom(0x48, 16), true),
        (eeprom(0x57, 1), true),
        (eeprom(0x78, 8), true),
        (eeprom(0xD0, 8), true),
        (eeprom(0x47, 1), false),
        (eeprom(0x47, 2), false),
        (eeprom(0x57, 2), false),
        (eeprom(0x58, 1), false),
        (eeprom(0x77, 1), false),
        (eeprom(0x7F, 2), false),
        (eeprom(0xCF, 2), false),
        (eeprom(0xD0, 9), false),
        (eeprom(0xFF, 1), false),
        (ram(0x58, 1), true),
        (ram(0x59, 1), true),
        (ram(0x58, 2), true),
        (ram(0x58, 3), false),
        (ram(0x57, 2), false),
        (ram(0x5A, 1), false),
    ] {
        let encoded = request.encode(address(1));
        assert_eq!(encoded.is_ok(), documented, "{request:?}");
        assert!(documented || matches!(encoded, Err(EncodeError::Undocumented { .. })));
        let raw = request.encode_even_if_it_bricks_the_module(address(1)).unwrap();
        assert_eq!(Request::decode(raw.as_bytes()).unwrap().request, request);
    }
    let refused = eeprom(0x57, 2).encode(address(1)).unwrap_err();
    assert_eq!(refused, EncodeError::Undocumented { start: 0x57, count: 2 });
    assert_eq!(refused.to_string(), "2 from 57 on are not documented as writable");
}

#[test]
fn impossible_transfers_are_refused() {
    let refused = |request: Request| request.encode_even_if_it_bricks_the_module(address(1)).unwrap_err();
    let count = |count, max| EncodeError::Count { count, max };
    assert_eq!(refused(Request::ReadRam { start: 0, count: 0 }), count(0, 253));
    assert_eq!(refused(Request::ReadRam { start: 0, count: 254 }), count(254, 253));
    assert_eq!(refused(Request::ReadEeprom { start: 0, count: 0 }), count(0, 126));
    assert_eq!(refused(Request::ReadEeprom { start: 0, count: 127 }), count(127, 126));
    assert_eq!(refused(Request::WriteRam { start: 0, data: data(&[]) }), count(0, 253));
    assert_eq!(refused(Request::WriteEeprom { start: 0, words: words(&[]) }), count(0, 126));
    let beyond = EncodeError::BeyondEnd { start: 0xFF, count: 2 };
    assert_eq!(refused(Request::ReadRam { start: 0xFF, count: 2 }), beyond);
    assert!(Request::ReadRam { start: 0xFE, count: 2 }.encode(address(1)).is_ok());
    assert_eq!(beyond.to_string(), "2 from FF on go beyond FF");
    assert_eq!(count(0, 126).to_string(), "count 0 is not in 1..=126");
    assert_eq!(EncodeError::ReservedAddress.to_string(), "address 15 is reserved");
}

#[test]
fn memory_contents_are_as_long_as_a_message_can_carry() {
    assert_eq!((MAX_DATA, MAX_WORDS), (253, 126));
    assert!(Data::new(&[0; 253]).is_some() && Data::new(&[0; 254]).is_none());
    assert!(Words::new(&[0; 126]).is_some() && Words::new(&[0; 127]).is_none());
    let some = words(&[0x0001, 0xFFFE]);
    assert_eq!((some.len(), some.is_empty()), (2, false));
    assert!(words(&[]).is_empty());
    assert_eq!(some.as_be_bytes(), [0, 1, 0xFF, 0xFE]);
    assert_eq!(format!("{some:04X?}"), "[0001, FFFE]");
    assert_eq!(format!("{:?}", data(&[0, 0xAB])), "[00, AB]");
}

#[test]
fn whatever_is_wrong_is_named() {
    assert_eq!(Answer::decode(&[]), Err(DecodeError::Size { received: 0, expected: 3 }));
    assert_eq!(Request::decode(&[1, 0x0C]), Err(DecodeError::Size { received: 2, expected: 3 }));
    assert_eq!(Answer::decode(&[4, 5, 0x58, 0, 0]), Err(DecodeError::Size { received: 5, expected: 6 }));
    let checksum = DecodeError::Checksum { received: 0x5E, computed: 0x5D };
    assert_eq!(Answer::decode(&[4, 5, 0x58, 0, 0, 0x5E]), Err(checksum));
    assert!(Answer::decode_with(&[4, 5, 0x58, 0, 0, 0x5E], Checks::NONE).is_ok());
    assert_eq!(
        Request::decode(&[3, 4, 0x58, 2, 0]),
        Err(DecodeError::Checksum { received: 0, computed: 0x5E })
    );

    let foreign =
        |differs| DecodeError::Foreign { address: address(5), function: Function::ReadRam, differs };
    for (error, check, text) in [
        (
            DecodeError::LineErrors { errors: LineErrors::PARITY },
            Check::LineErrors,
            "receiver errors: LineErrors(8)",
        ),
        (DecodeError::Size { received: 7, expected: 8 }, Check::Length, "7 bytes instead of 8"),
        (
            DecodeError::Length { length: 4, function: Function::ResetModule },
            Check::Length,
            "length byte 04 cannot go with ResetModule",
        ),
        (
            DecodeError::Checksum { received: 0x12, computed: 0xAB },
            Check::Checksum,
            "checksum 12 instead of AB",
        ),
        (DecodeError::UnknownFunction { head: 0x0F }, Check::Command, "no function has the code in 0F"),
        (DecodeError::Direction { head: 0x04 }, Check::Command, "04 marks the wrong direction"),
        (DecodeError::ReservedAddress { head: 0xF3 }, Check::Address, "F3 carries the reserved address"),
        (foreign(Differs::Address), Check::Address, "answer of address 5 to ReadRam, which was not asked"),
        (foreign(Differs::Function), Check::Command, "answer of address 5 to ReadRam, which was not asked"),
        (foreign(Differs::Both), Check::Address, "answer of address 5 to ReadRam, which was not asked"),
        (
            DecodeError::Memory { received: (0x59, 2), expected: (0x58, 2) },
            Check::Command,
            "answer about (59, 02) (address, count) instead of (58, 02)",
        ),
    ] {
        assert_eq!(error.failed_check(), check);
        assert_eq!(error.to_string(), text);
    }
}

#[test]
fn frames_show_their_bytes() {
    let frame = Request::READ_ANGLE.encode(Address::ANY).unwrap();
    assert_eq!(format!("{frame:?}"), "Frame([03, 04, 58, 02, 5E])");
    assert_eq!(frame.as_ref(), [3, 4, 0x58, 2, 0x5E]);
    assert_ne!(frame, Request::ResetModule.encode(Address::ANY).unwrap());
}
