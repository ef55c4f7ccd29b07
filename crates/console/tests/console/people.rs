//! A person at a terminal.

use clino_bus::line::Event;
use clino_bus::{Duration, Instant};
use clino_gateway::order::Order;
use clino_gateway::{Action, Bus};
use clino_recovery::Mode;

use crate::desk::Desk;

#[test]
fn enter_brings_a_prompt_and_what_is_typed_is_echoed() {
    let mut desk = Desk::new();
    assert!(desk.type_in("\r").ends_with("clino> "));
    assert_eq!(desk.type_in("vers"), "vers");
    assert!(desk.type_in("\t").contains("ion"), "completion");
    assert!(desk.type_in("\r").contains("clino: version 9.8.7, uptime_ms 0, mode normal, clock crystal, power_ups 0, boots 1, uid 000000020000000100000000\r\n"));
}

/// Tab, below the first word, too: what is typed, and what then stands there.
#[test]
fn tab_completes_what_can_stand_there() {
    for (typed, completed) in [
        ("t", "t"),
        ("t7 s", "t7 scan "),
        ("t7 scan ", "t7 scan all "),
        ("t7 d", "t7 d"),
        ("t7 di", "t7 direction "),
        ("t7 direction 5 re", "t7 direction 5 reversed "),
        ("t7 direction ", "t7 direction "),
        ("isu nu", "isu null "),
        ("slot 6 p", "slot 6 pwm "),
        ("slot p", "slot p "),
        ("set 3 fi", "set 3 filter "),
        ("set 3 filter me", "set 3 filter me"),
        ("set 3 filter med", "set 3 filter median "),
        ("set 3 filter mean 8 di", "set 3 filter mean 8 direction "),
        ("set 3 period 20 stale", "set 3 period 20 stale "),
        ("set 3 confirm o", "set 3 confirm o"),
        ("set modbus pau", "set modbus pauses "),
        ("set modbus pauses to", "set modbus pauses tolerant "),
        ("modbus par", "modbus parity "),
        ("show con", "show console "),
        ("help fac", "help factory-reset "),
        ("nonsense fac", "nonsense fac "),
    ] {
        let mut desk = Desk::with_person();
        desk.type_in(typed);
        desk.type_in("\t");
        let drawn = desk.type_in("\x0c");
        assert_eq!(drawn, format!("\x1b[H\x1b[2Jclino> {completed}"), "{typed:?}");
    }
}

/// Before the prompt stands that something is not saved; a line of it that an echo brings back is not carried out.
#[test]
fn the_prompt_says_what_is_not_saved() {
    let mut desk = Desk::with_person();
    desk.rest.unsaved = true;
    assert!(desk.type_in("version\r").ends_with("\r\nnot saved, clino> "));
    desk.type_in("ver");
    assert_eq!(desk.type_in("\x0c"), "\x1b[H\x1b[2Jnot saved, clino> ver");
    desk.type_in("\x03");
    desk.rest.unsaved = false;
    assert!(desk.type_in("version\r").ends_with("\r\nclino> "));
    assert!(desk.type_in("not saved, clino> slot 1 off\r").contains("\"why\":\"echo\""));
    assert!(desk.rest.orders.is_empty());
}

#[test]
fn safe_mode_is_said_before_the_prompt() {
    for (mode, said) in [(Mode::Normal, ""), (Mode::Safe, "safe mode"), (Mode::Bare, "bare mode")] {
        let mut desk = Desk::new();
        desk.rest.start.mode = mode;
        let greeting = desk.type_in("\r");
        let end = if said.is_empty() { "" } else { ", see reset-cause\r\n" };
        assert!(greeting.starts_with(&format!("\r\n{said}")), "{greeting:?}");
        assert!(greeting.contains(end) && greeting.ends_with("clino> "), "{greeting:?}");
        assert_eq!(greeting.contains("mode"), mode != Mode::Normal, "{greeting:?}");
        let name = format!("mode {}", mode.name());
        assert!(desk.type_in("version\r").contains(&name), "{name}");
        // A program is not greeted: it asks.
        desk.type_in("json on\r");
        assert_eq!(desk.type_in("\r"), "");
    }
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
    for command in [
        "list",
        "read",
        "watch",
        "slot",
        "show",
        "set",
        "zero",
        "bus",
        "t7",
        "isu",
        "cancel",
        "counters",
        "trace",
        "load",
        "export",
        "modbus",
        "save",
        "factory-reset",
        "reboot",
        "reset-cause",
        "version",
        "json",
        "help",
    ] {
        assert!(help.contains(&format!("  {command} ")), "{command} in {help}");
    }
}

#[test]
fn an_error_says_what_and_the_limit() {
    let mut desk = Desk::with_person();
    assert!(desk.type_in("read 99\r").contains("error: slot 99 is not between 0 and 47\r\n"));
    let refused = desk.type_in("bus t7 -b 300\r");
    assert!(refused.contains("error: 300 bit/s is not among 115200 "), "{refused}");
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
    let version = r#"{"what":"clino","version":"9.8.7","uptime_ms":0,"mode":"normal","clock":"crystal","power_ups":0,"boots":1,"uid":"000000020000000100000000"}"#;
    assert_eq!(desk.type_in("version\r"), format!("{version}\r\n"));
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

#[test]
fn help_of_a_command_says_how_to_use_it() {
    let mut desk = Desk::with_person();
    for line in ["help zero\r", "zero -h\r", "zero 1 --help\r"] {
        assert!(desk.type_in(line).contains("zero SLOT\r\nset the soft zero of a slot"), "{line}");
    }
    assert!(desk.type_in("help nothing\r").contains("error: unknown command, try help\r\n"));
}

#[test]
fn how_a_slot_is_set_is_shown_in_words() {
    let mut desk = Desk::with_person();
    let shown = desk.type_in("show 0\r");
    for line in
        ["config 0", "  kind               t7", "  period_ms          20", "  partner            none"]
    {
        assert!(shown.contains(&format!("{line}\r\n")), "{line} in {shown}");
    }
}

#[test]
fn what_cannot_be_undone_is_asked_about_and_only_y_does_it() {
    for (answer, done) in [
        ("y\r", true),
        ("y\n", true),
        ("\r", false),
        ("n\r", false),
        ("Y\r", false),
        ("yes\r", false),
        ("y\x03", false),
        ("\x03", false),
        ("xy\r", false),
        ("y\x7f\r", false),
    ] {
        let mut desk = Desk::with_person();
        let asked = desk.type_in("factory-reset\r");
        assert!(asked.ends_with("this discards the saved settings. Go on? y/N "), "{asked:?}");
        let said = desk.type_in(answer) + &desk.wait_ms(100);
        assert_eq!(desk.rest.done, if done { vec!["factory reset"] } else { vec![] }, "{answer:?}");
        let end = if done { "\r\ndone\r\n" } else { "\r\nnot done\r\n" };
        assert!(said.contains(end) && said.ends_with("clino> "), "{said:?}");
        assert!(desk.type_in("version\r").contains("9.8.7"), "commands go on after {answer:?}");
    }
}

#[test]
fn a_question_waits_for_thirty_seconds() {
    let mut desk = Desk::with_person();
    desk.type_in("reboot\r");
    desk.rest.now = Instant::from_millis(29_999);
    desk.stream();
    assert_eq!(desk.type_in("y"), "y");
    desk.rest.now = Instant::from_millis(30_000);
    assert!(desk.stream().contains("not done\r\n"));
    assert!(desk.type_in("\r").ends_with("clino> "));
    // The console was not polled meanwhile: the answer alone comes too late.
    desk.type_in("reboot\r");
    desk.rest.now = Instant::from_millis(60_000);
    assert!(desk.type_in("y\r").contains("not done\r\n"));
    assert_eq!(desk.rest.done, [""; 0]);
}

#[test]
fn every_command_that_writes_to_a_sensor_asks_and_no_other_does() {
    for (line, asks) in [
        ("t7 scan", false),
        ("t7 info 5", false),
        ("t7 zero 5", true),
        ("t7 offset 5 -- -500", true),
        ("t7 direction 5 reversed", true),
        ("t7 damping 5 500", true),
        ("t7 range 5 unidirectional", true),
        ("t7 address 5 6", true),
        ("t7 baud 5 9600", true),
        ("isu info 3", false),
        ("isu reset 3", false),
        ("isu zero 3", true),
        ("isu null 3 100", true),
        ("isu address 3 4", true),
        ("isu repair 3", true),
    ] {
        let mut desk = Desk::with_person();
        let said = desk.type_in(&format!("{line}\r"));
        assert_eq!(said.contains("Go on? y/N "), asks, "{line}: {said}");
        assert_eq!(desk.rest.orders.len(), usize::from(!asks), "{line}");
        if asks {
            desk.type_in("y\r");
            assert_eq!(desk.rest.orders.len(), 1, "{line}");
        }
    }
}

#[test]
fn what_is_refused_anyway_is_not_asked_about() {
    let said = Desk::with_person().type_in("t7 damping 5 5001\r");
    assert!(said.contains("error: ") && said.contains("5000") && !said.contains("Go on?"), "{said}");
}

#[test]
fn a_task_shows_how_far_it_is_and_stops_on_ctrl_c() {
    let mut desk = Desk::with_person();
    assert!(!desk.type_in("t7 scan\r").contains("clino> "), "no prompt before the end");
    desk.rest.now = Instant::from_millis(1_000);
    let shown = desk.stream();
    assert!(shown.starts_with("under way: done ") && shown.ends_with(", of 101\r\n"), "{shown:?}");
    desk.type_in("\x03");
    assert_eq!(desk.rest.orders.last(), Some(&Order::Cancel(Bus::T7)));
}

#[test]
fn watching_begins_with_a_head() {
    let mut desk = Desk::with_person();
    assert!(desk.type_in("watch\r").contains("slot  kind  addr      angle  age       status\r\n"));
}

/// What a terminal shows of a text, line by line: it knows line ends, cursor up and down, and erase to the end of the line.
fn screen(text: &str) -> Vec<String> {
    let (mut lines, mut row, mut column) = (vec![String::new()], 0_usize, 0_usize);
    let mut rest = text.chars();
    while let Some(character) = rest.next() {
        match character {
            '\r' => column = 0,
            '\n' => {
                row += 1;
                lines.resize(lines.len().max(row + 1), String::new());
            }
            '\x1b' => {
                assert_eq!(rest.next(), Some('['));
                let mut number = String::new();
                let letter = loop {
                    match rest.next().expect("a whole sequence") {
                        digit @ '0'..='9' => number.push(digit),
                        letter => break letter,
                    }
                };
                match letter {
                    'A' => {
                        row = row.checked_sub(number.parse().unwrap()).expect("no higher than the first line")
                    }
                    'B' => row += number.parse::<usize>().unwrap(),
                    'K' => lines[row].truncate(column),
                    other => panic!("ESC [ {number} {other}"),
                }
            }
            character => {
                let line = &mut lines[row];
                line.replace_range(column..(column + 1).min(line.len()), &character.to_string());
                column += 1;
            }
        }
    }
    lines
}

/// A person who watches sees a line for each slot, which changes where it stands.
#[test]
fn what_is_watched_is_written_over() {
    let mut desk = Desk::with_person();
    let mut text = desk.type_in("watch\r") + &desk.stream();
    let rows = |text: &str| -> Vec<String> {
        let lines = screen(text);
        let head = lines.iter().rposition(|line| line.starts_with("slot  kind")).expect("a head");
        lines[head + 1..]
            .iter()
            .map(|line| line.trim_end().to_owned())
            .filter(|line| !line.is_empty())
            .collect()
    };
    assert_eq!(rows(&text).len(), 2, "{text:?}");
    // No sensor answers; each slot tells so again and again.
    for round in 0..3 {
        for _ in 0..4_000 {
            desk.rest.now = desk.rest.now + Duration::from_micros(500);
            for bus in [Bus::T7, Bus::Isu] {
                let mut sent = false;
                desk.rest
                    .gateway
                    .poll(bus, desk.rest.now, |action| sent |= matches!(action, Action::Send(_)));
                if sent {
                    desk.rest.gateway.line(bus, Event::Released { at: desk.rest.now });
                }
            }
        }
        desk.rest.publish();
        let said = desk.stream();
        assert!(said.starts_with("\x1b["), "round {round}: {said:?}");
        text += &said;
        let rows = rows(&text);
        assert_eq!(rows.len(), 2, "{text:?}");
        for (slot, row) in rows.iter().enumerate() {
            assert!(row.starts_with(&format!("   {slot}  ")) && row.ends_with("no_answer"), "{rows:?}");
        }
    }
    // The prompt stands below the table.
    text += &desk.type_in("\r");
    assert_eq!(rows(&text).last().map(String::as_str), Some("clino>"), "{text:?}");
    assert_eq!(rows(&text).len(), 3);
    // Another slot: the table begins anew, below.
    text += &desk.type_in("slot 7 t7 9\r");
    text += &(desk.type_in("watch\r") + &desk.stream());
    assert_eq!(rows(&text).len(), 3, "{text:?}");
}

/// Whoever presses Ctrl-C does not mean what stands there.
#[test]
fn ctrl_c_drops_the_line() {
    let mut desk = Desk::with_person();
    desk.type_in("t7 zero 5 --yes");
    assert_eq!(desk.type_in("\x03"), "\r\nclino> ");
    desk.type_in("\r");
    assert_eq!(desk.rest.orders, []);
    let printed = desk.type_in("version\r");
    assert!(printed.contains("9.8.7"), "{printed}");
}
