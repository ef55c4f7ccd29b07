//! T7: every command in both directions, limits, and the guide's contradictions T1–T14.

mod common;

use clino_codec::angle::Range;
use clino_codec::checks::{Check, Checks, ValueRange};
use clino_codec::t7::{
    Acceleration, Address, Answer, Axis, BaudRate, Command, DecodeError, DeviceInformation, DeviceType,
    Differs, Direction, EncodeError, Expected, Field, Millidegrees, Opcode, Request, Response, Status,
    Temperature, Text,
};
use common::{hex, t7_frame};

fn address(number: u8) -> Address {
    Address::new(number).unwrap()
}

/// Each command with the bytes it must be, from the tables of section 2.
fn requests() -> Vec<(Request, Vec<u8>)> {
    let get = |command| t7_frame(5, command, &[], false);
    let set = |command, body: &[u8]| t7_frame(5, command, body, true);
    vec![
        (Request::GetAllAngles, get(0x80)),
        (Request::GetAngle(Axis::Zero), get(0x81)),
        (Request::GetAngle(Axis::One), get(0x82)),
        (Request::GetAngle(Axis::Two), get(0x83)),
        (
            Request::SetAngle { axis: Axis::One, angle: Millidegrees(-180_000) },
            set(0x84, &[1, 0xFF, 0xFD, 0x40, 0xE0]),
        ),
        (Request::GetAllAngleOffsets, get(0x85)),
        (
            Request::SetAngleOffset { axis: Axis::Zero, offset: Millidegrees(359_999) },
            set(0x86, &[0, 0x00, 0x05, 0x7E, 0x3F]),
        ),
        (Request::GetAllData, get(0x87)),
        (Request::GetAllDirections, get(0x88)),
        (Request::SetDirection { axis: Axis::Two, direction: Direction::Reversed }, set(0x89, &[2, 1])),
        (Request::SetDirection { axis: Axis::Zero, direction: Direction::Normal }, set(0x89, &[0, 0])),
        (Request::GetDamping, get(0x8A)),
        (Request::SetDamping { damping_ms: 2 }, set(0x8B, &[0x00, 0x02])),
        (Request::SetDamping { damping_ms: 5_000 }, set(0x8B, &[0x13, 0x88])),
        (Request::GetAngleOutputRange, get(0x8C)),
        (Request::SetAngleOutputRange(Range::Bidirectional), set(0x8D, &[0])),
        (Request::SetAngleOutputRange(Range::Unidirectional), set(0x8D, &[1])),
        (Request::GetDeviceInformation, get(0x8E)),
        (Request::SetBaudRate(BaudRate::B115200), set(0x8F, &[0])),
        (Request::SetBaudRate(BaudRate::B57600), set(0x8F, &[1])),
        (Request::SetBaudRate(BaudRate::B38400), set(0x8F, &[2])),
        (Request::SetBaudRate(BaudRate::B19200), set(0x8F, &[3])),
        (Request::SetBaudRate(BaudRate::B9600), set(0x8F, &[4])),
        (
            Request::SetAddress {
                device_type: DeviceType::T7_3,
                serial: 0xDEAD_BEEF,
                new_address: address(100),
            },
            set(0x91, &[1, 0xDE, 0xAD, 0xBE, 0xEF, 100]),
        ),
        (
            Request::SetAddress { device_type: DeviceType::T7_1, serial: 25_033, new_address: address(1) },
            set(0x91, &[4, 0, 0, 0x61, 0xC9, 1]),
        ),
    ]
}

/// Each kind of answer with the bytes it must be, from the tables of section 2.
fn responses() -> Vec<(Response, Vec<u8>)> {
    let frame = |command, body: &[u8]| t7_frame(127, command, body, true);
    let angles = [Millidegrees(1), Millidegrees(-2), Millidegrees(359_999)];
    let angle_bytes = [0, 0, 0, 1, 0xFF, 0xFF, 0xFF, 0xFE, 0x00, 0x05, 0x7E, 0x3F];
    let mut all = vec![
        (
            Response::GetAllAngles { angles, temperature: Temperature(-501) },
            frame(0x80, &[&angle_bytes[..], &[0xFE, 0x0B]].concat()),
        ),
        (Response::GetAngle { axis: Axis::Zero, angle: Millidegrees(0) }, frame(0x81, &[0; 4])),
        (
            Response::GetAngle { axis: Axis::One, angle: Millidegrees(-180_000) },
            frame(0x82, &[0xFF, 0xFD, 0x40, 0xE0]),
        ),
        (
            Response::GetAngle { axis: Axis::Two, angle: Millidegrees(179_999) },
            frame(0x83, &[0x00, 0x02, 0xBF, 0x1F]),
        ),
        (Response::GetAllAngleOffsets { offsets: angles }, frame(0x85, &angle_bytes)),
        (
            Response::GetAllData {
                angles,
                temperature: Temperature(19_001),
                accelerations: [Acceleration(i32::MIN), Acceleration(0), Acceleration(i32::MAX)],
                serial: u32::MAX,
            },
            frame(
                0x87,
                &[
                    &angle_bytes[..],
                    &[0x4A, 0x39],
                    &[0x80, 0, 0, 0, 0, 0, 0, 0, 0x7F, 0xFF, 0xFF, 0xFF],
                    &[0xFF; 4],
                ]
                .concat(),
            ),
        ),
        (
            Response::GetAllDirections {
                directions: [Direction::Reversed, Direction::Normal, Direction::Reversed],
            },
            frame(0x88, &[1, 0, 1]),
        ),
        (Response::GetDamping { damping_ms: 5_000 }, frame(0x8A, &[0x13, 0x88])),
        (Response::GetAngleOutputRange(Range::Bidirectional), frame(0x8C, &[0])),
        (Response::GetAngleOutputRange(Range::Unidirectional), frame(0x8C, &[1])),
        (
            Response::GetDeviceInformation(DeviceInformation {
                serial: 0x0102_0304,
                firmware: Text::new(*b"1.7   "),
                product: Text::new(*b"T7-3  "),
                calibration_state: 0x8001,
            }),
            frame(0x8E, b"\x01\x02\x03\x041.7   T7-3  \x80\x01"),
        ),
    ];
    for code in 0..=u8::MAX {
        let status = Status::new(code);
        all.extend([
            (Response::SetAngle(status), frame(0x84, &[code])),
            (Response::SetAngleOffset(status), frame(0x86, &[code])),
            (Response::SetDirection(status), frame(0x89, &[code])),
            (Response::SetDamping(status), frame(0x8B, &[code])),
            (Response::SetAngleOutputRange(status), frame(0x8D, &[code])),
            (Response::SetBaudRate(status), frame(0x8F, &[code])),
            (Response::SetAddress(status), frame(0x91, &[code])),
        ]);
    }
    all
}

#[test]
fn every_command_has_the_bytes_of_its_table_and_comes_back() {
    for (request, bytes) in requests() {
        assert_eq!(request.encode(address(5)).unwrap().as_bytes(), bytes, "{request:?}");
        assert_eq!(Request::decode(&bytes), Ok(Command { address: address(5), request }));
    }
}

#[test]
fn every_answer_has_the_bytes_of_its_table_and_comes_back() {
    for (response, bytes) in responses() {
        let address = Address::FACTORY;
        assert_eq!(response.encode(address).as_bytes(), bytes, "{response:?}");
        let answer = Answer { address, response, length_quirk: false };
        assert_eq!(Answer::decode(&bytes), Ok(answer));
        let expected = Expected { address, opcode: response.opcode() };
        assert_eq!(expected.size(), bytes.len());
        assert_eq!(expected.check(&bytes, Checks::ALL), Ok(answer));
    }
}

#[test]
fn requests_and_responses_agree_on_their_command() {
    let asked: Vec<Opcode> = requests().iter().map(|(request, _)| request.opcode()).collect();
    let answered: Vec<Opcode> = responses().iter().map(|(response, _)| response.opcode()).collect();
    for opcode in Opcode::ALL {
        assert!(asked.contains(&opcode) && answered.contains(&opcode), "{opcode:?}");
        assert_eq!(Opcode::new(opcode.get()), Some(opcode));
    }
    for (response, _) in responses() {
        assert_eq!(response.status().is_some(), response.opcode().is_set());
    }
    assert_eq!(
        Request::GetDamping.expected(address(9)),
        Expected { address: address(9), opcode: Opcode::GetDamping }
    );
}

#[test]
fn codes_are_those_of_section_2() {
    let codes: Vec<u8> = Opcode::ALL.iter().map(|opcode| opcode.get()).collect();
    let documented = [
        0x80, 0x81, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8A, 0x8B, 0x8C, 0x8D, 0x8E, 0x8F, 0x91,
    ];
    assert_eq!(codes, documented);
    let axes = Opcode::ALL.map(Opcode::axis);
    assert_eq!(axes[..5], [None, Some(Axis::Zero), Some(Axis::One), Some(Axis::Two), None]);
    assert!(axes[5..].iter().all(Option::is_none));
    assert_eq!(Axis::ALL.map(Opcode::get_angle), [Opcode::GetAngle0, Opcode::GetAngle1, Opcode::GetAngle2]);
    for code in (0..=u8::MAX).filter(|code| !documented.contains(code)) {
        assert_eq!(Opcode::new(code), None);
        let frame = t7_frame(5, code, &[0], true);
        let unknown = DecodeError::UnknownCommand { command: code };
        assert_eq!(Answer::decode(&frame), Err(unknown));
        assert_eq!(Request::decode(&frame), Err(unknown));
    }
}

// T1
#[test]
fn get_all_angles_with_the_printed_length_is_accepted_and_reported() {
    let printed = hex("05 0A 80 00 02 7D B2 FF FF 4E F8 00 00 4E DE 08 FC CC");
    let right = hex("05 10 80 00 02 7D B2 FF FF 4E F8 00 00 4E DE 08 FC C6");
    let (quirk, plain) = (Answer::decode(&printed).unwrap(), Answer::decode(&right).unwrap());
    assert_eq!((quirk.length_quirk, plain.length_quirk), (true, false));
    assert_eq!(quirk.response, plain.response);
    assert_eq!(quirk.encode().as_bytes(), printed);
    assert_eq!(plain.encode().as_bytes(), right);
    // The checksum is demanded all the same, and so are all 18 bytes.
    let mut swapped = printed.clone();
    swapped[17] = 0xC6;
    assert_eq!(Answer::decode(&swapped), Err(DecodeError::Checksum { received: 0xC6, computed: 0xCC }));
    assert_eq!(Answer::decode(&printed[..12]), Err(DecodeError::Size { received: 12, expected: 18 }));
    // No other answer may have it.
    let offsets = hex("05 0A 85 00 00 28 0A FF FF 4E 76 00 00 AF C8 01");
    assert_eq!(Answer::decode(&offsets), Err(DecodeError::Length { received: 0x0A, expected: 0x0E }));
    let angle = Answer { length_quirk: true, ..Answer::decode(&hex("05 06 81 FF FF 4E FF 29")).unwrap() };
    assert_eq!(angle.encode().as_bytes(), hex("05 06 81 FF FF 4E FF 29"));
}

// T3
#[test]
fn the_printed_command_of_section_2_6_1_is_refused_and_that_of_its_table_sent() {
    assert_eq!(Request::GetAngleOutputRange.encode(address(5)).unwrap().as_bytes(), [0x05, 0x01, 0x8C]);
    assert_eq!(Request::decode(&[0x05, 0x02, 0x8C]), Err(DecodeError::Length { received: 2, expected: 1 }));
}

// T5
#[test]
fn product_names_are_free_text() {
    let text = |bytes: &[u8; 6]| Text::new(*bytes);
    assert_eq!(text(b"X4-1  ").as_str(), Some("X4-1"));
    assert_eq!(text(b"      ").as_str(), Some(""));
    assert_eq!(text(b" T7 -1").as_str(), Some(" T7 -1"));
    assert_eq!(text(b"T7\xFF   ").as_str(), None);
    assert_eq!(text("T7é  ".as_bytes().try_into().unwrap()).as_str(), None);
    assert_eq!(text(b"T7\xFF   ").trimmed(), b"T7\xFF");
    assert_eq!(text(b"T7-1  ").as_bytes(), b"T7-1  ");
}

/// Guide section 1: a single-axis device measures axis 2 only. Its product type ends in `-1` (section 2.7.1).
#[test]
fn a_product_type_tells_which_axes_a_device_has() {
    let of = |product: &[u8; 6]| DeviceInformation {
        serial: 25_033,
        firmware: Text::new(*b"0.32  "),
        product: Text::new(*product),
        calibration_state: 0,
    };
    let axes = |product| Axis::ALL.map(|axis| of(product).has_axis(axis));
    for single in [b"T7-1  ", b"X4-1  ", b"X4-1\0\0", b"T7-X-1"] {
        assert!(of(single).is_single_axis(), "{single:?}");
        assert_eq!(axes(single), [false, false, true], "{single:?}");
    }
    // What is not known to lack an axis has it.
    for other in [b"T7-3  ", b"T7-11 ", b"1     ", b"-     ", b"T7 1  ", b"      ", b"\0\0\0\0\0\0"] {
        assert!(!of(other).is_single_axis(), "{other:?}");
        assert_eq!(axes(other), [true; 3], "{other:?}");
    }
}

#[test]
fn a_status_says_what_it_means() {
    assert_eq!(Status::new(3).to_string(), "status 3, invalid parameter");
    assert_eq!(Status::new(8).to_string(), "status 8, its memory could not be written");
    assert_eq!(Status::new(2).to_string(), "status 2, no documented meaning");
}

// T6
#[test]
fn discovery_asks_every_address_a_device_can_have() {
    let swept: Vec<u8> = Address::sweep().map(Address::get).collect();
    let documented: Vec<u8> = (1..=100).chain([127]).collect();
    assert_eq!(swept, documented);
    let rates = BaudRate::ALL.map(BaudRate::bits_per_second);
    assert_eq!(rates, [115_200, 57_600, 38_400, 19_200, 9_600]);
}

#[test]
fn baud_rates_by_index_and_by_rate() {
    for (index, rate) in BaudRate::ALL.into_iter().enumerate() {
        assert_eq!(usize::from(rate.get()), index);
        assert_eq!(BaudRate::new(rate.get()), Some(rate));
        assert_eq!(BaudRate::from_bits_per_second(rate.bits_per_second()), Some(rate));
    }
    assert_eq!(BaudRate::new(5), None);
    assert_eq!(BaudRate::from_bits_per_second(9_601), None);
}

// T8
#[test]
fn temperatures_outside_the_documented_range_are_reported_as_such() {
    for (raw, documented) in [(-501, false), (-500, true), (19_000, true), (19_001, false)] {
        let bytes = i16::to_be_bytes(raw);
        let frame = t7_frame(5, 0x80, &[&[0; 12][..], &bytes].concat(), true);
        let Response::GetAllAngles { temperature, .. } = Answer::decode(&frame).unwrap().response else {
            panic!()
        };
        assert_eq!((temperature.centi_celsius(), temperature.is_documented()), (raw, documented));
    }
}

// T9
#[test]
fn only_1_to_100_can_be_given_as_a_new_address() {
    let request = |new_address| Request::SetAddress { device_type: DeviceType::T7_1, serial: 1, new_address };
    for number in 1..=100 {
        assert!(address(number).is_assignable());
        assert!(request(address(number)).encode(Address::FACTORY).is_ok());
    }
    for refused in [Address::FACTORY, Address::ALL] {
        assert!(!refused.is_assignable());
        let error = EncodeError::OutOfRange {
            field: Field::NewAddress,
            value: i32::from(refused.get()),
            min: 1,
            max: 100,
        };
        assert_eq!(request(refused).encode(Address::FACTORY), Err(error));
    }
    for code in [0, 101, 125, 126, 127, 128, 255] {
        let frame = t7_frame(5, 0x91, &[4, 0, 0, 0, 1, code], true);
        let error = DecodeError::Value { field: Field::NewAddress, value: i32::from(code) };
        assert_eq!(Request::decode(&frame), Err(error));
    }
}

#[test]
fn device_types_are_1_and_4() {
    for code in 0..=u8::MAX {
        let known = DeviceType::new(code);
        assert_eq!(known.is_some(), code == 1 || code == 4);
        assert!(known.is_none_or(|device_type| device_type.get() == code));
        let frame = t7_frame(5, 0x91, &[code, 0, 0, 0, 1, 1], true);
        assert_eq!(Request::decode(&frame).is_ok(), known.is_some());
    }
}

// T11
#[test]
fn the_all_respond_address_takes_commands_with_short_answers_only() {
    let long = [0x80, 0x85, 0x87, 0x8E];
    for (request, mut bytes) in requests() {
        let encoded = request.encode(Address::ALL);
        if long.contains(&bytes[2]) {
            let length = request.opcode().response_length();
            assert!(length > 8);
            assert_eq!(
                encoded,
                Err(EncodeError::NotForAll { opcode: request.opcode(), response_length: length })
            );
            // But it can be heard.
            assert_eq!(Request::decode(&[126, 1, bytes[2]]), Ok(Command { address: Address::ALL, request }));
        } else {
            bytes[0] = 126;
            if let [.., checksum] = &mut bytes[3..] {
                *checksum = checksum.wrapping_sub(126 - 5);
            }
            assert_eq!(encoded.unwrap().as_bytes(), bytes);
            assert_eq!(Request::decode(&bytes), Ok(Command { address: Address::ALL, request }));
        }
    }
    // No device answers as 126.
    assert_eq!(
        Answer::decode(&t7_frame(126, 0x81, &[0; 4], true)),
        Err(DecodeError::UnknownAddress { address: 126 })
    );
}

#[test]
fn addresses_are_1_to_100_and_127() {
    for number in 0..=u8::MAX {
        let device = (1..=100).contains(&number) || number == 127;
        assert_eq!(Address::new(number).is_some(), device);
        assert_eq!(Address::of_request(number).is_some(), device || number == 126);
        assert_eq!(
            Address::try_from(number).map(u8::from).ok(),
            Address::of_request(number).map(Address::get)
        );
        let asked = Request::decode(&[number, 0x01, 0x81]);
        match Address::of_request(number) {
            Some(address) => assert_eq!(asked.unwrap().address, address),
            None => assert_eq!(asked, Err(DecodeError::UnknownAddress { address: number })),
        }
    }
    assert_eq!(
        Address::try_from(0).unwrap_err().to_string(),
        "0 is not a T7 address (1-100, 127, or 126 for all)"
    );
}

// T13
#[test]
fn axes_are_0_1_and_2() {
    for number in 0..=u8::MAX {
        assert_eq!(Axis::new(number).map(Axis::get), (number < 3).then_some(number));
        let set_angle = Request::decode(&t7_frame(5, 0x84, &[number, 0, 0, 0, 0], true));
        let set_offset = Request::decode(&t7_frame(5, 0x86, &[number, 0, 0, 0, 0], true));
        let set_direction = Request::decode(&t7_frame(5, 0x89, &[number, 0], true));
        for decoded in [set_angle, set_offset, set_direction] {
            let error = DecodeError::Value { field: Field::Axis, value: i32::from(number) };
            assert_eq!(decoded.err(), (number > 2).then_some(error));
        }
    }
    assert_eq!(Axis::ALL.map(|axis| axis.of([10, 11, 12])), [10, 11, 12]);
}

// T14
#[test]
fn get_commands_have_no_checksum_and_everything_else_does() {
    for (request, bytes) in requests() {
        if request.opcode().is_set() {
            let mut wrong = bytes.clone();
            let last = wrong.last_mut().unwrap();
            *last = last.wrapping_add(1);
            let error = DecodeError::Checksum {
                received: bytes[bytes.len() - 1].wrapping_add(1),
                computed: bytes[bytes.len() - 1],
            };
            assert_eq!(Request::decode(&wrong), Err(error));
            assert_eq!(error.failed_check(), Check::Checksum);
        } else {
            assert_eq!(bytes.len(), 3);
        }
    }
    for (_, mut bytes) in responses() {
        let last = bytes.len() - 1;
        bytes[last] ^= 0x80;
        assert!(matches!(Answer::decode(&bytes), Err(DecodeError::Checksum { .. })));
        let blind = Checks { checksum: false, ..Checks::ALL };
        assert!(Answer::decode_with(&bytes, blind).is_ok());
    }
}

#[test]
fn parameters_beyond_their_limits_are_refused_before_anything_is_sent() {
    let refused = |request: Request| request.encode(address(5)).err();
    let out_of_range = |field, value, min, max| Some(EncodeError::OutOfRange { field, value, min, max });
    for (mdeg, ok) in
        [(-180_001, false), (-180_000, true), (359_999, true), (360_000, false), (i32::MIN, false)]
    {
        let limits = |field| out_of_range(field, mdeg, -180_000, 359_999).filter(|_| !ok);
        let angle = Request::SetAngle { axis: Axis::Two, angle: Millidegrees(mdeg) };
        assert_eq!(refused(angle), limits(Field::Angle));
        let offset = Request::SetAngleOffset { axis: Axis::Two, offset: Millidegrees(mdeg) };
        assert_eq!(refused(offset), limits(Field::Offset));
    }
    for (damping_ms, ok) in
        [(0, false), (1, false), (2, true), (5_000, true), (5_001, false), (u16::MAX, false)]
    {
        let limits = out_of_range(Field::Damping, i32::from(damping_ms), 2, 5_000).filter(|_| !ok);
        assert_eq!(refused(Request::SetDamping { damping_ms }), limits);
        let decoded = Request::decode(&t7_frame(5, 0x8B, &damping_ms.to_be_bytes(), true));
        let error = DecodeError::Value { field: Field::Damping, value: i32::from(damping_ms) };
        assert_eq!(decoded.err(), (!ok).then_some(error));
    }
    let error = refused(Request::SetDamping { damping_ms: 1 }).unwrap();
    assert_eq!(error.to_string(), "Damping 1 is not in 2..=5000");
    let error = Request::GetAllData.encode(Address::ALL).unwrap_err();
    let text = "GetAllData must not go to the all-respond address: its response length 32 exceeds 8";
    assert_eq!(error.to_string(), text);
}

#[test]
fn codes_without_a_meaning_are_refused_with_their_value() {
    for code in 2..=u8::MAX {
        let value = |field| DecodeError::Value { field, value: i32::from(code) };
        let asked = |command, body: &[u8]| Request::decode(&t7_frame(5, command, body, true)).err();
        assert_eq!(asked(0x89, &[0, code]), Some(value(Field::Direction)));
        assert_eq!(asked(0x8D, &[code]), Some(value(Field::OutputRange)));
        assert_eq!(asked(0x8F, &[code]), (code > 4).then_some(value(Field::BaudRate)));
        let answered = |command, body: &[u8]| Answer::decode(&t7_frame(5, command, body, true)).err();
        assert_eq!(answered(0x88, &[code, 0, 0]), Some(value(Field::Direction)));
        assert_eq!(answered(0x88, &[0, code, 0]), Some(value(Field::Direction)));
        assert_eq!(answered(0x88, &[0, 0, code]), Some(value(Field::Direction)));
        assert_eq!(answered(0x8C, &[code]), Some(value(Field::OutputRange)));
    }
}

#[test]
fn numbers_are_checked_as_narrowly_as_asked() {
    let angle = |mdeg: i32| t7_frame(5, 0x83, &mdeg.to_be_bytes(), true);
    let accepted =
        |mdeg: i32, values| Answer::decode_with(&angle(mdeg), Checks { values, ..Checks::ALL }).is_ok();
    let bidirectional = ValueRange::Mode(Range::Bidirectional);
    let unidirectional = ValueRange::Mode(Range::Unidirectional);
    for (mdeg, any, bi, uni) in [
        (i32::MIN, false, false, false),
        (-180_001, false, false, false),
        (-180_000, true, true, false),
        (-1, true, true, false),
        (0, true, true, true),
        (179_999, true, true, true),
        (180_000, true, false, true),
        (359_999, true, false, true),
        (360_000, false, false, false),
    ] {
        let seen = [ValueRange::Off, ValueRange::AnyMode, bidirectional, unidirectional];
        assert_eq!(seen.map(|values| accepted(mdeg, values)), [true, any, bi, uni], "{mdeg}");
    }
    // The third of three is looked at too, and offsets like angles.
    let third = [&[0; 8][..], &360_000_i32.to_be_bytes()].concat();
    let value = |field| DecodeError::Value { field, value: 360_000 };
    let all_angles = t7_frame(5, 0x80, &[&third[..], &[0; 2]].concat(), true);
    assert_eq!(Answer::decode(&all_angles), Err(value(Field::Angle)));
    assert_eq!(Answer::decode(&t7_frame(5, 0x85, &third, true)), Err(value(Field::Offset)));
    let all_data = t7_frame(5, 0x87, &[&third[..], &[0; 18]].concat(), true);
    assert_eq!(Answer::decode(&all_data), Err(value(Field::Angle)));
    for (damping_ms, ok) in [(1_u16, false), (2, true), (5_000, true), (5_001, false)] {
        let frame = t7_frame(5, 0x8A, &damping_ms.to_be_bytes(), true);
        assert_eq!(Answer::decode(&frame).is_ok(), ok);
        assert!(Answer::decode_with(&frame, Checks::NONE).is_ok());
    }
}

#[test]
fn units_convert_as_section_1_says() {
    assert_eq!(Millidegrees(123_456).angle().unwrap().udeg(), 123_456_000);
    assert_eq!(Millidegrees(i32::MAX).angle(), None);
    assert_eq!(Millidegrees::from(Millidegrees(-45_313).angle().unwrap()), Millidegrees(-45_313));
    // The accelerations of section 2.3 in g: 0.00590, 0.01040, −0.95557.
    assert_eq!([604, 1_064, -97_755].map(|raw| Acceleration(raw).micro_g()), [5_904, 10_401, -955_572]);
    assert_eq!(Acceleration(Acceleration::STEPS_PER_G).micro_g(), 1_000_000);
    // The extremes, in millionths of g, worked out exactly: ±2^31 · 10^6 / 102 300.
    assert_eq!(Acceleration(i32::MIN).micro_g(), -20_992_020_020);
    assert_eq!(Acceleration(i32::MAX).micro_g(), 20_992_020_010);
}

#[test]
fn whatever_is_wrong_is_named() {
    let good = hex("05 06 83 FF FF 4E FF 27");
    assert_eq!(Answer::decode(&[]), Err(DecodeError::Size { received: 0, expected: 5 }));
    assert_eq!(Answer::decode(&good[..3]), Err(DecodeError::Size { received: 3, expected: 5 }));
    assert_eq!(Answer::decode(&good[..7]), Err(DecodeError::Size { received: 7, expected: 8 }));
    assert_eq!(Request::decode(&[5, 1]), Err(DecodeError::Size { received: 2, expected: 3 }));
    assert_eq!(Request::decode(&[5, 1, 0x80, 0]), Err(DecodeError::Size { received: 4, expected: 3 }));
    let longer = [&good[..], &[0]].concat();
    assert_eq!(Answer::decode(&longer), Err(DecodeError::Size { received: 9, expected: 8 }));

    let from = |number, opcode| Expected { address: address(number), opcode };
    let foreign = |expected: Expected| match expected.check(&good, Checks::ALL) {
        Err(DecodeError::Foreign { address, opcode: Opcode::GetAngle2, differs }) if address.get() == 5 => {
            Some(differs)
        }
        _ => None,
    };
    assert_eq!(foreign(from(5, Opcode::GetAngle2)), None);
    assert_eq!(foreign(from(6, Opcode::GetAngle2)), Some(Differs::Address));
    assert_eq!(foreign(from(5, Opcode::GetAngle1)), Some(Differs::Command));
    assert_eq!(foreign(from(6, Opcode::GetAngle1)), Some(Differs::Both));
    let anybody = Expected { address: Address::ALL, opcode: Opcode::GetAngle2 };
    assert!(anybody.check(&good, Checks::ALL).is_ok());
    assert!(from(6, Opcode::GetAngle1).check(&good, Checks::NONE).is_ok());
}

#[test]
fn errors_tell_their_layer_and_their_values() {
    use clino_codec::character::LineErrors;
    let foreign = |differs| DecodeError::Foreign { address: address(5), opcode: Opcode::GetAngle0, differs };
    for (error, check, text) in [
        (
            DecodeError::LineErrors { errors: LineErrors::FRAMING },
            Check::LineErrors,
            "receiver errors: LineErrors(1)",
        ),
        (DecodeError::Size { received: 7, expected: 8 }, Check::Length, "7 bytes instead of 8"),
        (DecodeError::Length { received: 10, expected: 6 }, Check::Length, "length byte 0A instead of 06"),
        (
            DecodeError::Checksum { received: 0x12, computed: 0xAB },
            Check::Checksum,
            "checksum 12 instead of AB",
        ),
        (DecodeError::UnknownAddress { address: 0 }, Check::Address, "no device can have address 0"),
        (DecodeError::UnknownCommand { command: 0x90 }, Check::Command, "no command has code 90"),
        (foreign(Differs::Address), Check::Address, "answer of address 5 to GetAngle0, which was not asked"),
        (foreign(Differs::Command), Check::Command, "answer of address 5 to GetAngle0, which was not asked"),
        (foreign(Differs::Both), Check::Address, "answer of address 5 to GetAngle0, which was not asked"),
        (DecodeError::Value { field: Field::Axis, value: 3 }, Check::Value, "Axis cannot be 3"),
    ] {
        assert_eq!(error.failed_check(), check);
        assert_eq!(error.to_string(), text);
    }
}

#[test]
fn statuses_are_those_of_section_1_3_and_unknown_ones_survive() {
    let known = [
        (0, Status::Success),
        (1, Status::InvalidCommand),
        (3, Status::InvalidParameter),
        (4, Status::ChecksumError),
        (5, Status::CommandFailed),
        (7, Status::FlashEraseError),
        (8, Status::FlashProgramError),
        (9, Status::AddressOutOfRange),
    ];
    for code in 0..=u8::MAX {
        let status = Status::from(code);
        assert_eq!(u8::from(status), code);
        match known.iter().find(|(known, _)| *known == code) {
            Some((_, documented)) => assert_eq!(status, *documented),
            None => assert!(matches!(status, Status::Unknown(unknown) if unknown.get() == code)),
        }
    }
}

#[test]
fn frames_show_their_bytes() {
    let frame = Request::GetAngle(Axis::Zero).encode(address(5)).unwrap();
    assert_eq!(format!("{frame:?}"), "Frame([05, 01, 81])");
    assert_eq!(frame.as_ref(), [5, 1, 0x81]);
    assert_ne!(frame, Request::GetAngle(Axis::One).encode(address(5)).unwrap());
}

/// T7 guide §1: mode 0 reports −180.000°…179.999°, mode 1 0°…359.999°.
#[test]
fn an_angle_is_in_the_range_of_its_output_mode() {
    for (millidegrees, bidirectional, unidirectional) in [
        (i32::MIN, false, false),
        (-180_001, false, false),
        (-180_000, true, false),
        (-1, true, false),
        (0, true, true),
        (179_999, true, true),
        (180_000, false, true),
        (359_999, false, true),
        (360_000, false, false),
        (i32::MAX, false, false),
    ] {
        let angle = Millidegrees(millidegrees);
        assert_eq!(angle.is_in(Range::Bidirectional), bidirectional, "{millidegrees}");
        assert_eq!(angle.is_in(Range::Unidirectional), unidirectional, "{millidegrees}");
        assert_eq!(angle.is_in_any(), bidirectional || unidirectional, "{millidegrees}");
    }
}
