//! Good files, bad files, and that what is built behaves as the file says.

use super::*;
use crate::injection::{Level, What};
use crate::oscillators::CrystalLife;
use clino_segment::log::{LineEvent, Talker};
use clino_segment::wire::{Format, Sent, Wire};

const SECOND: Ns = 1_000_000_000;

fn parse(text: &str) -> Result<Scenario, String> {
    Scenario::parse(Path::new("x.toml"), text).map_err(|error| error.to_string())
}

fn complaint(text: &str) -> String {
    parse(text).expect_err("the scenario should have been refused")
}

const T7: &str = "[[t7]]\naddress = 1\nmotion.constant = 0\n";

#[test]
fn an_empty_file_is_an_empty_board_for_five_seconds() {
    let scenario = parse("").unwrap();
    assert_eq!(scenario.duration(), 5 * SECOND);
    assert!(scenario.build().truths.is_empty());
}

#[test]
fn every_mistake_names_its_line_and_what_was_expected() {
    let t7 = |line: &str| format!("{T7}{line}\n");
    for (text, line, words) in [
        ("sed = 1".into(), 1, vec!["unknown field `sed`", "expected one of `seed`, `duration`"]),
        ("\nseed = -1".into(), 2, vec!["-1", "u64"]),
        ("seed = \"a\"".into(), 1, vec!["string \"a\"", "u64"]),
        ("duration = 5".into(), 1, vec!["integer `5`", "duration with its unit in quotes"]),
        ("duration = \"5 s\"".into(), 1, vec!["`5 s` is no duration", "number and a unit"]),
        ("duration = \"0s\"".into(), 1, vec!["expected more than 0s"]),
        ("seed = 1\n\n[[t7]]\nmotion.constant = 0".into(), 3, vec!["missing field `address`"]),
        ("[[t7]]\naddress = 1".into(), 1, vec!["missing field `motion`"]),
        ("[[t7]]\naddress = 101\nmotion.constant = 0".into(), 2, vec!["T7 address 101", "1 to 100 or 127"]),
        ("[[t7]]\naddress = 300\nmotion.constant = 0".into(), 2, vec!["300", "u8"]),
        ("[[isu]]\naddress = 15\nmotion.constant = 0".into(), 2, vec!["ISU address 15", "1 to 14"]),
        ("[[isu]]\naddress = 0\nmotion.constant = 0".into(), 2, vec!["ISU address 0", "1 to 14"]),
        (format!("{T7}{T7}"), 5, vec!["T7 address 1 for the second time", "only once"]),
        (t7("baud = 19201"), 4, vec!["baud rate 19201", "19200"]),
        (t7("latency = \"3ms\""), 4, vec!["T7 latency 3ms", "at most 2ms"]),
        (t7("latency = { min = \"2ms\", max = \"1ms\" }"), 4, vec!["min not above max"]),
        (t7("latency = 2"), 4, vec!["integer `2`", "a duration such as"]),
        (t7("colour = 2"), 4, vec!["unknown field `colour`", "`hold`"]),
        (t7("corrupt = 1.5"), 4, vec!["1.5 is out of range", "probability from 0 to 1"]),
        (t7("fault = { every = 0, what = \"silent\" }"), 4, vec!["nonzero"]),
        (t7("fault = { every = 1, what = \"loud\" }"), 4, vec!["unknown variant `loud`", "`bad_checksum`"]),
        (t7("unplugged = [{ from = \"2s\", until = \"1s\" }]"), 4, vec!["from 2s until 1s", "from before until"]),
        (
            t7("unplugged = [{ from = \"1s\", until = \"3s\" },\n { from = \"2s\", until = \"4s\" }]"),
            5,
            vec!["from 2s after one until 3s", "separate"],
        ),
        ("[[t7]]\naddress = 1\nmotion.spin = 0".into(), 3, vec!["unknown variant `spin`", "`constant`, `ramp`"]),
        ("[[t7]]\naddress = 1\nmotion.ramp = { rat = 1 }".into(), 3, vec!["rat", "available keys: start, rate"]),
        (
            "[[t7]]\naddress = 1\nmotion.table = [\n{ at = \"2s\", angle = 1 },\n{ at = \"1s\", angle = 1 },\n]".into(),
            5,
            vec!["point at 1s after one at 2s", "rising"],
        ),
        ("[[pwm]]\nchannel = 3\nmotion.constant = 0".into(), 2, vec!["PWM channel 3", "1 or 2"]),
        ("[[pwm]]\nchannel = 1\nfrequency = 0\nmotion.constant = 0".into(), 3, vec!["0 is out of range", "Hz"]),
        ("[segments.t7]\nnoise = { bit_error_rate = -1 }".into(), 2, vec!["-1 is out of range", "0 to 1"]),
        ("[segments.t7]\nstuck = [{ from = \"1s\", until = \"2s\" }]".into(), 2, vec!["missing field `level`"]),
        ("[segments.t7]\nstuck = [{ from = \"2s\", until = \"1s\", level = \"low\" }]".into(), 2, vec!["from before until"]),
        ("[segments.isu]\nde_shorted = [{ from = \"2s\", until = \"2s\" }]".into(), 2, vec!["from before until"]),
        ("[segments.can]\n".into(), 1, vec!["unknown field `can`", "`t7` or `isu`"]),
        ("[modbus]\nbaud = 300".into(), 2, vec!["baud rate 300", "1200 to 1000000"]),
        ("[modbus]\nstop_bits = 3".into(), 2, vec!["3 stop bits", "1 or 2"]),
        ("[modbus]\nparity = \"mark\"".into(), 2, vec!["unknown variant `mark`", "`none`, `even`, `odd`"]),
        ("[[modbus.request]]\nat = \"1s\"\nbytes = \"\"".into(), 3, vec!["without bytes"]),
        ("[[modbus.request]]\nat = \"1s\"\nbytes = \"1 04\"".into(), 3, vec!["`1` is no byte", "two hexadecimal digits"]),
        ("[[modbus.request]]\nat = \"1s\"\nbytes = \"+1\"".into(), 3, vec!["`+1` is no byte"]),
        (impairment("console", "effect = \"lost\""), 2, vec!["no or with two choices", "character or rate"]),
        (impairment("console", "effect = \"lost\", character = 1, rate = 0.5"), 2, vec!["two choices"]),
        (impairment("console", "effect = \"lost\", character = 1, count = 0"), 2, vec!["count 0"]),
        (impairment("console", "effect = \"lost\", rate = 0.5, count = 2"), 2, vec!["with character only"]),
        (impairment("console", "effect = \"parity_error\", rate = 0.5"), 2, vec!["without parity"]),
        (impairment("console", "effect = { flipped = 0x100 }, rate = 0.5"), 2, vec!["flipped 0x100", "0xff"]),
        (impairment("modbus", "effect = { flipped = 0 }, rate = 0.5"), 2, vec!["flipped 0x0", "0x1ff"]),
        (impairment("modbus", "effect = \"garbled\", rate = 0.5"), 2, vec!["unknown variant `garbled`"]),
        ("lsi_hz = 16999".into(), 1, vec!["lsi_hz 16999", "17000 to 47000"]),
        ("[crystal]\ninternal_error = 0.05".into(), 2, vec!["0.05 is out of range", "-0.08 to 0.045"]),
        ("[crystal]\ndead = true\nstops_at = \"1s\"".into(), 3, vec!["dead crystal"]),
        ("[crystal]\nreturns_at = \"1s\"".into(), 2, vec!["does not stop"]),
        ("[crystal]\nstops_at = \"2s\"\nreturns_at = \"1s\"".into(), 3, vec!["returns_at 1s", "stops at 2s"]),
        ("[[plant]]\nat = \"1s\"\nwhat = \"bang\"\nlevel = \"bus\"".into(), 3, vec!["unknown variant `bang`", "`hang`"]),
        ("[[plant]]\nat = \"1s\"\nwhat = \"hang\"\nlevel = \"moon\"".into(), 4, vec!["unknown variant `moon`", "`main`"]),
        ("[[plant]]\nat = \"1s\"\nwhat = \"hang\"".into(), 1, vec!["missing field `level`"]),
        (
            "[[plant]]\nat = \"1s\"\nwhat.flip = { address = 0x20000000, bit = 8 }\nlevel = \"main\"".into(),
            3,
            vec!["bit 8 of a byte", "0 to 7"],
        ),
        (
            "[[plant]]\nat = \"1s\"\nwhat = \"hang\"\nlevel = \"bus\"\ntimes = 0".into(),
            5,
            vec!["nonzero"],
        ),
        ("seed = 1\nseed = 2".into(), 2, vec!["duplicate"]),
        ("a b".into(), 1, vec!["expected"]),
    ] {
        let complaint = complaint(&text);
        assert!(complaint.starts_with(&format!("x.toml:{line}: ")), "{text}\n{complaint}");
        for word in words {
            assert!(complaint.contains(word), "`{word}` is not in: {complaint}");
        }
        assert!(!complaint.contains('\n'), "{complaint}");
    }
}

#[test]
fn the_masters_settings_and_requests_are_what_the_file_says() {
    assert_eq!(parse("").unwrap().modbus().to_string(), "19200 8E1");
    let scenario = parse(
        "[modbus]\nbaud = 9600\nparity = \"none\"\nstop_bits = 2\n[[modbus.request]]\nat = \"2s\"\nbytes = \"0a\"\n\
         [[modbus.request]]\nat = \"1s\"\nbytes = \"01 FF\"\n",
    )
    .unwrap();
    assert_eq!(scenario.modbus().to_string(), "9600 8N2");
    let requests: Vec<_> = scenario.requests().map(|request| (request.at, request.what)).collect();
    assert_eq!(requests, [(SECOND, &[0x01, 0xff][..]), (2 * SECOND, &[0x0a])]);
}

#[test]
fn faults_are_planted_as_the_file_says() {
    let scenario = parse(
        "[[plant]]\nat = \"2s\"\nwhat = \"masked_hang\"\nlevel = \"t7_port\"\ntimes = 3\nagain = \"10ms\"\n\
         [[plant]]\nat = \"1s\"\nwhat = \"panic\"\nlevel = \"main\"\n",
    )
    .unwrap();
    let injections: Vec<_> = scenario.injections().collect();
    assert_eq!(
        injections,
        [
            Injection {
                at: 2 * SECOND,
                what: What::MaskedHang,
                level: Level::T7Port,
                times: 3,
                again: 10_000_000
            },
            Injection { at: SECOND, what: What::Panic, level: Level::Main, times: 1, again: 0 },
        ]
    );
}

#[test]
fn oscillators_are_as_the_file_says() {
    assert_eq!(parse("").unwrap().oscillators(), Oscillators::default());
    let text = "lsi_hz = 47000\n[crystal]\nstops_at = \"1s\"\nreturns_at = \"2s\"\ninternal_error = -0.08\n";
    let crystal = CrystalLife { stops_at: Some(SECOND), returns_at: Some(2 * SECOND) };
    let expected = Oscillators { lsi_hz: 47_000, hsi_hz: 14_720_000, crystal };
    assert_eq!(parse(text).unwrap().oscillators(), expected);
    let dead = parse("[crystal]\ndead = true").unwrap().oscillators().crystal;
    assert_eq!(dead, CrystalLife { stops_at: Some(0), returns_at: None });
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let complaint = Scenario::read(Path::new("/nowhere/x.toml")).unwrap_err().to_string();
    assert!(complaint.starts_with("/nowhere/x.toml: "), "{complaint}");
}

#[test]
fn too_many_t7s_are_refused() {
    let text: String = (1..=33).map(|n| format!("[[t7]]\naddress = {n}\nmotion.constant = 0\n")).collect();
    assert_eq!(complaint(&text), "x.toml:98: 33 T7s, expected at most 32");
}

#[test]
fn the_truth_is_what_the_file_says() {
    let text = r#"
        [[t7]]
        address = 7
        motion.table = [{ at = "1s", angle = 10 }, { at = "2s", angle = -20.5 }]
        unplugged = [{ from = "1s", until = "2s" }]
        [[isu]]
        address = 14
        motion.sine = { centre = 1, amplitude = 2.5, period = "4s", phase = 90 }
        babble = [{ from = "3s", until = "4s" }]
        [[pwm]]
        channel = 2
        frequency = 29.4
        motion.ramp = { start = 5.5, rate = -3 }
        stuck = [{ from = "501ms", until = "2s", level = "high" }]
    "#;
    let truths = parse(text).unwrap().build().truths;
    let names: Vec<String> = truths.iter().map(|truth| truth.who.to_string()).collect();
    assert_eq!(names, ["t7 7", "isu 14", "pwm2"]);
    assert_eq!(truths[0].motion, Motion::Table(vec![(SECOND, 10_000_000), (2 * SECOND, -20_500_000)]));
    assert_eq!(truths[0].away, [(SECOND, 2 * SECOND)]);
    let (centre, amplitude) = (1_000_000, 2_500_000);
    assert_eq!(truths[1].motion, Motion::Sine { centre, amplitude, period: 4 * SECOND, phase: 90_000_000 });
    assert_eq!(truths[1].disturbed, [(3 * SECOND, 4 * SECOND)]);
    assert_eq!(truths[2].motion, Motion::Ramp { start: 5_500_000, rate: -3_000_000 });
    // The cycle under way is finished: 1 s / 29.4 = 34.013605 ms.
    assert_eq!(truths[2].away, [(501_000_000 + 34_013_605, 2 * SECOND)]);
}

/// Polls T7 1 with Get Angle axis 2 every 5 ms and returns the log as text.
fn poll(scenario: &Scenario) -> String {
    let mut bus = scenario.build().t7;
    let format = Format { bit_ps: 8_690_476, data_bits: 8, stop_halves: 2 };
    bus.set_receiver(0, Some(format));
    let play = |bus: &mut Segment, until: Ns| {
        while let Some(next) = bus.next_event().filter(|next| *next <= until) {
            bus.advance(next);
        }
    };
    for n in 10..400 {
        let start = n * 5_000_000;
        play(&mut bus, start);
        bus.drive_enable(start, true);
        for (n, byte) in [1, 1, 0x83].into_iter().enumerate() {
            let at = start + n as u64 * 86_905;
            play(&mut bus, at);
            bus.send(Sent { start: at, word: byte, format });
        }
        play(&mut bus, start + 3 * 86_905);
        bus.drive_enable(start + 3 * 86_905, false);
    }
    play(&mut bus, 2 * SECOND);
    let log = bus.log();
    let mut text = Vec::new();
    log.lock().unwrap().write_text("t7", &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

#[test]
fn the_same_file_gives_the_same_run_and_another_seed_another() {
    let text = |seed: u32| {
        format!(
            "seed = {seed}\n[segments.t7.noise]\nbit_error_rate = 0.001\ndrop_rate = 0.01\n{T7}\
             latency = {{ min = \"0.2ms\", max = \"2ms\" }}\ncorrupt = 0.1\n"
        )
    };
    let (first, again, other) = (text(1), text(1), text(2));
    let run = |text: &str| poll(&parse(text).unwrap());
    let log = run(&first);
    for word in ["heard", "flipped", "dropped", "altered"] {
        assert!(log.contains(word), "{word}");
    }
    assert_eq!(log, run(&again));
    assert_ne!(log, run(&other));
}

#[test]
fn a_t7_built_from_a_file_answers_on_the_line() {
    let scenario =
        parse(&format!("{T7}latency = \"1ms\"\nunplugged = [{{ from = \"1s\", until = \"1.5s\" }}]\n"))
            .unwrap();
    let text = poll(&scenario);
    let answers = text.lines().filter(|line| line.contains("char       t7/1 ")).count();
    // 390 polls, of which 100 to 104 fall into the half second and the boot after it; 8 characters each.
    assert!((8 * 280..=8 * 290).contains(&answers), "{answers}");
    assert!(text.contains("power      t7/1 off") && text.contains("power      t7/1 on"));
}

#[test]
fn an_isu_built_from_a_file_answers_on_the_line() {
    let scenario = parse("[[isu]]\naddress = 3\nmotion.constant = 90\n").unwrap();
    let mut bus = scenario.build().isu;
    let format = Format { bit_ps: 104_166_667, data_bits: 8, stop_halves: 2 };
    bus.set_receiver(0, Some(format));
    bus.advance(SECOND);
    bus.drive_enable(SECOND, true);
    // Read RAM 58H, 2 bytes: 03, address 3 << 4 | function 2 << 1, 58, 02, sum of the three.
    for (n, byte) in [0x03, 0x34, 0x58, 0x02, 0x8E].into_iter().enumerate() {
        let at = SECOND + n as u64 * 1_041_667;
        bus.advance(at);
        bus.send(Sent { start: at, word: byte, format });
    }
    let end = SECOND + 5 * 1_041_667;
    bus.advance(end);
    bus.drive_enable(end, false);
    bus.advance(2 * SECOND);
    let answer: Vec<u16> = std::iter::from_fn(|| bus.take_received()).map(|got| got.word).collect();
    // 90 degrees are 4000H.
    assert_eq!(answer, [0x04, 0x35, 0x58, 0x40, 0x00, 0x35 + 0x58 + 0x40]);
    let events = bus.log().lock().unwrap().events.clone();
    assert!(events.iter().any(|event| matches!(event, LineEvent::Char { who: Talker::Node(0), .. })));
}

#[test]
fn the_example_in_the_documentation_is_a_scenario_with_every_key() {
    let page = include_str!("../../../../docs/scenario.md");
    let example = page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let bench = parse(example).unwrap().build();
    assert!(bench.truths.len() >= 5);
    // Every key of the schema is named on the page.
    let rooms = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scenario/schema");
    let rooms = fs::read_dir(rooms).unwrap().map(|room| fs::read_to_string(room.unwrap().path()).unwrap());
    let schema: String = rooms.chain([include_str!("schema.rs").to_owned()]).collect();
    let keys = schema
        .lines()
        .filter_map(|line| line.trim().strip_prefix("pub "))
        .filter_map(|rest| rest.split_once(':'));
    for (key, _) in keys.filter(|(key, _)| !key.contains(' ') && *key != "fn") {
        assert!(page.contains(&format!("`{key}`")), "`{key}` is not explained");
        assert!(example.contains(key), "{key} is not in the example");
    }
}

#[test]
fn the_scenarios_that_come_with_the_project_are_good() {
    for (name, text) in [
        ("default", include_str!("../../../../scenarios/default.toml")),
        ("unplug", include_str!("../../../../scenarios/unplug.toml")),
        ("noise", include_str!("../../../../scenarios/noise.toml")),
    ] {
        let bench = parse(text).unwrap_or_else(|why| panic!("{name}: {why}")).build();
        let kinds = |kind| bench.truths.iter().filter(|truth| truth.who.kind == kind).count();
        assert_eq!([kinds(Kind::T7), kinds(Kind::Isu), kinds(Kind::Pwm)], [3, 1, 2], "{name}");
    }
}

/// A line with one impairment.
fn impairment(port: &str, keys: &str) -> String {
    format!("[{port}]\nimpairment = [{{ {keys} }}]")
}
