//! Every worked example of the two documents, in every direction in which it makes sense.

mod common;

use clino_codec::DecodeProgress;
use clino_codec::angle::Range;
use clino_codec::ascii::LineDecoder;
use clino_codec::pwm::{Law, Ticks};
use clino_codec::{isu, t7};
use common::{bytes_of, clean, vectors};
use serde_json::{Value, json};

#[test]
fn nothing_is_left_out() {
    let count = |protocol| vectors(protocol).len();
    assert_eq!([count("t7"), count("isu"), count("isu-ascii"), count("isu-pwm")], [35, 9, 1, 3]);
}

#[test]
fn t7_commands_decode_and_encode_to_the_same_bytes() {
    for vector in vectors("t7").iter().filter(|vector| vector["kind"] == "command") {
        let bytes = bytes_of(vector);
        let command = t7::Request::decode(&bytes).unwrap_or_else(|error| panic!("{vector}: {error}"));
        assert_eq!(command.address.get(), 5, "{vector}");
        assert_eq!(command.request.encode(command.address).unwrap().as_bytes(), bytes, "{vector}");
    }
}

#[test]
fn t7_answers_mean_what_the_guide_says_and_encode_to_the_same_bytes() {
    for vector in vectors("t7").iter().filter(|vector| vector["kind"] == "response") {
        let bytes = bytes_of(vector);
        let answer = t7::Answer::decode(&bytes).unwrap_or_else(|error| panic!("{vector}: {error}"));
        let mut meaning = t7_meaning(&answer.response);
        meaning["address"] = json!(answer.address.get());
        assert_eq!(meaning, vector["want"], "{vector}");
        assert_eq!(answer.encode().as_bytes(), bytes, "{vector}");
    }
}

/// The names and units of the vectors.
fn t7_meaning(response: &t7::Response) -> Value {
    use t7::Response as R;
    let triple = |values: &[t7::Millidegrees; 3]| json!(values.map(|value| value.0));
    match response {
        R::GetAllAngles { angles, temperature } => {
            json!({ "angles_mdeg": triple(angles), "temperature_centi_c": temperature.centi_celsius() })
        }
        R::GetAngle { axis, angle } => json!({ "axis": axis.get(), "angle_mdeg": angle.0 }),
        R::GetAllAngleOffsets { offsets } => json!({ "offsets_mdeg": triple(offsets) }),
        R::GetAllData { angles, temperature, accelerations, serial } => json!({
            "angles_mdeg": triple(angles),
            "temperature_centi_c": temperature.centi_celsius(),
            "accelerations_raw": accelerations.map(|acceleration| acceleration.0),
            "serial": serial,
        }),
        R::GetAllDirections { directions } => {
            json!({ "directions": directions.map(|direction| match direction {
            t7::Direction::Normal => "normal",
            t7::Direction::Reversed => "reversed",
        }) })
        }
        R::GetDamping { damping_ms } => json!({ "damping_ms": damping_ms }),
        R::GetAngleOutputRange(Range::Bidirectional) => json!({ "output_range": "bidirectional" }),
        R::GetAngleOutputRange(Range::Unidirectional) => json!({ "output_range": "unidirectional" }),
        R::GetDeviceInformation(information) => json!({
            "serial": information.serial,
            "firmware": information.firmware.as_str(),
            "product": information.product.as_str(),
            "calibration_state": information.calibration_state,
        }),
        other => match other.status() {
            Some(t7::Status::Success) => json!({ "status": "success" }),
            status => panic!("no vector has {status:?}"),
        },
    }
}

#[test]
fn isu_messages_decode_and_encode_to_the_same_bytes() {
    for vector in vectors("isu") {
        let bytes = bytes_of(&vector);
        if vector["kind"] == "command" {
            let command = isu::Request::decode(&bytes).unwrap_or_else(|error| panic!("{vector}: {error}"));
            assert_eq!(vector["want"], json!({ "address": command.address.get() }));
            assert_eq!(command.request.encode(command.address).unwrap().as_bytes(), bytes, "{vector}");
        } else {
            let answer = isu::Answer::decode(&bytes).unwrap_or_else(|error| panic!("{vector}: {error}"));
            let meaning = match answer.response {
                isu::Response::Error(isu::DeviceError::InvalidFunctionCode) => {
                    json!({ "device_error": "invalid_function_code" })
                }
                isu::Response::Error(isu::DeviceError::InvalidChecksum) => {
                    json!({ "device_error": "invalid_checksum" })
                }
                _ => json!({ "address": answer.address.get() }),
            };
            assert_eq!(meaning, vector["want"], "{vector}");
            assert_eq!(answer.encode().as_bytes(), bytes, "{vector}");
        }
    }
}

#[test]
fn isu_examples_are_the_functions_they_are_printed_as() {
    use isu::{Answer, Function, Request, Response};
    let request = |text| Request::decode(&common::hex(text)).unwrap().request;
    assert_eq!(request("03 04 58 02 5E"), Request::ReadRam { start: 0x58, count: 2 });
    assert_eq!(request("01 0C 0C"), Request::ResetNullPosition);
    assert_eq!(request("03 08 48 02 52"), Request::ReadEeprom { start: 0x48, count: 2 });
    assert_eq!(request("03 08 78 08 88"), Request::ReadEeprom { start: 0x78, count: 8 });
    let response = |text| Answer::decode(&common::hex(text)).unwrap().response;
    assert_eq!(response("03 0B 48 02 55"), Response::WriteEeprom { start: 0x48, count: 2 });
    assert_eq!(response("03 0B 78 08 8B"), Response::WriteEeprom { start: 0x78, count: 8 });
    assert_eq!(response("01 0D 0D").function(), Some(Function::ResetNullPosition));
}

#[test]
fn isu_hardware_error_as_described_in_section_4() {
    let answer = isu::Answer::decode(&[0x02, 0xF1, 0x04, 0xF5]).unwrap();
    assert!(answer.address.is_reserved());
    let error = isu::DeviceError::HardwareError { command_byte: 0x04 };
    assert_eq!(answer.response, isu::Response::Error(error));
    assert_eq!(answer.encode().as_bytes(), [0x02, 0xF1, 0x04, 0xF5]);
}

#[test]
fn isu_lines_mean_what_they_show() {
    let vectors = vectors("isu-ascii");
    let lines: Vec<&str> = vectors[0]["lines"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let mut decoder = LineDecoder::new();
    let mut seen = Vec::new();
    for character in clean(lines.concat().as_bytes()) {
        match decoder.push(character) {
            DecodeProgress::More => {}
            DecodeProgress::Frame(angle) => seen.push(angle),
            DecodeProgress::Bad(fault) => panic!("{fault}"),
        }
    }
    let centidegrees: Vec<i16> = seen.iter().map(|angle| angle.get()).collect();
    assert_eq!(json!(centidegrees), vectors[0]["want_centidegrees"]);
    let again: Vec<u8> = seen.iter().flat_map(|angle| angle.encode()).collect();
    assert_eq!(again, lines.concat().as_bytes());
    assert_eq!(decoder.discarded(), 0);
}

#[test]
fn isu_duty_cycles_give_the_printed_angles() {
    for vector in vectors("isu-pwm") {
        // A period of 10 000 ticks makes a hundredth of a percent one tick.
        let high = (vector["duty_percent"].as_f64().unwrap() * 100.0).round() as u32;
        let angle = Law::Documented.angle(Ticks { period: 10_000, high }).unwrap();
        let want = (vector["want_degrees"].as_f64().unwrap() * 1e6).round() as i32;
        assert_eq!(angle.udeg(), want, "{vector}");
    }
}

#[test]
fn every_single_bit_error_of_every_documented_frame_is_rejected() {
    let mut damaged = 0;
    for bytes in common::frames("t7", "response") {
        for frame in common::single_bit_errors(&bytes) {
            assert!(t7::Answer::decode(&frame).is_err(), "{frame:02X?}");
            damaged += 1;
        }
    }
    for bytes in common::frames("isu", "response") {
        for frame in common::single_bit_errors(&bytes) {
            assert!(isu::Answer::decode(&frame).is_err(), "{frame:02X?}");
            damaged += 1;
        }
    }
    for bytes in common::frames("isu", "command") {
        for frame in common::single_bit_errors(&bytes) {
            assert!(isu::Request::decode(&frame).is_err(), "{frame:02X?}");
            damaged += 1;
        }
    }
    // T7 Get commands have no checksum: a damaged one can be another Get, or the same for another device.
    for bytes in common::frames("t7", "command").into_iter().filter(|bytes| bytes.len() > 3) {
        for frame in common::single_bit_errors(&bytes) {
            assert!(t7::Request::decode(&frame).is_err(), "{frame:02X?}");
            damaged += 1;
        }
    }
    assert_eq!(damaged, 2_176);
}
