//! A port of one's own; and ports that are worse than any UART.

use std::convert::Infallible;
use std::ops::ControlFlow;

use clino_drivers::codec::angle::Angle;
use clino_drivers::codec::character::Character;
use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::{Duration, Port, Serial, Timing, UsDigitalT7, t7};

/// The answer of device 5, axis 2: −45.313° (T7 guide section 2.1.4).
const ANSWER: [u8; 8] = [0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];

/// A pipe to a device that answers at once.
#[derive(Default)]
struct Pipe {
    sent: Vec<Vec<u8>>,
    pending: Vec<u8>,
}

impl Port for Pipe {
    type Error = Infallible;

    fn send(&mut self, frame: &[u8]) -> Result<(), Infallible> {
        self.sent.push(frame.to_vec());
        self.pending.extend(ANSWER);
        Ok(())
    }

    fn listen(
        &mut self,
        _: Duration,
        mut take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.pending.drain(..).try_for_each(|byte| take(Character::clean(byte), Duration::ZERO))
    }
}

fn driver<P: Port>(port: P) -> UsDigitalT7<P> {
    UsDigitalT7::new(port, Timing::t7(Serial::T7_DEFAULT))
}

fn five() -> Address {
    Address::new(5).unwrap()
}

#[test]
fn any_port_will_do() {
    let mut t7 = driver(Pipe::default());
    assert_eq!(t7.angle(five(), Axis::Two), Ok(Angle::from_mdeg(-45_313).unwrap()));
    assert_eq!(t7.release().sent, [[0x05, 0x01, 0x83]]);
}

/// After this many frames sent, characters come without end, and listening takes no time: a babbling line on a processor
/// too slow for it.
struct Flood {
    after: usize,
    sent: usize,
    characters: u32,
}

impl Port for Flood {
    type Error = Infallible;

    fn send(&mut self, _: &[u8]) -> Result<(), Infallible> {
        self.sent += 1;
        Ok(())
    }

    fn listen(
        &mut self,
        _: Duration,
        mut take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        while self.sent >= self.after {
            self.characters += 1;
            assert!(self.characters < 10_000, "there is no end to it");
            take(Character::clean(0x55), Duration::ZERO)?;
        }
        ControlFlow::Continue(())
    }
}

#[test]
fn every_exchange_ends() {
    let mut t7 = driver(Flood { after: 0, sent: 0, characters: 0 });
    for _ in 0..3 {
        assert_eq!(t7.angle(five(), Axis::Two), Err(t7::Error::LineBusy));
    }
    assert_eq!(t7.release().sent, 0);
    let mut t7 = driver(Flood { after: 1, sent: 0, characters: 0 });
    let error = t7.angle(five(), Axis::Two).unwrap_err();
    assert!(matches!(error, t7::Error::Garbled { .. } | t7::Error::Bad { .. }), "{error:?}");
    for _ in 0..3 {
        assert_eq!(t7.angle(five(), Axis::Two), Err(t7::Error::LineBusy));
    }
    assert_eq!(t7.release().sent, 1);
}
