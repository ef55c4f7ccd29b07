//! Properties over random messages and random noise.

mod common;

use clino_codec::angle::{Angle, Range};
use clino_codec::character::{Character, LineErrors};
use clino_codec::checks::Checks;
use clino_codec::isu;
use clino_codec::isu::eeprom::{pack, unpack};
use clino_codec::t7::{self, Axis, BaudRate, DeviceType, Direction, Millidegrees};
use common::{isu_frame, t7_frame};
use proptest::prelude::*;
use proptest::sample::select;

fn t7_address() -> impl Strategy<Value = t7::Address> {
    (1..=101_u8).prop_map(|number| t7::Address::new(if number > 100 { 127 } else { number }).unwrap())
}

fn millidegrees() -> impl Strategy<Value = Millidegrees> {
    (-180_000..360_000).prop_map(Millidegrees)
}

fn range() -> impl Strategy<Value = Range> {
    select(vec![Range::Bidirectional, Range::Unidirectional])
}

fn direction() -> impl Strategy<Value = Direction> {
    select(vec![Direction::Normal, Direction::Reversed])
}

fn t7_request() -> impl Strategy<Value = t7::Request> {
    use t7::Request as R;
    let axis = || select(Axis::ALL.to_vec());
    prop_oneof![
        Just(R::GetAllAngles),
        axis().prop_map(R::GetAngle),
        (axis(), millidegrees()).prop_map(|(axis, angle)| R::SetAngle { axis, angle }),
        Just(R::GetAllAngleOffsets),
        (axis(), millidegrees()).prop_map(|(axis, offset)| R::SetAngleOffset { axis, offset }),
        Just(R::GetAllData),
        Just(R::GetAllDirections),
        (axis(), direction()).prop_map(|(axis, direction)| R::SetDirection { axis, direction }),
        Just(R::GetDamping),
        (2..=5_000_u16).prop_map(|damping_ms| R::SetDamping { damping_ms }),
        Just(R::GetAngleOutputRange),
        range().prop_map(R::SetAngleOutputRange),
        Just(R::GetDeviceInformation),
        select(BaudRate::ALL.to_vec()).prop_map(R::SetBaudRate),
        (select(vec![DeviceType::T7_1, DeviceType::T7_3]), any::<u32>(), 1..=100_u8).prop_map(
            |(device_type, serial, address)| R::SetAddress {
                device_type,
                serial,
                new_address: t7::Address::new(address).unwrap(),
            }
        ),
    ]
}

fn t7_response() -> impl Strategy<Value = t7::Response> {
    use t7::Response as R;
    let angles = || [millidegrees(), millidegrees(), millidegrees()];
    let status = any::<u8>().prop_map(t7::Status::new);
    let text = || any::<[u8; 6]>().prop_map(t7::Text::new);
    prop_oneof![
        (angles(), any::<i16>())
            .prop_map(|(angles, raw)| R::GetAllAngles { angles, temperature: t7::Temperature(raw) }),
        (select(Axis::ALL.to_vec()), millidegrees()).prop_map(|(axis, angle)| R::GetAngle { axis, angle }),
        angles().prop_map(|offsets| R::GetAllAngleOffsets { offsets }),
        (angles(), any::<i16>(), any::<[i32; 3]>(), any::<u32>()).prop_map(
            |(angles, raw, accelerations, serial)| {
                R::GetAllData {
                    angles,
                    temperature: t7::Temperature(raw),
                    accelerations: accelerations.map(t7::Acceleration),
                    serial,
                }
            }
        ),
        [direction(), direction(), direction()].prop_map(|directions| R::GetAllDirections { directions }),
        (2..=5_000_u16).prop_map(|damping_ms| R::GetDamping { damping_ms }),
        range().prop_map(R::GetAngleOutputRange),
        (any::<u32>(), text(), text(), any::<u16>()).prop_map(
            |(serial, firmware, product, calibration_state)| {
                R::GetDeviceInformation(t7::DeviceInformation {
                    serial,
                    firmware,
                    product,
                    calibration_state,
                })
            }
        ),
        (0..7, status).prop_map(|(command, status)| match command {
            0 => R::SetAngle(status),
            1 => R::SetAngleOffset(status),
            2 => R::SetDirection(status),
            3 => R::SetDamping(status),
            4 => R::SetAngleOutputRange(status),
            5 => R::SetBaudRate(status),
            _ => R::SetAddress(status),
        }),
    ]
}

fn isu_address() -> impl Strategy<Value = isu::Address> {
    (0..15_u8).prop_map(|number| isu::Address::new(number).unwrap())
}

fn isu_data() -> impl Strategy<Value = isu::Data> {
    prop::collection::vec(any::<u8>(), 1..=253).prop_map(|bytes| isu::Data::new(&bytes).unwrap())
}

fn isu_words() -> impl Strategy<Value = isu::Words> {
    prop::collection::vec(any::<u16>(), 1..=126).prop_map(|words| isu::Words::new(&words).unwrap())
}

fn isu_request() -> impl Strategy<Value = isu::Request> {
    use isu::Request as R;
    prop_oneof![
        Just(R::GoToSoftErrorState),
        Just(R::ResetModule),
        (0..4_u8, 1..=252_u8).prop_map(|(start, count)| R::ReadRam { start, count }),
        (0..4_u8, isu_data()).prop_map(|(start, data)| R::WriteRam { start, data }),
        (0..=130_u8, 1..=126_u8).prop_map(|(start, count)| R::ReadEeprom { start, count }),
        (0..=130_u8, isu_words()).prop_map(|(start, words)| R::WriteEeprom { start, words }),
        Just(R::ResetNullPosition),
    ]
}

fn isu_response() -> impl Strategy<Value = isu::Response> {
    use isu::Response as R;
    prop_oneof![
        Just(R::GoToSoftErrorState),
        Just(R::ResetModule),
        (any::<u8>(), isu_data()).prop_map(|(start, data)| R::ReadRam { start, data }),
        any::<[u8; 2]>().prop_map(|[start, count_or_first_byte]| R::WriteRam { start, count_or_first_byte }),
        (any::<u8>(), isu_words()).prop_map(|(start, words)| R::ReadEeprom { start, words }),
        any::<[u8; 2]>().prop_map(|[start, count]| R::WriteEeprom { start, count }),
        Just(R::ResetNullPosition),
    ]
}

/// Noise that likes to look like the beginning of something.
fn noise() -> impl Strategy<Value = Vec<u8>> {
    let header_bytes = select(vec![
        0x05, 0x06, 0x83, 0x09, 0x20, 0x87, 0x03, 0x84, 0x04, 0x35, 0x58, 0x01, 0xFF, 0x02, 0xF1,
    ]);
    let byte = prop_oneof![3 => header_bytes, 1 => any::<u8>()];
    prop::collection::vec(byte, 0..40)
}

/// Pieces of answers to Set Address, of which `05 03 91 00 67` is the wanted one: whole, damaged, cut, and
/// the beginnings of other people's long ones, so that one push has more than one thing to tell.
fn pieces() -> impl Strategy<Value = Vec<u8>> {
    let piece = select(vec![
        &[0x05, 0x03, 0x91, 0x00, 0x67][..],
        &[0x05, 0x03, 0x91, 0x00, 0x00],
        &[0x05, 0x03, 0x91, 0xFF],
        &[0x05, 0x03],
        &[0x05, 0x20, 0x87],
        &[0x5F, 0x20, 0x87],
        &[0x09, 0x10, 0x80],
        &[0x09, 0x06, 0x83, 0x00, 0x00, 0x00, 0x00, 0x6E],
        &[0x00],
    ]);
    prop::collection::vec(piece, 0..24).prop_map(|pieces| pieces.concat())
}

/// The same for the answer of ISU 3 to Read RAM 58H, `04 35 58 80 00 0D`.
fn isu_pieces() -> impl Strategy<Value = Vec<u8>> {
    let piece = select(vec![
        &[0x04, 0x35, 0x58, 0x80, 0x00, 0x0D][..],
        &[0x04, 0x35, 0x58, 0x80, 0x00, 0x00],
        &[0x04, 0x35, 0x58, 0x80],
        &[0x04, 0x35],
        &[0xFE, 0x15],
        &[0x20, 0x25, 0x58],
        &[0x00],
    ]);
    prop::collection::vec(piece, 0..24).prop_map(|pieces| pieces.concat())
}

/// Feeds a T7 decoder, and silence at the end. Returns the last byte's index and meaning of every good
/// answer.
fn t7_frames(decoder: &mut t7::AnswerDecoder, bytes: &[u8]) -> Vec<t7::Answer> {
    let mut frames = Vec::new();
    for &byte in bytes {
        if let t7::DecodeProgress::Frame(answer) = decoder.push(Character::clean(byte)) {
            frames.push(answer);
        }
    }
    loop {
        match decoder.idle() {
            t7::DecodeProgress::More => return frames,
            t7::DecodeProgress::Frame(answer) => frames.push(answer),
            t7::DecodeProgress::Bad(_) => {}
        }
    }
}

fn isu_frames(decoder: &mut isu::AnswerDecoder, bytes: &[u8]) -> Vec<isu::Answer> {
    let mut frames = Vec::new();
    for &byte in bytes {
        if let isu::DecodeProgress::Frame(answer) = decoder.push(Character::clean(byte)) {
            frames.push(answer);
        }
    }
    loop {
        match decoder.idle() {
            isu::DecodeProgress::More => return frames,
            isu::DecodeProgress::Frame(answer) => frames.push(answer),
            isu::DecodeProgress::Bad(_) => {}
        }
    }
}

proptest! {
    #[test]
    fn t7_commands_survive_encoding(request in t7_request(), address in t7_address()) {
        let frame = request.encode(address).unwrap();
        prop_assert_eq!(t7::Request::decode(frame.as_bytes()), Ok(t7::Command { address, request }));
    }

    #[test]
    fn t7_answers_survive_encoding(response in t7_response(), address in t7_address(), quirk: bool) {
        let length_quirk = quirk && response.opcode() == t7::Opcode::GetAllAngles;
        let answer = t7::Answer { address, response, length_quirk };
        let frame = answer.encode();
        prop_assert_eq!(t7::Answer::decode(frame.as_bytes()), Ok(answer));
    }

    #[test]
    fn isu_commands_survive_encoding(request in isu_request(), address in isu_address()) {
        let frame = request.encode_even_if_it_bricks_the_module(address).unwrap();
        prop_assert_eq!(isu::Request::decode(frame.as_bytes()), Ok(isu::Command { address, request }));
    }

    #[test]
    fn isu_answers_survive_encoding(response in isu_response(), address in isu_address()) {
        let answer = isu::Answer { address, response };
        prop_assert_eq!(isu::Answer::decode(answer.encode().as_bytes()), Ok(answer));
    }

    #[test]
    fn any_bytes_decode_to_something_that_encodes_to_them(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
        if let Ok(command) = t7::Request::decode(&bytes) {
            match command.request.encode(command.address) {
                Ok(frame) => prop_assert_eq!(frame.as_bytes(), &bytes[..]),
                Err(_) => prop_assert!(command.address.is_all()),
            }
        }
        if let Ok(answer) = t7::Answer::decode(&bytes) {
            let frame = answer.encode();
            prop_assert_eq!(frame.as_bytes(), &bytes[..]);
        }
        if let Ok(answer) = isu::Answer::decode(&bytes) {
            let frame = answer.encode();
            prop_assert_eq!(frame.as_bytes(), &bytes[..]);
        }
    }

    #[test]
    fn every_single_bit_error_is_rejected(response in t7_response(), address in t7_address()) {
        let frame = response.encode(address);
        for damaged in common::single_bit_errors(frame.as_bytes()) {
            prop_assert!(t7::Answer::decode(&damaged).is_err());
        }
    }

    #[test]
    fn t7_answers_come_out_of_any_noise(
        before in noise(), between in noise(), after in noise(), mdeg in -180_000..360_000_i32,
    ) {
        let good = t7_frame(5, 0x83, &mdeg.to_be_bytes(), true);
        let bytes = [&before[..], &good, &between, &good, &after].concat();
        let address = t7::Address::new(5).unwrap();
        let mut decoder =
            t7::AnswerDecoder::new(t7::Request::GetAngle(Axis::Two).expected(address), Checks::ALL);
        // By definition: eight bytes with that header whose sum is zero, and no byte used twice.
        let mut wanted = 0;
        let mut free = 0;
        for end in good.len()..=bytes.len() {
            let window = &bytes[end - good.len()..end];
            let total: u32 = window.iter().map(|&byte| u32::from(byte)).sum();
            let value = i32::from_be_bytes(window[3..7].try_into().unwrap());
            let fits = window[..3] == [0x05, 0x06, 0x83] && total.is_multiple_of(256);
            if fits && (-180_000..360_000).contains(&value) && end - good.len() >= free {
                wanted += 1;
                free = end;
            }
        }
        let frames = t7_frames(&mut decoder, &bytes);
        prop_assert!(wanted >= 1);
        prop_assert_eq!(frames.len(), wanted);
        prop_assert_eq!(decoder.pending(), 0);
        prop_assert!(decoder.discarded() as usize <= bytes.len() - wanted * good.len());
    }

    #[test]
    fn no_t7_answer_is_lost_between_pieces_of_others(bytes in pieces()) {
        let good = [0x05, 0x03, 0x91, 0x00, 0x67];
        let (device_type, serial) = (t7::DeviceType::T7_1, 1);
        let address = t7::Address::new(5).unwrap();
        let request = t7::Request::SetAddress { device_type, serial, new_address: address };
        let mut decoder = t7::AnswerDecoder::new(request.expected(address), Checks::ALL);
        // It cannot overlap itself, and no other five bytes of the pieces are an answer from 5 to this.
        let wanted = bytes.windows(good.len()).filter(|window| **window == good).count();
        prop_assert_eq!(t7_frames(&mut decoder, &bytes).len(), wanted);
        prop_assert_eq!(decoder.pending(), 0);
    }

    #[test]
    fn no_isu_answer_is_lost_between_pieces_of_others(bytes in isu_pieces()) {
        let good = isu_frame(0x35, &[0x58, 0x80, 0x00]);
        let address = isu::Address::new(3).unwrap();
        let mut decoder = isu::AnswerDecoder::new(isu::Request::READ_ANGLE.expected(address), Checks::ALL);
        let wanted = bytes.windows(good.len()).filter(|window| *window == good).count();
        let answer = isu::Answer::decode(&good).unwrap();
        let frames = isu_frames(&mut decoder, &bytes);
        prop_assert_eq!(frames.iter().filter(|frame| **frame == answer).count(), wanted);
        prop_assert_eq!(decoder.pending(), 0);
    }

    #[test]
    fn isu_answers_come_out_of_any_noise(before in noise(), after in noise(), code: u16) {
        let good = isu_frame(0x35, &[&[0x58], &code.to_be_bytes()[..]].concat());
        let bytes = [&before[..], &good, &after].concat();
        let address = isu::Address::new(3).unwrap();
        let mut decoder = isu::AnswerDecoder::new(isu::Request::READ_ANGLE.expected(address), Checks::ALL);
        let frames = isu_frames(&mut decoder, &bytes);
        // Noise can complete to a frame of its own that takes the first bytes of the good one.
        let stolen = (0..before.len()).any(|start| {
            (start + 3..before.len() + good.len()).any(|end| {
                let window = &bytes[start..end];
                end > before.len() && isu::Request::READ_ANGLE.expected(address).check(window, Checks::ALL).is_ok()
            })
        });
        let want = isu::Answer::decode(&good).unwrap();
        prop_assert!(stolen || frames.contains(&want));
        prop_assert_eq!(decoder.pending(), 0);
    }

    #[test]
    fn a_dirty_character_anywhere_spoils_the_frame(position in 0..8_usize, mdeg in -180_000..360_000_i32) {
        let good = t7_frame(5, 0x83, &mdeg.to_be_bytes(), true);
        let address = t7::Address::new(5).unwrap();
        let mut decoder =
            t7::AnswerDecoder::new(t7::Request::GetAngle(Axis::Two).expected(address), Checks::ALL);
        for (index, &byte) in good.iter().enumerate() {
            let errors = if index == position { LineErrors::FRAMING } else { LineErrors::NONE };
            let progress = decoder.push(Character { byte, errors });
            prop_assert!(!matches!(progress, t7::DecodeProgress::Frame(_)));
        }
    }

    #[test]
    fn a_sniffer_never_loses_an_exchange_after_silence(before in noise(), mdeg in -180_000..360_000_i32) {
        let mut sniffer = t7::Sniffer::new(Checks::ALL);
        for &byte in &before {
            _ = sniffer.push(Character::clean(byte));
        }
        while sniffer.idle() != t7::SniffProgress::More {}
        let answer = t7_frame(5, 0x83, &mdeg.to_be_bytes(), true);
        let mut seen = Vec::new();
        for byte in [0x05, 0x01, 0x83].into_iter().chain(answer) {
            if let t7::SniffProgress::Frame(message) = sniffer.push(Character::clean(byte)) {
                seen.push(message);
            }
        }
        let both = matches!(seen[..], [t7::Sniffed::Command(_), t7::Sniffed::Answer { to: Some(_), .. }]);
        prop_assert!(both);
    }

    #[test]
    fn differences_lead_from_one_angle_to_the_other(from: i32, to: i32) {
        let (from, to) = (Angle::from_udeg(from), Angle::from_udeg(to));
        let turn = to.difference(from);
        prop_assert!(Range::Bidirectional.contains(turn));
        let arrived = (i64::from(from.udeg()) + i64::from(turn.udeg()) - i64::from(to.udeg())) % 360_000_000;
        prop_assert_eq!(arrived, 0);
    }

    #[test]
    fn text_is_the_number(udeg: i32) {
        let angle = Angle::from_udeg(udeg);
        let text = format!("{angle:.6}");
        let digits: String = text.chars().filter(|&character| character != '.').collect();
        prop_assert_eq!(digits.parse::<i64>().unwrap(), i64::from(udeg));
        prop_assert_eq!(text.len() - text.find('.').unwrap(), 7);
        let mdeg: String = angle.to_string().chars().filter(|&character| character != '.').collect();
        prop_assert_eq!(mdeg.parse::<i32>().unwrap(), angle.mdeg());
    }

    #[test]
    fn packing_is_undone_by_unpacking(words: [u16; 8], data: u16) {
        prop_assert_eq!(unpack(pack(words, data)), data);
        prop_assert_eq!(pack(words, unpack(words)), words);
    }
}
