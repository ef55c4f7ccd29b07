//! Every command, for people and for programs, on sensors that do what they are told.

use serde_json::{Value, json};

use super::server::Server;
use super::{json, on, patiently, together};

/// A command, its words for people, and its object for programs.
type Row = (&'static str, &'static str, Value);

/// Runs the rows on two buses that are alike, one for people and one for programs.
fn check(sensors: &str, rows: &[Row]) {
    // What was changed can be put back: people and programs have the command.
    let puts_back = |text: &str| text.contains("puts the old value back");
    let is_changed =
        |object: &Value| ["changed", "zeroed", "nulled"].iter().any(|what| object["what"] == *what);
    let people = || {
        let server = Server::start(sensors);
        let port = server.path();
        for (line, words, object) in rows {
            let run = on(&port, line);
            assert_eq!((run.status, run.stdout.trim_end()), (0, *words), "{line}: {run:?}");
            assert_eq!(puts_back(&run.stderr), is_changed(object), "{line}: {run:?}");
        }
    };
    let programs = || {
        let server = Server::start(sensors);
        let port = server.path();
        for (line, _, object) in rows {
            let (status, objects) = json(&port, line);
            assert_eq!((status, objects.first()), (0, Some(object)), "{line}");
            let hint = objects.iter().find(|object| object["hint"]["kind"] == "put_back");
            let why = hint.map_or("", |hint| hint["hint"]["why"].as_str().unwrap());
            assert_eq!(puts_back(why), is_changed(object), "{line}: {objects:?}");
        }
    };
    together(&[&people, &programs]);
}

#[test]
fn a_t7_of_three_axes_is_read_at_each() {
    check(
        "--t7 5,model=t7-3,angle=-12.345,angle0=45 --pty",
        &[
            (
                "t7 angle 5 -a 0",
                "angle: address 5, axis 0, angle_deg 45.000",
                json!({"what":"angle","address":5,"axis":0,"angle_deg":45.0}),
            ),
            (
                "t7 angle 5",
                "angle: address 5, axis 2, angle_deg -12.345",
                json!({"what":"angle","address":5,"axis":2,"angle_deg":-12.345}),
            ),
        ],
    );
}

#[test]
fn a_t7_is_read_and_set_up() {
    check(
        "--t7 5,angle=-12.345,serial=25033 --pty",
        &[
            (
                "t7 info 5",
                "identity: product T7-1, serial 25033, firmware 0.32, damping_ms 1000, range bidirectional, direction_0 \
                 normal, direction_1 normal, direction_2 normal, offset_0_mdeg 0, offset_1_mdeg 0, offset_2_mdeg 0",
                json!({"what":"identity","product":"T7-1","serial":25033,"firmware":"0.32","damping_ms":1000,
                    "range":"bidirectional","direction_0":"normal","direction_1":"normal","direction_2":"normal",
                    "offset_0_mdeg":0,"offset_1_mdeg":0,"offset_2_mdeg":0}),
            ),
            (
                "t7 angle 5",
                "angle: address 5, axis 2, angle_deg -12.345",
                json!({"what":"angle","address":5,"axis":2,"angle_deg":-12.345}),
            ),
            (
                "t7 damping 5 50 --yes",
                "changed: damping_ms 50, from 1000, writes 1",
                json!({"what":"changed","damping_ms":50,"from":1000,"writes":1}),
            ),
            (
                "t7 damping 5 50 --yes",
                "unchanged: damping_ms 50, writes 0",
                json!({"what":"unchanged","damping_ms":50,"writes":0}),
            ),
            (
                "t7 zero 5 --yes",
                "zeroed: before_mdeg -12345, after_mdeg 0, writes 1",
                json!({"what":"zeroed","before_mdeg":-12345,"after_mdeg":0,"writes":1}),
            ),
            (
                "t7 offset 5 0 --yes",
                "changed: offset_mdeg 0, from 12345, writes 1",
                json!({"what":"changed","offset_mdeg":0,"from":12345,"writes":1}),
            ),
            (
                "t7 offset 5 -1000 -a 2 -y",
                "changed: offset_mdeg -1000, from 0, writes 1",
                json!({"what":"changed","offset_mdeg":-1000,"from":0,"writes":1}),
            ),
            (
                "t7 offset 5 0 -y",
                "changed: offset_mdeg 0, from -1000, writes 1",
                json!({"what":"changed","offset_mdeg":0,"from":-1000,"writes":1}),
            ),
            (
                "t7 direction 5 reversed --yes",
                "changed: direction reversed, from normal, writes 1",
                json!({"what":"changed","direction":"reversed","from":"normal","writes":1}),
            ),
            (
                "t7 angle 5",
                "angle: address 5, axis 2, angle_deg 12.345",
                json!({"what":"angle","address":5,"axis":2,"angle_deg":12.345}),
            ),
            (
                "t7 range 5 unidirectional --yes",
                "changed: range unidirectional, from bidirectional, writes 1",
                json!({"what":"changed","range":"unidirectional","from":"bidirectional","writes":1}),
            ),
            (
                "t7 baud 5 9600 --yes",
                "changed: baud 9600, from 115200, writes 1",
                json!({"what":"changed","baud":9600,"from":115200,"writes":1}),
            ),
            (
                "t7 address 5 7 --baud 9600 --yes",
                "changed: address 7, from 5, writes 1",
                json!({"what":"changed","address":7,"from":5,"writes":1}),
            ),
            (
                "t7 angle 7 --baud 9600",
                "angle: address 7, axis 2, angle_deg 12.345",
                json!({"what":"angle","address":7,"axis":2,"angle_deg":12.345}),
            ),
        ],
    );
}

#[test]
fn an_isu_is_read_and_set_up() {
    check(
        "--isu 3,angle=90 --pty",
        &[
            (
                "isu info 3",
                "identity: address 3, angle_deg 90.000, null_position_deg 0.000, auto_shutoff_word 49508, checksum_right \
                 yes",
                json!({"what":"identity","address":3,"angle_deg":90.0,"null_position_deg":0.0,"auto_shutoff_word":49508,
                    "checksum_right":true}),
            ),
            (
                "isu angle 3",
                "angle: address 3, angle_deg 90.000",
                json!({"what":"angle","address":3,"angle_deg":90.0}),
            ),
            (
                "isu angle 0 --alone",
                "angle: address 0, angle_deg 90.000",
                json!({"what":"angle","address":0,"angle_deg":90.0}),
            ),
            (
                "isu zero 3 --yes",
                "nulled: before_deg 90.000, after_deg 0.000, writes 1",
                json!({"what":"nulled","before_deg":90.0,"after_deg":0.0,"writes":1}),
            ),
            (
                "isu null 3 8192 --yes",
                "changed: null_position_deg 45.000, from 90.000, writes 2",
                json!({"what":"changed","null_position_deg":45.0,"from":90.0,"writes":2}),
            ),
            (
                "isu address 3 4 --yes",
                "changed: address 4, from 3, writes 2",
                json!({"what":"changed","address":4,"from":3,"writes":2}),
            ),
            ("isu reset 4", "alive: address 4", json!({"what":"alive","address":4})),
            (
                "isu scan",
                "found: address 4, angle_deg 45.000\nswept: devices 1, suspects 0, asked 14, complete yes",
                json!({"what":"found","address":4,"angle_deg":45.0}),
            ),
            (
                "isu auto-shutoff 4",
                "auto_shutoff: address 4, auto_shutoff_word 49508",
                json!({"what":"auto_shutoff","address":4,"auto_shutoff_word":49508}),
            ),
            (
                "isu auto-shutoff 4 on --bit 0 --yes",
                "changed: auto_shutoff yes, from no, writes 2",
                json!({"what":"changed","auto_shutoff":true,"from":false,"writes":2}),
            ),
            (
                "isu auto-shutoff 4 off --bit 0 --yes",
                "changed: auto_shutoff no, from yes, writes 2",
                json!({"what":"changed","auto_shutoff":false,"from":true,"writes":2}),
            ),
            (
                "isu auto-shutoff 4 off --bit 0 --yes",
                "unchanged: auto_shutoff no, writes 0",
                json!({"what":"unchanged","auto_shutoff":false,"writes":0}),
            ),
            (
                "isu repair 4 --yes",
                "repaired: address 4, stored_address 4, writes 0",
                json!({"what":"repaired","address":4,"stored_address":4,"writes":0}),
            ),
        ],
    );
}

#[test]
fn an_isu_that_is_alone_gets_an_address_and_loses_it_again() {
    let server = Server::start("--isu 3,angle=90 --pty");
    let port = server.path();
    let run = on(&port, "isu address 0 5 --alone --yes");
    assert_eq!((run.status, run.stdout.as_str()), (0, "changed: address 5, from 3, writes 2\n"), "{run:?}");
    let back = format!("clino isu address 5 3 --alone --port {port} puts the old value back");
    assert!(run.stderr.contains(&back), "{run:?}");
    assert_eq!(on(&port, "isu angle 5").status, 0);
    // As it leaves the factory.
    let run = on(&port, "isu address 5 0 --alone --yes");
    assert_eq!((run.status, run.stdout.as_str()), (0, "changed: address 0, from 5, writes 2\n"), "{run:?}");
    assert_eq!(on(&port, "isu angle 0 --alone").stdout, "angle: address 0, angle_deg 90.000\n");
}

#[test]
fn an_isu_with_a_wrong_checksum_is_told_of_and_repaired() {
    let server = Server::start("--isu 3,angle=90,hard-error --pty");
    let port = server.path();
    let run = on(&port, "isu angle 3");
    assert_eq!(
        (run.status, run.stdout.as_str()),
        (1, "failed: why hard_error, writes 0, repair no\n"),
        "{run:?}"
    );
    assert!(run.stderr.contains("isu repair restores its memory"), "{run:?}");
    let (status, objects) = json(&port, "isu repair 3 --yes");
    assert_eq!((status, &objects[0]["what"], &objects[0]["address"]), (0, &json!("repaired"), &json!(3)));
    assert!(objects[0]["writes"].as_u64().unwrap() > 0, "{objects:?}");
    assert_eq!(on(&port, "isu angle 3").stdout, "angle: address 3, angle_deg 90.000\n");
}

#[test]
fn everything_that_a_t7_measures() {
    let server = Server::start("--t7 6,model=t7-3,angle0=1,angle1=-2,angle2=3,serial=7 --pty");
    let port = server.path();
    let (status, objects) = json(&port, "t7 all 6");
    let all = &objects[0];
    assert_eq!(status, 0, "{objects:?}");
    let named = |name: &str| all[name].clone();
    assert_eq!(["angle_0_deg", "angle_1_deg", "angle_2_deg"].map(named), [1.0, -2.0, 3.0].map(Value::from));
    assert_eq!((&all["what"], &all["address"], &all["serial"]), (&json!("all"), &json!(6), &json!(7)));
    for name in ["acceleration_0_g", "acceleration_1_g", "acceleration_2_g", "temperature_c"] {
        assert!(all[name].is_f64(), "{name} in {all}");
    }
    let run = on(&port, "t7 all 6");
    assert!(
        run.stdout.starts_with("all: address 6, angle_0_deg 1.000, angle_1_deg -2.000, angle_2_deg 3.000, ")
    );
}

#[test]
fn a_scan_finds_what_is_there_at_one_rate_and_at_all() {
    let server = Server::start("--t7 1 --t7 100,baud=9600 --t7 127 --pty");
    let port = server.path();
    let found = |line: &str| {
        patiently(|| {
            let run = super::clino(&format!("{line} --port {port} --latency 15 --json"));
            let objects = run.objects();
            let found: Vec<[u64; 2]> = objects
                .iter()
                .filter(|object| object["what"] == "found")
                .map(|object| ["address", "baud"].map(|name| object[name].as_u64().unwrap()))
                .collect();
            let swept = super::what(&objects, "swept");
            let is_all = swept["devices"] == found.len() && swept["complete"] == true && run.status == 0;
            if is_all && found.len() == 3 { Ok(found) } else { Err(format!("{objects:?}")) }
        })
    };
    assert_eq!(found("t7 scan all"), [[1, 115_200], [127, 115_200], [100, 9_600]]);
    // People have lines, and the rate of the port alone.
    let run = patiently(|| {
        let run = super::clino(&format!("t7 scan --port {port} --latency 15"));
        let is_all = run.stdout.ends_with("swept: devices 2, suspects 0, asked 101, complete yes\n");
        if is_all { Ok(run) } else { Err(format!("{run:?}")) }
    });
    let line = "found: address 127, baud 115200, product T7-1, serial 1003, firmware 0.32\n";
    assert!(run.stdout.contains(line), "{run:?}");
}

#[test]
fn the_ports_of_this_computer_are_listed() {
    let run = super::clino("ports --json");
    assert_eq!((run.status, run.stderr.as_str()), (0, ""), "{run:?}");
    for object in run.objects().iter().filter(|object| object["what"] == "port") {
        assert!(object["name"].as_str().is_some_and(|name| name.starts_with("/dev/")), "{object}");
        for name in ["usb", "adapter", "serial", "latency_ms", "problem"] {
            assert!(object.get(name).is_some(), "{name} in {object}");
        }
    }
    assert_eq!(super::clino("ports").status, 0);
}

#[test]
fn the_memory_of_an_isu_is_read_and_audited() {
    let server = Server::start("--isu 3 --isu 5,hard-error --pty");
    let port = server.path();
    let (status, objects) = json(&port, "isu eeprom audit 3");
    assert_eq!(
        (status, &objects[0]["what"], &objects[0]["checksum_right"]),
        (0, &json!("audit"), &json!(true))
    );
    let run = on(&port, "isu eeprom dump 3");
    let words = run.stdout.lines().map(|line| line.split_once(": ").unwrap());
    let words: Vec<u16> = words
        .flat_map(|(_, words)| {
            words.split(' ').map(|word| u16::from_str_radix(word, 16).unwrap()).collect::<Vec<_>>()
        })
        .collect();
    assert_eq!((run.status, words.len()), (0, 256), "{run:?}");
    // The address, in the low bits of eight words from 48H, most significant pair first, low byte first: b7-b4 are in two words.
    assert_eq!(((words[0x48] & 3) << 2) | (words[0x49] & 3), 3);
    // The checksum: the sum of all words without its own 16 bits, or without its own eight words.
    let bits = [3, 2, 1, 0, 7, 6, 5, 4].map(|pair| pair * 2);
    let stored = (0..8).fold(0, |sum, place| sum | ((words[0x78 + place] & 3) << bits[place]));
    let total = |words: &[u16]| words.iter().fold(0_u16, |sum, word| sum.wrapping_add(*word));
    let left_out = total(&words).wrapping_sub(total(&words[0x78..0x80]));
    let counted =
        left_out.wrapping_add(words[0x78..0x80].iter().fold(0, |sum: u16, word| sum.wrapping_add(word & !3)));
    assert!([left_out, counted].contains(&stored), "{stored} {left_out} {counted}");
    let (_, objects) = json(&port, "isu eeprom dump 3");
    let listed: Vec<u64> = objects
        .iter()
        .flat_map(|object| object["words"].as_array().unwrap().clone())
        .map(|word| word.as_u64().unwrap())
        .collect();
    assert_eq!(listed, words.iter().map(|word| u64::from(*word)).collect::<Vec<_>>());
    // One in its Hard Error state says so.
    let (status, objects) = json(&port, "isu eeprom audit 5");
    assert_eq!((status, &objects[0]["why"]), (1, &json!("hard_error")), "{objects:?}");
}

#[test]
fn lines_that_a_module_prints_are_read_at_a_port() {
    let server = Server::start("--isu 3,ascii,angle=-32.7 --pty");
    let run = super::clino(&format!("isu ascii --lines 3 --port {}", server.path()));
    assert_eq!((run.status, run.stderr.as_str()), (0, ""), "{run:?}");
    assert!(
        run.objects().len() == 3 && run.objects().iter().all(|object| object["angle_cdeg"] == -3_270),
        "{run:?}"
    );
}

#[test]
fn completions_and_the_manual_know_every_command() {
    for shell in ["bash", "zsh", "fish"] {
        let run = super::clino(&format!("completions {shell}"));
        assert_eq!(run.status, 0, "{run:?}");
        for word in ["watch", "sniff", "gateway", "auto-shutoff", "damping"] {
            assert!(run.stdout.contains(word), "{word} for {shell}");
        }
    }
    let run = super::clino("man");
    assert!(run.status == 0 && run.stdout.contains(".TH clino 1") && run.stdout.contains("sniff"), "{run:?}");
    let folder = std::env::temp_dir().join(format!("clino-man-{}", std::process::id()));
    assert_eq!(super::clino(&format!("man --dir {}", folder.display())).status, 0);
    let page = std::fs::read_to_string(folder.join("clino-t7-scan.1")).unwrap();
    assert!(page.contains("scan"), "{page}");
    std::fs::remove_dir_all(folder).unwrap();
}
