//! Every worked example of the two documents, through the tool.

mod common;

use common::{assert_has, encoded, fed, good, vectors};
use serde_json::{Value, json};

/// How to decode a vector.
fn decode(vector: &Value) -> String {
    let protocol = vector["protocol"].as_str().unwrap();
    let command = if vector["kind"] == "command" { " --command" } else { "" };
    format!("{protocol} decode{command}")
}

#[test]
fn nothing_is_left_out() {
    let count = |protocol| vectors(protocol).len();
    assert_eq!([count("t7"), count("isu"), count("isu-ascii"), count("isu-pwm")], [35, 9, 1, 3]);
}

#[test]
fn every_frame_is_good_and_means_what_the_document_says() {
    for vector in [vectors("t7"), vectors("isu")].concat() {
        let hex = vector["hex"].as_str().unwrap();
        let object = good(&format!("{} {hex}", decode(&vector)));
        assert_has(&object, vector.get("want").unwrap_or(&json!({})), hex);
    }
}

#[test]
fn every_frame_means_the_same_in_a_stream() {
    for protocol in ["t7", "isu"] {
        for kind in ["command", "response"] {
            let vectors: Vec<Value> =
                vectors(protocol).into_iter().filter(|vector| vector["kind"] == kind).collect();
            let input: Vec<&str> = vectors.iter().map(|vector| vector["hex"].as_str().unwrap()).collect();
            let run = fed(&format!("{} --stdin", decode(&vectors[0])), input.join("\n"));
            assert_eq!(run.status, 0, "{run:?}");
            let objects = run.objects();
            assert_eq!(objects.len(), vectors.len());
            for (object, vector) in objects.iter().zip(&vectors) {
                assert_has(object, vector.get("want").unwrap_or(&json!({})), &vector.to_string());
            }
        }
    }
}

/// Meaning of the commands of the T7 guide, in the order of the vectors, in the words of the guide.
const T7_COMMANDS: [(&str, &str); 17] = [
    ("get_all_angles", r#"{}"#),
    ("get_angle --axis 0", r#"{"axis":0}"#),
    ("get_angle --axis 1", r#"{"axis":1}"#),
    ("get_angle --axis 2", r#"{"axis":2}"#),
    ("set_angle --axis 2 --angle-mdeg 10500", r#"{"axis":2,"angle_mdeg":10500}"#),
    ("get_all_angle_offsets", r#"{}"#),
    ("set_angle_offset --axis 2 --offset-mdeg 30000", r#"{"axis":2,"offset_mdeg":30000}"#),
    ("get_all_data", r#"{}"#),
    ("get_all_directions", r#"{}"#),
    ("set_direction --axis 2 --direction reversed", r#"{"axis":2,"direction":"reversed"}"#),
    ("get_damping", r#"{}"#),
    ("set_damping --damping-ms 500", r#"{"damping_ms":500}"#),
    ("get_angle_output_range", r#"{}"#),
    ("set_angle_output_range --range unidirectional", r#"{"output_range":"unidirectional"}"#),
    ("get_device_information", r#"{}"#),
    ("set_baud_rate --baud 9600", r#"{"baud":9600}"#),
    (
        "set_address --device-type t7-1 --serial 25033 --new-address 1",
        r#"{"device_type":"t7-1","serial":25033,"new_address":1}"#,
    ),
];

#[test]
fn every_t7_command_encodes_to_the_documented_bytes_and_decodes_to_the_same_parameters() {
    let commands: Vec<Value> =
        vectors("t7").into_iter().filter(|vector| vector["kind"] == "command").collect();
    assert_eq!(commands.len(), T7_COMMANDS.len());
    for (vector, (arguments, parameters)) in commands.iter().zip(T7_COMMANDS) {
        let hex = vector["hex"].as_str().unwrap();
        assert_eq!(encoded(&format!("t7 encode --address 5 {arguments}")), hex, "{vector}");

        let mut want: Value = serde_json::from_str(parameters).unwrap();
        want["address"] = json!(5);
        want["command"] = json!(arguments.split(' ').next().unwrap());
        assert_eq!(good(&format!("t7 decode --command {hex}")), want, "{vector}");
    }
}

#[test]
fn every_isu_command_encodes_to_the_documented_bytes() {
    for (arguments, hex) in [
        ("read_angle", "03 04 58 02 5E"),
        ("read_ram --start 58H --count 2", "03 04 58 02 5E"),
        ("reset_null_position", "01 0C 0C"),
        ("read_eeprom --start 0x48 --count 2", "03 08 48 02 52"),
        ("read_eeprom --start 120 --count 8", "03 08 78 08 88"),
    ] {
        assert_eq!(encoded(&format!("isu encode --address 0 {arguments}")), hex);
        assert!(vectors("isu").iter().any(|vector| vector["hex"] == hex), "{hex} is not in the document");
    }
}

#[test]
fn every_ascii_line_means_what_it_shows() {
    let vector = vectors("isu-ascii").remove(0);
    let lines: Vec<&str> = vector["lines"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    // As sent, and as a terminal's log keeps them.
    for input in [lines.concat(), lines.concat().replace('\r', "")] {
        let run = fed("isu ascii", input);
        assert_eq!(run.status, 0, "{run:?}");
        let angles: Vec<Value> = run.objects().iter().map(|object| object["angle_cdeg"].clone()).collect();
        assert_eq!(json!(angles), vector["want_centidegrees"]);
    }
}

#[test]
fn every_duty_cycle_gives_the_printed_angle() {
    for vector in vectors("isu-pwm") {
        // A period of 10 000 ticks makes a hundredth of a percent one tick.
        let high = (vector["duty_percent"].as_f64().unwrap() * 100.0).round() as u32;
        let angle_udeg = (vector["want_degrees"].as_f64().unwrap() * 1e6).round() as i64;
        let object = good(&format!("pwm --period-ticks 10000 --high-ticks {high}"));
        assert_eq!(object, json!({ "duty_ppm": high * 100, "angle_udeg": angle_udeg }), "{vector}");
    }
}
