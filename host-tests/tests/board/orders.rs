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

/// Row 34 of issue 12: memory was written three times, then `not_zero`.
#[test]
fn a_sensor_that_moves_is_not_zeroed_and_nothing_is_written() {
    let ran = run(r#"
        seed = 1
        duration = "7s"
        t7 = [
            { address = 1, motion.ramp = { start = -30.0, rate = 20.0 } },
            { address = 2, motion.sine = { centre = 10.0, amplitude = 0.5, period = "150ms" } },
            { address = 3, motion.constant = 12.5 },
        ]
        isu = [{ address = 1, motion.ramp = { start = 10.0, rate = 20.0 }, phase = "200ms" }]
        typed = [
            { at = "500ms", line = "t7 zero 1 --yes" },
            { at = "600ms", line = "isu zero 1 --yes" },
            { at = "2500ms", line = "t7 zero 2 --yes" },
            { at = "5s", line = "t7 zero 3 --yes" },
        ]
    "#);
    let failed = said(&ran, r#"{"what":"failed","why":"moving","writes":0"#);
    let rate = |line: &str| {
        let (_, rate) = line.split_once(r#""rate_deg_s":"#).expect("a rate");
        rate.trim_end_matches('}').parse::<f64>().expect("a number")
    };
    assert_eq!(failed.len(), 3, "{:?}", said(&ran, r#"{"what""#));
    let isu: Vec<_> = failed.iter().filter(|line| line.contains("repair")).collect();
    assert_eq!(isu.len(), 1, "{failed:?}");
    // The module's clock tells its angles apart, beside the polling: to a part of its refresh.
    assert!((13.0..31.0).contains(&rate(isu[0])), "{isu:?}");
    let t7: Vec<_> = failed.iter().filter(|line| !line.contains("repair")).map(|line| rate(line)).collect();
    assert!((19.5..20.5).contains(&t7[0]), "{failed:?}");
    assert!(t7[1] > 1.0, "{failed:?}");
    let zeroed = said(&ran, r#"{"what":"zeroed""#);
    assert_eq!(
        zeroed,
        [r#"{"what":"zeroed","before_mdeg":12500,"after_mdeg":0,"writes":1}"#],
        "one stands still"
    );
    // On the wire: requests that set something carry data and a checksum, others are three bytes.
    let sets = ran.t7.polls.iter().filter(|poll| poll.request.len() > 3);
    assert_eq!(sets.map(|poll| poll.request[0]).collect::<Vec<_>>(), [3]);
    // Reset Null Position is function 110 (AN #201 appendix A).
    assert!(ran.isu.polls.iter().all(|poll| poll.request[1] >> 1 & 7 != 0b110));
}

/// Row 24 of issue 12: a slot reads zero when its sensor was set to zero, whatever its soft zero was.
#[test]
fn a_sensor_that_is_zeroed_reads_zero_in_its_slots() {
    // FC 16 to the command block (0x1F00): sensor_zero (16) of slot 3, with the key.
    let zero = modbus::request(
        &[0x10, 0x1F, 0x00, 0x00, 0x05, 0x0A, 0x00, 0x10, 0x00, 0x03, 0, 0, 0, 0, 0x4E, 0x56],
        500,
    );
    let ran = run(&format!(
        r#"
        seed = 1
        duration = "7s"
        t7 = [{{ address = 1, motion.constant = 12.5 }}]
        isu = [{{ address = 1, motion.constant = 90.0 }}]
        typed = [
            {{ at = "10ms", line = "slot 1 off" }},
            {{ at = "20ms", line = "slot 2 off" }},
            {{ at = "100ms", line = "set 0 zero 5" }},
            {{ at = "150ms", line = "set 3 zero 5" }},
            {{ at = "600ms", line = "t7 zero 1 --yes" }},
            {{ at = "800ms", line = "set 0 zero 7" }},
            {{ at = "6500ms", line = "show 0" }},
            {{ at = "6600ms", line = "show 3" }},
        ]
        [modbus]
        {zero}
        "#
    ));
    assert_eq!(said(&ran, r#"{"what":"zeroed""#).len(), 1);
    assert_eq!(count(&ran, r#"{"error":{"kind":"busy"}}"#), 1, "the zero is the task's until it has ended");
    for slot in [0, 3] {
        let angle = |at: u64| {
            let before = ran.slot(slot).filter(|spoken| spoken.at < at).last();
            before.expect("a reading").reading.angle_deg
        };
        let (true_angle, shown) = if slot == 0 { (7.5, 0.0) } else { (85.0, 0.0) };
        assert_eq!(angle(450 * MS), Some(true_angle), "slot {slot}");
        assert_eq!(angle(7_000 * MS), Some(shown), "slot {slot}");
    }
    let configs = said(&ran, r#"{"config""#);
    assert_eq!(configs.len(), 2);
    assert!(configs.iter().all(|config| config.contains(r#""zero_deg":0,"#)), "{configs:?}");
}

/// The question before a change of bit rate names the other nodes of the bus; the hint after it, the gateway's own settings.
#[test]
fn a_change_of_bit_rate_says_who_falls_silent_before_it_is_done() {
    let ran = run(r#"
        seed = 1
        duration = "4s"
        t7 = [
            { address = 1, motion.constant = 12.5 },
            { address = 2, motion.constant = 12.5 },
            { address = 3, motion.constant = 12.5 },
        ]
        typed = [
            { at = "300ms", line = "t7 baud 1 57600" },
            { at = "400ms", line = "t7 address 1 2" },
            { at = "1s", line = "" },
            { at = "1200ms", line = "t7 baud 1 57600" },
            { at = "1500ms", line = "n" },
            { at = "1700ms", line = "json on" },
            { at = "2s", line = "t7 baud 1 57600 --yes" },
        ]
    "#);
    let refused = said(&ran, r#"{"error":{"kind":"unconfirmed""#);
    assert!(refused[0].contains("2 other nodes") && refused[0].ends_with(r#""silenced":2}}"#), "{refused:?}");
    assert!(refused[1].ends_with(r#""slot":1}}"#), "{refused:?}");
    let asked: Vec<_> = ran.lines.iter().filter(|line| line.text.contains("Go on? y/N n")).collect();
    assert_eq!(asked.len(), 1);
    for told in ["changes to 57600 bit/s", "only save keeps that", "2 other nodes of the bus stay"] {
        assert!(asked[0].text.contains(told), "{}", asked[0].text);
    }
    let hints: Vec<_> = said(&ran, r#"{"hint""#);
    assert!(
        hints[0].starts_with(r#"{"hint":{"kind":"silenced""#) && hints[0].contains(r#""silenced":2"#),
        "{hints:?}"
    );
    assert!(hints[1].starts_with(r#"{"hint":{"kind":"unsaved""#), "{hints:?}");
    assert_eq!(count(&ran, CHANGED), 1);
    // Nothing was done before it was meant.
    assert!(
        ran.t7.polls.iter().filter(|poll| poll.de_high < 2_000 * MS).all(|poll| rate(poll.bit_ps) == 115_200)
    );
}

/// Row 24 of issue 12: the last command that was accepted is the cancel; its outcome says what was stopped.
#[test]
fn a_cancel_is_the_last_command() {
    // FC 16: sensor_zero (16) of slot 0 with the key, cancel (5) on bus 0; FC 04: last_command, outcome, sequence.
    let zero = [0x10, 0x1F, 0x00, 0x00, 0x05, 0x0A, 0x00, 0x10, 0x00, 0x00, 0, 0, 0, 0, 0x4E, 0x56];
    let cancel = [0x10, 0x1F, 0x00, 0x00, 0x02, 0x04, 0x00, 0x05, 0x00, 0x00];
    let last = [0x04, 0x1F, 0x08, 0x00, 0x03];
    let requests =
        [(&zero[..], 500), (&last, 550), (&cancel, 600), (&last, 700), (&cancel, 800), (&last, 900)];
    let requests: String = requests.into_iter().map(|(pdu, at)| modbus::request(pdu, at)).collect();
    let ran = run(&format!(
        r#"
        seed = 1
        duration = "1200ms"
        t7 = [{{ address = 1, motion.constant = 12.5 }}]
        [modbus]
        {requests}
        "#
    ));
    let exchanges = modbus::exchanges(&ran.bus_log);
    let read = |index: usize| exchanges[index].registers().expect("three registers");
    assert_eq!(read(1), [16, 1, 1], "running");
    assert_eq!(read(3), [5, 4, 2], "cancelled");
    assert_eq!(read(5), [5, 2, 3], "there is nothing to be cancelled");
    assert!(ran.t7.polls.iter().all(|poll| poll.request.len() == 3), "nothing was written");
}
