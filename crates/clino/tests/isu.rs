//! ISU frames, lines and pulses beyond the documented examples. Frames are made here, by the description.

mod common;

use common::{bad, encoded, fed, good, isu_frame, misused};
use serde_json::{Value, json};

/// The second byte: address, function, and whether it is an answer.
fn head(address: u8, function: u8, answer: bool) -> u8 {
    address << 4 | function << 1 | u8::from(answer)
}

#[test]
fn every_angle_there_is() {
    let frames: Vec<String> = (0..=u16::MAX)
        .map(|code| {
            let [high, low] = code.to_be_bytes();
            isu_frame(&[4, head(14, 2, true), 0x58, high, low])
        })
        .collect();
    let run = fed("isu decode --stdin", frames.join("\n"));
    assert_eq!(run.status, 0);
    let objects = run.objects();
    assert_eq!(objects.len(), 65_536);
    for (code, object) in (0_u64..).zip(objects) {
        // code · 360/65536 degrees, to the nearest micro-degree.
        let angle_udeg = (code * 360_000_000 * 2 + 65_536) / (2 * 65_536);
        let want = json!({
            "address": 14,
            "function": "read_ram",
            "start": 88,
            "data": [code / 256, code % 256],
            "angle_udeg": angle_udeg,
        });
        assert_eq!(object, want);
    }
}

#[test]
fn only_the_angle_is_taken_for_the_angle() {
    let other = good(&format!("isu decode {}", isu_frame(&[4, head(1, 2, true), 0x59, 0x40, 0])));
    assert_eq!(other.get("angle_udeg"), None);
    let longer = good(&format!("isu decode {}", isu_frame(&[5, head(1, 2, true), 0x58, 0x40, 0, 0])));
    assert_eq!((&longer["data"], longer.get("angle_udeg")), (&json!([64, 0, 0]), None));
}

#[test]
fn answers_of_every_function() {
    for (body, want) in [
        (vec![1, head(3, 0, true)], json!({ "address": 3, "function": "go_to_soft_error_state" })),
        (vec![1, head(14, 1, true)], json!({ "address": 14, "function": "reset_module" })),
        (
            vec![3, head(0, 3, true), 0x58, 0xA5],
            json!({
                "address": 0, "function": "write_ram", "start": 88, "count": 0xA5, "count_may_be_first_byte": true,
            }),
        ),
        (
            vec![6, head(1, 4, true), 0x48, 0x12, 0x34, 0xFF, 0xFE],
            json!({ "address": 1, "function": "read_eeprom", "start": 72, "words": [0x1234, 0xFFFE] }),
        ),
        (
            vec![3, head(1, 5, true), 0x78, 8],
            json!({ "address": 1, "function": "write_eeprom", "start": 120, "count": 8 }),
        ),
        (vec![1, head(0, 6, true)], json!({ "address": 0, "function": "reset_null_position" })),
    ] {
        assert_eq!(good(&format!("isu decode {}", isu_frame(&body))), want);
    }
}

#[test]
fn the_three_error_answers_name_the_error_and_no_module() {
    assert_eq!(good("isu decode 01 FF FF"), json!({ "device_error": "invalid_function_code" }));
    assert_eq!(good("isu decode 01 FD FD"), json!({ "device_error": "invalid_checksum" }));
    for command_byte in [0x00, 0x04, 0x3C, 0xFF_u8] {
        let frame = isu_frame(&[2, 0xF1, command_byte]);
        let want = json!({ "device_error": "hardware_error", "command_byte": command_byte });
        assert_eq!(good(&format!("isu decode {frame}")), want);
    }
    assert_eq!(bad("isu decode 01 FF FE")["kind"], "checksum");
}

#[test]
fn every_command_encodes_to_its_bytes_and_decodes_to_its_parameters() {
    let checksum_words: Vec<u16> = (0..8).map(|index| 0x1230 + index).collect();
    let words_text = checksum_words.iter().map(|word| format!("{word:04x}")).collect::<Vec<_>>().join(" ");
    let words_bytes: Vec<u8> = checksum_words.iter().flat_map(|word| word.to_be_bytes()).collect();
    for (address, arguments, function, payload, parameters) in [
        (0, "go_to_soft_error_state".to_owned(), 0, vec![], json!({})),
        (14, "reset-module".to_owned(), 1, vec![], json!({})),
        (1, "read_angle".to_owned(), 2, vec![0x58, 2], json!({ "start": 0x58, "count": 2 })),
        (
            1,
            "read_ram --start 0 --count 253".to_owned(),
            2,
            vec![0, 253],
            json!({ "start": 0, "count": 253 }),
        ),
        (
            1,
            "write_ram --start 58H --data A5 a5".to_owned(),
            3,
            vec![0x58, 0xA5, 0xA5],
            json!({ "start": 0x58, "data": [0xA5, 0xA5] }),
        ),
        (
            2,
            "read_eeprom --start 0x82 --count 126".to_owned(),
            4,
            vec![0x82, 126],
            json!({ "start": 0x82, "count": 126 }),
        ),
        (
            2,
            format!("write_eeprom --start 78H --words {words_text}"),
            5,
            [vec![0x78], words_bytes].concat(),
            json!({ "start": 0x78, "words": checksum_words }),
        ),
        (13, "reset_null_position".to_owned(), 6, vec![], json!({})),
    ] {
        let length = u8::try_from(payload.len() + 1).unwrap();
        let frame = isu_frame(&[&[length, head(address, function, false)][..], &payload].concat());
        assert_eq!(encoded(&format!("isu encode --address {address} {arguments}")), frame);
        let mut want: Value = parameters;
        want["address"] = json!(address);
        want["function"] = json!(match function {
            0 => "go_to_soft_error_state",
            1 => "reset_module",
            2 => "read_ram",
            3 => "write_ram",
            4 => "read_eeprom",
            5 => "write_eeprom",
            _ => "reset_null_position",
        });
        assert_eq!(good(&format!("isu decode --command {frame}")), want);
    }
}

#[test]
fn writes_that_can_destroy_the_module_need_permission() {
    let write = "isu encode --address 1 write_eeprom --start 0 --words 0";
    assert!(misused(write).contains("--even-if-it-bricks-the-module"));
    let permitted = encoded(&format!("{write} --even-if-it-bricks-the-module"));
    assert_eq!(permitted, isu_frame(&[4, head(1, 5, false), 0, 0, 0]));
    assert!(misused("isu encode --address 1 write_ram --start 57H --data 00").contains("58H-59H"));
}

#[test]
fn damaged_frames_are_bad_for_the_right_reason() {
    let kind = |hex: &str| bad(&format!("isu decode {hex}"))["kind"].clone();
    assert_eq!(kind("01 0D 0C"), "checksum");
    assert_eq!(kind("01 0C 0C"), "direction");
    assert_eq!(kind("03 04 58 02 5E"), "direction");
    assert_eq!(kind("04 05 58 40 00"), "size");
    assert_eq!(kind("01"), "size");
    assert_eq!(kind("01 0F 0F"), "unknown_function");
    assert_eq!(kind(&isu_frame(&[1, head(15, 1, true)])), "reserved_address");
    assert_eq!(kind("01 0"), "odd_digits");
    let error = bad(&format!("isu decode {}", isu_frame(&[5, head(1, 4, true), 0x48, 0, 0, 0])));
    assert_eq!([&error["kind"], &error["function"]], [&json!("length"), &json!("read_eeprom")]);
    assert_eq!(bad("isu decode --command 01 0D 0D")["kind"], "direction");
    assert_eq!(bad("isu decode --command 01 0E 0E")["kind"], "unknown_function");
}

#[test]
fn bad_lines_are_told_apart_and_cost_no_good_one() {
    let run = fed("isu ascii", "+180.00\n-180.01\n 32.70\n+ 3 .70\n- 4.31\n+124.5\n+124.500\n\n-  0.00\r\n+");
    assert_eq!(run.status, 1);
    let kinds: Vec<String> = run
        .objects()
        .iter()
        .map(|object| match &object["error"]["kind"] {
            Value::String(kind) => kind.clone(),
            _ => object["angle_cdeg"].to_string(),
        })
        .collect();
    let unexpected = "unexpected";
    assert_eq!(
        kinds,
        [
            "18000", "value", "no_sign", unexpected, unexpected, unexpected, unexpected, "no_sign", "0",
            unexpected
        ]
    );
    let error = &run.objects()[3]["error"];
    assert_eq!((&error["character"], &error["position"]), (&json!(" "), &json!(4)));
}

#[test]
fn pulses_of_any_timer_rounded_half_away_from_zero() {
    for (period, high, duty_ppm, angle_udeg) in [
        // The ends of what the arguments can say: −157.45°, and 517.45° from 674.9 − 157.45.
        (1_u32, 0_u32, 0, -157_450_000_i64),
        (1, 1, 1_000_000, 517_450_000),
        (u32::MAX, u32::MAX, 1_000_000, 517_450_000),
        (u32::MAX, 0, 0, -157_450_000),
        // 50 % is 180° exactly.
        (2_800_000, 1_400_000, 500_000, 180_000_000),
        // 674 900 000/3 = 224 966 666.67, less 157 450 000.
        (3, 1, 333_333, 67_516_667),
        // 674 900 000/64 000 000 = 10.545…: −157 449 989.45 rounds to the nearest.
        (64_000_000, 1, 0, -157_449_989),
        // 674 900 000/200 000 000 = 3.3745; 4 of them 13.498: −157 449 986.502 rounds away from zero.
        (200_000_000, 4, 0, -157_449_987),
        // Exactly halves: 674 900 000/40 000 = 16 872.5, and a duty of half a millionth more than 25.
        (40_000, 1, 25, -157_433_128),
        (40_000, 10_001, 250_025, 11_291_873),
    ] {
        let object = good(&format!("pwm --period-ticks {period} --high-ticks {high}"));
        assert_eq!(object, json!({ "duty_ppm": duty_ppm, "angle_udeg": angle_udeg }), "{high}/{period}");
    }
}

#[test]
fn pulses_that_are_none_are_bad() {
    assert_eq!(bad("pwm --period-ticks 0 --high-ticks 0")["kind"], "zero_period");
    let error = bad("pwm --period-ticks 1000 --high-ticks 1001");
    assert_eq!(
        [&error["kind"], &error["period_ticks"], &error["high_ticks"]],
        [&json!("high_beyond_period"), &json!(1_000), &json!(1_001)]
    );
}
