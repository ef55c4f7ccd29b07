//! Characters and silences.
//!
//! Times are restated from MODBUS over Serial Line V1.02, section 2.5.1.1: 1.5 and 3.5 characters up to 19200 bit/s,
//! 750 µs and 1.750 ms above.

mod common;

use clino_bus::{Duration, Instant};
use clino_codec::character::{Character, LineErrors};
use clino_modbus::settings::{Parity, Pauses, Settings, StopBits};
use common::real::Real;
use common::{ADDRESS, Bench, IDENTIFICATION, SETTINGS, crc, sealed};

const REQUEST: [u8; 6] = [ADDRESS, 3, 0, 0, 0, 1];

fn settings(baud: u32, parity: Parity, stop_bits: StopBits) -> Settings {
    Settings { baud, parity, stop_bits, ..SETTINGS }
}

#[test]
fn silences() {
    use {Parity::*, StopBits::*};
    for (baud, parity, stop_bits, t1_5, t3_5) in [
        (2_400, Even, One, 6_875, 16_042),
        (9_600, Even, One, 1_719, 4_011),
        (9_600, None, Two, 1_719, 4_011),
        (9_600, None, One, 1_563, 3_646),
        (19_200, Even, One, 860, 2_006),
        (19_200, Odd, Two, 938, 2_188),
        (38_400, Even, One, 750, 1_750),
        (115_200, None, One, 750, 1_750),
    ] {
        let settings = settings(baud, parity, stop_bits);
        let near = |found: Duration, expected: u32| found.as_micros().abs_diff(expected) <= 1;
        assert!(near(settings.t1_5(), t1_5), "{baud}: {:?}", settings.t1_5());
        assert!(near(settings.t3_5(), t3_5), "{baud}: {:?}", settings.t3_5());
    }
    assert_eq!(Settings::DEFAULT.baud, 19_200);
    assert_eq!(Settings::DEFAULT.bits_per_character(), 11);
}

/// The answer comes at t3.5 after the last stop bit, not before, and the deadline says so. It is made when t1.5 and a
/// character have passed, when nothing that begins can belong to the request any more.
#[test]
fn the_answer_comes_when_the_silence_is_over() {
    for (baud, character, t3_5, half_bit) in [(19_200, 573, 2_006, 27), (115_200, 96, 1_750, 5)] {
        let mut bench = Bench::with(settings(baud, Parity::Even, StopBits::One), character, t3_5);
        for byte in sealed(&REQUEST) {
            bench.character(byte, LineErrors::NONE);
        }
        let due = bench.now + half_bit + t3_5;
        let made = bench.server.poll_at().expect("a deadline").as_micros();
        let t1_5 = if baud == 19_200 { 860 } else { 750 };
        assert!((bench.now + t1_5 + character..due).contains(&made), "{made}");
        let looks = bench.host.begun;
        assert!(bench.server.poll(Instant::from_micros(made - 1), &mut bench.host).is_none());
        assert_eq!(bench.host.begun, looks);
        assert!(bench.server.poll(Instant::from_micros(made), &mut bench.host).is_none());
        assert_eq!(bench.host.begun, looks + 1);
        let at = bench.server.poll_at().expect("a deadline").as_micros();
        assert!(at.abs_diff(due) <= 1, "{at} instead of {due}");
        assert!(bench.server.poll(Instant::from_micros(at - 1), &mut bench.host).is_none());
        assert_eq!(bench.server.poll(Instant::from_micros(at), &mut bench.host).map(<[u8]>::len), Some(7));
        bench.server.sent(Instant::from_micros(at + 7 * character));
        assert_eq!(bench.server.poll_at(), None, "nothing to wait for");
    }
}

/// What comes after a request and before t3.5 spoils it, whether its answer is made already or not.
#[test]
fn an_answer_that_was_made_is_dropped_with_its_request() {
    let frame = sealed(&REQUEST);
    for pause in [900, 1_200, 1_600, 1_900] {
        let mut bench = Bench::new();
        for &byte in &frame {
            bench.character(byte, LineErrors::NONE);
        }
        assert_eq!(bench.pause(pause), None);
        assert_eq!(bench.raw(&frame), None, "after {pause} us");
        let counters = *bench.server.counters();
        assert_eq!((counters.errors, counters.messages, counters.requests), (1, 0, 0), "after {pause} us");
        // Whatever it was, the next one is answered.
        assert!(bench.raw(&frame).is_some());
    }
}

/// The server is not called at the first deadline: the answer is made at the second.
#[test]
fn nothing_is_lost_if_the_first_call_comes_at_the_end() {
    let mut bench = Bench::new();
    for byte in sealed(&REQUEST) {
        bench.character(byte, LineErrors::NONE);
    }
    let late = Instant::from_micros(bench.now + 27 + 2_006);
    assert_eq!(bench.server.poll(late, &mut bench.host).map(<[u8]>::len), Some(7));
    let counters = bench.server.counters();
    assert_eq!((counters.messages, counters.requests), (1, 1));
}

/// A request that writes is not carried out before t3.5 is over: until then it may turn out to be none.
#[test]
fn nothing_is_written_before_the_silence_is_over() {
    let mut bench = Bench::new();
    for byte in sealed(&[ADDRESS, 6, 0x18, 0x05, 0, 1]) {
        bench.character(byte, LineErrors::NONE);
    }
    let at = bench.server.poll_at().expect("a deadline").as_micros();
    assert!(at.abs_diff(bench.now + 27 + 2_006) <= 1, "{at}");
}

/// A pause within a frame, by the specification. What USB adapters do is in `adapters.rs`.
#[test]
fn pauses() {
    let frame = sealed(&REQUEST);
    for position in 1..frame.len() {
        let with_pause = |pause: u64| {
            let mut bench = Bench::with(Settings { pauses: Pauses::Strict, ..SETTINGS }, 573, 2_006);
            for &byte in &frame[..position] {
                bench.character(byte, LineErrors::NONE);
            }
            let early = bench.pause(pause);
            assert_eq!(early, None);
            let answer = bench.raw(&frame[position..]);
            // Whatever it was, the next one is answered.
            assert!(bench.raw(&frame).is_some());
            (answer.is_some(), bench.server.counters().errors)
        };
        assert_eq!(with_pause(0), (true, 0));
        // t1.5 is allowed,
        assert_eq!(with_pause(859), (true, 0), "{position}");
        // two characters are not: one fault, for the whole of it.
        assert_eq!(with_pause(1_146), (false, 1), "{position}");
        assert_eq!(with_pause(1_900), (false, 1), "{position}");
        // After t3.5 it is two frames, both bad.
        let (answered, errors) = with_pause(2_100);
        assert_eq!((answered, errors), (false, 2), "{position}");
    }
}

/// Misread characters; noise alone does not count.
#[test]
fn error_flags() {
    let frame = sealed(&REQUEST);
    for errors in [LineErrors::FRAMING, LineErrors::PARITY, LineErrors::OVERRUN] {
        for spoilt in 0..frame.len() {
            let mut bench = Bench::new();
            for (index, &byte) in frame.iter().enumerate() {
                bench.character(byte, if index == spoilt { errors } else { LineErrors::NONE });
            }
            assert_eq!(bench.pause(5_000), None);
            assert_eq!(bench.server.counters().errors, 1);
            assert_eq!(bench.server.counters().overruns, u16::from(errors == LineErrors::OVERRUN));
            assert!(bench.raw(&frame).is_some());
        }
    }
    let mut bench = Bench::new();
    for &byte in &frame {
        bench.character(byte, LineErrors::NOISE);
    }
    assert!(bench.pause(5_000).is_some());
}

/// Frames for others, of others, and from others to their master.
#[test]
fn only_what_is_for_us_is_answered() {
    let mut bench = Bench::new();
    for address in (0..=255).filter(|&address| address != ADDRESS) {
        assert_eq!(bench.raw(&sealed(&[address, 3, 0, 0, 0, 1])), None, "{address}");
    }
    assert_eq!(bench.server.counters().messages, 255);
    assert_eq!(bench.server.counters().requests, 1, "the broadcast");
}

/// Every frame with one or two wrong bits.
#[test]
fn broken_checksums() {
    let frame = sealed(&REQUEST);
    let mut bench = Bench::new();
    let bits = frame.len() * 8;
    for first in 0..bits {
        for second in first..bits {
            let mut broken = frame.clone();
            broken[first / 8] ^= 1 << (first % 8);
            if second != first {
                broken[second / 8] ^= 1 << (second % 8);
            }
            assert_eq!(bench.raw(&broken), None, "{first} {second}");
        }
    }
    assert_eq!(usize::from(bench.server.counters().errors), bits * (bits + 1) / 2);
}

/// Checksums over frames of all lengths, by the other way to compute them.
#[test]
fn lengths() {
    let mut bench = Bench::new();
    for length in 0..=260_usize {
        let data: Vec<u8> = (0..length).map(|index| (index * 37) as u8).collect();
        // Diagnostic echo: what comes back is what went out.
        let frame = sealed(&[&[ADDRESS, 8, 0, 0], &data[..]].concat());
        let answer = bench.raw(&frame);
        match length {
            0 | 1 => assert_eq!(answer, Some(sealed(&[ADDRESS, 0x88, 3]))),
            _ if frame.len() > 256 => assert_eq!(answer, None, "{length}"),
            _ if length % 2 == 1 => assert_eq!(answer, Some(sealed(&[ADDRESS, 0x88, 3]))),
            _ => assert_eq!(answer, Some(frame)),
        }
    }
    // Shorter than anything that makes sense, each with a right checksum of its own.
    for length in 0..=1 {
        let bytes = &[ADDRESS, 3][..length];
        let crc = crc(bytes);
        let errors = bench.server.counters().errors;
        assert_eq!(bench.raw(&[bytes, &crc.to_le_bytes()].concat()), None);
        assert_eq!(bench.server.counters().errors, errors + 1);
    }
}

/// A frame that is too long by much, in one go; then the next.
#[test]
fn a_flood_is_one_fault() {
    let mut bench = Bench::new();
    assert_eq!(bench.raw(&[0x55; 5_000]), None);
    assert_eq!(bench.server.counters().errors, 1);
    assert!(bench.raw(&sealed(&REQUEST)).is_some());
}

/// While the answer goes out, nothing is heard: not an echo, not another sender.
#[test]
fn deaf_while_it_talks() {
    let mut bench = Bench::new();
    for byte in sealed(&REQUEST) {
        bench.character(byte, LineErrors::NONE);
    }
    let made = bench.server.poll_at().expect("a deadline");
    assert!(bench.server.poll(made, &mut bench.host).is_none());
    let at = bench.server.poll_at().expect("a deadline");
    let answer = bench.server.poll(at, &mut bench.host).expect("an answer").to_vec();
    let mut now = at.as_micros();
    for &byte in &answer {
        now += bench.character;
        // The centre of the stop bit; transmission is complete half a bit later.
        bench.server.heard(Character::clean(byte), Instant::from_micros(now - 26));
    }
    bench.server.sent(Instant::from_micros(now));
    // The last character of the echo may be handed over after that.
    bench.server.heard(Character::clean(0x55), Instant::from_micros(now + 10));
    assert_eq!(bench.server.poll_at(), None);
    assert_eq!(bench.server.counters().errors, 0);
    // A master that does not wait long is heard.
    bench.now = now + 500;
    assert!(bench.raw(&sealed(&REQUEST)).is_some());
}

/// A port that never says that the answer is out does not silence the server.
#[test]
fn a_port_that_forgets() {
    let mut bench = Bench::new();
    for byte in sealed(&REQUEST) {
        bench.character(byte, LineErrors::NONE);
    }
    let made = bench.server.poll_at().expect("a deadline");
    assert!(bench.server.poll(made, &mut bench.host).is_none());
    let at = bench.server.poll_at().expect("a deadline");
    assert!(bench.server.poll(at, &mut bench.host).is_some());
    let again = bench.server.poll_at().expect("a deadline").as_micros() - at.as_micros();
    assert!((7 * bench.character..100_000).contains(&again), "{again}");
    bench.now = at.as_micros() + again;
    assert_eq!(bench.pause(1), None);
    assert!(bench.raw(&sealed(&REQUEST)).is_some());
}

/// What was on its way when the port was switched on is no frame.
#[test]
fn begins_in_the_middle_of_a_frame() {
    let mut server = clino_modbus::Server::new(SETTINGS, IDENTIFICATION, Instant::from_micros(0));
    let mut host = Real::new();
    for (index, &byte) in sealed(&REQUEST).iter().enumerate() {
        server.heard(Character::clean(byte), Instant::from_micros(573 * (index as u64 + 1)));
    }
    let at = server.poll_at().expect("a deadline");
    assert!(server.poll(at, &mut host).is_none());
}

/// The server is called too late, and the next frame is there: the first one is not answered any more.
#[test]
fn too_late_for_an_answer() {
    let mut bench = Bench::new();
    for byte in sealed(&REQUEST) {
        bench.character(byte, LineErrors::NONE);
    }
    bench.now += 50_000;
    let answer = bench.raw(&sealed(&[ADDRESS, 3, 0, 2, 0, 1]));
    assert_eq!(answer, Some(sealed(&[ADDRESS, 3, 2, 0, 2])));
    assert_eq!(bench.server.counters().unanswered, 1);
}
