//! A person at a terminal.

use crate::desk::Desk;

#[test]
fn enter_brings_a_prompt_and_what_is_typed_is_echoed() {
    let mut desk = Desk::new();
    assert!(desk.type_in("\r").ends_with("clino> "));
    assert_eq!(desk.type_in("vers"), "vers");
    assert!(desk.type_in("\t").contains("ion"), "completion");
    assert!(desk.type_in("\r").contains("clino: version 9.8.7, uptime_ms 0\r\n"));
}

#[test]
fn a_key_of_a_stream_does_nothing_but_end_it() {
    let mut desk = Desk::with_person();
    desk.type_in("watch\r");
    assert_eq!(desk.type_in("abc"), "");
    assert!(desk.type_in("\x03").ends_with("clino> "));
    assert!(desk.type_in("\r").ends_with("clino> "));
}

#[test]
fn the_list_has_a_line_for_each_slot_in_use() {
    let mut desk = Desk::with_person();
    let list = desk.type_in("list\r");
    assert!(list.contains("   0  t7       5          -  never     never_read"), "{list}");
    assert!(list.contains("   1  isu      3          -  never     never_read"), "{list}");
    assert_eq!(list.lines().filter(|line| line.contains("never_read")).count(), 2, "{list}");
}

#[test]
fn help_names_every_command() {
    let help = Desk::with_person().type_in("help\r");
    for command in ["list", "read", "watch", "json", "slot", "bus", "t7", "isu", "counters", "version"] {
        assert!(help.contains(&format!("  {command} ")), "{command} in {help}");
    }
}

#[test]
fn an_error_says_what_and_the_limit() {
    let mut desk = Desk::with_person();
    assert!(desk.type_in("read 99\r").contains("error: slot 99 is not between 0 and 47\r\n"));
    let refused = desk.type_in("bus t7 -b 300\r");
    assert!(refused.contains("error: the sensors do not have 300 bit/s, only 115200 "), "{refused}");
    assert!(desk.type_in("what\r").contains("error: unknown command, try help\r\n"));
}

#[test]
fn former_lines_come_back_with_the_arrow() {
    let mut desk = Desk::with_person();
    desk.type_in("read 1\r");
    assert!(desk.type_in("\x1b[A").contains("read 1"));
}

#[test]
fn json_is_a_mode_without_echo_and_back() {
    let mut desk = Desk::with_person();
    desk.type_in("json on\r");
    assert_eq!(desk.type_in("version\r"), "{\"what\":\"clino\",\"version\":\"9.8.7\",\"uptime_ms\":0}\r\n");
    assert!(desk.type_in("json off\r").ends_with("clino> "));
}

#[test]
fn no_bytes_do_harm() {
    // A generator of full period over the bytes: every pair of bytes comes once.
    let mut desk = Desk::with_person();
    let mut state = 1_u32;
    for _ in 0..200_000 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        desk.type_bytes(&[(state >> 24) as u8]);
    }
    assert!(desk.rest.orders.is_empty(), "{:?}", desk.rest.orders);
    desk.type_in("\r\x03\rjson off\r\r");
    assert!(desk.type_in("version\r").contains("9.8.7"));
}
