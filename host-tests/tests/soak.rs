//! The shipped image with everything at once and faults by chance: 32 T7 asked as often as the bus can, 14 ISU, 2 PWM
//! inputs, a Modbus master that reads without a pause, commands at the console, one save in the middle.
//!
//! Nodes are unplugged, babble, answer damaged, torn or not at all; the lines are noisy; PWM outputs stand still. In the last
//! fifteen seconds there are no faults. No reset, no wrong angle, no slot that stays away, every Modbus request answered.
//!
//! Two virtual minutes daily; `cargo xtask campaign soak` makes ten of it, `CLINO_SOAK_MINUTES`, with several seeds,
//! `CLINO_SOAK_SEED`.

use std::env;
use std::fmt::Write as _;
use std::path::Path;

use clino_board::console::Line;
use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::image;
use clino_host_tests::modbus;

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000 * MS;
/// Without faults at the end, seconds: the longest away, two to be found, the silence for deaf nodes, and some.
const CALM: u64 = 15;
/// Every slot says something good this often, seconds: longest away 3 s, and the luck of a few faults in a row.
const WINDOW: u64 = 15;
/// FC 04, registers 0x0020 to 0x007F: angles and ages of 32 slots.
const READ: [u8; 5] = [4, 0x00, 0x20, 0x00, 0x60];
/// The shortest run with a whole window, which ends at 30 s, seconds.
const SHORT: u64 = 35;
/// From the beginning of one request to the next: 8 characters, t3.5 and 0.5 ms, 197 characters, t3.5 at 19200 bit/s.
const ROUND: u64 = 123 * MS;
/// The save in the middle may erase a sector: 0.52 s in which the core stands still and requests are not heard.
const LOST_IN_AN_ERASE: u64 = (520 * MS).div_ceil(ROUND) + 1;
/// Of an answer of 96 registers.
const ANSWER: usize = 5 + 2 * 96;

/// Anything that is decided by chance, the same for the same seed (xorshift64*).
struct Chance(u64);

impl Chance {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 16) % limit
    }

    /// Some intervals, `every` seconds on average, up to `most_ms` long, as a scenario writes them.
    fn intervals(&mut self, seconds: u64, every: u64, most_ms: u64, more: &str) -> String {
        let mut text = String::new();
        let mut at = 5_000 + self.below(2_000 * every);
        while at + most_ms < 1_000 * (seconds - CALM) {
            let until = at + 50 + self.below(most_ms - 50);
            write!(text, "{{ from = \"{at}ms\", until = \"{until}ms\"{more} }}, ").expect("text");
            at = until + 1_000 + self.below(2_000 * every);
        }
        format!("[{text}]")
    }
}

fn scenario(seed: u64, seconds: u64) -> String {
    let mut chance = Chance(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let calm = seconds - CALM;
    let mut text = format!("seed = {seed}\nduration = \"{seconds}s\"\n");
    for (bus, errors, drops) in [("t7", "2e-7", "1e-6"), ("isu", "1e-6", "1e-5")] {
        writeln!(
            text,
            "[segments.{bus}]\nnoise = {{ bit_error_rate = {errors}, drop_rate = {drops}, \
             within = {{ from = \"5s\", until = \"{calm}s\" }} }}"
        )
        .expect("text");
    }
    for address in 1..=32u64 {
        let unplugged = chance.intervals(seconds, 240, 3_000, "");
        let babble = if address % 8 == 0 {
            chance.intervals(seconds, 120, 300, ", gap = \"1ms\"")
        } else {
            "[]".into()
        };
        let fault = ["\"bad_checksum\"", "\"silent\"", "{ late = \"3ms\" }", "{ truncated = 5 }"];
        let fault = fault[chance.below(4) as usize];
        let every = 400 + chance.below(800);
        writeln!(
            text,
            "[[t7]]\naddress = {address}\nlatency = {{ min = \"1ms\", max = \"2ms\" }}\n\
             motion.sine = {{ amplitude = {}.0, period = \"{}s\" }}\nunplugged = {unplugged}\nbabble = {babble}",
            5 + chance.below(90),
            20 + chance.below(60)
        )
        .expect("text");
        // The last seconds are without faults, and these are without end: some sensors have none.
        if address % 4 == 0 {
            writeln!(text, "fault = {{ every = {every}, what = {fault} }}").expect("text");
        }
    }
    for address in 1..=14u64 {
        let unplugged = chance.intervals(seconds, 240, 3_000, "");
        writeln!(
            text,
            "[[isu]]\naddress = {address}\nphase = \"{}ms\"\nmotion.ramp.rate = {}.5\nunplugged = {unplugged}",
            chance.below(533),
            chance.below(5)
        )
        .expect("text");
    }
    for channel in 1..=2 {
        let stuck = chance.intervals(seconds, 60, 2_000, ", level = \"low\"");
        writeln!(text, "[[pwm]]\nchannel = {channel}\nmotion.sine = {{ centre = 90.0, amplitude = 60.0, period = \"30s\" }}\nstuck = {stuck}")
            .expect("text");
    }
    let t7 = (0..32).map(|slot| format!("slot {slot} t7 {} -p 0 -s 1000", slot + 1));
    let isu = (32..46).map(|slot| format!("slot {slot} isu {}", slot - 31));
    let pwm = (46..48).map(|slot| format!("slot {slot} pwm {}", slot - 45));
    for (number, line) in t7.chain(isu).chain(pwm).enumerate() {
        writeln!(text, "[[typed]]\nat = \"{}ms\"\nline = \"{line}\"", 10 + 10 * number).expect("text");
    }
    for at in (10..seconds - 1).step_by(10) {
        let line = ["load", "counters 3", "nonsense", "bus isu"][(at / 10 % 4) as usize];
        writeln!(text, "[[typed]]\nat = \"{at}s\"\nline = \"{line}\"").expect("text");
    }
    writeln!(text, "[[typed]]\nat = \"{}s\"\nline = \"save\"", seconds / 2).expect("text");
    writeln!(text, "[[typed]]\nat = \"{}ms\"\nline = \"reset-cause\"", 1_000 * seconds - 1_500)
        .expect("text");
    text
}

/// What a run came to.
struct Soak {
    /// Every console line and every answer on the Modbus port, as one number (FNV-1a).
    digest: u64,
    readings: u64,
    answers: u64,
}

fn soak(seed: u64, seconds: u64) -> Soak {
    let text = scenario(seed, seconds);
    let parsed = Scenario::parse(Path::new("soak"), &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut run = Run::new(image(), &parsed).unwrap_or_else(|error| panic!("{error}"));
    run.remember(2 * SECOND);
    let master = run.modbus();
    let mut digest = 0xCBF2_9CE4_8422_2325u64;
    let (mut asked, mut answers) = (0u64, 0u64);
    let mut said: Vec<Line> = Vec::new();
    let mut before = vec![0; 48];
    let (mut next_window, mut next_request) = (2 * WINDOW, SECOND);
    let mut going = true;
    while going {
        while next_request < (run.now() + SECOND).min((seconds - 2) * SECOND) {
            master.lock().send(next_request, &modbus::frame(&READ));
            next_request += ROUND;
            asked += 1;
        }
        going = run.go_on_by(50 * MS, |line| {
            digest = mix(digest, line.text.as_bytes());
            if !line.text.contains("\"slot\"") {
                said.push(line.clone());
            }
        });
        for answer in master.lock().take_answers() {
            digest = mix(digest, &answer.bytes);
            assert_eq!(answer.bytes.len(), ANSWER, "{answer:?}");
            answers += 1;
        }
        assert_eq!(run.board().stats().resets, 0, "a reset before {} ms", run.now() / MS);
        if run.now() >= next_window * SECOND {
            next_window += WINDOW;
            for (slot, before) in run.checker().slots().iter().zip(&mut before) {
                assert!(slot.ok > *before, "{}: nothing for {WINDOW} s before {next_window}", slot.truth.who);
                *before = slot.ok;
            }
        }
    }
    let (summary, _) = run.summary();
    for slot in run.checker().slots() {
        assert_eq!(slot.wrong, 0, "{}: {:?}", slot.truth.who, slot.wrong_kept);
        let last = slot.last_ok.expect("good readings");
        assert!(last + 2 * SECOND > seconds * SECOND, "{}: last {} ms", slot.truth.who, last / MS);
    }
    assert!(
        answers + LOST_IN_AN_ERASE >= asked && asked > 5 * seconds,
        "{answers} answers to {asked} requests"
    );
    let start = said.iter().find(|line| line.text.contains("\"what\":\"start\"")).expect("an answer");
    assert!(start.text.contains("\"boots\":1"), "{}", start.text);
    assert!(said.iter().any(|line| line.text.contains("\"stored\":\"written\"")), "it was saved");
    let readings = run.checker().slots().iter().map(|slot| slot.readings).sum();
    println!("seed {seed}, {seconds} s: {readings} readings, {answers} Modbus answers, digest {digest:016x}");
    println!("{summary}");
    Soak { digest, readings, answers }
}

fn mix(digest: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(digest, |digest, byte| (digest ^ u64::from(*byte)).wrapping_mul(0x100_0000_01B3))
}

fn number(name: &str, usual: u64) -> u64 {
    env::var(name).map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{name} is a number")))
}

#[test]
fn everything_at_once() {
    let soak = soak(number("CLINO_SOAK_SEED", 1), 60 * number("CLINO_SOAK_MINUTES", 2));
    assert!(soak.readings > 0 && soak.answers > 0);
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let first = soak(7, SHORT);
    assert_eq!(soak(7, SHORT).digest, first.digest);
}
