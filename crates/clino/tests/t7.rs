//! T7 frames beyond the documented examples. Frames are made here, by the description, not by the tool.

mod common;

use common::{bad, encoded, fed, good, t7_frame, text};
use serde_json::{Value, json};

/// The answers in a stream, all of which have to be good.
fn answers(arguments: &str, frames: &[String]) -> Vec<Value> {
    let run = fed(&format!("t7 decode {arguments} --stdin"), frames.join("\n"));
    assert_eq!(run.status, 0, "{}", run.stdout);
    let objects = run.objects();
    assert_eq!(objects.len(), frames.len());
    objects
}

#[test]
fn every_status_of_every_set_command() {
    let commands = [
        (0x84, "set_angle"),
        (0x86, "set_angle_offset"),
        (0x89, "set_direction"),
        (0x8B, "set_damping"),
        (0x8D, "set_angle_output_range"),
        (0x8F, "set_baud_rate"),
        (0x91, "set_address"),
    ];
    let name = |status: u8| match status {
        0 => "success",
        1 => "invalid_command",
        3 => "invalid_parameter",
        4 => "checksum_error",
        5 => "command_failed",
        7 => "flash_erase_error",
        8 => "flash_program_error",
        9 => "address_out_of_range",
        _ => "unknown",
    };
    for (code, command) in commands {
        let frames: Vec<String> = (0..=255).map(|status| t7_frame(&[7, 3, code, status])).collect();
        for (status, object) in (0..=255).zip(answers("", &frames)) {
            let mut want = json!({ "address": 7, "command": command, "status": name(status) });
            if want["status"] == "unknown" {
                want["status_code"] = json!(status);
            }
            assert_eq!(object, want);
        }
    }
}

#[test]
fn angles_over_the_whole_documented_range() {
    let angles: Vec<i32> = (-180_000..=359_999).step_by(37).chain([359_999]).collect();
    let frame = |angle: i32| t7_frame(&[&[100, 6, 0x82][..], &angle.to_be_bytes()].concat());
    let frames: Vec<String> = angles.iter().map(|&angle| frame(angle)).collect();
    for (angle, object) in angles.iter().zip(answers("", &frames)) {
        let want = json!({ "address": 100, "command": "get_angle", "axis": 1, "angle_mdeg": angle });
        assert_eq!(object, want);
    }
}

#[test]
fn numbers_out_of_range_are_bad_unless_permitted() {
    for (name, field, frame) in [
        ("angle_mdeg", "angle_mdeg", [&[5, 6, 0x81][..], &360_000_i32.to_be_bytes()].concat()),
        ("angle_mdeg", "angle_mdeg", [&[5, 6, 0x81][..], &(-180_001_i32).to_be_bytes()].concat()),
        ("damping_ms", "damping_ms", vec![5, 4, 0x8A, 0x13, 0x89]),
    ] {
        let frame = t7_frame(&frame);
        let error = bad(&format!("t7 decode {frame}"));
        assert_eq!((&error["kind"], &error["field"]), (&json!("value"), &json!(field)));
        assert_eq!(good(&format!("t7 decode --any-value {frame}"))[name], error["value"]);
    }
    // Permission for numbers is none for codes without a meaning.
    let error = bad(&format!("t7 decode --any-value {}", t7_frame(&[5, 3, 0x8C, 2])));
    assert_eq!((&error["field"], &error["value"]), (&json!("output_range"), &json!(2)));
    let error = bad(&format!("t7 decode --any-value {}", t7_frame(&[5, 5, 0x88, 0, 1, 2])));
    assert_eq!((&error["field"], &error["value"]), (&json!("direction"), &json!(2)));
}

#[test]
fn a_temperature_out_of_range_is_reported_and_marked() {
    for (temperature, marked) in
        [(-500, false), (-501, true), (19_000, false), (19_001, true), (i16::MIN, true)]
    {
        let frame = [&[1, 16, 0x80][..], &[0; 12], &i16::to_be_bytes(temperature)].concat();
        let mut want = json!({
            "address": 1,
            "command": "get_all_angles",
            "angles_mdeg": [0, 0, 0],
            "temperature_centi_c": temperature,
        });
        if marked {
            want["temperature_out_of_range"] = json!(true);
        }
        assert_eq!(good(&format!("t7 decode {}", t7_frame(&frame))), want);
    }
}

#[test]
fn the_length_quirk_is_accepted_and_visible_and_nothing_else_is() {
    let body = |length| [&[5, length, 0x80][..], &[0; 14]].concat();
    assert_eq!(good(&format!("t7 decode {}", t7_frame(&body(0x0A))))["length_quirk"], true);
    assert_eq!(good(&format!("t7 decode {}", t7_frame(&body(0x10)))).get("length_quirk"), None);
    let error = bad(&format!("t7 decode {}", t7_frame(&body(0x0B))));
    assert_eq!(
        [&error["kind"], &error["received"], &error["expected"]],
        [&json!("length"), &json!(11), &json!(16)]
    );
}

#[test]
fn texts_are_trimmed_at_the_end_only_and_survive_when_they_are_no_text() {
    let frame = |text: &[u8; 12]| {
        t7_frame(&[&[127, 0x14, 0x8E, 0xFF, 0xFF, 0xFF, 0xFF][..], text, &[0xFF, 0xFF]].concat())
    };
    let object = good(&format!("t7 decode {}", frame(b" 1.0   T7-3 ")));
    assert_eq!(object["firmware"], " 1.0");
    assert_eq!(object["product"], " T7-3");
    assert_eq!((&object["serial"], &object["calibration_state"]), (&json!(u32::MAX), &json!(0xFFFF)));
    let object = good(&format!("t7 decode {}", frame(b"      \xB5\"7\0\xFF ")));
    assert_eq!(object["firmware"], "");
    assert_eq!(object["product"], r#"\xb5\"7\x00\xff"#);
}

/// Every command with the extremes of its parameters: arguments, and bytes between the length byte and the checksum.
fn commands() -> Vec<(String, Vec<u8>)> {
    let mut commands = Vec::new();
    let mut add = |arguments: String, body: &[u8]| commands.push((arguments, body.to_vec()));
    for axis in 0..=2_u8 {
        add(format!("get_angle --axis {axis}"), &[0x81 + axis]);
        for mdeg in [-180_000_i32, -1, 0, 1, 179_999, 180_000, 359_999] {
            let [a, b, c, d] = mdeg.to_be_bytes();
            add(format!("set_angle --axis {axis} --angle-mdeg {mdeg}"), &[0x84, axis, a, b, c, d]);
            add(format!("set_angle_offset --axis {axis} --offset-mdeg={mdeg}"), &[0x86, axis, a, b, c, d]);
        }
        add(format!("set_direction --axis {axis} --direction normal"), &[0x89, axis, 0]);
        add(format!("set_direction --axis {axis} --direction reversed"), &[0x89, axis, 1]);
    }
    for ms in [2_u16, 255, 256, 5_000] {
        let [high, low] = ms.to_be_bytes();
        add(format!("set_damping --damping-ms {ms}"), &[0x8B, high, low]);
    }
    add("set_angle_output_range --range bidirectional".into(), &[0x8D, 0]);
    add("set_angle_output_range --range unidirectional".into(), &[0x8D, 1]);
    for (index, baud) in (0..).zip([115_200, 57_600, 38_400, 19_200, 9_600]) {
        add(format!("set_baud_rate --baud {baud}"), &[0x8F, index]);
    }
    for (device_type, code) in [("t7-3", 1), ("t7-1", 4)] {
        for (serial, new_address) in [(0_u32, 1_u8), (u32::MAX, 100)] {
            let [a, b, c, d] = serial.to_be_bytes();
            add(
                format!(
                    "set_address --device-type {device_type} --serial {serial} --new-address {new_address}"
                ),
                &[0x91, code, a, b, c, d, new_address],
            );
        }
    }
    for (name, code) in [
        ("get_all_angles", 0x80),
        ("get_all_angle_offsets", 0x85),
        ("get_all_data", 0x87),
        ("get_all_directions", 0x88),
        ("get_damping", 0x8A),
        ("get_angle_output_range", 0x8C),
        ("get_device_information", 0x8E),
    ] {
        add(name.into(), &[code]);
    }
    commands
}

/// The arguments as the JSON object of the same command.
fn object(address: u8, arguments: &str) -> Value {
    let mut words = arguments.split([' ', '=']);
    let mut object = json!({ "address": address, "command": words.next() });
    while let (Some(option), Some(value)) = (words.next(), words.next()) {
        let name = match option.trim_start_matches('-') {
            "range" => "output_range".to_owned(),
            option => option.replace('-', "_"),
        };
        object[name] = value.parse::<i64>().map_or(json!(value), Value::from);
    }
    object
}

#[test]
fn every_command_encodes_to_its_bytes_and_decodes_to_its_parameters() {
    for (index, (arguments, body)) in commands().into_iter().enumerate() {
        let address = [1, 5, 100, 127][index % 4];
        let is_set = body.len() > 1;
        let length = u8::try_from(body.len()).unwrap() + u8::from(is_set);
        let bytes = [&[address, length][..], &body].concat();
        let frame = if is_set { t7_frame(&bytes) } else { text(&bytes) };
        assert_eq!(encoded(&format!("t7 encode --address {address} {arguments}")), frame, "{arguments}");
        assert_eq!(good(&format!("t7 decode --command {frame}")), object(address, &arguments), "{arguments}");
    }
}

#[test]
fn options_may_stand_in_any_order_and_names_be_written_with_hyphens() {
    let frame = "05 07 84 02 00 00 29 04 41";
    for line in [
        "t7 encode set-angle --angle-mdeg 10500 --axis 2 --address 5",
        "t7 encode --axis=2 --address=5 --angle-mdeg=10500 set_angle",
        "t7 encode --address 0x05 SET_ANGLE --axis 2 --angle-mdeg 0x2904",
    ] {
        assert_eq!(encoded(line), frame, "{line}");
    }
    assert_eq!(
        encoded("t7 encode --address 5 set_angle_output_range --output-range unidirectional"),
        encoded("t7 encode --address 5 set_angle_output_range --range unidirectional"),
    );
}

#[test]
fn damaged_frames_are_bad_for_the_right_reason() {
    let kind = |hex: &str| bad(&format!("t7 decode {hex}"));
    let error = kind("05 06 81 FF FF 4E FF 28");
    assert_eq!(
        [&error["kind"], &error["received"], &error["computed"]],
        [&json!("checksum"), &json!(0x28), &json!(0x29)]
    );
    let error = kind("05 07 81 FF FF 4E FF 28");
    assert_eq!(
        [&error["kind"], &error["received"], &error["expected"]],
        [&json!("length"), &json!(7), &json!(6)]
    );
    let error = kind("05 06 81 FF FF 4E FF");
    assert_eq!(
        [&error["kind"], &error["received"], &error["expected"]],
        [&json!("size"), &json!(7), &json!(8)]
    );
    assert_eq!(kind("05 06 81 FF FF 4E FF 29 00")["kind"], "size");
    assert_eq!(kind("05")["kind"], "size");
    assert_eq!(kind("05 06 90 FF FF 4E FF 1A")["kind"], "unknown_command");
    assert_eq!(kind("7E 06 81 FF FF 4E FF B0")["kind"], "unknown_address");
    assert_eq!(kind("05 0")["kind"], "odd_digits");
    assert_eq!(kind("05 06 8X")["kind"], "not_hex");
    for error in [kind("05 06 81 FF FF 4E FF 28"), kind("05 0")] {
        assert!(!error["message"].as_str().unwrap().is_empty());
    }
}

#[test]
fn damaged_commands_are_bad_for_the_right_reason() {
    let kind = |hex: &str| bad(&format!("t7 decode --command {hex}"));
    assert_eq!(kind("05 07 84 02 00 00 29 04 42")["kind"], "checksum");
    assert_eq!(kind("05 02 8C")["kind"], "length");
    assert_eq!(kind("05 01 8C 00")["kind"], "size");
    assert_eq!(kind("65 01 80")["kind"], "unknown_address");
    let error = kind(&t7_frame(&[5, 7, 0x84, 3, 0, 0, 0, 0]));
    assert_eq!(
        [&error["kind"], &error["field"], &error["value"]],
        [&json!("value"), &json!("axis"), &json!(3)]
    );
    assert_eq!(kind(&t7_frame(&[5, 3, 0x8F, 5]))["field"], "baud");
    assert_eq!(kind(&t7_frame(&[5, 8, 0x91, 2, 0, 0, 0, 0, 1]))["field"], "device_type");
    assert_eq!(kind(&t7_frame(&[5, 8, 0x91, 4, 0, 0, 0, 0, 127]))["field"], "new_address");
}

#[test]
fn every_single_bit_error_of_an_answer_is_bad() {
    let frame = [0x05, 0x06, 0x81, 0xFF, 0xFF, 0x4E, 0xFF, 0x29_u8];
    let damaged: Vec<String> = (0..frame.len() * 8)
        .map(|bit| {
            let mut bytes = frame;
            bytes[bit / 8] ^= 1 << (bit % 8);
            text(&bytes)
        })
        .collect();
    let run = fed("t7 decode --stdin", damaged.join("\n"));
    assert_eq!(run.status, 1);
    let objects = run.objects();
    assert_eq!(objects.len(), 64);
    assert!(objects.iter().all(|object| object["error"]["kind"].is_string()), "{}", run.stdout);
}
