//! Finding every device: each address at each bit rate.
//!
//! There is no command that lists devices (Roll Call was removed in version 1.7), so Get Device Information goes to
//! 1–100 and 127 in turn. The line's own rate comes first. Every change of rate is followed by [`RESYNC`]: devices at
//! the new rate have taken the traffic at the old one for beginnings of commands.
//!
//! At the other rates all devices are [called](CALLS) first: they answer at once, on top of each other, and if nothing at
//! all is heard, none is there and the addresses are left out. The rate of the line, where the other devices are at work, is
//! swept without a call.
//!
//! A device that noise has put out of step is deaf for half a second and would be missed: on a bad line ask
//! [more than once](Sweep::passes); then nothing is left out.
//!
//! Whatever happens, the line ends at its own rate, and not before devices there hear again.
//!
//! Source: T7 guide sections 1, 1.1, 1.4, 2.7.1.

use core::convert::Infallible;

use clino_bus::{Duration, ExchangeOutcome, Instant, Serial, T7};
use clino_codec::t7::{Address, Axis, BaudRate, DeviceInformation, Request, Response};

use super::{Fault, RESYNC};
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// Addresses at each rate: 1–100 and 127.
const ADDRESSES: u8 = 101;

/// How often all devices at a rate are called before none is taken to be there: what keeps one from hearing a call is
/// unlikely to keep it from the next two.
const CALLS: u8 = 3;
/// What all devices can answer together: its length value is 6 (section 1.4).
const CALL: Request = Request::GetAngle(Axis::Two);

/// A set of bit rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rates(u8);

impl Rates {
    /// None.
    pub const NONE: Rates = Rates(0);
    /// All five.
    pub const ALL: Rates = Rates(0b1_1111);

    /// These and that one.
    #[must_use]
    pub const fn and(self, rate: BaudRate) -> Rates {
        Rates(self.0 | Self::bit(rate))
    }

    /// Whether that one is among them.
    pub const fn contain(self, rate: BaudRate) -> bool {
        self.0 & Self::bit(rate) != 0
    }

    /// How many there are.
    pub const fn len(self) -> u16 {
        self.0.count_ones() as u16
    }

    /// Whether there are none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    const fn without(self, rate: BaudRate) -> Rates {
        Rates(self.0 & !Self::bit(rate))
    }

    /// That one if it is among them, or the fastest.
    fn first(self, preferred: Option<BaudRate>) -> Option<BaudRate> {
        preferred.into_iter().chain(BaudRate::ALL).find(|&rate| self.contain(rate))
    }

    const fn bit(rate: BaudRate) -> u8 {
        match rate {
            BaudRate::B115200 => 1,
            BaudRate::B57600 => 1 << 1,
            BaudRate::B38400 => 1 << 2,
            BaudRate::B19200 => 1 << 3,
            BaudRate::B9600 => 1 << 4,
        }
    }
}

/// What was found, as it is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Found {
    /// A device.
    Device {
        /// Its address.
        address: Address,
        /// Its bit rate.
        rate: BaudRate,
        /// Its identity.
        information: DeviceInformation,
    },
    /// An answer comes, but never a good one: two devices with one address, or a bad line.
    Suspect {
        /// At which address.
        address: Address,
        /// At which bit rate.
        rate: BaudRate,
        /// The last fault.
        #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
        fault: Fault,
    },
}

/// The end of a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Swept {
    /// Devices found.
    pub devices: u16,
    /// Addresses at which something unintelligible answered.
    pub suspects: u16,
    /// Addresses dealt with, at each rate and in each pass; all of a rate at which nothing answered a call.
    pub asked: u16,
    /// Every rate was dealt with; `false` after a cancel.
    pub complete: bool,
}

/// Asks every address at some bit rates.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    home: Serial,
    /// What the line runs at.
    line: Serial,
    /// Devices at the line's rate may be deaf until then.
    deaf_until: Instant,
    /// Not yet begun.
    rates: Rates,
    passes: u8,
    /// Addresses of this rate that have answered, one bit each.
    answered: u128,
    /// The address being asked; `None` on the way home.
    asking: Option<Asking>,
    of: u16,
    swept: Swept,
}

#[derive(Clone, Copy, Debug)]
struct Asking {
    rate: BaudRate,
    /// Calls to all devices still to come, before the first address is asked.
    calls: u8,
    /// Passes still to come.
    passes: u8,
    /// Which of the addresses.
    index: u8,
    /// Bad answers so far.
    bad: u8,
}

impl Sweep {
    /// `home` is the bit rate at which the line runs, and will again.
    pub fn new(home: Serial, rates: Rates) -> Sweep {
        let mut sweep = Sweep {
            home,
            line: home,
            deaf_until: Instant::ZERO,
            rates,
            passes: 1,
            answered: 0,
            asking: None,
            of: rates.len().saturating_mul(u16::from(ADDRESSES)),
            swept: Swept::default(),
        };
        sweep.next_rate();
        sweep
    }

    /// Asks each silent address this many times, at least once; more than once also where no device has answered to a call.
    /// To be said before the sweep begins.
    #[must_use]
    pub fn passes(mut self, passes: u8) -> Sweep {
        self.passes = passes.max(1);
        self.of = self.of.saturating_mul(u16::from(self.passes));
        if let Some(asking) = &mut self.asking {
            asking.passes = self.passes.saturating_sub(1);
            asking.calls = calls(asking.rate, self.home, self.passes);
        }
        self
    }

    fn next_rate(&mut self) {
        let rate = self.rates.first(BaudRate::from_bits_per_second(self.home.baud));
        self.answered = 0;
        self.asking = rate.map(|rate| {
            self.rates = self.rates.without(rate);
            let calls = calls(rate, self.home, self.passes);
            Asking { rate, calls, passes: self.passes.saturating_sub(1), index: 0, bad: 0 }
        });
    }

    /// The outcome of a call to all devices.
    fn called(&mut self, mut asking: Asking, fault: Option<Fault>) {
        match fault {
            Some(Fault::Over { answers: 0, garbled: 0 }) => asking.calls = asking.calls.saturating_sub(1),
            // Something is there, or it cannot be told whether.
            Some(Fault::Over { .. } | Fault::LineBusy | Fault::NotSent) => asking.calls = 0,
            // One of the answers: the end is still to come.
            _ => return,
        }
        let is_silent = matches!(fault, Some(Fault::Over { answers: 0, garbled: 0 })) && asking.calls == 0;
        self.asking = Some(asking);
        if is_silent {
            self.swept.asked = self.swept.asked.saturating_add(ADDRESSES.into());
            self.next_rate();
        }
    }

    /// The next address that has not answered yet.
    fn next_address(&mut self, Asking { rate, mut passes, mut index, .. }: Asking) {
        loop {
            self.swept.asked = self.swept.asked.saturating_add(1);
            index = index.saturating_add(1);
            if index >= ADDRESSES {
                let Some(left) = passes.checked_sub(1) else { return self.next_rate() };
                (passes, index) = (left, 0);
            }
            if self.answered & bit(index) == 0 {
                self.asking = Some(Asking { rate, calls: 0, passes, index, bad: 0 });
                return;
            }
        }
    }

    fn found(&mut self, asking: Asking, information: DeviceInformation) -> Found {
        self.swept.devices = self.swept.devices.saturating_add(1);
        self.answered |= bit(asking.index);
        self.next_address(asking);
        Found::Device { address: address(asking.index), rate: asking.rate, information }
    }

    /// Silence means that no device is there. Everything else is worth asking again: two devices at one address are unintelligible every
    /// time, noise and a device that took another's address for its own are not.
    fn failed(&mut self, mut asking: Asking, fault: Fault) -> Option<Found> {
        asking.bad = asking.bad.saturating_add(1);
        if matches!(fault, Fault::NoAnswer { .. }) {
            self.next_address(asking);
            None
        } else if asking.bad < READ_TRIES {
            self.asking = Some(asking);
            None
        } else {
            self.swept.suspects = self.swept.suspects.saturating_add(1);
            self.answered |= bit(asking.index);
            self.next_address(asking);
            Some(Found::Suspect { address: address(asking.index), rate: asking.rate, fault })
        }
    }
}

impl Operation for Sweep {
    type Protocol = T7;
    type Event = Found;
    type Report = Swept;
    type Error = Infallible;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        let serial = self.asking.map_or(self.home, |asking| Serial { baud: asking.rate.bits_per_second() });
        if self.line != serial {
            self.line = serial;
            self.deaf_until = now + RESYNC;
            return Step::Serial(serial);
        }
        if now < self.deaf_until {
            return Step::Wait { until: self.deaf_until };
        }
        match self.asking {
            Some(Asking { calls: 1.., .. }) => {
                Step::Collect { address: Address::ALL, request: CALL, window: Duration::ZERO }
            }
            Some(Asking { index, .. }) => {
                Step::Ask { address: address(index), request: Request::GetDeviceInformation, tries: 1 }
            }
            None => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        let swept = Swept { complete: self.swept.asked == self.of, ..self.swept };
        self.asking.is_none().then_some(Ok(swept))
    }

    fn on(&mut self, outcome: &ExchangeOutcome<T7>) -> Option<Found> {
        let asking = self.asking?;
        if asking.calls > 0 {
            self.called(asking, outcome.result.err());
            return None;
        }
        match outcome.result {
            Ok(answer) => match answer.response {
                Response::GetDeviceInformation(information) => Some(self.found(asking, information)),
                _ => None,
            },
            Err(fault) => self.failed(asking, fault),
        }
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress::new(self.swept.asked, self.of)
    }

    fn cancel(&mut self) {
        self.asking = None;
    }

    /// At another rate than the line's own, and until devices at its own hear again.
    fn is_exclusive(&self) -> bool {
        self.line != self.home || (self.asking.is_none() && self.deaf_until > Instant::ZERO)
    }
}

/// How often all devices at this rate are called first.
fn calls(rate: BaudRate, home: Serial, passes: u8) -> u8 {
    let is_home = rate.bits_per_second() == home.baud;
    if is_home || passes > 1 { 0 } else { CALLS }
}

/// The address of that number.
fn address(index: u8) -> Address {
    // 0–99 are the addresses 1–100; the last one is 127.
    Address::new(index.saturating_add(1)).unwrap_or(Address::FACTORY)
}

/// That address among the 101.
#[inline(never)]
fn bit(index: u8) -> u128 {
    1_u128.wrapping_shl(u32::from(index))
}
