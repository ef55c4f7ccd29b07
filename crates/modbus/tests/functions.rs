//! What requests are answered with: the specification's own examples where it has them, the map's rules where not.

mod common;

use clino_bus::Duration;
use clino_codec::t7::Axis;
use clino_gateway::config::Kind;
use clino_gateway::{SlotConfig, Source};
use clino_modbus::Refusal;
use clino_modbus::command::Command;
use common::real::Written;
use common::{ADDRESS, Bench, crc, sealed, write_request};

/// The oracle itself, against values that others have published: the check value of CRC-16/MODBUS over "123456789", and
/// the example of MODBUS over Serial Line V1.02, section 6.2.2 (0x02 0x07 gives 0x1241).
#[test]
fn checksum_oracle() {
    assert_eq!(crc(b"123456789"), 0x4B37);
    assert_eq!(crc(&[0x02, 0x07]), 0x1241);
    assert_eq!(
        sealed(&[0x01, 0x03, 0x00, 0x00, 0x00, 0x01]),
        [0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A]
    );
}

/// Whole frames, written out.
#[test]
fn frames_as_they_are_on_the_wire() {
    let mut bench = Bench::new();
    // 11 03 00 0C 00 02: the test number.
    let answer = bench.raw(&sealed(&[0x11, 0x03, 0x00, 0x0C, 0x00, 0x02]));
    assert_eq!(answer, Some(sealed(&[0x11, 0x03, 0x04, 0x12, 0x34, 0x56, 0x78])));
    // The same with function 4, and the floating-point one.
    let answer = bench.raw(&sealed(&[0x11, 0x04, 0x00, 0x0E, 0x00, 0x02]));
    assert_eq!(answer, Some(sealed(&[0x11, 0x04, 0x04, 0x42, 0xF6, 0xE9, 0x79])));
    // An exception.
    let answer = bench.raw(&sealed(&[0x11, 0x03, 0x16, 0x00, 0x00, 0x01]));
    assert_eq!(answer, Some(sealed(&[0x11, 0x83, 0x02])));
}

#[test]
fn unknown_functions_are_exception_1() {
    let known = [3, 4, 6, 8, 16, 43];
    for function in (0..128).filter(|function| !known.contains(function)) {
        assert_eq!(Bench::new().ask(&[function, 0, 0, 0, 1]), [function | 0x80, 1], "function {function}");
    }
}

#[test]
fn quantities() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x0100, 0), Err(3));
    assert!(bench.read(0x0100, 125).is_ok());
    for quantity in [126, 127, 128, 129, 256, 0x8000, 0xFFFF] {
        assert_eq!(bench.ask(&[3, 1, 0, (quantity >> 8) as u8, quantity as u8]), [0x83, 3]);
    }
    // 123 registers fit into a frame; the map has no 123 in a row that can be written.
    assert_eq!(bench.write(0x1000, &[0; 123]), Err(2));
    assert_eq!(bench.write(0x1000, &[]), Err(3));
    // 124 are one byte more than a frame can have.
    let request = sealed(&[&[ADDRESS], &write_request(0x1000, &[0; 124])[..]].concat());
    assert_eq!((request.len(), bench.raw(&request)), (257, None));
    assert_eq!(bench.ask(&[16, 0x10, 0, 0, 124, 248, 0, 0]), [0x90, 3]);
}

/// A request that is longer or shorter than it says.
#[test]
fn wrong_lengths_are_exception_3() {
    let mut bench = Bench::new();
    for pdu in [
        vec![3],
        vec![3, 0, 0, 0],
        vec![3, 0, 0, 0, 1, 0],
        vec![4, 0, 0],
        vec![6],
        vec![6, 0x10, 0, 0],
        vec![6, 0x10, 0, 0, 1, 0],
        vec![6, 0x10, 0, 0, 1, 0, 1],
        vec![16],
        vec![16, 0x10, 0, 0, 1, 2],
        vec![16, 0x10, 0, 0, 1, 2, 0],
        vec![16, 0x10, 0, 0, 1, 2, 0, 1, 0],
        vec![16, 0x10, 0, 0, 2, 2, 0, 1],
        vec![16, 0x10, 0, 0, 1, 4, 0, 1, 0, 1],
        vec![16, 0x10, 0, 0, 1, 3, 0, 1],
        vec![8, 0],
        vec![8, 0, 0],
        vec![8, 0, 0, 1],
        vec![8, 0, 11, 0, 0, 0, 0],
        vec![8, 0, 11, 0, 1],
        vec![43, 14],
        vec![43, 14, 1],
        vec![43, 14, 1, 0, 0],
    ] {
        assert_eq!(bench.ask(&pdu), [pdu[0] | 0x80, 3], "{pdu:02X?}");
    }
    assert!(bench.host.writes.is_empty());
}

/// A read beyond the end of the address space, and across the border of the map.
#[test]
fn reads_outside_the_map_are_exception_2() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0xFFFF, 2), Err(2));
    assert_eq!(bench.read(0xFFFF, 125), Err(2));
    assert_eq!(bench.read(0x00DF, 2), Err(2));
    assert_eq!(bench.read(0x00FF, 2), Err(2));
    assert!(bench.read(0x00DE, 2).is_ok());
    // From one block into the next: all registers exist.
    assert!(bench.read(0x0010, 64).is_ok());
}

/// 32-bit numbers may be cut in half when they are read.
#[test]
fn halves_can_be_read() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x000D, 1), Ok(vec![0x5678]));
    assert_eq!(bench.read(0x000C, 1), Ok(vec![0x1234]));
    assert_eq!(bench.read(0x000B, 2), Ok(vec![1, 0x1234]));
    assert_eq!(bench.read(0x000D, 2), Ok(vec![0x5678, 0x42F6]));
}

#[test]
fn halves_cannot_be_written() {
    let mut bench = Bench::new();
    // Period: two registers at offset 4.
    assert_eq!(bench.write_one(0x1004, 0), Err(2));
    assert_eq!(bench.write_one(0x1005, 10), Err(2));
    assert_eq!(bench.write(0x1005, &[10]), Err(2));
    assert_eq!(bench.write(0x1003, &[2, 0]), Err(2));
    assert_eq!(bench.write(0x1005, &[10, 0, 100]), Err(2));
    assert!(bench.host.writes.is_empty());
    assert_eq!(bench.write(0x1004, &[0, 10]), Ok(()));
    assert_eq!(bench.host.config(0).period.as_micros(), 10_000);
}

#[test]
fn what_cannot_be_written() {
    let mut bench = Bench::new();
    // Header, angles, an unused register, the hole behind the settings of a slot, nothing at all, a result.
    for address in [0x0000, 0x0020, 0x001F, 0x1012, 0x1019, 0x101F, 0x1600, 0x09C0, 0x0A00, 0x1F09] {
        assert_eq!(bench.write_one(address, 0), Err(2), "{address:04X}");
        assert_eq!(bench.write(address, &[0]), Err(2), "{address:04X}");
    }
    // From the settings of a slot to those of the next.
    let mut words = vec![0; 33];
    words[0] = 1;
    assert_eq!(bench.write(0x1000, &words), Err(2));
    assert!(bench.host.writes.is_empty());
}

/// A fault in the last register: nothing of the first ones is done.
#[test]
fn function_16_is_checked_whole() {
    let mut bench = Bench::new();
    let before = bench.host.slots();
    // Enabled, kind, address, axis, period, stale, timeout, retries: 11 is one too many.
    let good = [0, 2, 3, 1, 0, 20, 0, 60, 5, 10];
    let mut bad = good;
    bad[9] = 11;
    assert_eq!(bench.write(0x1000, &bad), Err(3));
    assert_eq!(bench.host.slots(), before);
    // An address fault behind a value fault is an address fault.
    assert_eq!(bench.write(0x1018, &[2, 0]), Err(2));
    assert_eq!(bench.write(0x1000, &good), Ok(()));
    // In slot 0, which has read a T7: another kind brings its own settings for what was not written.
    let isu = Source::of(Kind::Isu, 3, Axis::Two);
    let expected = SlotConfig {
        enabled: false,
        held_axis: Axis::One,
        period: Duration::from_millis(20),
        timeout: Duration::from_millis(5),
        stale: Duration::from_millis(60),
        retries: 10,
        ..SlotConfig::usual(isu)
    };
    assert_eq!(bench.host.config(0), expected);
    assert_eq!(bench.host.writes.len(), 1);
    // A number below zero where there is one.
    let [_, _, high, low] = (-360_000_i32).to_be_bytes().map(u16::from);
    assert_eq!(bench.write(0x100A, &[0xFFFA, high * 256 + low]), Ok(()));
    assert_eq!(bench.host.config(0).soft_zero.udeg(), -360_000_000);
    assert_eq!(bench.write(0x100A, &[0xFFFA, high * 256 + low - 1]), Err(3));
    // One beyond the largest positive one, where none is negative.
    assert_eq!(bench.write(0x1004, &[0x8000, 0]), Err(3));
}

#[test]
fn the_host_has_the_last_word() {
    let mut bench = Bench::new();
    for (refusal, exception) in [(Refusal::Value, 3), (Refusal::Failed, 4), (Refusal::Busy, 6)] {
        bench.host.refusal = Some(refusal);
        assert_eq!(bench.write_one(0x1000, 1), Err(exception));
        assert_eq!(bench.write(0x1F00, &[1]), Err(exception));
    }
    assert!(bench.host.writes.is_empty());
}

#[test]
fn commands() {
    let mut bench = Bench::new();
    let command = |command, target, value| Written::Command { command, target, value, armed: false };
    // Without a key: one register is enough.
    assert_eq!(bench.write_one(0x1F00, 1), Ok(()));
    assert_eq!(bench.host.writes.pop(), Some(command(Command::Save, 0, 0)));
    assert_eq!(bench.write(0x1F00, &[4, 47]), Ok(()));
    assert_eq!(bench.host.writes.pop(), Some(command(Command::SoftZero, 47, 0)));
    // With a key, in the same request, or not at all.
    for code in [2, 16, 17, 18, 19, 20, 21, 22, 23, 24] {
        assert_eq!(bench.write_one(0x1F00, code), Err(3));
        assert_eq!(bench.write(0x1F00, &[code, 1, 0, 0, 0]), Err(3));
        assert_eq!(bench.write(0x1F00, &[code, 1, 0, 0, 0x4E55]), Err(3));
        assert_eq!(bench.write(0x1F00, &[code, 1, 0, 0]), Err(3));
        assert!(bench.host.writes.is_empty());
        assert_eq!(bench.write(0x1F00, &[code, 1, 0xFFFF, 0xFFFE, 0x4E56]), Ok(()));
        let Some(Written::Command { command, target: 1, value: -2, armed: true }) = bench.host.writes.pop()
        else {
            panic!("no command");
        };
        assert_eq!(command as u16, code);
    }
    // A key alone arms nothing.
    assert_eq!(bench.write_one(0x1F04, 0x4E56), Err(2));
    assert_eq!(bench.write_one(0x1F00, 16), Err(3));
    // A wrong key is wrong even where none is needed.
    assert_eq!(bench.write(0x1F00, &[1, 0, 0, 0, 1]), Err(3));
    // No such commands; no such slot; no command.
    for code in [0, 6, 15, 25, 0x8001] {
        assert_eq!(bench.write_one(0x1F00, code), Err(3), "{code}");
    }
    assert_eq!(bench.write(0x1F00, &[4, 48]), Err(3));
    assert_eq!(bench.write(0x1F01, &[1, 0, 0, 0x4E56]), Err(2));
    assert!(bench.host.writes.is_empty());
    assert_eq!(bench.read(0x1F00, 8), Ok(vec![0; 8]), "a command is not kept");
}

/// The settings of the port: the answer still comes as before.
#[test]
fn the_port_changes_after_the_answer() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(0x1840, &[18, 0, 0, 9_600, 2]), Ok(()));
    let settings = bench.server.reconfigured().expect("new settings");
    assert_eq!((settings.address, settings.baud), (18, 9_600));
    assert_eq!(bench.server.reconfigured(), None);
    assert_eq!(bench.raw(&sealed(&[ADDRESS, 3, 0, 0, 0, 1])), None, "the old address");
    // 8N2 at 9600 bit/s: eleven bits take 1146 µs.
    (bench.character, bench.t3_5) = (1_146, 4_011);
    bench.pause(50_000);
    assert_eq!(bench.raw(&sealed(&[18, 3, 0, 2, 0, 1])), Some(sealed(&[18, 3, 2, 0, 2])));

    let mut bench = Bench::new();
    // A bit rate that is none; an address that is none.
    assert_eq!(bench.write(0x1842, &[0, 9_601]), Err(3));
    assert_eq!(bench.write_one(0x1840, 0), Err(3));
    assert_eq!(bench.write_one(0x1840, 248), Err(3));
    assert_eq!(bench.server.reconfigured(), None);
    // Refused by the gateway: nothing changes.
    bench.host.refusal = Some(Refusal::Busy);
    assert_eq!(bench.write_one(0x1840, 5), Err(6));
    assert_eq!(bench.server.reconfigured(), None);
    // To everybody: at once.
    bench.host.refusal = None;
    assert_eq!(bench.raw(&sealed(&[0, 6, 0x18, 0x40, 0, 5])), None);
    assert_eq!(bench.server.reconfigured().map(|settings| settings.address), Some(5));
}

/// Broadcasts write, and the server does not answer.
#[test]
fn broadcasts() {
    let mut bench = Bench::new();
    assert_eq!(bench.raw(&sealed(&[&[0], &write_request(0x1004, &[0, 77])[..]].concat())), None);
    assert_eq!(bench.host.config(0).period.as_micros(), 77_000);
    assert_eq!(bench.raw(&sealed(&[0, 6, 0x10, 0x00, 0, 0])), None);
    assert!(!bench.host.config(0).enabled);
    let (writes, begun) = (bench.host.writes.len(), bench.host.begun);
    for pdu in [vec![3, 0, 0, 0, 1], vec![8, 0, 0, 1, 2], vec![8, 0, 10, 0, 0], vec![43, 14, 1, 0], vec![99]]
    {
        assert_eq!(bench.raw(&sealed(&[&[0], &pdu[..]].concat())), None);
    }
    assert_eq!((bench.host.writes.len(), bench.host.begun), (writes, begun));
    // A fault in a broadcast is counted as an exception.
    assert_eq!(bench.raw(&sealed(&[0, 6, 0, 0, 0, 0])), None);
    let counters = bench.server.counters();
    assert_eq!(
        (counters.exceptions, counters.unanswered, counters.requests, counters.messages),
        (1, 8, 8, 8)
    );
}

#[test]
fn diagnostic_echo() {
    let mut bench = Bench::new();
    for data in [vec![0xA5, 0x37], vec![0; 250], (0..=249).collect()] {
        let request = [&[8, 0, 0], &data[..]].concat();
        assert_eq!(bench.ask(&request), request);
    }
    assert_eq!(bench.ask(&[8, 0, 0, 1, 2, 3]), [0x88, 3]);
}

#[test]
fn diagnostic_counters() {
    let mut bench = Bench::new();
    let counter = |bench: &mut Bench, sub: u8| {
        // A counter of zero is answered with its request, which is taken for an echo for a second.
        bench.pause(1_200_000);
        let answer = bench.ask(&[8, 0, sub, 0, 0]);
        assert_eq!(answer[..3], [8, 0, sub]);
        u16::from(answer[3]) * 256 + u16::from(answer[4])
    };
    // Diagnostic register: the status of the gateway.
    assert_eq!(counter(&mut bench, 2), 0x040B);
    assert_eq!(bench.ask(&[8, 0, 10, 0, 0]), [8, 0, 10, 0, 0]);
    bench.raw(&sealed(&[ADDRESS + 1, 3, 0, 0, 0, 1])); // for another: a message
    bench.raw(&[ADDRESS, 3, 0, 0, 0, 1, 0, 0]); // wrong checksum
    bench.raw(&[ADDRESS]); // too short
    bench.raw(&sealed(&[0, 6, 0x10, 0, 0, 1])); // to everybody
    bench.ask(&[99]); // exception
    bench.character(ADDRESS, clino_codec::character::LineErrors::OVERRUN);
    bench.raw(&sealed(&[ADDRESS, 3, 0, 0, 0, 1])[1..]); // whole, but for the overrun
    // Every question is a message to us, and counted before it is answered.
    assert_eq!(counter(&mut bench, 11), 4);
    assert_eq!(counter(&mut bench, 12), 3);
    assert_eq!(counter(&mut bench, 13), 1);
    assert_eq!(counter(&mut bench, 14), 6);
    assert_eq!(counter(&mut bench, 15), 1);
    assert_eq!(counter(&mut bench, 18), 1);
    // Both ways to clear them.
    for request in [[8, 0, 1, 0, 0], [8, 0, 1, 0xFF, 0], [8, 0, 10, 0, 0]] {
        assert_eq!(bench.ask(&[99]), [99 | 0x80, 1]);
        assert_eq!(bench.ask(&request), request);
        assert_eq!(counter(&mut bench, 13), 0);
        assert_eq!(counter(&mut bench, 11), 2);
    }
    // No such sub-function: no such function. No such data.
    for sub in (0..=255).filter(|sub| !matches!(sub, 0..=2 | 10..=15 | 18)) {
        assert_eq!(bench.ask(&[8, 0, sub, 0, 0]), [0x88, 1], "{sub}");
    }
    assert_eq!(bench.ask(&[8, 1, 0, 0, 0]), [0x88, 1]);
    for request in [[8, 0, 1, 0, 1], [8, 0, 1, 0xFF, 1], [8, 0, 2, 0, 1], [8, 0, 11, 1, 0]] {
        assert_eq!(bench.ask(&request), [0x88, 3]);
    }
}

#[test]
fn identification() {
    let mut bench = Bench::new();
    let objects = ["Vendor", "P-1", "1.2.3", "https://example.org", "Gateway", "Model"];
    let coded = |numbers: std::ops::Range<usize>| -> Vec<u8> {
        let object = |n: usize| [&[n as u8, objects[n].len() as u8], objects[n].as_bytes()].concat();
        numbers.flat_map(object).collect()
    };
    let head = |code: u8, count: u8| vec![43, 14, code, 0x82, 0, 0, count];
    assert_eq!(bench.ask(&[43, 14, 1, 0]), [head(1, 3), coded(0..3)].concat());
    assert_eq!(bench.ask(&[43, 14, 2, 0]), [head(2, 6), coded(0..6)].concat());
    assert_eq!(bench.ask(&[43, 14, 3, 0]), [head(3, 6), coded(0..6)].concat());
    assert_eq!(bench.ask(&[43, 14, 2, 4]), [head(2, 2), coded(4..6)].concat());
    // An object that the stream does not have: from the beginning.
    assert_eq!(bench.ask(&[43, 14, 1, 4]), [head(1, 3), coded(0..3)].concat());
    assert_eq!(bench.ask(&[43, 14, 2, 0x80]), [head(2, 6), coded(0..6)].concat());
    for one in 0..6 {
        assert_eq!(
            bench.ask(&[43, 14, 4, one]),
            [head(4, 1), coded(one.into()..usize::from(one) + 1)].concat()
        );
    }
    assert_eq!(bench.ask(&[43, 14, 4, 6]), [0xAB, 2]);
    assert_eq!(bench.ask(&[43, 14, 0, 0]), [0xAB, 3]);
    assert_eq!(bench.ask(&[43, 14, 5, 0]), [0xAB, 3]);
    assert_eq!(bench.ask(&[43, 13, 1, 0]), [0xAB, 1]);
    assert_eq!(bench.ask(&[43]), [0xAB, 1]);
}

/// More than fits into one frame: the rest on the next request.
#[test]
fn identification_in_parts() {
    let long: &'static str = Box::leak("x".repeat(122).into_boxed_str());
    let longest: &'static str = Box::leak("y".repeat(300).into_boxed_str());
    let mut bench = Bench::new();
    let mut objects = common::IDENTIFICATION.0;
    [objects[0], objects[1], objects[2]] = [long, long, longest];
    let identification = Box::leak(Box::new(clino_modbus::Identification(objects)));
    bench.server = clino_modbus::Server::new(
        common::SETTINGS,
        identification,
        clino_bus::Instant::from_micros(bench.now),
    );
    bench.pause(10_000);
    let first = bench.ask(&[43, 14, 1, 0]);
    assert_eq!(first[..7], [43, 14, 1, 0x82, 0xFF, 1, 1]);
    let second = bench.ask(&[43, 14, 1, 1]);
    assert_eq!(second[..7], [43, 14, 1, 0x82, 0xFF, 2, 1]);
    let third = bench.ask(&[43, 14, 1, 2]);
    assert_eq!(third[..7], [43, 14, 1, 0x82, 0, 0, 1]);
    assert_eq!(usize::from(third[8]), third.len() - 9);
    assert_eq!(third.len(), 253, "a frame of 256");
}

/// Row 22 of the issue: an object without a text is not there, in no way to ask for it.
#[test]
fn empty_objects_are_left_out() {
    for empty in 1..64_usize {
        let mut objects = common::IDENTIFICATION.0;
        (0..6).filter(|object| empty >> object & 1 == 1).for_each(|object| objects[object] = "");
        let identification = Box::leak(Box::new(clino_modbus::Identification(objects)));
        let mut bench = Bench::new();
        bench.server = clino_modbus::Server::new(
            common::SETTINGS,
            identification,
            clino_bus::Instant::from_micros(bench.now),
        );
        bench.pause(10_000);
        let coded = |numbers: std::ops::Range<usize>| -> Vec<u8> {
            let object = |n: usize| [&[n as u8, objects[n].len() as u8], objects[n].as_bytes()].concat();
            numbers.filter(|&n| !objects[n].is_empty()).flat_map(object).collect()
        };
        let stream = |code: u8, numbers: std::ops::Range<usize>| {
            let count = numbers.clone().filter(|&n| !objects[n].is_empty()).count() as u8;
            [vec![43, 14, code, 0x82, 0, 0, count], coded(numbers)].concat()
        };
        for (code, objects) in [(1, 0..3), (2, 0..6), (3, 0..6)] {
            assert_eq!(bench.ask(&[43, 14, code, 0]), stream(code, objects), "{empty:06b}");
        }
        for (one, text) in objects.iter().enumerate() {
            let (alone, from) = (bench.ask(&[43, 14, 4, one as u8]), bench.ask(&[43, 14, 2, one as u8]));
            if text.is_empty() {
                assert_eq!(alone, [0xAB, 2]);
                assert_eq!(from, stream(2, 0..6), "from the beginning");
            } else {
                assert_eq!(alone, stream(4, one..one + 1));
                assert_eq!(from, stream(2, one..6));
            }
        }
    }
}
