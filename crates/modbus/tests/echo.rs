//! Echo storm: a line that brings back all that the gateway sends, at once or up to half a second later.
//!
//! One request is answered by one frame at most, and what the master has written stays as it has written it.

mod common;

use std::collections::BTreeMap;

use clino_bus::Instant;
use clino_bus::line::EchoMode;
use clino_codec::character::Character;
use clino_modbus::Server;
use clino_modbus::settings::Settings;
use common::real::Real;
use common::{ADDRESS, IDENTIFICATION, SETTINGS, sealed, write_request};

const MS: u64 = 1_000;
const MODES: [EchoMode; 3] = [EchoMode::Off, EchoMode::Expected, EchoMode::Detect];
/// Within a character, a frame, t3.5, a master's pause; what radio links and store-and-forward servers take.
const DELAYS_US: [u64; 22] = [
    0, 1, 30, 200, 573, 700, 1_000, 2_000, 2_500, 4_000, 5_000, 7_000, 10_000, 15_000, 20_000, 33_000,
    50_000, 100_000, 200_000, 300_000, 400_000, 500_000,
];

/// A server on a line that repeats what it says, in virtual time.
struct Air {
    server: Server,
    host: Real,
    now: u64,
    character: u64,
    /// Each character of the gateway comes back so much later, µs, so often.
    echoes: Vec<u64>,
    /// The centres of the stop bits of what will be heard.
    heard: BTreeMap<u64, Vec<u8>>,
    /// The end of the answer that is going out.
    sending: Option<u64>,
    frames: Vec<Vec<u8>>,
}

impl Air {
    fn new(echo: EchoMode, echoes: &[u64]) -> Air {
        Air::at(Settings { echo, ..SETTINGS }, 573, echoes)
    }

    fn at(settings: Settings, character: u64, echoes: &[u64]) -> Air {
        let mut air = Air {
            server: Server::new(settings, IDENTIFICATION, Instant::from_micros(0)),
            host: Real::new(),
            now: 0,
            character,
            echoes: echoes.to_vec(),
            heard: BTreeMap::new(),
            sending: None,
            frames: Vec::new(),
        };
        air.run(20 * MS);
        air
    }

    fn run(&mut self, micros: u64) {
        let end = self.now + micros;
        loop {
            let heard = self.heard.first_key_value().map(|(&at, _)| at);
            let polled = self.server.poll_at().map(|at| at.as_micros().max(self.now));
            let Some(next) =
                [heard, self.sending, polled].into_iter().flatten().min().filter(|&at| at <= end)
            else {
                break;
            };
            self.now = next;
            if heard == Some(next) {
                for byte in self.heard.remove(&next).expect("characters") {
                    self.server.heard(Character::clean(byte), Instant::from_micros(next));
                }
            } else if self.sending == Some(next) {
                self.sending = None;
                self.server.sent(Instant::from_micros(next));
                _ = self.server.reconfigured();
            } else if let Some(answer) = self.server.poll(Instant::from_micros(next), &mut self.host) {
                let answer = answer.to_vec();
                self.sending = Some(next + self.character * answer.len() as u64);
                for (index, &byte) in answer.iter().enumerate() {
                    let centre = next + self.character * (index as u64 + 1) - self.character / 22;
                    for delay in &self.echoes {
                        self.heard.entry(centre + delay).or_default().push(byte);
                    }
                }
                self.frames.push(answer);
            }
        }
        self.now = end;
    }

    /// The master sends a request now.
    fn send(&mut self, pdu: &[u8]) {
        for (index, byte) in sealed(&[&[ADDRESS], pdu].concat()).into_iter().enumerate() {
            let centre = self.now + self.character * (index as u64 + 1) - self.character / 22;
            self.heard.entry(centre).or_default().push(byte);
        }
    }

    /// The same; what is answered within so long.
    fn ask(&mut self, pdu: &[u8], wait: u64) -> Option<Vec<u8>> {
        let before = self.frames.len();
        self.send(pdu);
        self.run(wait);
        self.frames.get(before).cloned()
    }
}

/// Of each function one that works and one that does not.
fn requests() -> Vec<Vec<u8>> {
    vec![
        vec![3, 0, 0x0C, 0, 2],
        vec![4, 0, 0, 0, 1],
        vec![4, 0x0F, 0, 0, 1],
        vec![6, 0x10, 0, 0, 0],
        vec![6, 0x10, 0x02, 0, 7],
        vec![6, 0, 0, 0, 0],
        vec![8, 0, 0, 0xA5, 0x37],
        vec![8, 0, 11, 0, 0],
        vec![8, 0, 13, 0, 0],
        vec![8, 0, 2, 0, 0],
        vec![8, 0, 10, 0, 0],
        write_request(0x1004, &[0, 77]),
        write_request(0x1F00, &[4, 1]),
        write_request(0x1000, &[5, 5]),
        vec![43, 14, 1, 0],
        vec![43, 14, 9, 0],
        vec![99, 1],
        vec![4, 0, 0x20, 0, 96],
    ]
}

/// What the requests write when each is carried out once.
fn once(requests: &[Vec<u8>]) -> Vec<common::real::Written> {
    let mut quiet = Air::new(EchoMode::Off, &[]);
    requests.iter().for_each(|pdu| _ = quiet.ask(pdu, 300 * MS).expect("an answer"));
    assert_eq!(quiet.frames.len(), requests.len());
    quiet.host.writes
}

/// A master that waits: every request is answered by exactly one frame, and carried out once.
#[test]
fn one_frame_for_a_request() {
    let requests = requests();
    let expected = once(&requests);
    for mode in MODES {
        for delay in DELAYS_US {
            let mut air = Air::new(mode, &[delay]);
            for pdu in &requests {
                let before = air.frames.len();
                assert!(air.ask(pdu, 1_500 * MS).is_some(), "{mode:?}, {delay} us: {pdu:02X?}");
                assert_eq!(air.frames.len(), before + 1, "{mode:?}, {delay} us: {pdu:02X?}");
            }
            air.run(20_000 * MS);
            assert_eq!(air.frames.len(), requests.len(), "{mode:?}, {delay} us");
            assert_eq!(air.host.writes, expected, "{mode:?}, {delay} us");
        }
    }
}

/// A master in a hurry: it goes on as soon as it has its answer, while the echoes of the last ones are on their way, and
/// into some of them. Nothing is answered twice, and nothing is carried out twice or in another order.
#[test]
fn a_master_in_a_hurry() {
    let requests = requests();
    let expected = once(&requests);
    for mode in MODES {
        for delay in DELAYS_US {
            for pace in [100 * MS, 170 * MS, 330 * MS] {
                let mut air = Air::new(mode, &[delay]);
                let mut sent = 0;
                for pdu in &requests {
                    let before = air.frames.len();
                    _ = air.ask(pdu, pace);
                    sent += 1;
                    assert!(air.frames.len() <= before + 1, "{mode:?}, {delay} us: {pdu:02X?}");
                }
                air.run(5_000 * MS);
                assert!(air.frames.len() <= sent, "{mode:?}, {delay} us: {} frames", air.frames.len());
                // What is missing was lost in an echo.
                let mut rest = expected.iter();
                let in_order = air.host.writes.iter().all(|write| rest.any(|other| other == write));
                assert!(in_order, "{mode:?}, {delay} us: {:?}", air.host.writes);
            }
        }
    }
}

/// One setting is written with one value after another: the echo of an older one does not bring it back.
#[test]
fn the_last_value_stays() {
    for mode in MODES {
        for delay in DELAYS_US {
            for pace in [25 * MS, 60 * MS, 150 * MS, 400 * MS] {
                let mut air = Air::new(mode, &[delay]);
                // Some are lost in an echo, some are refused because too many have no echo yet.
                let done = |answer: &Vec<u8>| answer[1] == 6;
                let answered: Vec<u8> = (1..=99)
                    .filter(|&address| air.ask(&[6, 0x10, 2, 0, address], pace).as_ref().is_some_and(done))
                    .collect();
                air.run(3_000 * MS);
                let last = *answered.last().expect("some are answered");
                assert_eq!(
                    air.host.config(0).source.address(),
                    last,
                    "{mode:?}, {delay} us, every {pace} us"
                );
                assert_eq!(air.host.writes.len(), answered.len());
            }
        }
    }
}

/// A command that must not be done twice.
#[test]
fn a_command_is_done_once() {
    let key = write_request(0x1F00, &[16, 1, 0, 0, 0x4E56]);
    for command in [key, vec![6, 0x1F, 0, 0, 1]] {
        for delay in DELAYS_US {
            let mut air = Air::new(EchoMode::Off, &[delay]);
            assert!(air.ask(&command, 5_000 * MS).is_some());
            assert_eq!((air.frames.len(), air.host.writes.len()), (1, 1), "{delay} us");
        }
    }
}

/// The answer was lost on its way: the master asks again. On a new line it may be taken for an echo once.
#[test]
fn a_master_that_tries_again() {
    for pdu in [vec![6, 0x10, 2, 0, 7], vec![8, 0, 0, 1, 2], vec![8, 0, 10, 0, 0], vec![6, 0x1F, 0, 0, 1]] {
        for timeout in [50, 200, 300, 500, 900, 1_000, 1_500, 3_000] {
            for delay in [None, Some(0), Some(10 * MS), Some(25 * MS)] {
                let mut air = Air::new(EchoMode::Off, delay.as_slice());
                assert!(air.ask(&pdu, timeout * MS).is_some());
                let tries = (1..).find(|_| air.ask(&pdu, timeout * MS).is_some()).expect("some day");
                assert!(tries <= 2, "{pdu:02X?}: {tries} tries, {timeout} ms, {delay:?} us");
                assert!(tries == 1 || timeout < 1_100, "{pdu:02X?}: {tries} tries, {timeout} ms");
            }
        }
    }
}

/// On a line that is known to be quiet, a master may ask the same thing again at once; nearly always.
#[test]
fn a_quiet_line() {
    for pdu in [vec![6, 0x10, 2, 0, 7], vec![8, 0, 0, 1, 2], vec![8, 0, 13, 0, 0]] {
        let mut air = Air::new(EchoMode::Off, &[]);
        // A read, whose answer would come back if any did.
        assert!(air.ask(&[4, 0, 0, 0, 1], 1_100 * MS).is_some());
        let answered = (0..100).filter(|_| air.ask(&pdu, 30 * MS).is_some()).count();
        assert!(answered >= 88, "{answered} of 100");
        assert_eq!(air.frames.len(), answered + 1);
        // In turn with another one: always.
        let both = [[6, 0x10, 2, 0, 7], [6, 0x10, 2, 0, 8]];
        let mut air = Air::new(EchoMode::Off, &[]);
        assert!(air.ask(&[4, 0, 0, 0, 1], 1_100 * MS).is_some());
        let answered = (0..10).filter(|&turn| air.ask(&both[turn % 2], 30 * MS).is_some()).count();
        assert_eq!(answered, 10);
    }
}

/// A line that was quiet begins to repeat: no storm. The next answer that is none but an answer ends all doubt.
#[test]
fn a_quiet_line_that_begins_to_repeat() {
    for delay in DELAYS_US {
        let mut air = Air::new(EchoMode::Off, &[]);
        for _ in 0..5 {
            assert!(air.ask(&[4, 0, 0, 0, 1], 1_100 * MS).is_some());
        }
        air.echoes = vec![delay];
        let before = air.frames.len();
        assert!(air.ask(&[6, 0x10, 2, 0, 7], 30_000 * MS).is_some());
        assert!(air.frames.len() <= before + 9, "{delay} us: {}", air.frames.len() - before);
        // Now, or as soon as something was read.
        assert!(air.ask(&[4, 0, 0, 0, 1], 1_100 * MS).is_some());
        let before = air.frames.len();
        assert!(air.ask(&[6, 0x10, 2, 0, 8], 30_000 * MS).is_some());
        assert_eq!(air.frames.len(), before + 1, "{delay} us");
    }
}

/// More than one comes back of each answer: as many answers at most, then silence.
#[test]
fn several_echoes() {
    for echoes in [
        vec![50 * MS, 120 * MS],
        vec![100 * MS, 200 * MS, 300 * MS],
        vec![70 * MS, 140 * MS, 210 * MS, 280 * MS],
    ] {
        for pdu in requests() {
            let mut air = Air::new(EchoMode::Off, &echoes);
            assert!(air.ask(&pdu, 60_000 * MS).is_some());
            assert!(air.frames.len() <= echoes.len(), "{pdu:02X?}: {} frames", air.frames.len());
        }
    }
}

/// A receiver that hears its own driver, a little late: with the echo taken off, what follows at once is heard; without,
/// no later than the one after it.
#[test]
fn the_rest_of_an_echo() {
    for mode in MODES {
        // Of an answer of 7 characters, up to all but the first come back after its end.
        for delay in [0, 30, 573, 1_000, 2_000, 3_000] {
            for address in [ADDRESS, 3] {
                let mut air = Air::at(Settings { echo: mode, address, ..SETTINGS }, 573, &[delay]);
                let request = sealed(&[address, 3, 0, 2, 0, 1]);
                let ask = |air: &mut Air| {
                    let before = air.frames.len();
                    for (index, &byte) in request.iter().enumerate() {
                        let centre = air.now + 573 * (index as u64 + 1) - 26;
                        air.heard.entry(centre).or_default().push(byte);
                    }
                    while air.frames.len() == before && air.now % 50_000 < 40_000 {
                        air.run(100);
                    }
                    air.frames.len() > before
                };
                let mut answered = 0;
                for _ in 0..10 {
                    air.now = air.now.next_multiple_of(50_000);
                    air.run(0);
                    answered += usize::from(ask(&mut air));
                    // The rest of the answer, the rest of its echo, and t3.5: the next one follows at once.
                    air.run(7 * 573 + delay + 2_100);
                    answered += usize::from(ask(&mut air));
                    air.run(30_000);
                }
                assert_eq!(answered, 20, "{mode:?}: {delay} us, address {address}");
                let errors = air.server.counters().errors;
                assert!(mode == EchoMode::Off || errors == 0, "{mode:?}: {delay} us: {errors} errors");
                assert_eq!(air.frames.len(), 20);
            }
        }
    }
}
