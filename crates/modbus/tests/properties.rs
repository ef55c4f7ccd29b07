//! Any bytes at any time.
//!
//! The oracle is a second receiver (`common/traffic.rs`).

mod common;

use clino_bus::Instant;
use clino_codec::character::{Character, LineErrors};
use clino_modbus::Server;
use clino_modbus::settings::{Pauses, Settings};
use common::real::{Real, Written};
use common::traffic::{
    BETWEEN, BROKEN, CHARACTER, Heard, WITHIN, check, frames, is_for_us, may_be_echo, play,
};
use common::{ADDRESS, Bench, IDENTIFICATION, SETTINGS, sealed, write_request};
use proptest::prelude::*;

fn flags() -> impl Strategy<Value = LineErrors> {
    prop_oneof![
        20 => Just(LineErrors::NONE),
        1 => Just(LineErrors::FRAMING),
        1 => Just(LineErrors::PARITY),
        1 => Just(LineErrors::OVERRUN),
        1 => Just(LineErrors::NOISE),
    ]
}

/// Silences that leave no doubt what they are.
fn silence() -> impl Strategy<Value = u64> {
    prop_oneof![40 => 0..=WITHIN, 1 => BROKEN..=1_400, 4 => BETWEEN + CHARACTER + 1..=20_000]
}

fn heard() -> impl Strategy<Value = Heard> {
    (silence(), any::<u8>(), flags()).prop_map(|(silence, byte, errors)| Heard { silence, byte, errors })
}

/// A frame with a right checksum, mostly for us, whatever is in it.
fn frame() -> impl Strategy<Value = Vec<Heard>> {
    let function = prop_oneof![Just(3_u8), Just(4), Just(6), Just(8), Just(16), Just(43), any::<u8>()];
    let address = prop_oneof![4 => Just(ADDRESS), 1 => Just(0), 1 => any::<u8>()];
    let data = prop_oneof![
        prop::collection::vec(any::<u8>(), 0..12),
        prop::collection::vec(any::<u8>(), 0..252),
        (any::<u16>(), 0..130_u16)
            .prop_map(|(first, quantity)| { [first.to_be_bytes(), quantity.to_be_bytes()].concat() }),
        (0x1000..0x1020_u16, prop::collection::vec(0..12_u16, 0..20))
            .prop_map(|(first, words)| write_request(first, &words)[1..].to_vec()),
    ];
    (address, function, data, BETWEEN + CHARACTER + 1..30_000_u64).prop_map(
        |(address, function, data, silence)| {
            sealed(&[&[address, function], &data[..]].concat())
                .into_iter()
                .enumerate()
                .map(|(index, byte)| Heard {
                    silence: if index == 0 { silence } else { 0 },
                    byte,
                    errors: LineErrors::NONE,
                })
                .collect()
        },
    )
}

fn traffic() -> impl Strategy<Value = Vec<Heard>> {
    let piece = prop_oneof![frame(), prop::collection::vec(heard(), 1..30)];
    prop::collection::vec(piece, 1..12).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    /// An answer to every frame for us, and to nothing else; every answer is a right one.
    #[test]
    fn answers_are_to_valid_frames(traffic in traffic(), strict in any::<bool>()) {
        let pauses = if strict { Pauses::Strict } else { Pauses::Tolerant };
        let mut bench = Bench::with(Settings { pauses, ..SETTINGS }, CHARACTER, BETWEEN);
        let answers = play(&traffic, &mut bench);
        let frames = frames(&traffic);
        let is_expected = |frame: &usize| is_for_us(&frames[*frame], pauses);
        let may_be_echo = |frame: usize| may_be_echo(&frames[frame], &frames[..frame]);
        let expected: Vec<usize> =
            (0..frames.len()).filter(is_expected).filter(|frame| !may_be_echo(*frame)).collect();
        // The port may have been told to run otherwise: then it has another address, and another ear.
        let moved = bench.host.writes.iter().any(|write| matches!(write, Written::Port));
        let found: Vec<usize> =
            answers.iter().map(|(frame, _)| *frame).filter(|frame| !may_be_echo(*frame)).collect();
        if !moved {
            prop_assert_eq!(found, expected);
        }
        for (frame, answer) in &answers {
            check(answer, &frames[*frame]);
        }
    }

    /// Half of a write is never done: the settings of a slot are as before, or as written.
    #[test]
    fn writes_are_whole(
        first in 0x1000..0x1019_u16,
        words in prop::collection::vec(prop_oneof![0..12_u16, any::<u16>()], 1..22),
    ) {
        let mut bench = Bench::new();
        let before = bench.read(0x1000, 32).expect("settings");
        let result = bench.write(first, &words);
        let after = bench.read(0x1000, 32).expect("settings");
        let offset = usize::from(first - 0x1000);
        let written = offset..offset + words.len();
        if result.is_err() {
            prop_assert_eq!(&after, &before);
        } else {
            prop_assert_eq!(&after[written.clone()], &words[..], "what is acknowledged is there");
            // Another kind brings other settings; a stale limit may follow the period.
            let same_kind = after[1] == before[1];
            for at in (0..32).filter(|at| !written.contains(at) && ![6, 7, 24].contains(at) && same_kind) {
                prop_assert_eq!(after[at], before[at], "{}", at);
            }
        }
        prop_assert_eq!(bench.host.writes.len(), usize::from(result.is_ok()));
    }

    /// Calls in any order at any times: no panic, no deadline that is never over.
    #[test]
    fn any_calls(calls in prop::collection::vec((0..5_u8, any::<u8>(), 0..10_000_u64), 0..600)) {
        let mut server = Server::new(SETTINGS, IDENTIFICATION, Instant::from_micros(0));
        let mut host = Real::new();
        let mut now = 0;
        for (call, byte, later) in calls {
            now += later;
            match call {
                0 | 1 => server.heard(Character::clean(byte), Instant::from_micros(now)),
                2 => server.heard(Character::clean(byte), Instant::from_micros(now.saturating_sub(later * 2))),
                3 => _ = server.poll(Instant::from_micros(now), &mut host),
                _ => server.sent(Instant::from_micros(now)),
            }
            prop_assert!(server.poll_at().is_none_or(|at| at.as_micros() < now + 1_000_000));
        }
        // Whatever it was, the server comes back.
        let mut bench = Bench { server, host, now, character: CHARACTER, t3_5: BETWEEN };
        bench.pause(1_000_000);
        let request = sealed(&[bench.server.settings().address, 3, 0, 2, 0, 1]);
        prop_assert!(bench.raw(&request).is_some());
    }
}

/// A million characters of noise with true frames in between, each answered.
#[test]
fn long_run() {
    let mut bench = Bench::new();
    let mut state = 0x2545_F491_4F6C_DD1D_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let (mut characters, mut asked) = (0, 0);
    while characters < 1_000_000 {
        let length = random() % 300;
        for _ in 0..length {
            let errors = if random().is_multiple_of(16) { LineErrors::FRAMING } else { LineErrors::NONE };
            bench.character((random() >> 32) as u8, errors);
        }
        characters += length;
        assert_eq!(bench.pause(4 * BETWEEN), None, "noise was answered");
        let first = (random() % 0x700) as u16;
        let quantity = (random() % 125 + 1) as u16;
        _ = bench.read(first, quantity);
        asked += 1;
        characters += 8;
    }
    assert_eq!(bench.server.counters().requests, (asked % 65_536) as u16);
    assert!(bench.host.writes.is_empty());
}
