//! *Altered input* at the shipped image: scripts whose characters are damaged on their way to the receiver.
//!
//! Every line that would write to a sensor is damaged so that the receiver or the console can know of it; of the others one in
//! three is. What the console has to answer follows from what the receiver has sampled and flagged, which the board logs:
//! one `done` for each line that arrived whole, one error for each that did not, in this order. And no sensor is written to.
//!
//! `cargo xtask campaign altered` runs a thousand scripts.

use std::collections::BTreeSet;
use std::env;
use std::fmt::Write as _;

use clino_board::reception::Reception;
use clino_host_tests::{Ran, run};

const MS: u64 = 1_000_000;

/// Scripts in a run.
const SCRIPTS: u64 = 8;
/// When the first line is typed, and how much later each next: an error of 75 characters takes 6.5 ms.
const FROM_MS: u64 = 400;
const EVERY_MS: u64 = 12;

/// What writes to a sensor, or cannot be undone.
const WRITING: [&str; 16] = [
    "t7 zero 1 --yes",
    "t7 zero 13 --yes",
    "t7 offset 3 --yes -- -500",
    "t7 offset 3 500 --yes",
    "t7 direction 1 reversed --yes",
    "t7 damping 3 500 --yes",
    "t7 range 3 unidirectional --yes",
    "t7 address 3 61 --yes",
    "t7 baud 3 9600 --yes",
    "isu zero 1 --yes",
    "isu null 1 1000 --yes",
    "isu address 1 14 --yes",
    "isu reset 1",
    "isu repair 1 --yes",
    "factory-reset --yes",
    "reboot --yes",
];

/// What is answered with `done`, and changes nothing on the buses.
const SETTING: [&str; 8] = [
    "set 0 report 20",
    "set 0 report 2000",
    "set 1 rate 400",
    "set 10 direction reversed",
    "set 12 zero 12.5",
    "set 2 tolerance 0.1",
    "set 3 range unidirectional",
    "set 11 filter mean 5",
];

/// xorshift64*
struct Chance(u64);

impl Chance {
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 16) % most as u64) as usize
    }

    /// What no line has. In front of a line NUL is the rest of the line end before it, and no damage.
    fn unprintable(&mut self, in_front: bool) -> u8 {
        loop {
            let byte = self.below(256) as u8;
            if !(matches!(byte, b' '..=b'~' | b'\r' | b'\n' | 0x03) || in_front && byte == 0) {
                return byte;
            }
        }
    }

    /// Damage to one of the characters of a line that has `length`, without its end; `first` is the number of the first.
    fn damage(&mut self, first: u64, length: usize) -> String {
        let place = self.below(length);
        let at = first + place as u64;
        let effect = match self.below(5) {
            0 => "\"framing_error\"".to_owned(),
            1 => "\"noise\"".to_owned(),
            2 => "\"overrun\"".to_owned(),
            3 => format!("{{ replaced = {} }}", self.unprintable(place == 0)),
            _ => format!("{{ inserted = {} }}", self.unprintable(place == 0)),
        };
        // In a burst now and then, the line end and the next line included.
        let count = if self.below(8) == 0 { 1 + self.below(40) } else { 1 };
        format!("{{ effect = {effect}, character = {at}, count = {count} }},\n")
    }
}

fn scripts(seed: u64) -> Ran {
    let mut chance = Chance(seed);
    let mut scenario = format!(
        "seed = 1\nduration = \"{}ms\"\n\
         t7 = [{{ address = 1, motion.constant = 12.5 }}, {{ address = 3, motion.constant = 0.5 }}]\n\
         isu = [{{ address = 1, motion.constant = 90.0 }}]\n\
         [[typed]]\nat = \"300ms\"\nline = \"json on\"\n",
        FROM_MS + EVERY_MS * 40 * SCRIPTS + 200
    );
    let (mut impairments, mut number) = (String::new(), "json on\r".len() as u64);
    for line in 0..40 * SCRIPTS {
        let writes = chance.below(2) == 0;
        let text =
            if writes { WRITING[chance.below(WRITING.len())] } else { SETTING[chance.below(SETTING.len())] };
        write!(scenario, "[[typed]]\nat = \"{}ms\"\nline = \"{text}\"\n", FROM_MS + EVERY_MS * line)
            .expect("memory");
        if writes {
            impairments += &chance.damage(number, text.len());
        }
        // Anywhere, at the line end, too.
        if chance.below(6) == 0 {
            impairments += &chance.damage(number, text.len() + 1);
        }
        number += text.len() as u64 + 1;
    }
    write!(scenario, "[console]\nimpairment = [\n{impairments}]\n").expect("memory");
    run(&scenario)
}

#[derive(Debug, PartialEq)]
enum Answer {
    Done,
    Damaged,
}

/// What has to be answered, from what was received: the receiver's view, and nothing of the console's.
fn expected(received: &[Reception]) -> Vec<Answer> {
    let mut answers = Vec::new();
    let (mut line, mut damaged, mut after_return) = (Vec::new(), false, false);
    for reception in received.iter().skip_while(|reception| reception.at < FROM_MS * MS) {
        let byte = reception.byte();
        let clean = !(reception.framing || reception.noise || reception.parity || reception.overrun);
        let begins = line.is_empty() && !damaged;
        match byte {
            // CR NUL is one line end.
            0 if clean && begins && after_return => {}
            b'\r' if clean => {
                let text = String::from_utf8(std::mem::take(&mut line)).expect("ASCII");
                assert!(damaged || SETTING.contains(&text.as_str()), "the checker: {text}");
                answers.push(if damaged { Answer::Damaged } else { Answer::Done });
                damaged = false;
            }
            b' '..=b'~' if clean => line.push(byte),
            _ => damaged = true,
        }
        after_return = clean && byte == b'\r';
    }
    answers
}

/// Commands on the buses: the second byte of each request.
fn commands(ran: &Ran, until: u64) -> BTreeSet<(u8, u8)> {
    let of = |bus, polls: &[clino_board::analysis::Poll]| {
        let within = polls.iter().filter(|poll| poll.de_high < until);
        within.filter_map(|poll| Some((bus, *poll.request.get(1)?))).collect::<Vec<_>>()
    };
    of(0, &ran.t7.polls).into_iter().chain(of(1, &ran.isu.polls)).collect()
}

#[test]
fn damaged_lines_are_refused_one_error_each_and_write_to_no_sensor() {
    let runs: u64 = env::var("CLINO_ALTERED_RUNS").ok().and_then(|runs| runs.parse().ok()).unwrap_or(1);
    let (mut done, mut refused) = (0, 0);
    for seed in 1..=runs {
        let ran = scripts(seed);
        let answers: Vec<Answer> = ran
            .lines
            .iter()
            .filter(|line| line.began > FROM_MS * MS)
            .map(|line| match line.text.as_str() {
                "{\"done\":true}" => Answer::Done,
                text if text.contains("damaged_line") || text.contains("line_too_long") => Answer::Damaged,
                text => panic!("seed {seed}: {text}"),
            })
            .collect();
        let expected = expected(&ran.received.console);
        assert_eq!(answers, expected, "seed {seed}");
        done += answers.iter().filter(|answer| **answer == Answer::Done).count();
        refused += answers.len();
        // Polling alone goes over the buses, as before the first line.
        assert_eq!(commands(&ran, u64::MAX), commands(&ran, 300 * MS), "seed {seed}");
        let starts = ran.log.iter().filter(|line| line.starts_with("clino ")).count();
        assert_eq!(starts, 1, "seed {seed}: a reboot");
    }
    refused -= done;
    println!("{} scripts: {done} lines whole and carried out, {refused} refused", runs * SCRIPTS);
    assert!(done > 20 && refused > 20);
}
