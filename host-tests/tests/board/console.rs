//! The console of the shipped image: settings that take effect on the bus, what it tells, what it asks about.

use clino_host_tests::{Ran, run};

const MS: u64 = 1_000_000;

/// Three T7s, and these lines typed.
fn typed(duration: &str, lines: &[(u64, &str)]) -> Ran {
    let mut scenario = format!(
        r#"
        seed = 1
        duration = "{duration}"
        t7 = [
            {{ address = 1, motion.constant = 12.5 }},
            {{ address = 2, motion.constant = -12.5 }},
            {{ address = 3, motion.constant = 0.5 }},
        ]
        isu = [{{ address = 1, motion.constant = 90.0 }}]
        "#
    );
    for (at, line) in lines {
        scenario += &format!("[[typed]]\nat = \"{at}ms\"\nline = {line:?}\n");
    }
    run(&scenario)
}

/// Lines that begin like this.
fn lines<'a>(ran: &'a Ran, begin: &str) -> Vec<&'a str> {
    ran.lines.iter().map(|line| line.text.as_str()).filter(|text| text.starts_with(begin)).collect()
}

/// The number behind a name in a line.
fn number(line: &str, name: &str) -> f64 {
    let (_, rest) = line.split_once(&format!("\"{name}\":")).unwrap_or_else(|| panic!("{name} in {line}"));
    let end = rest.find([',', '}']).expect("an end");
    rest[..end].parse().unwrap_or_else(|_| panic!("{name} in {line}"))
}

#[test]
fn a_slot_is_set_zeroed_and_shown() {
    let ran = typed(
        "3s",
        &[
            (500, "set 0 period 100"),
            (510, "set 0 direction reversed"),
            (1_000, "set 0 zero 2.5"),
            (1_500, "zero 1"),
            (2_000, "show 0"),
            (2_100, "show 1"),
            (2_200, "zero 5"),
        ],
    );
    assert!(lines(&ran, "{\"done\":true}").len() == 4, "{}", ran.summary);
    let angles = |slot, from: u64, until: u64| {
        let spoken = ran.slot(slot).filter(move |spoken| (from * MS..until * MS).contains(&spoken.began));
        spoken.filter_map(|spoken| spoken.reading.angle_deg).collect::<Vec<_>>()
    };
    for (slot, from, until, angle) in [
        (0, 100, 490, 12.5),
        (0, 700, 990, -12.5),
        (0, 1_200, 3_000, -10.0),
        (1, 100, 1_490, -12.5),
        (1, 1_700, 3_000, 0.0),
    ] {
        let said = angles(slot, from, until);
        assert!(
            said.len() >= 2 && said.iter().all(|&said| said == angle),
            "slot {slot}, {from} ms: {said:?}"
        );
    }
    // Ten polls a second for slot 0, in the place of fifty; fifty for the others.
    let polls = |address: u8| {
        let polls = ran.t7.polls.iter().filter(|poll| (1_600 * MS..2_600 * MS).contains(&poll.de_high));
        polls.filter(|poll| poll.request.first() == Some(&address)).count()
    };
    let polls = [polls(1), polls(2), polls(3)];
    println!("polls in a second: {polls:?}");
    assert!((9..=11).contains(&polls[0]) && (49..=51).contains(&polls[1]) && (49..=51).contains(&polls[2]));
    let [config0, config1] = lines(&ran, "{\"config\":")[..] else { panic!("two slots are shown") };
    assert_eq!((number(config0, "period_ms"), number(config0, "zero_deg")), (100.0, 2.5));
    assert!(config0.contains(r#""direction":"reversed""#), "{config0}");
    assert_eq!(number(config1, "zero_deg"), -12.5);
    // Nothing is connected to the second PWM input.
    let [refused] = lines(&ran, "{\"error\"")[..] else { panic!("one command is refused") };
    assert!(refused.starts_with(r#"{"error":{"kind":"no_value","slot":5,"status":"stuck_"#), "{refused}");
}

#[test]
fn the_trace_the_counters_and_the_load_fit_the_wire() {
    let ran = typed("4s", &[(3_000, "trace"), (3_700, "counters 0"), (3_800, "load")]);
    let trace = lines(&ran, "{\"trace\":");
    // All that are kept, but for one that ended while they were fetched.
    assert!((31..=32).contains(&trace.len()), "{}", trace.len());
    // The one that ended last comes first; how long it took is given to 16 us.
    let ends = trace.iter().map(|line| number(line, "at_us") + number(line, "took_us"));
    let ends: Vec<f64> = ends.collect();
    assert!(ends.is_sorted_by(|newer, older| newer + 16.0 > *older), "{ends:?}");
    // Each one was on the wire, at one distance between power-up and the begin of the gateway's clock.
    let requests: Vec<(i64, u8)> =
        ran.t7.polls.iter().map(|poll| (poll.de_high as i64, poll.request[0])).collect();
    let mut begun = None;
    for line in trace.iter().filter(|line| line.contains(r#""trace":"t7""#)) {
        assert!(line.contains(r#""verdict":"good""#), "{line}");
        let (at, address) = (number(line, "at_us") as i64 * 1_000, number(line, "address") as u8);
        let of_node = requests.iter().filter(|(_, node)| *node == address).map(|(de_high, _)| de_high - at);
        let nearest =
            of_node.min_by_key(|distance| (distance - begun.unwrap_or(0)).abs()).expect("a request");
        let begun = *begun.get_or_insert(nearest);
        assert!(
            (0..10 * MS as i64).contains(&begun) && (nearest - begun).abs() < 300_000,
            "{nearest} ns: {line}"
        );
    }
    // The requests to node 1 until the line was made, but for one that was on its way.
    let line = ran.lines.iter().find(|line| line.text.starts_with("{\"counters\":0,")).expect("counters");
    let on_wire =
        ran.t7.polls.iter().filter(|poll| poll.request[0] == 1 && poll.de_high < line.began).count();
    let counters = line.text.as_str();
    assert!(
        (number(counters, "requests") - on_wire as f64).abs() <= 1.0,
        "{on_wire} on the wire: {counters}"
    );
    assert_eq!(number(counters, "first_try"), number(counters, "requests"));
    assert_eq!(number(counters, "no_answer"), 0.0);
    let load = lines(&ran, "{\"load\":\"t7\"")[0];
    // Three T7s of 3.04 ms each in 20 ms.
    assert_eq!(number(load, "wanted_percent"), 46.0);
    assert!((149.0..=151.0).contains(&number(load, "polls_per_s")), "{load}");
}

#[test]
fn what_cannot_be_undone_is_not_done_without_yes() {
    let ran = typed(
        "2s",
        &[
            (200, "t7 zero 1"),
            (300, "t7 address 2 9"),
            (400, "isu address 1 2"),
            (500, "factory-reset"),
            (600, "reboot"),
            (900, "help"),
            (1_900, "list"),
        ],
    );
    let unconfirmed = r#"{"error":{"kind":"unconfirmed","why":"irreversible, needs --yes"}}"#;
    assert_eq!(lines(&ran, unconfirmed).len(), 5, "{:?}", lines(&ran, "{\"error\""));
    assert_eq!(lines(&ran, "{\"command\":").len(), 26);
    assert!(
        ran.slot(0)
            .filter(|spoken| spoken.began > 250 * MS)
            .all(|spoken| spoken.reading.angle_deg == Some(12.5))
    );
    assert!(ran.slot(1).all(|spoken| spoken.reading.address == 2));
    assert!(ran.slot(3).all(|spoken| spoken.reading.address == 1));
}

#[test]
fn a_reboot_waits_until_what_was_said_is_out() {
    let ran = typed("2s", &[(1_000, "reboot --yes")]);
    assert_eq!(lines(&ran, "{\"done\":true}").len(), 1);
    let starts = ran.log.iter().filter(|line| line.starts_with("clino ")).count();
    assert_eq!(starts, 2, "{:?}", ran.log);
}

#[test]
fn a_reboot_cuts_no_frame_on_a_bus() {
    // At 9600 bit/s, as often as the bus can: a request is on the line for a quarter of the time. The console is looked at every
    // 10 ms.
    for offset in (0..12).map(|turn| 11 * turn) {
        let lines = [
            (100, "bus t7 -b 9600"),
            (200, "set 0 period 0"),
            (300, "set 1 period 0"),
            (1_000 + offset, "reboot --yes"),
        ];
        let ran = typed("1300ms", &lines);
        assert_eq!(ran.log.iter().filter(|line| line.starts_with("clino ")).count(), 2, "{:?}", ran.log);
        let t7 = &ran.t7;
        assert_eq!((t7.broken_characters, t7.idle_de, t7.malformed_requests), (0, 0, 0), "{offset} ms");
        assert!(t7.polls.iter().filter(|poll| poll.bit_ps > 100_000_000).count() > 30);
    }
}
