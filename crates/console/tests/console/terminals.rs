//! Keys of terminals, as they send them; and what looks like keys, but is none.

use clino_console::Received;

use crate::desk::Desk;

/// What Enter makes of these keys: the line as it is told to have been, by a command that repeats its argument.
fn line(keys: &str) -> String {
    let mut desk = Desk::with_person();
    desk.type_in("read ");
    let said = desk.type_in(&format!("{keys}\r"));
    let (_, told) = said.split_once("error: slot ").unwrap_or_else(|| panic!("{keys:?}: {said:?}"));
    told.split(" is not ").next().expect("a word").to_owned()
}

/// Whether the line is refused as damaged, and nothing else happens.
fn is_damaged(text: &str) -> bool {
    let mut desk = Desk::with_person();
    let said = desk.type_in(text);
    let errors = said.matches("error: line not carried out, ").count();
    assert!(errors <= 1, "{text:?}: {said:?}");
    assert!(desk.type_in("version\r").contains("9.8.7"), "after {text:?}");
    errors == 1
}

#[test]
fn enter_is_cr_lf_cr_lf_or_cr_nul() {
    for end in ["\r", "\n", "\r\n", "\r\0", "\x1bOM"] {
        let mut desk = Desk::with_person();
        let said = desk.type_in(&format!("version{end}version{end}"));
        assert_eq!(said.matches("9.8.7").count(), 2, "{end:?}: {said:?}");
        assert!(!said.contains("error"), "{end:?}: {said:?}");
        assert_eq!(said.matches("clino> ").count(), 2, "one Enter, one prompt: {end:?}: {said:?}");
    }
}

#[test]
fn keys_edit_the_line() {
    for (keys, left) in [
        // Backspace: PuTTY, picocom, screen, tio; Windows Terminal, miniterm.
        ("abcx\x7fd", "abcd"),
        ("abcx\x08d", "abcd"),
        ("abc\x7f\x7f\x7f\x7f\x7f\x7f\x7f\x7f\x7f\x7f\x7fread q", "q"),
        // Arrows, as cursor keys and as application cursor keys.
        ("bc\x1b[D\x1b[Da", "abc"),
        ("bc\x1bOD\x1bODa", "abc"),
        ("ac\x1b[D\x1b[D\x1b[Cb", "abc"),
        ("ac\x1bOD\x1bOD\x1bOCb", "abc"),
        // With modifiers: word by word.
        ("x y\x1b[1;5D\x7f", "xy"),
        ("x y\x1b[1;3D\x7f", "xy"),
        ("x y\x1b[5D\x7f", "xy"),
        ("x\x1b[1;5D\x1b[1;5D\x1b[1;5C\x1b[1;5Cy", "xy"),
        ("bc\x1b[1;2D\x1b[1;2Da", "abc"),
        // Home and End: xterm, application, linux and screen, rxvt, Emacs.
        ("x\x1b[H\x1b[3~\x1b[3~\x1b[3~\x1b[3~read\x1b[Fy", "xy"),
        ("x\x1bOH\x1b[3~\x1b[3~\x1b[3~\x1b[3~read\x1bOFy", "xy"),
        ("x\x1b[1~\x1b[3~\x1b[3~\x1b[3~\x1b[3~read\x1b[4~y", "xy"),
        ("x\x1b[7~\x1b[3~\x1b[3~\x1b[3~\x1b[3~read\x1b[8~y", "xy"),
        ("x\x01\x04\x04\x04\x04read\x05y", "xy"),
        ("bc\x02\x02a\x06d", "abdc"),
        ("x\x1b[1;5H\x1b[1;5Fy", "xy"),
        // Kill.
        ("x y\x15read z", "z"),
        ("xyz\x02\x02\x0bw", "xw"),
        ("x yz\x17\x7fw", "xw"),
        ("xy \x17w", "w"),
        ("x yz\x1b\x7f\x7fw", "xw"),
        // Delete at the end, Backspace at the begin do nothing.
        ("x\x1b[3~", "x"),
        // Keypad in application mode.
        ("9\x1bOp\x1bOy\x1bOn\x1bOq", "909.1"),
        // Tab completes, or keeps words apart.
        ("x\x01\x1b[C\x1b[C\x1b[C\x1b[C\x0b\ty", "y"),
    ] {
        assert_eq!(line(keys), left, "{keys:?}");
    }
}

#[test]
fn former_lines_come_back_and_are_edited() {
    let mut desk = Desk::with_person();
    for number in ["60", "61", "62"] {
        desk.type_in(&format!("read {number}\r"));
    }
    for (keys, told) in [
        ("\x1b[A\x1b[A\x1b[A\x1b[A", "60"),
        ("\x1bOA\x1bOA\x1bOB", "60"),
        ("\x10\x10\x10\x10\x0e", "61"),
        ("\x1b[A\x7f9", "69"),
        ("junk\x1b[A", "69"),
    ] {
        let said = desk.type_in(&format!("{keys}\r"));
        assert!(said.contains(&format!("error: slot {told} is not ")), "{keys:?}: {said:?}");
    }
}

#[test]
fn keys_that_do_nothing_are_consumed_whole() {
    for keys in [
        // Insert, page up, page down; F1 to F12 of xterm, linux, PuTTY; with modifiers; shift-tab; focus.
        "\x1b[2~",
        "\x1b[5~",
        "\x1b[6~",
        "\x1bOP",
        "\x1bOS",
        "\x1b[[A",
        "\x1b[[E",
        "\x1b[11~",
        "\x1b[15~",
        "\x1b[24~",
        "\x1b[1;2P",
        "\x1b[15;5~",
        "\x1b[Z",
        "\x1b[I",
        "\x1b[O",
        "\x1b[E",
        "\x1b[G",
        "\x1b[3^",
        "\x1b[7@",
        // Answers of a terminal: cursor position, device attributes, mode, mouse.
        "\x1b[24;80R",
        "\x1b[?1;2c",
        "\x1b[?2004;1$y",
        "\x1b[>0;276;0c",
        "\x1b[<0;10;20M",
        "\x1b[<0;10;20m",
    ] {
        assert_eq!(line(&format!("x{keys}y")), "xy", "{keys:?}");
    }
}

#[test]
fn a_lone_escape_before_a_line_does_nothing_and_eats_nothing() {
    for keys in ["\x1b", "\x1b\x1b", "\x1b\x1b\x1b"] {
        let said = Desk::with_person().type_in(&format!("{keys}version\r"));
        assert!(said.contains("9.8.7"), "{keys:?}: {said:?}");
    }
    assert!(Desk::with_person().type_in("\x1b\rversion\r").contains("9.8.7"));
}

#[test]
fn what_may_have_eaten_something_spoils_the_line_and_eats_no_line_end() {
    for text in [
        "versio\x1b[\r",
        "versio\x1bO\r",
        "versio\x1b\r",
        "version\x1b[\n",
        "version\x1b[1;\r",
        "version\x1b[3\x1b\r",
        "\x1b[version\r",
        "\x1b[7version\r",
        "ver\x1bsion\r",
        "version\x1b[[x\r",
        "version\x1bOx\u{1b}Oa\r",
        "version\x1b[00000000000000000000000000000000\r",
    ] {
        assert!(is_damaged(text), "{text:?}");
    }
}

/// Of `ESC [` and Enter, the Enter was swallowed, and two lines became one.
#[test]
fn a_sequence_that_is_cut_short_joins_no_lines() {
    let mut desk = Desk::with_person();
    let said = desk.type_in("set 0 period 2\x1b[\rset 1 period 400\r");
    assert_eq!(desk.rest.orders.len(), 1, "{said:?}");
    assert_eq!(said.matches("error: line not carried out, control sequences").count(), 1, "{said:?}");
    assert!(said.contains("done"), "{said:?}");
}

#[test]
fn what_is_not_typed_on_a_keyboard_of_this_language_spoils_the_line() {
    for (text, why) in [
        ("t7 offset 3 \u{2212}500 --yes", "characters that are not ASCII: 3"),
        ("version\u{a0}", "characters that are not ASCII: 2"),
        ("\u{feff}version", "characters that are not ASCII: 3"),
        ("read \u{201c}1\u{201d}", "characters that are not ASCII: 6"),
        ("ver\0sion", "control characters: 1"),
        ("ver\x07sion\x07", "control characters: 2"),
        ("version\x13", "XON or XOFF, which are not used here: 1"),
        ("\x11version", "XON or XOFF, which are not used here: 1"),
        ("version \u{2013} \x07", "characters that are not ASCII: 4"),
    ] {
        let mut desk = Desk::with_person();
        let said = desk.type_in(&format!("{text}\r"));
        assert!(said.contains(&format!("error: line not carried out, {why}\r\n")), "{text:?}: {said:?}");
        assert_eq!(said.matches("error").count(), 1);
        assert!(desk.rest.orders.is_empty());
        // The same for a program.
        let mut desk = Desk::new();
        let said = desk.type_in(&format!("{text}\r"));
        let count = why.rsplit(' ').next().expect("a count");
        assert!(said.starts_with(r#"{"error":{"kind":"damaged_line","reason":""#), "{said}");
        assert!(said.ends_with(&format!("\"characters\":{count}}}}}\r\n")), "{said}");
        assert_eq!(said.lines().count(), 1);
        assert!(desk.rest.orders.is_empty());
    }
}

#[test]
fn damage_stays_whatever_is_typed_after_it() {
    for repair in
        ["\x7f", "\x15version", "\x1b[Aversion", "\x17version", "\x01\x0bversion", "\t", "\x1b[A\x1b[B\x15"]
    {
        let mut desk = Desk::with_person();
        desk.type_in("version\r");
        let said = desk.type_in(&format!("version\u{e4}{repair}\r"));
        assert!(said.contains("error: line not carried out"), "{repair:?}: {said:?}");
        assert!(!said.contains("9.8.7"), "{repair:?}: {said:?}");
        // And a damaged line does not come back.
        assert!(desk.type_in("\x1b[A\r").contains("9.8.7"));
    }
    // Ctrl-C drops it, damage and all.
    assert!(Desk::with_person().type_in("vers\u{e4}\x03version\r").contains("9.8.7"));
}

#[test]
fn what_the_port_knows_against_a_character_spoils_the_line() {
    let good = Received::clean;
    for byte in [b'1', b'\r', 0x03, 0, 0xFF, 0x1B] {
        let mut desk = Desk::new();
        b"read 1".iter().for_each(|&byte| desk.receive(good(byte)));
        desk.receive(Received::new(byte, true, 0));
        assert_eq!(desk.printed(), "", "{byte:#04x} is no line end and no Ctrl-C");
        // What follows may be the rest of another line.
        let said = desk.type_in("t7 zero 5 --yes\r");
        assert_eq!(
            said,
            "{\"error\":{\"kind\":\"damaged_line\",\"reason\":\"receiver\",\"characters\":1}}\r\n"
        );
        assert!(desk.rest.orders.is_empty());
        assert!(desk.type_in("version\r").contains("9.8.7"));
    }
}

#[test]
fn a_loss_spoils_the_line_it_may_have_joined() {
    for lost in [1, 7, 127] {
        let expected = format!(
            "{{\"error\":{{\"kind\":\"damaged_line\",\"reason\":\"lost\",\"characters\":{lost}}}}}\r\n"
        );
        // Before the first character, within, before the line end, and before the line feed of CR LF.
        for (before, after) in
            [("", "zero 1"), ("t7 ", "zero 1 --yes"), ("set 0 period 2", "set 1 period 400"), ("list", "")]
        {
            let mut desk = Desk::new();
            desk.type_in(before);
            let next = after.bytes().next().unwrap_or(b'\r');
            desk.receive(Received::new(next, false, lost));
            let rest = after.get(1..).map(|rest| format!("{rest}\r")).unwrap_or_default();
            let said = desk.printed() + &desk.type_in(&rest);
            assert_eq!(said, expected, "{before:?} {after:?}");
            assert!(desk.rest.orders.is_empty());
        }
        let mut desk = Desk::new();
        assert!(desk.type_in("version\r").contains("9.8.7"));
        desk.receive(Received::new(b'\n', false, lost));
        assert_eq!(desk.printed(), expected, "a line end was lost with the rest");
        desk.receive(Received::new(0x03, false, lost));
        assert!(desk.type_in("version\r").contains("9.8.7"), "Ctrl-C begins anew");
    }
}

#[test]
fn a_person_s_line_that_is_too_long_is_refused_whole() {
    let mut desk = Desk::with_person();
    let said = desk.type_in(&format!("t7 zero 5 --yes{}\r", " ".repeat(80)));
    assert!(said.contains("error: line not carried out, characters more than 80: 15\r\n"), "{said:?}");
    assert!(desk.rest.orders.is_empty());
    let longest = format!("version{}", " ".repeat(73));
    assert!(desk.type_in(&format!("{longest}\r")).contains("9.8.7"));
    assert!(
        desk.type_in(&format!("{longest} \x7f\r")).contains("more than 80: 1"),
        "what is deleted was typed"
    );
}

#[test]
fn a_bracketed_paste_is_taken_as_it_is() {
    let mut desk = Desk::with_person();
    let said = desk.type_in("\x1b[200~version\rread 61\r\x1b[201~");
    assert!(said.contains("9.8.7") && said.contains("slot 61 is not"), "{said:?}");
    // Keys edit again after it.
    assert!(desk.type_in("versiom\x7fn\r").contains("9.8.7"));
    // Within it nothing edits: whatever looks like a key was in the text.
    for text in
        ["t7 \x15zero 5 --yes", "set 0 period 20\x7f", "set 0\tperiod 20", "ver\x1b[Dsion", "x\x08version"]
    {
        let mut desk = Desk::with_person();
        let said = desk.type_in(&format!("\x1b[200~{text}\x1b[201~\r"));
        assert!(said.contains("error: line not carried out, control characters"), "{text:?}: {said:?}");
        assert!(desk.rest.orders.is_empty());
        assert!(desk.type_in("versiom\x7fn\r").contains("9.8.7"), "after {text:?}");
    }
    // Its end is lost: the next damaged line ends it, or Ctrl-C does.
    let mut desk = Desk::with_person();
    desk.type_in("\x1b[200~version\r");
    assert!(desk.type_in("x\x7fversion\r").contains("not carried out"));
    assert!(desk.type_in("x\x7fversion\r").contains("9.8.7"));
    desk.type_in("\x1b[200~vers\x03");
    assert!(desk.type_in("x\x7fversion\r").contains("9.8.7"));
}

#[test]
fn tabs_of_a_document_keep_words_apart() {
    let mut desk = Desk::with_person();
    let said = desk.type_in("set\t0\tperiod\t2\t0\r");
    assert!(said.contains("error: 0: expected "), "{said:?}");
    assert!(desk.rest.orders.is_empty());
    assert!(desk.type_in("set\t0\tperiod\t20\r").contains("done"));
    assert_eq!(desk.rest.orders.len(), 1);
}

#[test]
fn what_is_drawn_is_what_stands_in_the_line() {
    // A screen of one row, which knows printable characters and backspaces.
    let mut desk = Desk::with_person();
    let (mut row, mut column) = (Vec::new(), 0);
    let keys = "read 12\x7f\x7f1\x01x\x7f\x1b[C\x1b[C\x1b[3~d\x0bd 1 2\x17\x17\x02\x02z\x06\x06\x05\x10\x0e\x15ab\x1b[Dc\x1b[1;5Dq";
    for byte in keys.bytes() {
        for drawn in desk.type_bytes(&[byte]).bytes() {
            match drawn {
                0x08 => column -= 1,
                b' '..=b'~' => {
                    row.resize(row.len().max(column + 1), b' ');
                    row[column] = drawn;
                    column += 1;
                }
                _ => panic!("{drawn:#04x}"),
            }
        }
    }
    let shown = String::from_utf8(row).expect("text");
    assert_eq!(shown.trim_end(), "qacb");
    assert!(desk.type_in("\r").contains("unknown command"));
}

#[test]
fn ctrl_l_draws_anew_and_ctrl_d_leaves() {
    let mut desk = Desk::with_person();
    desk.type_in("vers");
    assert!(desk.type_in("\x0c").ends_with("\x1b[H\x1b[2Jclino> vers"));
    assert!(desk.type_in("ion\r").contains("9.8.7"));
    let left = desk.type_in("\x04");
    assert_eq!(left, "\r\n{\"stream\":\"resumed\",\"why\":\"left\",\"prompt\":\"Enter or Ctrl-C\"}\r\n");
    assert!(desk.type_in("\r").ends_with("clino> "));
}
