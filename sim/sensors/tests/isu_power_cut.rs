//! Power cuts at every character and every EEPROM word of an ISU's address change and null reset, each
//! followed by a repair with nothing but documented commands. Everything the repair needs is computed
//! here.

mod common;

use clino_sim::isu::{Adoption, ChecksumScope, Content, Eeprom, Isu, Mode, Options, Supervision, WORDS};
use clino_sim::node::{Heard, Ns};
use common::{Bench, MS, SECOND, bit};

const SCOPES: [ChecksumScope; 2] = [ChecksumScope::UpperBitsCounted, ChecksumScope::WordsLeftOut];
const CHECKSUM: usize = 0x78;
const SHIFTS: [u8; 8] = [6, 4, 2, 0, 14, 12, 10, 8];

fn message(body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![body.len() as u8];
    bytes.extend_from_slice(body);
    bytes.push(body.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
    bytes
}

fn words_message(function: u8, start: u8, words: &[u16]) -> Vec<u8> {
    let mut body = vec![function, start];
    body.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    message(&body)
}

/// The checksum that a set of words calls for.
fn checksum_of(words: &[u16], scope: ChecksumScope) -> u16 {
    words.iter().enumerate().fold(0, |sum: u16, (i, word)| {
        let own = (CHECKSUM..CHECKSUM + 8).contains(&i);
        match (own, scope) {
            (false, _) => sum.wrapping_add(*word),
            (true, ChecksumScope::UpperBitsCounted) => sum.wrapping_add(*word & 0xFFFC),
            (true, ChecksumScope::WordsLeftOut) => sum,
        }
    })
}

fn encode(old: &[u16], data: u16) -> Vec<u16> {
    old.iter().zip(SHIFTS).map(|(word, shift)| word & 0xFFFC | data >> shift & 3).collect()
}

/// The documented sequence that changes address 0 to 9 (1001): two words, then the checksum.
fn address_change(words: &[u16; WORDS], scope: ChecksumScope) -> Vec<Vec<u8>> {
    let mut next = words.to_vec();
    next[0x48] = next[0x48] & 0xFFFC | 0b10;
    next[0x49] = next[0x49] & 0xFFFC | 0b01;
    let checksum = encode(&words[CHECKSUM..CHECKSUM + 8], checksum_of(&next, scope));
    vec![words_message(0x0A, 0x48, &next[0x48..0x4A]), words_message(0x0A, 0x78, &checksum)]
}

fn module(scope: ChecksumScope, options: Options) -> Bench<Isu> {
    Bench::new(Isu::new(Eeprom::factory(Content::default(), scope, 99), options))
}

/// Plays the messages, each 500 ms after the one before, and cuts the power at `cut`.
fn play_until(bench: &mut Bench<Isu>, messages: &[Vec<u8>], cut: Ns) {
    for (i, bytes) in messages.iter().enumerate() {
        for (k, &byte) in bytes.iter().enumerate() {
            let at = i as Ns * 500 * MS + (k as Ns * 10 + 9) * bit(9_600);
            if at <= cut {
                bench.run_until(at);
                bench.hear(Heard { at, byte, framing_error: false });
            }
        }
    }
    bench.run_until(cut);
    bench.power_cycle(MS, SECOND);
}

fn answer(bench: &mut Bench<Isu>, command: &[u8]) -> Vec<u8> {
    bench.ask_within(command, 3 * SECOND).expect("an answer").bytes
}

/// Soft error state, read all words, put the checksum right, reset.
fn repair(bench: &mut Bench<Isu>, scope: ChecksumScope) {
    assert_eq!(answer(bench, &message(&[0x00])), message(&[0x01]));
    let mut words = Vec::new();
    for start in (0..WORDS).step_by(64) {
        let bytes = answer(bench, &message(&[0x08, start as u8, 64]));
        words.extend(bytes[3..131].chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])));
    }
    let checksum = encode(&words[CHECKSUM..CHECKSUM + 8], checksum_of(&words, scope));
    let bytes = answer(bench, &words_message(0x0A, 0x78, &checksum));
    assert_eq!(bytes, message(&[0x0B, 0x78, 8]));
    assert_eq!(answer(bench, &message(&[0x02])), message(&[0x03]));
    bench.run_for(SECOND);
}

/// Cuts the power at instants through `messages` until `last`, repairs what needs it, and says how often
/// that was.
fn campaign(scope: ChecksumScope, options: &Options, messages: &[Vec<u8>], last: Ns) -> (usize, usize) {
    let (mut broken, mut total) = (0, 0);
    let mut cut = 0;
    while cut <= last {
        let mut bench = module(scope, options.clone());
        let before = *bench.node.eeprom.words();
        play_until(&mut bench, messages, cut);
        let sound = checksum_of(bench.node.eeprom.words(), scope) == bench.node.eeprom.data(0x78);
        assert_eq!(bench.node.mode(), if sound { Mode::Normal } else { Mode::HardError }, "cut at {cut}");
        if !sound {
            broken += 1;
            repair(&mut bench, scope);
        }
        assert_eq!(bench.node.mode(), Mode::Normal, "cut at {cut}");
        assert_eq!(answer(&mut bench, &message(&[0x04, 0x58, 2]))[..3], [4, 5, 0x58]);
        let after = bench.node.eeprom.words();
        assert!(before.iter().zip(after).all(|(a, b)| a & 0xFFFC == b & 0xFFFC), "cut at {cut}");
        total += 1;
        cut += bit(9_600) * 10;
    }
    (broken, total)
}

#[test]
fn address_change_is_repairable_wherever_it_is_cut() {
    for scope in SCOPES {
        for adoption in [Adoption::AtOnce, Adoption::AfterReset] {
            let options = Options { adoption, ..Options::default() };
            let messages = address_change(module(scope, options.clone()).node.eeprom.words(), scope);
            let (broken, total) = campaign(scope, &options, &messages, 700 * MS);
            // The sum is wrong from the first word that changes (18 or 28 ms) to the last that changes in
            // the checksum (at most 602 ms).
            assert!((400..600).contains(&broken), "{broken} of {total}");
        }
    }
}

#[test]
fn null_reset_is_repairable_wherever_it_is_cut() {
    for scope in SCOPES {
        let options =
            Options { motion: clino_sim::motion::Motion::Constant(123_000_000), ..Options::default() };
        let (broken, total) = campaign(scope, &options, &[message(&[0x0C])], 250 * MS);
        assert!((100..200).contains(&broken), "{broken} of {total}");
    }
}

#[test]
fn continuous_supervision_stops_a_sequence_in_the_middle() {
    // Address words at 18 and 28 ms, a new angle and with it the check at 300 ms, checksum at 500 ms.
    let options = Options { supervision: Supervision::Continuous, phase: 300 * MS, ..Options::default() };
    let scope = ChecksumScope::default();
    let mut bench = module(scope, options);
    let messages = address_change(bench.node.eeprom.words(), scope);
    answer(&mut bench, &messages[0]);
    bench.run_until(400 * MS);
    assert_eq!(answer(&mut bench, &messages[1]), message(&[0xF1, 0x0A]));
    repair(&mut bench, scope);
    assert_eq!((bench.node.mode(), bench.node.address()), (Mode::Normal, 9));
}

#[test]
fn a_cut_command_is_forgotten_and_its_rest_begins_nothing() {
    let scope = ChecksumScope::default();
    for heard in 0..5 {
        let mut bench = module(scope, Options::default());
        let command = message(&[0x04, 0x58, 2]);
        bench.send(&command[..heard]);
        // Well within the 400 ms after which the first half would be forgotten anyway.
        bench.power_cycle(MS, 100 * MS);
        assert_eq!(bench.ask_within(&command[heard..], SECOND).is_some(), heard == 0, "{heard} heard");
        bench.run_for(SECOND);
        answer(&mut bench, &command);
    }
}
