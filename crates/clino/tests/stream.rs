//! One frame per line in, one object per line out.

mod common;

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Command, Stdio};

use common::{CLINO, fed, text};
use serde_json::Value;

const GOOD: &str = "05 06 81 FF FF 4E FF 29";
const BAD: &str = "05 06 81 FF FF 4E FF 28";

#[test]
fn good_and_bad_lines_keep_their_order() {
    let lines = [GOOD, BAD, "", "050583", "0x05 0x03 0x84 0x00 0x74", "zz", "05 1", GOOD];
    for end in ["\n", "\r\n"] {
        let run = fed("t7 decode --stdin", lines.join(end));
        assert_eq!((run.status, run.stderr.as_str()), (1, ""));
        let kinds: Vec<Value> = run
            .objects()
            .iter()
            .map(|object| match object.get("error") {
                Some(error) => error["kind"].clone(),
                None => object["command"].clone(),
            })
            .collect();
        assert_eq!(
            kinds,
            ["get_angle", "checksum", "empty", "size", "set_angle", "not_hex", "odd_digits", "get_angle"]
        );
    }
}

#[test]
fn only_good_lines_are_success_and_no_line_is_too() {
    assert_eq!(fed("t7 decode --stdin", GOOD).status, 0);
    assert_eq!(fed("isu decode --stdin --command", "01 0C 0C\n").status, 0);
    let nothing = fed("t7 decode --stdin", "");
    assert_eq!((nothing.status, nothing.stdout.as_str()), (0, ""));
}

#[test]
fn whatever_the_bytes_every_line_is_answered() {
    let mut input = Vec::new();
    for byte in (0..=255_u8).filter(|&byte| byte != b'\n') {
        input.extend([byte, b'5', byte, b'\n']);
    }
    for line in ["t7 decode --stdin", "isu decode --stdin", "isu ascii"] {
        assert_eq!(fed(line, input.clone()).objects().len(), 255, "{line}");
    }
}

#[test]
fn a_line_of_a_megabyte_is_refused_and_the_next_is_not() {
    let run = fed("t7 decode --stdin", format!("{}\n{GOOD}\n", "0".repeat(1 << 20)));
    let objects = run.objects();
    assert_eq!(objects[0]["error"]["kind"], "line_too_long");
    assert_eq!((objects.len(), &objects[1]["axis"]), (2, &Value::from(0)));
}

#[test]
fn the_longest_frame_fits_a_line_however_it_is_written() {
    let mut bytes = vec![255, 0x05, 0];
    bytes.extend((0..253).map(|index: u8| index.wrapping_mul(31)));
    let sum = bytes[1..].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    bytes.push(sum);
    let verbose: Vec<String> = bytes.iter().map(|byte| format!("0x{byte:02X}")).collect();
    let run = fed("isu decode --stdin", [verbose.join(", "), text(&bytes)].join("\n"));
    assert_eq!(run.status, 0, "{run:?}");
    let objects = run.objects();
    assert_eq!(objects[0], objects[1]);
    assert_eq!(objects[0]["data"].as_array().unwrap().len(), 253);
}

/// Row 15 of the issue, and others of its kind, through the tool; what each way means is tested in `hex/tests.rs`.
#[test]
fn a_frame_in_every_customary_way() {
    let ways = [
        "05:06:81:FF:FF:4E:FF:29",
        "05-06-81-FF-FF-4E-FF-29",
        "[05][06][81][FF][FF][4E][FF][29]",
        r"\x05\x06\x81\xFF\xFF\x4E\xFF\x29",
        "$05 $06 $81 $FF $FF $4E $FF $29",
        "05h 06h 81h FFh FFh 4Eh FFh 29h",
        "05H,06H,81H,FFH,FFH,4EH,FFH,29H",
        "05;06;81;FF;FF;4E;FF;29",
        "05|06|81|FF|FF|4E|FF|29",
        "\u{FEFF}05 06 81 FF FF 4E FF 29",
        "{0x05, 0x06, 0x81, 0xFF, 0xFF, 0x4E, 0xFF, 0x29}",
        r#"b"\x05\x06\x81\xff\xffN\xff)""#,
        "00000000: 0506 81ff ff4e ff29                      .....N.)",
        "00000000  05 06 81 ff ff 4e ff 29                           |.....N.)|",
        "0000   05 06 81 ff ff 4e ff 29                           .....N.)",
        "0000000 05 06 81 ff ff 4e ff 29",
        "can0  123   [8]  05 06 81 FF FF 4E FF 29",
        "05\u{A0}06\u{A0}81\u{A0}FF\u{A0}FF\u{A0}4E\u{A0}FF\u{A0}29\t",
    ];
    let run = fed("t7 decode --stdin", ways.join("\n"));
    assert_eq!(run.status, 0, "{run:?}");
    let expected = fed("t7 decode --stdin", GOOD).objects().remove(0);
    assert!(run.objects().iter().all(|object| *object == expected) && run.objects().len() == ways.len());
}

/// Would hang, not fail, if answers were kept until the end of the input.
#[test]
fn an_answer_comes_before_the_next_line_is_asked_for() {
    let mut child = Command::new(CLINO)
        .args(["t7", "decode", "--stdin"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    for line in [GOOD, BAD, GOOD] {
        writeln!(input, "{line}").unwrap();
        let mut answer = String::new();
        output.read_line(&mut answer).unwrap();
        assert_eq!(answer.contains("error"), line == BAD, "{answer}");
    }
    drop(input);
    assert_eq!(child.wait().unwrap().code(), Some(1));
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let mut child = Command::new(CLINO)
        .args(["t7", "decode", "--stdin"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut input = child.stdin.take().unwrap();
    // The tool stops reading at some point; that is what is tested.
    let _ = input.write_all(format!("{GOOD}\n").repeat(10_000).as_bytes());
    drop(input);
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]));
}
