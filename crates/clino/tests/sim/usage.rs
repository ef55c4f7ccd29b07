//! Bad usage: exit status 2, nothing on standard output, and a message with the limit.

use std::process::{Command, Stdio};

use super::server::CLINO;

fn run(line: &str) -> (Option<i32>, String, String) {
    let output = Command::new(CLINO).arg("sim").args(line.split_whitespace()).stdin(Stdio::null()).output();
    let output = output.unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    (output.status.code(), stdout, stderr)
}

#[test]
fn sensors_that_cannot_be_are_refused_with_the_limit() {
    for (line, limit) in [
        ("--t7 0 --pty", "1..=100, nor 127"),
        ("--t7 101 --pty", "1..=100, nor 127"),
        ("--t7 126 --pty", "1..=100, nor 127"),
        ("--t7 five --pty", "1..=100, nor 127"),
        ("--isu 0 --pty", "1..=14"),
        ("--isu 15 --pty", "1..=14"),
        ("--t7 5,baud=4800 --pty", "115200, 57600, 38400, 19200, 9600"),
        ("--t7 5,damping=1 --pty", "2..=5000"),
        ("--t7 5,latency=3ms --pty", "more than 2 ms"),
        ("--t7 5,set-latency=25.1ms --pty", "more than 25 ms"),
        ("--t7 5,model=t7-2 --pty", "t7-1, t7-3"),
        ("--t7 5,serial=4294967296 --pty", "0..=4294967295"),
        ("--t7 5,angle=1000001 --pty", "-1000000..=1000000"),
        ("--t7 5,angle=left --pty", "ramp:START:RATE"),
        ("--t7 5,fault=loud/3 --pty", "bad-checksum, silent, late"),
        ("--t7 5,length-quirk=1 --pty", "no value"),
        ("--t7 5,phase=1 --pty", "no such key"),
        ("--isu 3,baud=9600 --pty", "no such key"),
        ("--t7 5,flash=burns --pty", "fails, erase-fails, program-fails"),
        ("--isu 3,latency=401ms --pty", "more than 400 ms"),
        ("--isu 3,ascii --isu 4 --pty", "for itself"),
        ("--t7 5 --pty --bit-error-rate 1.5", "0..=1"),
        ("--t7 5", "--pty"),
        ("--pty", "--t7"),
    ] {
        let (status, stdout, stderr) = run(line);
        assert_eq!((status, stdout.as_str()), (Some(2), ""), "{line}: {stderr}");
        assert!(stderr.contains(limit), "{limit} in: {stderr}");
    }
}

#[test]
fn a_bus_has_room_for_so_many() {
    for (sensor, most, limit) in [("--t7 5 ", 32, "at most 32"), ("--isu 3 ", 14, "at most 14")] {
        let (status, _, stderr) = run(&format!("{}--pty", sensor.repeat(most + 1)));
        assert_eq!(status, Some(2));
        assert!(stderr.contains(limit), "{limit} in: {stderr}");
        let server = super::Server::start(&format!("{}--pty", sensor.repeat(most)));
        assert!(server.path().starts_with("/dev/"));
    }
}

#[test]
fn help_names_every_key() {
    let (status, stdout, _) = run("--help");
    assert_eq!(status, Some(0));
    for key in [
        "angle=",
        "angle0=",
        "latency=",
        "fault=",
        "model=",
        "serial=",
        "baud=",
        "damping=",
        "range=",
        "set-latency=",
        "length-quirk",
        "flash=",
        "ascii",
        "hard-error",
        "--echo",
        "--bit-error-rate",
        "--seed",
        "--verbose",
    ] {
        assert!(stdout.contains(key), "{key} in: {stdout}");
    }
}
