//! Two orders about one thing, one upon the other, through the shipped image: what was acknowledged last is in force.

use clino_host_tests::{Ran, modbus, run};

const MS: u64 = 1_000_000;
/// A T7 gives up half a command after this (T7 guide section 1), and an ISU after 400 ms.
const T7_DEAF: u64 = 500 * MS;

fn said<'a>(ran: &'a Ran, begin: &str) -> Vec<&'a str> {
    let texts = ran.lines.iter().map(|line| line.text.as_str());
    texts.filter(|text| text.starts_with(begin)).collect()
}

fn count(ran: &Ran, line: &str) -> usize {
    ran.lines.iter().filter(|said| said.text == line).count()
}

/// Bit rate of a request, from the length of its bits.
fn rate(bit_ps: u64) -> u32 {
    let measured = 1e12 / bit_ps as f64;
    let near = |rate: &u32| (measured / f64::from(*rate) - 1.0).abs() < 0.02;
    [115_200, 57_600, 38_400, 19_200, 9_600].into_iter().find(near).expect("a rate of a T7")
}

const BUS_AT_57600: &str =
    r#"{"bus":"t7","baud":57600,"guard_us":300,"pre_us":0,"post_us":0,"echo":"off","fault":null}"#;
const CHANGED: &str = r#"{"what":"changed","baud":57600,"from":115200,"writes":1}"#;

/// Row 27 of issue 12. The change of bit rate takes about 50 ms; the other change comes at different instants of it, and
/// by either door.
#[test]
fn a_guard_that_is_set_during_a_change_of_bit_rate_undoes_neither() {
    let typed = |ms: u64| format!(r#"{{ at = "{}ms", line = "bus t7 -g 300" }},"#, 1_000 + ms);
    // FC 06, guard of the T7 bus (0x1802): 300.
    let written = |ms: u64| modbus::request(&[0x06, 0x18, 0x02, 0x01, 0x2C], 1_000 + ms);
    let doors = [5, 25, 45].map(|ms| (typed(ms), String::new())).into_iter();
    for (line, request) in doors.chain([12, 32].map(|ms| (String::new(), written(ms)))) {
        let ran = run(&format!(
            r#"
            seed = 1
            duration = "2500ms"
            t7 = [{{ address = 1, motion.constant = 12.5 }}]
            typed = [
                {{ at = "20ms", line = "slot 1 off" }},
                {{ at = "30ms", line = "slot 2 off" }},
                {{ at = "1s", line = "t7 baud 1 57600 --yes" }},
                {line}
                {{ at = "2300ms", line = "bus t7" }},
            ]
            {}
            {request}
            "#,
            if request.is_empty() { "" } else { "[modbus]" }
        ));
        let told = format!("{line}{request}");
        assert_eq!(count(&ran, CHANGED), 1, "{told} {:?}", said(&ran, r#"{"what""#));
        assert_eq!(said(&ran, r#"{"bus":"t7","baud""#), [BUS_AT_57600], "{told}");
        if !request.is_empty() {
            let exchanges = modbus::exchanges(&ran.bus_log);
            let answer = exchanges[0].answer.as_ref().expect("the write is answered");
            assert_eq!(answer.bytes, exchanges[0].request.bytes, "it is acknowledged");
        }
        let later: Vec<_> = ran.t7.polls.iter().filter(|poll| poll.de_high > 1_700 * MS).collect();
        assert!(later.len() > 25 && later.iter().all(|poll| rate(poll.bit_ps) == 57_600), "{told}");
        let ok = ran.slot(0).filter(|spoken| spoken.is_ok() && spoken.began > 1_800 * MS).count();
        assert!(ok > 3, "{told}: {ok} angles at the new rate");
    }
}

/// A bit rate is refused while a task needs the present one.
#[test]
fn another_bit_rate_during_a_task_is_refused_as_busy() {
    let ran = run(r#"
        seed = 1
        duration = "2s"
        t7 = [{ address = 1, motion.constant = 12.5 }]
        typed = [
            { at = "500ms", line = "t7 scan" },
            { at = "520ms", line = "bus t7 -b 57600" },
            { at = "530ms", line = "bus t7 -b 115200 -g 200" },
            { at = "1900ms", line = "bus t7" },
        ]
    "#);
    assert_eq!(count(&ran, r#"{"error":{"kind":"busy"}}"#), 1, "{:?}", said(&ran, "{\"error"));
    let swept = said(&ran, r#"{"what":"swept""#);
    assert_eq!(swept, [r#"{"what":"swept","devices":1,"suspects":0,"asked":101,"complete":true}"#]);
    let bus = said(&ran, r#"{"bus":"t7","baud""#);
    assert_eq!(bus.len(), 1);
    assert!(bus[0].starts_with(r#"{"bus":"t7","baud":115200,"guard_us":200,"#), "{bus:?}");
    assert!(ran.t7.polls.iter().all(|poll| rate(poll.bit_ps) == 115_200));
}

/// Row 28 of issue 12: the sensors run at 57600 already, and have taken what was sent at 115200 for anything.
#[test]
fn a_task_after_a_change_of_bit_rate_begins_when_it_is_in_force_and_the_nodes_hear() {
    // Slot 2 reads what is not there, and waits for it: the change has to wait for an exchange of half a second.
    for (slow, task, expected) in [
        ("", "t7 info 1", r#"{"what":"identity","product":"T7-1""#),
        ("", "t7 scan", r#"{"what":"swept","devices":2,"#),
        (
            r#"{ at = "100ms", line = "set 2 timeout 500" },"#,
            "t7 info 2",
            r#"{"what":"identity","product":"T7-1""#,
        ),
    ] {
        for ms in [1_000, 1_007] {
            let ran = run(&format!(
                r#"
                seed = 1
                duration = "4s"
                t7 = [
                    {{ address = 1, baud = 57600, motion.constant = 12.5 }},
                    {{ address = 2, baud = 57600, motion.constant = 12.5 }},
                ]
                typed = [
                    {slow}
                    {{ at = "{ms}ms", line = "bus t7 -b 57600" }},
                    {{ at = "{ms}ms", line = "{task}" }},
                ]
                "#
            ));
            assert_eq!(said(&ran, expected).len(), 1, "{task}: {:?}", said(&ran, r#"{"what""#));
            let answers = [r#"{"done":true}"#, r#"{"accepted":true}"#].map(|answer| count(&ran, answer));
            let settings = usize::from(!slow.is_empty());
            assert_eq!(answers[0] + answers[1], 1 + settings, "{answers:?}");
            let (old, new): (Vec<_>, Vec<_>) =
                ran.t7.polls.iter().partition(|poll| rate(poll.bit_ps) == 115_200);
            assert!(old.len() > 1 && new.len() > 3, "{} {}", old.len(), new.len());
            let (last, first) = (old.last().unwrap(), new[0]);
            assert!(last.de_high < first.de_high, "no way back");
            // From the end of what was sent at the old rate on, or of what was waited for.
            assert!(first.de_high - last.last_stop >= T7_DEAF, "{task}");
            assert!(first.de_high - last.last_stop < T7_DEAF + 540 * MS, "{task}");
            if !slow.is_empty() {
                // The exchange was in hand when the change came: it was not done yet, and not called so.
                assert_eq!(answers[1], 1, "{:?}", said(&ran, "{\"accepted"));
            }
        }
    }
}
