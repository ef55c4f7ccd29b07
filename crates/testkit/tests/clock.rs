//! A gateway whose clock is off: how far it still talks to its sensors, and that it never takes a wrong value for a right one.
//!
//! What it calls a microsecond is off, and so are its bits. The sensors are right, sample in the middle of each bit, and are
//! as slow as their documents allow. The limit of the line alone is half a bit in nine and a half, 5.3 %.

use clino_bus::{Instant, Isu, Protocol, Serial, T7, Timing};
use clino_codec::t7::Axis;
use clino_codec::{isu, t7};
use clino_segment::{Noise, SegmentSettings, Station, chance::Chance};
use clino_sim::isu::{ChecksumScope, Content, Eeprom};
use clino_sim::motion::Motion;
use clino_testkit::rig::{Bench, sensor};

const ASKED: usize = 20;
/// By how much a USART's clock and the sender's may differ (RM0090 section 30.3.5), in parts per million.
const UART_TOLERANCE: i32 = 33_300;
/// All that the internal oscillator can be off (DS8626 table 39), either way.
const WORST: i32 = 80_000;

fn bench<P: Protocol>(timing: Timing, station: Station, ppm: i32) -> Bench<P> {
    let settings = SegmentSettings { chance: Chance::new(1), echo: false, noise: Noise::default() };
    let mut bench = Bench::new(timing, settings, vec![station]);
    bench.port.set_clock_error(ppm);
    // The sensors have started.
    bench.run_until(Instant::from_micros(1_000_000));
    bench
}

/// Right answers of a T7 at 54.321°, of [`ASKED`].
fn t7((baud, baud_index): (u32, u8), ppm: i32) -> usize {
    let motion = [const { Motion::Constant(54_321_000) }; 3];
    let options = clino_sim::t7::Options { motion, ..Default::default() };
    let stored = clino_sim::t7::StoredSettings { address: 5, baud_index, ..Default::default() };
    let node = clino_sim::t7::T7::new(clino_sim::t7::Identity::default(), stored, options).unwrap();
    let mut bench = bench::<T7>(Timing::t7(Serial { baud }), sensor("t7-5", Box::new(node)), ppm);
    let address = t7::Address::new(5).unwrap();
    let ask = |_: &usize| {
        let outcome = bench.ask(address, &t7::Request::GetAngle(Axis::Two));
        bench.settle();
        let Ok(answer) = outcome.result else { return false };
        let t7::Response::GetAngle { angle, .. } = answer.response else { panic!("{answer:?}") };
        assert_eq!(angle, t7::Millidegrees(54_321), "at {ppm} ppm");
        true
    };
    (0..ASKED).filter(ask).count()
}

/// Right answers of an ISU at 40°, of [`ASKED`].
fn isu(ppm: i32) -> usize {
    let content = Content { address: 3, ..Content::default() };
    let eeprom = Eeprom::factory(content, ChecksumScope::default(), 1);
    let options = clino_sim::isu::Options { motion: Motion::Constant(40_000_000), ..Default::default() };
    let node = clino_sim::isu::Isu::new(eeprom, options);
    let mut bench = bench::<Isu>(Timing::isu(), sensor("isu-3", Box::new(node)), ppm);
    let address = isu::Address::new(3).unwrap();
    let ask = |_: &usize| {
        let outcome = bench.ask(address, &isu::Request::READ_ANGLE);
        bench.settle();
        let Ok(answer) = outcome.result else { return false };
        let angle = answer.angle().expect("an angle").mdeg();
        assert!((angle - 40_000).abs() <= 6, "{angle} at {ppm} ppm");
        true
    };
    (0..ASKED).filter(ask).count()
}

/// Asks at every error up to the worst: all answers are right as far as a UART goes, and none is wrong beyond. Returns the
/// errors between which every answer came.
fn sweep(ask: impl Fn(i32) -> usize) -> (i32, i32) {
    let errors = (-WORST..=WORST).step_by(1_000);
    let well: Vec<i32> = errors.filter(|&ppm| ask(ppm) == ASKED).collect();
    let (&slowest, &fastest) = (well.first().expect("a right clock"), well.last().expect("a right clock"));
    assert_eq!(well.len() as i32, (fastest - slowest) / 1_000 + 1, "no gap in {well:?}");
    assert!(slowest <= -UART_TOLERANCE && fastest >= UART_TOLERANCE, "{slowest} to {fastest} ppm");
    assert!(slowest > -WORST && fastest < WORST, "the line has a limit: {slowest} to {fastest} ppm");
    (slowest, fastest)
}

#[test]
fn a_t7_is_read_within_what_a_uart_can_take_and_never_wrong() {
    // Rates and their codes: T7 guide section 2.7.2.
    for rate in [(115_200, 0), (9_600, 4)] {
        let (slowest, fastest) = sweep(|ppm| t7(rate, ppm));
        println!("T7 at {} bit/s: every answer with a clock {slowest} to {fastest} ppm fast", rate.0);
    }
}

#[test]
fn an_isu_is_read_within_what_a_uart_can_take_and_never_wrong() {
    let (slowest, fastest) = sweep(isu);
    println!("ISU: every answer with a clock {slowest} to {fastest} ppm fast");
}
