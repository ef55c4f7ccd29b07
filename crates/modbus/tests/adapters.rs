//! Requests as USB adapters send them: in packets, with pauses of any length below t3.5 between any two characters.

mod common;

use clino_codec::character::LineErrors;
use clino_modbus::settings::{Parity, Pauses, Settings, StopBits};
use common::{ADDRESS, Bench, SETTINGS, sealed, write_request};

/// Bit rate, a character of eleven bits and t3.5, µs; from MODBUS over Serial Line V1.02, section 2.5.1.1.
const RATES: [(u32, u64, u64); 3] = [(9_600, 1_146, 4_011), (19_200, 573, 2_006), (115_200, 96, 1_750)];

fn bench(baud: u32, pauses: Pauses) -> Bench {
    let &(_, character, t3_5) = RATES.iter().find(|rate| rate.0 == baud).expect("a rate of the table");
    let settings = Settings { baud, parity: Parity::Even, stop_bits: StopBits::One, pauses, ..SETTINGS };
    Bench::with(settings, character, t3_5)
}

fn requests() -> Vec<Vec<u8>> {
    let pdus = [
        vec![3, 0, 0, 0, 1],
        vec![4, 0, 0x20, 0, 0x60],
        vec![6, 0x10, 0, 0, 0],
        write_request(0x1004, &[0, 77]),
        vec![8, 0, 0, 0xA5, 0x37],
        vec![43, 14, 1, 0],
    ];
    pdus.map(|pdu| sealed(&[&[ADDRESS], &pdu[..]].concat())).into()
}

/// Cut at every byte, with every pause up to t3.5 in steps of 50 µs, the last one just below it.
#[test]
fn a_pause_anywhere() {
    for (baud, _, t3_5) in RATES {
        for request in requests() {
            let expected = bench(baud, Pauses::Tolerant).raw(&request).expect("an answer");
            for cut in 1..request.len() {
                for pause in (0..t3_5 - 10).step_by(50).chain([t3_5 - 10]) {
                    let mut bench = bench(baud, Pauses::Tolerant);
                    request[..cut].iter().for_each(|&byte| bench.character(byte, LineErrors::NONE));
                    bench.now += pause;
                    let said = bench.raw(&request[cut..]);
                    assert_eq!(said.as_ref(), Some(&expected), "{baud}: {pause} us before byte {cut}");
                    assert_eq!(bench.server.counters().errors, 0);
                }
            }
        }
    }
}

/// The server is called at each of its deadlines meanwhile, as it is on the board.
#[test]
fn a_pause_in_which_the_server_runs() {
    for (baud, _, t3_5) in RATES {
        for request in requests() {
            for cut in 1..request.len() {
                for pause in (0..t3_5 - 10).step_by(50).chain([t3_5 - 10]) {
                    let mut bench = bench(baud, Pauses::Tolerant);
                    request[..cut].iter().for_each(|&byte| bench.character(byte, LineErrors::NONE));
                    // Its deadlines until the next character is whole.
                    let begins = bench.now + pause;
                    assert_eq!(bench.pause(pause + bench.character - 1), None);
                    bench.now = begins;
                    assert!(bench.raw(&request[cut..]).is_some(), "{baud}: {pause} us before byte {cut}");
                    assert_eq!(bench.server.counters().errors, 0);
                }
            }
        }
    }
}

/// A pause before every character.
#[test]
fn pauses_everywhere() {
    for (baud, _, t3_5) in RATES {
        for request in requests() {
            for pause in [t3_5 / 4, t3_5 / 2, 1_000, t3_5 - 10] {
                let mut bench = bench(baud, Pauses::Tolerant);
                for &byte in &request {
                    assert_eq!(bench.pause(pause), None);
                    bench.character(byte, LineErrors::NONE);
                }
                assert!(bench.pause(bench.over()).is_some(), "{baud}: {pause} us");
            }
        }
    }
}

/// Longer than t3.5: two frames, neither of them one.
#[test]
fn a_longer_pause_ends_the_frame() {
    for (baud, _, t3_5) in RATES {
        for pauses in [Pauses::Tolerant, Pauses::Strict] {
            for request in requests() {
                for cut in 1..request.len() {
                    for pause in [t3_5 + 10, t3_5 + 200, 2 * t3_5, 50_000] {
                        let mut bench = bench(baud, pauses);
                        request[..cut].iter().for_each(|&byte| bench.character(byte, LineErrors::NONE));
                        assert_eq!(bench.pause(pause), None);
                        assert_eq!(bench.raw(&request[cut..]), None, "{baud}: {pause} us before byte {cut}");
                        assert_eq!(bench.server.counters().errors, 2);
                        assert!(bench.host.writes.is_empty());
                        assert!(bench.raw(&request).is_some());
                    }
                }
            }
        }
    }
}

/// The standard as a setting: t1.5 and no more.
#[test]
fn strict() {
    for (baud, character, t3_5) in RATES {
        let t1_5 = if baud > 19_200 { 750 } else { character * 3 / 2 };
        let request = &requests()[0];
        for cut in 1..request.len() {
            for (pause, answered) in [(t1_5, true), (t1_5 + 170, false), (t3_5 - 10, false)] {
                let mut bench = bench(baud, Pauses::Strict);
                request[..cut].iter().for_each(|&byte| bench.character(byte, LineErrors::NONE));
                assert_eq!(bench.pause(pause), None);
                assert_eq!(bench.raw(&request[cut..]).is_some(), answered, "{baud}: {pause} us");
            }
        }
    }
}

/// The answer to a whole request still goes out at t3.5, not later.
#[test]
fn tolerance_costs_no_time() {
    for (baud, _, t3_5) in RATES {
        for pauses in [Pauses::Tolerant, Pauses::Strict] {
            let mut bench = bench(baud, pauses);
            requests()[0].iter().for_each(|&byte| bench.character(byte, LineErrors::NONE));
            let end = bench.now;
            let mut at = 0;
            while let Some(next) = bench.server.poll_at().filter(|_| at == 0) {
                if bench.server.poll(next, &mut bench.host).is_some() {
                    at = next.as_micros();
                }
            }
            let half_bit = u64::from(500_000_u32.div_ceil(baud));
            assert!((at - end - half_bit).abs_diff(t3_5) <= 2, "{baud}: {} us", at - end);
        }
    }
}
