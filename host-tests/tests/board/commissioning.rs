//! Sensors set up from the console, through the shipped image.

use clino_host_tests::{Ran, run};

const MS: u64 = 1_000_000;

/// The console lines that tell of tasks.
fn news(ran: &Ran) -> Vec<&str> {
    let texts = ran.lines.iter().map(|line| line.text.as_str());
    texts.filter(|text| text.starts_with(r#"{"what":"#)).collect()
}

/// One T7 that answers; slots 1 and 2, where none is, are switched off.
fn one_t7(rest: &str) -> String {
    format!(
        r#"
        seed = 1
        t7 = [{{ address = 1, motion.constant = 12.5, latency = {{ min = "200us", max = "2ms" }} }}]
        typed = [
            {{ at = "20ms", line = "slot 1 off" }},
            {{ at = "30ms", line = "slot 2 off" }},
            {rest}
        ]
        "#
    )
}

#[test]
fn a_change_of_bit_rate_is_followed_while_the_angles_go_on() {
    let ran = run(&format!(
        "duration = \"5s\"\n{}",
        one_t7(
            r#"{ at = "1s", line = "t7 baud 1 9600 --yes" }, { at = "3s", line = "t7 baud 1 57600 --yes" }"#
        )
    ));
    assert!(ran.all_well, "{}", ran.summary);
    assert_eq!(
        news(&ran),
        [
            r#"{"what":"changed","baud":9600,"from":115200,"writes":1}"#,
            r#"{"what":"changed","baud":57600,"from":9600,"writes":1}"#,
        ]
    );
    for (rate, from, until) in [(115_200, 100, 990), (9_600, 1_200, 2_990), (57_600, 3_200, 5_000)] {
        let polls = ran.t7.polls.iter().filter(|poll| (from * MS..until * MS).contains(&poll.de_high));
        let polls: Vec<_> = polls.collect();
        assert!(polls.len() >= 40, "{} polls at {rate} bit/s", polls.len());
        for poll in polls {
            let measured = 1e12 / poll.bit_ps as f64;
            assert!((measured / f64::from(rate) - 1.0).abs() < 0.005, "{measured} instead of {rate} bit/s");
            assert!((0.0..=1.0).contains(&poll.lead_bits()), "{poll:?}");
            assert!(poll.tail().is_none_or(|tail| (0..=5_000).contains(&tail)), "{poll:?}");
        }
        let ok =
            ran.slot(0).filter(|spoken| spoken.is_ok() && (from * MS..until * MS).contains(&spoken.began));
        assert!(ok.count() >= 8, "angles at {rate} bit/s");
    }
}

#[test]
fn driver_enable_at_9600_is_as_at_115200() {
    let ran =
        run(&format!("duration = \"6s\"\n{}", one_t7(r#"{ at = "100ms", line = "t7 baud 1 9600 --yes" }"#)));
    let slow: Vec<_> = ran.t7.polls.iter().filter(|poll| poll.bit_ps > 100_000_000).collect();
    assert!(slow.len() >= 250, "{}", slow.len());
    let tails: Vec<i64> = slow.iter().filter_map(|poll| poll.tail()).collect();
    let leads = slow.iter().map(|poll| poll.lead_bits());
    let (least, most) = (tails.iter().min().expect("frames"), tails.iter().max().expect("frames"));
    println!("{} frames at 9600 bit/s: stop bit to DE low {least} to {most} ns", slow.len());
    assert!(*least >= 0 && *most <= 5_000);
    assert!(leads.fold(0.0, f64::max) <= 1.0);
}

#[test]
fn a_t7_is_found_identified_and_set_up() {
    let ran = run(&format!(
        "duration = \"6s\"\n{}",
        one_t7(
            r#"
            { at = "100ms", line = "t7 scan" },
            { at = "2s", line = "t7 info 1" },
            { at = "2500ms", line = "t7 damping 1 500 --yes" },
            { at = "2700ms", line = "t7 damping 1 500 --yes" },
            { at = "2900ms", line = "t7 damping 1 5001 --yes" },
            { at = "3s", line = "t7 address 1 77 --yes" },
            { at = "5s", line = "t7 info 1" },
            "#
        )
    ));
    assert_eq!(
        news(&ran),
        [
            r#"{"what":"found","address":1,"baud":115200,"product":"T7-1","serial":1,"firmware":"0.32"}"#,
            r#"{"what":"swept","devices":1,"suspects":0,"asked":101,"complete":true}"#,
            concat!(
                r#"{"what":"identity","product":"T7-1","serial":1,"firmware":"0.32","damping_ms":1000,"#,
                r#""range":"bidirectional","direction_0":"normal","direction_1":"normal","direction_2":"normal","#,
                r#""offset_0_mdeg":0,"offset_1_mdeg":0,"offset_2_mdeg":0}"#
            ),
            r#"{"what":"changed","damping_ms":500,"from":1000,"writes":1}"#,
            r#"{"what":"unchanged","damping_ms":500,"writes":0}"#,
            r#"{"what":"changed","address":77,"from":1,"writes":1}"#,
            r#"{"what":"failed","why":"no_answer","writes":0}"#,
        ]
    );
    let refused = r#"{"error":{"kind":"out_of_range","value":5001,"least":2,"most":5000}}"#;
    assert_eq!(ran.lines.iter().filter(|line| line.text == refused).count(), 1);
    // The slot has followed the device to its new address.
    let last = ran.slot(0).last().expect("slot 0 is read");
    assert_eq!((last.reading.address, last.reading.angle_deg), (77, Some(12.5)));
}

#[test]
fn an_isu_moves_to_another_address_and_its_eeprom_stays_sound() {
    let ran = run(r#"
        seed = 1
        duration = "14s"
        isu = [{ address = 1, motion.constant = 90.0 }]
        typed = [
            { at = "100ms", line = "isu info 1" },
            { at = "4s", line = "isu address 1 9 --yes" },
            { at = "10s", line = "isu info 9" },
        ]
    "#);
    let news = news(&ran);
    let [before, moved, after] = news[..] else { panic!("{news:?}") };
    assert!(before.starts_with(r#"{"what":"identity","address":1,"angle_deg":90.000,"#), "{before}");
    assert!(moved.starts_with(r#"{"what":"changed","address":9,"from":1,"writes":"#), "{moved}");
    assert!(after.starts_with(r#"{"what":"identity","address":9,"angle_deg":90.000,"#), "{after}");
    assert!(before.ends_with(r#""checksum_right":true}"#) && after.ends_with(r#""checksum_right":true}"#));
    let last = ran.slot(3).last().expect("slot 3 is read");
    assert_eq!((last.reading.address, last.reading.angle_deg), (9, Some(90.0)));
}

#[test]
fn an_echo_is_removed_and_the_delays_of_the_driver_are_kept() {
    // The gateway's receiver is always on, and the line is set accordingly, with 50 us before and 20 us after each frame.
    let ran = run(r#"
        seed = 1
        duration = "3s"
        segments.t7.echo = true
        t7 = [
            { address = 1, motion.constant = 12.5 },
            { address = 2, motion.constant = -12.5 },
            { address = 3, motion.constant = 0.5 },
        ]
        typed = [
            { at = "500ms", line = "bus t7 --pre 50 --post 20 -e detect" },
            { at = "2900ms", line = "counters" },
        ]
    "#);
    let total = ran.t7.total();
    assert_eq!(total.good, total.polls, "{}", ran.summary);
    let set = ran.t7.polls.iter().filter(|poll| poll.de_high > 600 * MS);
    let set: Vec<_> = set.collect();
    assert!(set.len() >= 300);
    for poll in set {
        let lead = poll.first_start - poll.de_high;
        // The microsecond in which DE rises is not counted. At its end, a run of the bus level or a lock of one below may be
        // in hand: 17 us were seen.
        assert!((48_000..70_000).contains(&lead), "{lead} ns before the frame");
        // The bus level ends the delay, after whatever it has in hand.
        assert!(poll.tail().is_none_or(|tail| (20_000..60_000).contains(&tail)), "{poll:?}");
    }
    assert!(ran.slot(0).all(|spoken| spoken.reading.angle_deg == Some(12.5)));
}
