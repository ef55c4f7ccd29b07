//! Bad usage: exit status 2, and a message that names the value and its limits.

mod common;

use common::{clino, misused};

#[test]
fn values_out_of_range_are_named_with_their_limits() {
    for (line, value, limits) in [
        ("t7 encode --address 0 get_damping", "'0' for '--address", "1..=100"),
        ("t7 encode --address 101 get_damping", "'101' for '--address", "1..=100"),
        ("t7 encode --address 300 get_damping", "'300' for '--address", "126"),
        ("t7 encode --address -5 get_damping", "'-5' for '--address", "127"),
        ("t7 encode --address 126 get_all_angles", "'126' for '--address", "exceeds 8"),
        ("t7 encode --address 126 get_device_information", "'126' for '--address", "exceeds 8"),
        ("t7 encode --address 5 get_angle --axis 3", "'3' for '--axis", "0, 1, 2"),
        ("t7 encode --address 5 set_angle --axis 2 --angle-mdeg 360000", "'360000'", "-180000..=359999"),
        ("t7 encode --address 5 set_angle --axis 2 --angle-mdeg -180001", "'-180001'", "-180000..=359999"),
        ("t7 encode --address 5 set_angle --axis 2 --angle-mdeg 1e3", "'1e3'", "-180000..=359999"),
        ("t7 encode --address 5 set_angle_offset --axis 2 --offset-mdeg 360000", "'360000'", "359999"),
        ("t7 encode --address 5 set_direction --axis 2 --direction up", "'up'", "normal, reversed"),
        ("t7 encode --address 5 set_damping --damping-ms 1", "'1'", "2..=5000"),
        ("t7 encode --address 5 set_damping --damping-ms 5001", "'5001'", "2..=5000"),
        ("t7 encode --address 5 set_damping --damping-ms 99999999999999999999", "'9999", "2..=5000"),
        (
            "t7 encode --address 5 set_angle_output_range --range both",
            "'both'",
            "bidirectional, unidirectional",
        ),
        ("t7 encode --address 5 set_baud_rate --baud 4800", "'4800'", "115200, 57600, 38400, 19200, 9600"),
        (
            "t7 encode --address 5 set_address --device-type t7-2 --serial 1 --new-address 1",
            "'t7-2'",
            "t7-1, t7-3",
        ),
        (
            "t7 encode --address 5 set_address --device-type t7-1 --serial 4294967296 --new-address 1",
            "'4294967296'",
            "0..=4294967295",
        ),
        (
            "t7 encode --address 5 set_address --device-type t7-1 --serial 1 --new-address 127",
            "'127' for '--new-address",
            "1..=100",
        ),
        ("t7 encode --address 5 get_roll_call", "'get_roll_call'", "get_all_angles, get_angle, set_angle"),
        ("isu encode --address 15 read_angle", "'15' for '--address", "0..=14"),
        ("isu encode --address 1 read_ram --start 256 --count 1", "'256' for '--start", "0..=255"),
        ("isu encode --address 1 read_ram --start 58 --count 0", "'0' for '--count", "1..=253"),
        ("isu encode --address 1 read_ram --start 58 --count 254", "'254' for '--count", "1..=253"),
        ("isu encode --address 1 read_eeprom --start 0 --count 127", "127", "1..=126"),
        ("isu encode --address 1 read_eeprom --start 255 --count 2", "2 from FFH", "FFH"),
        ("isu encode --address 1 write_eeprom --start 48H --words 12345", "'12345'", "0..=FFFF"),
        ("isu encode --address 1 write_ram --start 58H --data 1", "'1'", "whole number of bytes"),
        ("isu encode --address 1 erase", "'erase'", "read_angle, go_to_soft_error_state"),
        ("pwm --period-ticks 4294967296 --high-ticks 1", "'4294967296'", "0..=4294967295"),
        ("pwm --period-ticks 1000 --high-ticks -1", "'-1' for '--high-ticks", "0..=4294967295"),
    ] {
        let message = misused(line);
        assert!(message.contains(value), "{value} in: {message}");
        assert!(message.contains(limits), "{limits} in: {message}");
    }
}

#[test]
fn parameters_that_are_missing_or_too_many_are_named() {
    for (line, named) in [
        ("t7 encode get_damping", "--address"),
        ("t7 encode --address 5", "<COMMAND>"),
        ("t7 encode --address 5 get_angle", "get_angle needs --axis"),
        ("t7 encode --address 5 set_angle --axis 1", "set_angle needs --angle-mdeg"),
        ("t7 encode --address 5 set_angle --angle-mdeg 1", "set_angle needs --axis"),
        (
            "t7 encode --address 5 set_address --device-type t7-1 --serial 1",
            "set_address needs --new-address",
        ),
        ("t7 encode --address 5 get_damping --axis 1", "get_damping has no --axis"),
        ("t7 encode --address 5 set_angle --axis 1 --angle-mdeg 1 --baud 9600", "set_angle has no --baud"),
        ("isu encode --address 1 read_ram --start 58H", "read_ram needs --count"),
        ("isu encode --address 1 read_angle --count 2", "read_angle has no --count"),
        ("isu encode --address 1 write_eeprom --start 48H", "write_eeprom needs --words"),
        ("pwm --period-ticks 5", "--high-ticks"),
        ("t7 decode", "<HEX>"),
        ("t7 decode --stdin 05", "--stdin"),
        ("isu ascii +124.50", "+124.50"),
        ("t8 decode 05", "t8"),
    ] {
        let message = misused(line);
        assert!(message.contains(named), "{named} in: {message}");
    }
}

#[test]
fn help_and_version_are_no_error() {
    let version = clino("--version");
    assert_eq!(
        (version.status, version.stdout.as_str()),
        (0, concat!("clino ", env!("CARGO_PKG_VERSION"), "\n"))
    );
    for (line, named) in [
        ("--help", "Exit status:"),
        ("t7 --help", "decode"),
        ("t7 decode --help", "--command"),
        ("t7 encode --help", "set_angle_output_range"),
        ("isu --help", "ascii"),
        ("isu decode --help", "--stdin"),
        ("isu encode --help", "write_eeprom"),
        ("pwm --help", "--period-ticks"),
    ] {
        let run = clino(line);
        assert_eq!((run.status, run.stderr.as_str()), (0, ""), "{line}");
        assert!(run.stdout.contains(named), "{named} in: {}", run.stdout);
    }
    assert_eq!(clino("").status, 2);
}
