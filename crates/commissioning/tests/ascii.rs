//! ASCII mode: the pins of a simulated module, and the lines it sends.

use clino_bus::{Duration, Instant};
use clino_codec::ascii::Centidegrees;
use clino_codec::character::Character;
use clino_commissioning::ascii::{Lines, NoLine, OneLine, PinStep, Pins, Step};
use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu, Options};
use clino_sim::motion::Motion;
use clino_sim::node::{Node, Ns};

const US: Ns = 1_000;

/// A module whose RX and RESET pins are driven, and whose TX is heard.
struct Board {
    module: Isu,
    now: Ns,
    rx_low: bool,
    reset_low: bool,
    /// What each pin did, and when, in ms.
    edges: Vec<(&'static str, bool, u64)>,
    /// Characters under way, with the centre of their stop bits.
    under_way: Vec<(Ns, u8)>,
    mute: bool,
}

impl Pins for Board {
    fn rx_low(&mut self, low: bool) {
        self.rx_low = low;
        self.edges.push(("rx", low, self.now / 1_000_000));
        self.module.line_level(self.now, !low);
    }

    /// As power: the document calls a reset the equivalent of one.
    fn reset_low(&mut self, low: bool) {
        self.reset_low = low;
        self.edges.push(("reset", low, self.now / 1_000_000));
        if low { self.module.power_off(self.now) } else { self.module.power_on(self.now) }
    }
}

impl Board {
    fn new(microdegrees: i64) -> Board {
        let eeprom = Eeprom::factory(Content::default(), ChecksumScope::default(), 1);
        let options = Options { motion: Motion::Constant(microdegrees), ..Options::default() };
        Board {
            module: Isu::new(eeprom, options),
            now: 1_000_000_000,
            rx_low: false,
            reset_low: false,
            edges: Vec::new(),
            under_way: Vec::new(),
            mute: false,
        }
    }

    fn now(&self) -> Instant {
        Instant::from_micros(self.now / US)
    }

    /// Runs until a character is complete, at most until `until`.
    fn run(&mut self, until: Instant) -> Option<Character> {
        let until = until.as_micros() * US;
        loop {
            let heard = self.under_way.first().map(|&(at, _)| at);
            let acts = self.module.next_event();
            match [heard, acts].into_iter().flatten().min().filter(|&at| at <= until) {
                None => {
                    self.now = self.now.max(until);
                    return None;
                }
                Some(at) => self.now = self.now.max(at),
            }
            if heard.is_some_and(|at| at <= self.now) {
                let (_, byte) = self.under_way.remove(0);
                return Some(Character::clean(byte));
            }
            if let Some(burst) = self.module.act(self.now).filter(|_| !self.mute) {
                let character = 10_000_000_000 / u64::from(burst.baud) / 10 * 10;
                let ends = (1..).map(|n| burst.start_at + n * character);
                self.under_way.extend(ends.zip(burst.bytes));
            }
        }
    }
}

/// Leads one line to its end.
fn one_line(board: &mut Board, cancel_after: Option<Duration>) -> Result<Centidegrees, NoLine> {
    let mut operation = OneLine::new();
    let begun = board.now();
    loop {
        match operation.next(board.now()) {
            Step::Pin(pin) => pin.apply(board),
            Step::Wait { until } => {
                let stop = cancel_after.map(|after| begun + after).filter(|&at| at > board.now());
                if let Some(character) = board.run(until.min(stop.unwrap_or(until))) {
                    operation.hear(character);
                }
                if stop.is_some_and(|at| board.now() >= at) {
                    operation.cancel();
                }
            }
            Step::Done(result) => return result,
        }
    }
}

#[test]
fn one_pulse_is_one_line() {
    for (microdegrees, centidegrees) in [(124_500_000, 12_450), (-4_310_000, -431), (0, 0)] {
        let mut board = Board::new(microdegrees);
        for _ in 0..3 {
            let line = one_line(&mut board, None).unwrap();
            assert!((line.get() - centidegrees).abs() <= 1, "{line:?}");
        }
        // Low for the documented 100 ms and some, each time.
        let [(_, true, fell), (_, false, rose), ..] = board.edges[..] else { panic!("{:?}", board.edges) };
        assert_eq!((rose - fell, board.edges.len()), (120, 6));
        assert!(!board.rx_low && !board.reset_low);
    }
}

#[test]
fn no_line_is_an_error_after_a_bounded_time() {
    let mut board = Board::new(0);
    board.mute = true;
    let begun = board.now();
    let Err(NoLine::Silent { waited, lines: 0 }) = one_line(&mut board, None) else { panic!() };
    assert_eq!(waited, Duration::from_micros(800_000));
    assert_eq!(board.now().since(begun), Duration::from_micros(800_000));
    assert!(!board.rx_low);
}

#[test]
fn a_bad_line_is_told() {
    let mut operation = OneLine::new();
    assert_eq!(operation.next(Instant::from_micros(0)), Step::Pin(PinStep::RxLow(true)));
    assert_eq!(operation.next(Instant::from_micros(120_000)), Step::Pin(PinStep::RxLow(false)));
    for &byte in b"+ 12x45\r\n" {
        operation.hear(Character::clean(byte));
    }
    let waiting = Step::Wait { until: Instant::from_micros(800_000) };
    assert_eq!(operation.next(Instant::from_micros(130_000)), waiting);
    assert!(matches!(operation.next(Instant::from_micros(800_000)), Step::Done(Err(NoLine::Bad(_)))));
}

#[test]
fn a_cancelled_pulse_is_released() {
    for after in [1, 50, 119].map(Duration::from_millis) {
        let mut board = Board::new(0);
        assert_eq!(one_line(&mut board, Some(after)), Err(NoLine::Cancelled));
        assert_eq!(board.edges.iter().filter(|edge| edge.0 == "rx").count(), 2);
        assert!(!board.rx_low && board.now() <= Instant::from_micros(1_121_000));
    }
}

/// Runs continuous output until this many lines have come.
fn lines(board: &mut Board, wanted: u32) -> (Vec<i16>, Result<u32, NoLine>) {
    let mut operation = Lines::new();
    let mut heard = Vec::new();
    loop {
        match operation.next(board.now()) {
            Step::Pin(pin) => pin.apply(board),
            Step::Wait { until } => {
                if let Some(character) = board.run(until)
                    && let Some(line) = operation.hear(character, board.now())
                {
                    heard.push(line.unwrap().get());
                    if heard.len() == wanted as usize {
                        operation.cancel();
                    }
                }
            }
            Step::Done(result) => return (heard, result),
        }
    }
}

#[test]
fn lines_come_as_long_as_they_are_wanted() {
    let mut board = Board::new(32_700_000);
    let begun = board.now();
    let (heard, result) = lines(&mut board, 5);
    assert_eq!(result, Ok(5));
    assert!(heard.iter().all(|&line| (line - 3_270).abs() <= 1), "{heard:?}");
    // RX is low before the reset begins and until after the last line.
    let pins: Vec<_> = board.edges.iter().map(|&(pin, low, _)| (pin, low)).collect();
    assert_eq!(pins, [("rx", true), ("reset", true), ("reset", false), ("rx", false)]);
    assert_eq!(board.edges[2].2 - board.edges[1].2, 10);
    // Boot, then four pauses of 8/15 s.
    let took = board.now().since(begun).as_millis();
    assert!((2_190..2_300).contains(&took), "{took}");
}

#[test]
fn lines_that_stop_are_an_error_and_the_pins_are_released() {
    let mut board = Board::new(0);
    board.mute = true;
    let (heard, result) = lines(&mut board, 1);
    assert!(heard.is_empty());
    assert_eq!(result, Err(NoLine::Silent { waited: Duration::from_micros(5_000_000), lines: 0 }));
    assert!(!board.rx_low && !board.reset_low);
}

#[test]
fn a_cancel_before_anything_touches_nothing() {
    let mut operation = Lines::new();
    operation.cancel();
    assert_eq!(operation.next(Instant::from_micros(5)), Step::Done(Ok(0)));
    let mut operation = OneLine::new();
    operation.cancel();
    assert_eq!(operation.next(Instant::from_micros(5)), Step::Done(Err(NoLine::Cancelled)));
}

#[test]
fn a_cancel_in_the_reset_ends_the_reset_first() {
    let mut operation = Lines::new();
    assert_eq!(operation.next(Instant::from_micros(0)), Step::Pin(PinStep::RxLow(true)));
    assert_eq!(operation.next(Instant::from_micros(0)), Step::Pin(PinStep::ResetLow(true)));
    operation.cancel();
    assert_eq!(operation.next(Instant::from_micros(1)), Step::Wait { until: Instant::from_micros(10_000) });
    assert_eq!(operation.next(Instant::from_micros(10_000)), Step::Pin(PinStep::ResetLow(false)));
    assert_eq!(operation.next(Instant::from_micros(10_000)), Step::Pin(PinStep::RxLow(false)));
    assert_eq!(operation.next(Instant::from_micros(10_000)), Step::Done(Ok(0)));
}
