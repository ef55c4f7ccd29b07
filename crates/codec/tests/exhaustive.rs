//! Whole domains. The long ones are ignored by default; `checks/campaign.sh` runs them.

mod common;

use clino_codec::character::Character;
use clino_codec::checks::{Checks, ValueRange};
use clino_codec::isu;
use clino_codec::t7::{self, Axis};
use common::{isu_frame, t7_frame};

/// Length of the answer to each command, from the tables of section 2 of the T7 guide.
fn documented_answer_length(command: u8) -> Option<u8> {
    Some(match command {
        0x80 => 0x10,
        0x81..=0x83 => 0x06,
        0x85 => 0x0E,
        0x87 => 0x20,
        0x88 => 0x05,
        0x8A => 0x04,
        0x8C => 0x03,
        0x8E => 0x14,
        0x84 | 0x86 | 0x89 | 0x8B | 0x8D | 0x8F | 0x91 => 0x03,
        _ => return None,
    })
}

/// Decodes a frame of zeros with that header and the right checksum, of the length that the command calls
/// for.
fn accepts_header(address: u8, length: u8, command: u8) -> bool {
    let size = documented_answer_length(command).map_or(5, |length| usize::from(length) + 2);
    let mut frame = [0; 34];
    frame[..3].copy_from_slice(&[address, length, command]);
    frame[size - 1] = 0_u8.wrapping_sub(address).wrapping_sub(length).wrapping_sub(command);
    // Zero is no valid damping time.
    let checks = Checks { values: ValueRange::Off, ..Checks::ALL };
    t7::Answer::decode_with(&frame[..size], checks).is_ok()
}

fn is_documented_header(address: u8, length: u8, command: u8) -> bool {
    let device = (1..=100).contains(&address) || address == 127;
    let right = documented_answer_length(command) == Some(length) || (command == 0x80 && length == 0x0A);
    device && right
}

#[test]
fn t7_headers_at_some_addresses() {
    for address in [0, 1, 5, 100, 101, 126, 127, 128, 255] {
        for (length, command) in
            (0..=u8::MAX).flat_map(|length| (0..=u8::MAX).map(move |command| (length, command)))
        {
            let documented = is_documented_header(address, length, command);
            assert_eq!(accepts_header(address, length, command), documented, "{address} {length} {command}");
        }
    }
}

#[test]
#[ignore = "16.8 million headers: see checks/campaign.sh"]
fn t7_headers_all_16_777_216() {
    let mut accepted = 0;
    for header in 0..1_u32 << 24 {
        let [_, address, length, command] = header.to_be_bytes();
        let documented = is_documented_header(address, length, command);
        assert_eq!(accepts_header(address, length, command), documented, "{header:06X}");
        accepted += u32::from(documented);
    }
    // 101 addresses; 17 commands with one length each, and one with two.
    assert_eq!(accepted, 101 * 18);
}

#[test]
#[ignore = "4.3 billion angles: see checks/campaign.sh"]
fn t7_angle_payloads_all_4_294_967_296() {
    let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    std::thread::scope(|scope| {
        for thread in 0..threads {
            scope.spawn(move || {
                let first = (thread << 32) / threads;
                let end = ((thread + 1) << 32) / threads;
                (first..end).for_each(|payload| check_angle_payload(payload as u32));
            });
        }
    });
}

#[test]
fn t7_angle_payloads_around_every_limit() {
    for limit in [i32::MIN, -180_000, -1, 0, 179_999, 359_999, i32::MAX] {
        (-300..=300).for_each(|offset: i32| check_angle_payload(limit.wrapping_add(offset) as u32));
    }
}

fn check_angle_payload(payload: u32) {
    let bytes = payload.to_be_bytes();
    let sum =
        bytes.iter().fold(0x05_u8.wrapping_add(0x06).wrapping_add(0x83), |sum, &byte| sum.wrapping_add(byte));
    let frame = [0x05, 0x06, 0x83, bytes[0], bytes[1], bytes[2], bytes[3], 0_u8.wrapping_sub(sum)];
    let mdeg = payload as i32;
    match t7::Answer::decode(&frame) {
        Ok(t7::Answer { response: t7::Response::GetAngle { axis: Axis::Two, angle }, .. }) => {
            assert!((-180_000..=359_999).contains(&mdeg));
            assert_eq!(angle.0, mdeg);
            assert_eq!(angle.angle().map(|angle| angle.udeg()), Some(mdeg * 1_000));
        }
        Ok(other) => panic!("{other:?}"),
        Err(error) => {
            assert!(!(-180_000..=359_999).contains(&mdeg));
            assert_eq!(error, t7::DecodeError::Value { field: t7::Field::Angle, value: mdeg });
        }
    }
}

#[test]
fn isu_angles_all_65_536_through_the_decoder() {
    let address = isu::Address::new(9).unwrap();
    let mut decoder = isu::AnswerDecoder::new(isu::Request::READ_ANGLE.expected(address), Checks::ALL);
    for code in 0..=u16::MAX {
        let [high, low] = code.to_be_bytes();
        let sum = 0x95_u8.wrapping_add(0x58).wrapping_add(high).wrapping_add(low);
        let mut last = isu::DecodeProgress::More;
        for byte in [0x04, 0x95, 0x58, high, low, sum] {
            last = decoder.push(Character::clean(byte));
        }
        let isu::DecodeProgress::Frame(answer) = last else { panic!("{code:04X}: {last:?}") };
        assert_eq!(answer.angle_word(), Some(code));
        // Within half a micro-degree of code · 360/65536.
        let error = i64::from(answer.angle().unwrap().udeg()) * 65_536 - i64::from(code) * 360_000_000;
        assert!(error.abs() <= 32_768);
    }
    assert_eq!(decoder.discarded(), 0);
}

/// With every length: short messages have their own test, `short_messages`.
#[cfg(feature = "long-messages")]
#[test]
fn isu_all_pairs_of_length_and_second_byte() {
    for length in 0..=u8::MAX {
        for head in 0..=u8::MAX {
            let payload = vec![0; usize::from(length).saturating_sub(1)];
            let mut frame = isu_frame(head, &payload);
            frame[0] = length;
            let (address, function, response) = (head >> 4, head >> 1 & 7, head & 1 == 1);
            // Appendix A: lengths of commands and answers by function.
            let right_command = match function {
                0 | 1 | 6 => length == 1,
                2 | 4 => length == 3,
                3 => length >= 3,
                5 => length >= 4 && length % 2 == 0,
                _ => false,
            };
            let right_answer = match function {
                0 | 1 | 6 => length == 1,
                2 => length >= 3,
                4 => length >= 4 && length % 2 == 0,
                3 | 5 => length == 3,
                _ => false,
            };
            let error_answer = matches!((length, head), (1, 0xFF | 0xFD) | (2, 0xF1));
            let command = isu::Request::decode(&frame).is_ok();
            assert_eq!(command, right_command && !response && address < 15, "{length:02X} {head:02X}");
            let answer = isu::Answer::decode(&frame).is_ok();
            let wanted = (right_answer && response && address < 15) || error_answer;
            assert_eq!(answer, wanted, "{length:02X} {head:02X}");
        }
    }
}

#[test]
fn t7_axes_and_statuses_in_every_answer_to_a_set_command() {
    for command in [0x84, 0x86, 0x89, 0x8B, 0x8D, 0x8F, 0x91] {
        for code in 0..=u8::MAX {
            let answer = t7::Answer::decode(&t7_frame(1, command, &[code], true)).unwrap();
            assert_eq!(answer.response.status().map(t7::Status::get), Some(code));
            assert_eq!(answer.response.opcode().get(), command);
        }
    }
}
