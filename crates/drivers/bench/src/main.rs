//! Reads an angle `COUNT` times over a port that answers at once: `clino-drivers-bench t7|isu COUNT`.
//!
//! As in `clino-codec`'s bench, the difference between two counts gives the cost of one.

use std::convert::Infallible;
use std::hint::black_box;
use std::ops::ControlFlow;

use clino_drivers::codec::character::Character;
use clino_drivers::codec::{isu, t7};
use clino_drivers::{Duration, Port, Serial, SttIsu, Timing, UsDigitalT7};

/// The answer of section 2.1.4 of the T7 guide.
const T7_ANSWER: &[u8] = &[0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];
/// 90° from module 3 (AN #201 appendix A, Read RAM).
const ISU_ANSWER: &[u8] = &[0x04, 0x35, 0x58, 0x40, 0x00, 0xCD];

/// A port that has an answer as soon as a frame is out.
struct Script {
    answer: &'static [u8],
    pending: &'static [u8],
}

impl Port for Script {
    type Error = Infallible;

    fn send(&mut self, frame: &[u8]) -> Result<(), Infallible> {
        black_box(frame);
        self.pending = black_box(self.answer);
        Ok(())
    }

    fn listen(
        &mut self,
        _: Duration,
        mut take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        std::mem::take(&mut self.pending)
            .iter()
            .try_for_each(|&byte| take(Character::clean(byte), Duration::ZERO))
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let sensor = arguments.next().expect("a sensor");
    let count: u32 = arguments.next().and_then(|count| count.parse().ok()).expect("a count");
    let port = |answer| Script { answer, pending: &[] };
    match sensor.as_str() {
        "t7" => {
            let mut t7 = UsDigitalT7::new(port(T7_ANSWER), Timing::t7(Serial::T7_DEFAULT));
            let five = t7::Address::new(5).expect("an address");
            for _ in 0..count {
                assert_eq!(black_box(t7.angle(five, t7::Axis::Two)).expect("an angle").mdeg(), -45_313);
            }
        }
        "isu" => {
            let mut isu = SttIsu::new(port(ISU_ANSWER), Timing::isu());
            let three = isu::Address::new(3).expect("an address");
            for _ in 0..count {
                assert_eq!(black_box(isu.angle(three)).expect("an angle").mdeg(), 90_000);
            }
        }
        other => panic!("no sensor {other}"),
    }
}
