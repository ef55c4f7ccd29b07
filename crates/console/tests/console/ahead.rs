//! What is typed ahead: of a question, of the end of a task, of the end of a stream; and what is pasted.

use clino_bus::{Duration, Event};
use clino_console::Received;
use clino_gateway::order::Order;
use clino_gateway::{Action, Bus};

use crate::desk::Desk;

const EARLY: &str = "error: line not carried out, characters too early: ";

#[test]
fn a_paste_does_not_answer_the_question_in_its_middle() {
    for rest in ["y\r", "y\rversion\r", "list\rsave\ry\r", "y", "\r", "\ry\r", "save\r", "\x03", "y\r\x03y\r"]
    {
        for end in ["\r", "\r\n"] {
            let mut desk = Desk::with_person();
            let said = desk.paste(&format!("t7 zero 5{end}{rest}"));
            assert!(said.contains("Go on? y/N \r\nnot done\r\n"), "{rest:?}: {said:?}");
            assert_eq!(desk.rest.orders, [], "{rest:?}");
            // What comes of it after the question is no command, for as long as it comes.
            assert_eq!(desk.wait_ms(99), "");
            assert_eq!(desk.type_in("save\rfactory-reset\ry\r"), "");
            assert_eq!(desk.wait_ms(99), "");
            let said = desk.wait_ms(1);
            assert_eq!(said, format!("{EARLY}{}\r\nclino> ", rest.len() + 21), "{rest:?}");
            assert_eq!(desk.rest.done, [""; 0]);
            assert!(desk.type_in("version\r").contains("9.8.7"));
        }
    }
}

#[test]
fn the_line_feed_of_the_line_end_is_no_answer() {
    for end in ["\r\n", "\r\0"] {
        let mut desk = Desk::with_person();
        assert!(desk.paste(&format!("t7 zero 5{end}")).ends_with("Go on? y/N "));
        assert!(!desk.type_in("y\r").contains("not done"));
        assert_eq!(desk.rest.orders.len(), 1);
        // Nor is it when it comes after the question.
        let mut desk = Desk::with_person();
        desk.type_in("t7 zero 5\r");
        assert!(!desk.type_in(&format!("{}y\r", &end[1..])).contains("not done"));
        assert_eq!(desk.rest.orders.len(), 1);
    }
}

#[test]
fn a_paste_that_pauses_at_the_question_does_not_answer_it_either() {
    for rest in [
        "list\rsave\r",
        "yes\rsave\r",
        "yy\rsave\r",
        " y\rsave\r",
        "y \rsave\r",
        "Y\rsave\r",
        "xy\x7f\x7fy\rsave\r",
    ] {
        let mut desk = Desk::with_person();
        desk.type_in("t7 zero 5\r");
        let said = desk.type_in(rest) + &desk.wait_ms(100);
        assert!(said.contains("\r\nnot done\r\n") && said.ends_with("clino> "), "{rest:?}: {said:?}");
        assert!(said.contains(EARLY), "{rest:?}: {said:?}");
        assert_eq!((desk.rest.orders.len(), desk.rest.done.len()), (0, 0), "{rest:?}");
    }
    // The answer no has no delay.
    for no in ["\r", "n\r", "N\r", "no\r", "\x03"] {
        let mut desk = Desk::with_person();
        desk.type_in("t7 zero 5\r");
        assert!(desk.type_in(no).ends_with("not done\r\nclino> "), "{no:?}");
        assert!(desk.type_in("version\r").contains("9.8.7"));
    }
}

#[test]
fn an_answer_that_is_damaged_is_a_no() {
    let mut desk = Desk::with_person();
    desk.type_in("t7 zero 5\r");
    desk.receive(Received::new(b'y', true, 0));
    assert!((desk.type_in("\r") + &desk.wait_ms(100)).contains("not done\r\n"));
    assert_eq!(desk.rest.orders, []);
    for lost_before in [b'y', b'\r'] {
        let mut desk = Desk::with_person();
        desk.type_in("t7 zero 5\r");
        for byte in *b"y\r" {
            let lost = u8::from(byte == lost_before);
            desk.receive(Received::new(byte, false, lost));
        }
        assert!((desk.printed() + &desk.wait_ms(100)).contains("not done\r\n"));
        assert_eq!(desk.rest.orders, []);
    }
}

#[test]
fn the_rest_of_an_answer_that_came_too_late_is_no_command() {
    let mut desk = Desk::with_person();
    desk.type_in("t7 zero 5\r");
    desk.type_in("t7 ");
    assert!(desk.wait_ms(30_000).contains("not done"));
    let said = desk.type_in("zero 1\r");
    assert!(said.contains(EARLY), "{said:?}");
    assert_eq!(desk.rest.orders, []);
}

/// The task on the T7 bus goes on until it ends; no node answers.
fn finish(desk: &mut Desk) -> String {
    let mut said = String::new();
    for _ in 0..100_000 {
        desk.rest.now = desk.rest.now + Duration::from_micros(500);
        let mut sent = false;
        desk.rest.gateway.poll(Bus::T7, desk.rest.now, |action| sent |= matches!(action, Action::Send(_)));
        if sent {
            desk.rest.gateway.line(Bus::T7, Event::Released { at: desk.rest.now });
        }
        said += &desk.stream();
        if said.contains("failed: ") {
            return said;
        }
    }
    panic!("the task does not end: {said}");
}

/// Of `t7 zero 3`, typed while `t7 info 1` worked, the tail `zero 3` was carried out.
#[test]
fn lines_typed_while_a_task_works_are_refused_whole() {
    let mut desk = Desk::with_person();
    desk.type_in("t7 info 1\r");
    let said = desk.type_in("t7 zero 3\rversion\rset 0 per");
    assert_eq!(said, "error: line not carried out, a task is running: Ctrl-C stops it\r\n".repeat(2));
    // What is typed of a line stands at the prompt that follows, and is gone on with.
    let said = finish(&mut desk);
    assert!(said.ends_with("clino> set 0 per"), "{said:?}");
    let orders = desk.rest.orders.len();
    assert!(desk.type_in("iod 100\r").contains("done"));
    assert_eq!(desk.rest.orders.len(), orders + 1);
    assert!(matches!(desk.rest.orders.last(), Some(Order::Slot { slot: 0, .. })));
}

#[test]
fn every_cut_of_a_line_by_the_end_of_a_task_leaves_it_whole_or_refused() {
    let line = "t7 zero 3";
    for cut in 0..=line.len() {
        let mut desk = Desk::with_person();
        desk.type_in("t7 info 1\r");
        desk.type_in(&line[..cut]);
        finish(&mut desk);
        let orders = desk.rest.orders.len();
        let said = desk.type_in(&format!("{}\r", &line[cut..]));
        assert!(said.contains("Go on? y/N "), "cut at {cut}: {said:?}");
        assert_eq!(desk.rest.orders.len(), orders);
    }
}

#[test]
fn a_paste_behind_watch_ends_it_and_is_not_carried_out() {
    let mut desk = Desk::with_person();
    let said = desk.paste("watch\rsave\r");
    assert!(said.contains(&format!("{EARLY}4\r\n")) && said.ends_with("clino> "), "{said:?}");
    assert_eq!(desk.rest.done, [""; 0]);
}

#[test]
fn a_prompt_left_alone_gives_way_to_the_stream() {
    let mut desk = Desk::with_person();
    desk.wait_ms(30_000);
    desk.type_in("a\x7f");
    assert_eq!(desk.wait_ms(59_999), "");
    let said = desk.wait_ms(1);
    let begin = "\r\n{\"stream\":\"resumed\",\"why\":\"idle\",\"prompt\":\"Enter or Ctrl-C\"}\r\n{\"stream\":\"started\"";
    assert!(said.starts_with(begin), "{said:?}");
    assert!(desk.wait_ms(1_000).contains("{\"stats\":\"t7\""));
    assert!(desk.type_in("\r").ends_with("clino> "));
}

/// The longest idle time is a day, and a line that was begun waits for ten.
#[test]
fn a_prompt_is_kept_for_a_day_and_a_line_for_ten() {
    const DAY_MS: u64 = 86_400_000;
    for (typed, days) in [("", 1), ("t7 ", 10)] {
        let mut desk = Desk::left_alone_after(86_400);
        desk.type_in("\r");
        desk.type_in(typed);
        assert_eq!(desk.wait_ms(days * DAY_MS - 1), "");
        assert!(desk.wait_ms(1).contains("\"why\":\"idle\""), "{days} days");
    }
}

/// A cable that picks up disturbances types nothing: neither the prompt nor a paste that is dropped waits for it.
#[test]
fn noise_holds_no_prompt() {
    let disturbed = Received::new(0x55, true, 0);
    let mut desk = Desk::with_person();
    let mut said = String::new();
    for _ in 0..60 {
        desk.receive(disturbed);
        said += &desk.wait_ms(1_000);
    }
    assert!(said.contains("\"why\":\"idle\""), "{said:?}");

    let mut desk = Desk::with_person();
    desk.type_in("t7 zero 5\r");
    let mut said = desk.type_in("list\r");
    for _ in 0..10 {
        desk.receive(disturbed);
        said += &desk.wait_ms(10);
    }
    assert!(said.contains(EARLY) && said.ends_with("clino> "), "{said:?}");
}

#[test]
fn a_line_that_was_begun_waits_longer_and_its_rest_is_no_command() {
    let mut desk = Desk::with_person();
    desk.type_in("t7 ");
    assert_eq!(desk.wait_ms(599_999), "");
    assert!(desk.wait_ms(1).contains("\"why\":\"idle\""));
    let said = desk.type_in("zero 1\r");
    assert_eq!(said, "{\"error\":{\"kind\":\"damaged_line\",\"reason\":\"left\",\"characters\":3}}\r\n");
    assert_eq!(desk.rest.orders, []);
    assert!(desk.type_in("\r").ends_with("clino> "));
}

#[test]
fn neither_a_task_nor_a_program_nor_a_watch_is_left_alone() {
    let mut desk = Desk::with_person();
    desk.type_in("watch\r");
    assert!(!desk.wait_ms(3_600_000).contains("resumed"));
    desk.type_in("\r");
    desk.type_in("json on\r");
    assert!(!desk.wait_ms(3_600_000).contains("resumed"));
    desk.type_in("json off\r");
    desk.type_in("t7 scan\r");
    assert!(!desk.wait_ms(100_000).contains("resumed"));
}

/// An hour at the prompt was made up for with an hour of statistics.
#[test]
fn statistics_are_not_made_up_for() {
    for away_ms in [900, 1_500, 60_000, 3_600_000] {
        let mut desk = Desk::new();
        desk.type_in("json on\r");
        desk.wait_ms(away_ms);
        desk.type_in("watch\r");
        let rounds = |text: String| text.matches("{\"stats\":\"t7\"").count();
        let first = rounds(desk.stream());
        assert_eq!(first, usize::from(away_ms >= 1_000), "after {away_ms} ms");
        let later: usize = (0..100).map(|_| rounds(desk.wait_ms(100))).sum();
        assert!((9..=11).contains(&later), "{later} rounds in 10 s after {away_ms} ms");
    }
}

#[test]
fn a_line_check_is_taken_off_and_required_from_then_on() {
    let answer = r#"{"what":"clino","version":"9.8.7","uptime_ms":0,"mode":"normal","clock":"crystal","power_ups":0,"boots":1,"uid":"000000020000000100000000"}"#;
    let refused = |length| {
        format!(
            "{{\"error\":{{\"kind\":\"damaged_line\",\"reason\":\"check\",\"characters\":{length}}}}}\r\n"
        )
    };
    let mut desk = Desk::new();
    assert_eq!(desk.type_in("version\r"), format!("{answer}\r\n"), "optional");
    // Wrong, malformed, with something behind it.
    for line in
        ["version*00", "version*6", "version*", "version*6A0", "version*+6", "version*6A ", "ver*sion"]
    {
        assert_eq!(desk.type_in(&format!("{line}\r")), refused(line.len()), "{line}");
    }
    // v^e^r^s^i^o^n, computed by hand: 76 65 72 73 69 6F 6E.
    assert_eq!(desk.type_in("version*7A\r"), format!("{answer}\r\n"));
    assert_eq!(desk.type_in("version\r"), refused(7), "whose * was lost");
    assert_eq!(desk.type_in("version7A\r"), refused(9));
    assert_eq!(desk.type_in("version*7a\r"), format!("{answer}\r\n"));
    // Ctrl-C begins a session without.
    desk.type_in("\x03json on\r");
    assert_eq!(desk.type_in("version\r"), format!("{answer}\r\n"));
}
