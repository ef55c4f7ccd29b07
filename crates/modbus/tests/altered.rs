//! Frames that are not what a master sent: answers, zeros behind and before them, two in one, cut short. None of them
//! changes anything, and none costs a read that can be told.

mod common;

use clino_bus::Instant;
use clino_codec::character::{Character, LineErrors};
use clino_modbus::settings::Settings;
use common::{ADDRESS, Bench, SETTINGS, crc, sealed, write_request};

/// Requests that only read: function and data.
fn reads() -> Vec<Vec<u8>> {
    vec![
        vec![3, 0, 0x0C, 0, 4],
        vec![4, 0, 0x0C, 0, 4],
        // Looks like the beginning of an answer with two, with four bytes.
        vec![4, 2, 0, 0, 2],
        vec![3, 4, 0, 0, 1],
        vec![8, 0, 0, 0xA5, 0x37],
        vec![8, 0, 2, 0, 0],
        vec![8, 0, 11, 0, 0],
        vec![43, 14, 1, 0],
        vec![43, 14, 4, 3],
        // Refused all the same.
        vec![3, 0x0F, 0, 0, 1],
        vec![99, 1, 2],
    ]
}

/// Requests that change something.
fn writes() -> Vec<Vec<u8>> {
    vec![
        vec![6, 0x10, 0, 0, 0],
        write_request(0x1004, &[0, 77]),
        write_request(0x1000, &[0, 2, 3, 1]),
        write_request(0x1F00, &[16, 1, 0, 0, 0x4E56]),
        vec![8, 0, 10, 0, 0],
        vec![8, 0, 1, 0xFF, 0],
    ]
}

/// Row 8 of the issue: a frame with the bit of an exception in its function is an answer.
#[test]
fn exceptions_are_not_answered() {
    let mut bench = Bench::new();
    let mut unanswered = 0;
    for function in 0x80..=0xFF_u8 {
        for data in [&[1][..], &[], &[0, 0, 0, 1], &[0x10, 0, 0, 1, 2, 0, 1], &[14, 1, 0]] {
            assert_eq!(bench.raw(&sealed(&[&[ADDRESS, function], data].concat())), None, "{function:02X}");
            unanswered += 1;
        }
    }
    let counters = bench.server.counters();
    assert_eq!((counters.unanswered, counters.exceptions, counters.errors), (unanswered, 0, 0));
    assert!(bench.host.writes.is_empty());
}

/// Every answer that the server gives, heard again at any time after: none is answered.
#[test]
fn no_answer_is_answered() {
    for pdu in [reads(), writes()].concat() {
        for zeros in 0..4 {
            let mut bench = Bench::new();
            let asked = sealed(&[&[ADDRESS], &pdu[..]].concat());
            let answer = bench.raw(&asked).expect("an answer");
            let writes = bench.host.writes.len();
            let again = [&answer[..], &[0; 3][..zeros]].concat();
            assert_eq!(bench.raw(&again), None, "{again:02X?}");
            assert_eq!(bench.host.writes.len(), writes, "{again:02X?}");
            // The master goes on.
            assert!(bench.raw(&sealed(&[ADDRESS, 4, 0, 0, 0, 1])).is_some());
        }
    }
}

/// All angles, ages, and each register on its own, with any value: the answers look like requests in some places.
#[test]
fn no_reading_of_the_map_is_answered_when_it_comes_back() {
    for quantity in 1..=12_u8 {
        for first in (0..0x0800_u16).step_by(usize::from(quantity)) {
            let mut bench = Bench::new();
            let [high, low] = first.to_be_bytes();
            let answer = bench.raw(&sealed(&[ADDRESS, 3, high, low, 0, quantity])).expect("an answer");
            for zeros in 0..3 {
                let again = [&answer[..], &[0; 3][..zeros]].concat();
                assert_eq!(bench.raw(&again), None, "{again:02X?}");
            }
        }
    }
}

/// Row 13: zeros behind a good frame, which its checksum cannot see: a read is answered as without them, whenever they come
/// within t3.5 and whatever the receiver says of them but that it lost some.
#[test]
fn zeros_behind_a_read_do_not_cost_it() {
    for pdu in reads() {
        let request = sealed(&[&[ADDRESS], &pdu[..]].concat());
        let expected = Bench::new().raw(&request).expect("an answer");
        for zeros in [1, 2, 3, 4, 5, 8, 60] {
            for pause in [0, 700, 1_400, 1_900] {
                for errors in [LineErrors::NONE, LineErrors::FRAMING, LineErrors::PARITY] {
                    let mut bench = Bench::new();
                    for &byte in &request {
                        bench.character(byte, LineErrors::NONE);
                    }
                    for _ in 0..zeros {
                        assert_eq!(bench.pause(pause), None, "too early");
                        bench.character(0, errors);
                    }
                    let said = bench.pause(bench.over());
                    assert_eq!(said.as_ref(), Some(&expected), "{zeros} after {pause} us: {pdu:02X?}");
                    let counters = bench.server.counters();
                    assert_eq!((counters.messages, counters.errors), (1, 0));
                }
            }
        }
    }
}

/// The same behind a write: nothing is carried out, nothing is said; the same frame without them is the next thing to work.
#[test]
fn zeros_behind_a_write_stop_it() {
    for pdu in writes() {
        for address in [ADDRESS, 0] {
            let request = sealed(&[&[address], &pdu[..]].concat());
            for zeros in [1, 2, 3, 4, 5, 8, 60] {
                for pause in [0, 700, 1_900] {
                    let mut bench = Bench::new();
                    bench.ask(&[99]);
                    let slots = bench.host.slots();
                    for &byte in &request {
                        bench.character(byte, LineErrors::NONE);
                    }
                    for _ in 0..zeros {
                        assert_eq!(bench.pause(pause), None);
                        bench.character(0, LineErrors::NONE);
                    }
                    assert_eq!(bench.pause(bench.over()), None, "{zeros}: {pdu:02X?}");
                    assert!(bench.host.writes.is_empty() && bench.host.slots() == slots, "{pdu:02X?}");
                    let counters = bench.server.counters();
                    assert_eq!((counters.exceptions, counters.unanswered, counters.requests), (1, 1, 2));
                    assert_eq!(bench.raw(&request).is_some(), address == ADDRESS);
                }
            }
        }
    }
}

/// Zeros, or anything else, before a frame: its checksum begins with 0xFFFF and sees them.
#[test]
fn what_comes_before_a_frame_spoils_it() {
    for pdu in [reads(), writes()].concat() {
        let request = sealed(&[&[ADDRESS], &pdu[..]].concat());
        for before in [&[0][..], &[0, 0], &[0; 8], &[0xFF], &[0xFF, 0xFF], &[ADDRESS]] {
            let mut bench = Bench::new();
            assert_eq!(bench.raw(&[before, &request[..]].concat()), None);
            assert!(bench.host.writes.is_empty());
            assert_eq!(bench.server.counters().errors, 1);
        }
    }
}

/// Something that is not zero behind a frame, or zeros and then something.
#[test]
fn what_comes_behind_a_frame_spoils_it() {
    for pdu in [reads(), writes()].concat() {
        let request = sealed(&[&[ADDRESS], &pdu[..]].concat());
        for behind in [&[0xFF][..], &[1], &[0, 0xFF], &[0, 0, 0x80, 0]] {
            let mut bench = Bench::new();
            assert_eq!(bench.raw(&[&request[..], behind].concat()), None);
            assert!(bench.host.writes.is_empty());
        }
    }
}

/// Requests whose own last bytes are zeros: they are as long as they should be.
#[test]
fn checksums_that_end_with_zeros() {
    let mut found = [0; 2];
    for value in 0..=0xFFFF_u16 {
        // The period of slot 0, as two registers.
        let [high, low] = value.to_be_bytes();
        let pdu = write_request(0x1004, &[u16::from(high) & 7, u16::from(low)]);
        let request = sealed(&[&[ADDRESS], &pdu[..]].concat());
        let zeros = request.iter().rev().take_while(|&&byte| byte == 0).count();
        if zeros > 0 && found[zeros.min(2) - 1] < 4 {
            found[zeros.min(2) - 1] += 1;
            let mut bench = Bench::new();
            assert!(bench.raw(&request).is_some(), "{request:02X?}");
            assert_eq!(
                bench.host.config(0).period.as_micros(),
                1_000 * ((u32::from(high) & 7) << 16 | u32::from(low))
            );
            // One more is one too many.
            let mut bench = Bench::new();
            assert_eq!(bench.raw(&[&request[..], &[0]].concat()), None);
            assert!(bench.host.writes.is_empty());
        }
    }
    assert!(found[0] > 0, "no request with one zero");
    // Two zeros: a checksum of 0x0000, so that it is right two bytes earlier, too. With any register and value.
    let zero = (0..=u32::MAX).step_by(7).map(|bits| [&[ADDRESS, 6][..], &bits.to_be_bytes()].concat());
    let request = sealed(&zero.into_iter().find(|bytes| crc(bytes) == 0).expect("one in 65536"));
    assert_eq!(request[6..], [0, 0]);
    let answer = Bench::new().raw(&request).expect("an answer");
    assert!(answer == request || answer[1] == 0x86, "{answer:02X?}");
}

/// Two requests without a silence between them, each good: neither is carried out.
#[test]
fn two_in_one() {
    let all = [reads(), writes()].concat();
    for first in &all {
        for second in &all {
            for gap in [0, 800, 1_900] {
                let mut bench = Bench::new();
                for &byte in &sealed(&[&[ADDRESS], &first[..]].concat()) {
                    bench.character(byte, LineErrors::NONE);
                }
                bench.pause(gap);
                assert_eq!(bench.raw(&sealed(&[&[ADDRESS], &second[..]].concat())), None);
                assert!(bench.host.writes.is_empty(), "{first:02X?} {second:02X?}");
            }
        }
    }
}

/// Every beginning and every end of a request, with zeros in place of what is missing, and without.
#[test]
fn cut_short() {
    for pdu in [reads(), writes()].concat() {
        let request = sealed(&[&[ADDRESS], &pdu[..]].concat());
        for length in 0..request.len() {
            for part in [&request[..length], &request[request.len() - length..]] {
                for zeros in [0, 1, 2, 3, request.len() - length] {
                    let mut bench = Bench::new();
                    let said = bench.raw(&[part, &vec![0; zeros][..]].concat());
                    let whole = length + zeros >= request.len()
                        && request[length..].iter().all(|&byte| byte == 0)
                        && request.starts_with(part);
                    assert!(said.is_none() || whole, "{part:02X?} and {zeros} zeros");
                    assert!(bench.host.writes.is_empty() || whole);
                }
            }
        }
    }
}

/// A function 16 whose count of bytes, count of registers and length do not agree, each with a right checksum.
#[test]
fn counts_that_do_not_agree() {
    for bytes in 0..=255_u8 {
        for quantity in [0_u16, 1, 2, 3, 123, 124, 256] {
            for length in [0_usize, 1, 2, 3, 4, 5, 6, 8] {
                if (usize::from(bytes), length) == (2 * usize::from(quantity), usize::from(bytes)) {
                    continue;
                }
                let [high, low] = quantity.to_be_bytes();
                let pdu = [&[16, 0x10, 0x00, high, low, bytes], &[0; 8][..length]].concat();
                let mut bench = Bench::new();
                let said = bench.raw(&sealed(&[&[ADDRESS], &pdu[..]].concat()));
                assert!(bench.host.writes.is_empty(), "{pdu:02X?}");
                if let Some(said) = said {
                    assert_eq!(said[1..3], [0x90, 3], "{pdu:02X?}");
                }
            }
        }
    }
}

/// An answer that is made already when a zero comes goes out t3.5 after that, not before.
#[test]
fn a_late_zero_puts_the_answer_off() {
    let mut bench = Bench::new();
    for byte in sealed(&[ADDRESS, 4, 0, 0x0C, 0, 4]) {
        bench.character(byte, LineErrors::NONE);
    }
    assert_eq!(bench.pause(1_700), None);
    assert_eq!(bench.host.begun, 1, "it is made");
    bench.character(0, LineErrors::FRAMING);
    let at = bench.server.poll_at().expect("a deadline").as_micros();
    assert!(at.abs_diff(bench.now + 27 + 2_006) <= 1, "{at}");
    assert_eq!(bench.server.poll(Instant::from_micros(at), &mut bench.host).map(<[u8]>::len), Some(13));
    // With another character behind it, it was none.
    let mut bench = Bench::new();
    for byte in sealed(&[ADDRESS, 4, 0, 0x0C, 0, 4]) {
        bench.character(byte, LineErrors::NONE);
    }
    assert_eq!(bench.pause(1_700), None);
    bench.server.heard(Character::clean(0), Instant::from_micros(bench.now + 573));
    bench.server.heard(Character::clean(5), Instant::from_micros(bench.now + 1_146));
    bench.now += 1_146;
    assert_eq!(bench.pause(5_000), None);
    assert_eq!(bench.server.counters().errors, 1);
}

/// A locked port reads and changes nothing, not even its own counters or its lock.
#[test]
fn locked() {
    let mut bench = Bench::with(Settings { locked: true, ..SETTINGS }, 573, 2_006);
    bench.ask(&[99]);
    for pdu in writes() {
        assert_eq!(bench.ask(&pdu), [pdu[0] | 0x80, 1], "{pdu:02X?}");
        assert_eq!(bench.raw(&sealed(&[&[0], &pdu[..]].concat())), None);
    }
    // The port's own settings, all of them; a command without a key.
    assert_eq!(bench.write(0x1840, &[18, 0, 0, 9_600, 2]), Err(1));
    assert_eq!(bench.write_one(0x1F00, 1), Err(1));
    assert!(bench.host.writes.is_empty());
    assert_eq!(bench.server.reconfigured(), None);
    assert!(bench.server.counters().exceptions > 8, "not cleared");
    for pdu in reads() {
        let expected = Bench::new().ask(&pdu);
        let said = bench.ask(&pdu);
        assert_eq!(said[0], expected[0], "{pdu:02X?}");
    }
    // Unlocked from elsewhere.
    bench.server.set(SETTINGS, Instant::from_micros(bench.now));
    bench.pause(10_000);
    assert_eq!(bench.write_one(0x1000, 0), Ok(()));
}
