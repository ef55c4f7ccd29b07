//! Polling an ISU: the angle in its RAM, when it is new.
//!
//! An angle is confirmed by reading the same cell again. That is often the same measurement, which is intended: the
//! line may be at fault, not the sensor. There is only one request for it, so only the time distinguishes the two
//! answers.

use clino_bus::{Duration, Instant, Isu};
use clino_codec::isu::{Address, Answer, DecodeError, Function, Request, Response};

use super::Poll;
use crate::schedule::Turn;
use crate::schedule::queue::Asked;
use crate::slot::{Sample, Slot};
use crate::{Bus, SlotConfig, Source, Status};

impl Poll for Isu {
    const BUS: Bus = Bus::Isu;
    /// Half. A probe takes 58 ms, so that 13 dead ISUs are each probed every 1.5 s; a living one reads its new angle by
    /// that much later.
    const PROBE_SHARE: u32 = 2;
    /// The message timeout is 400 ms (AN #201 section 4); by a clock that is 3.3 % fast, as for a T7.
    const SILENCE: Duration = Duration::from_millis(416);
    /// 0.05°: nine steps of 360/65536°.
    const RESOLUTION: u32 = 50_000;
    /// Until the next refresh it may say the angle before (AN #201 section 4: 533 ms), and longer by its clock.
    const SETTLES: Duration = Duration::from_millis(600);

    fn alters(command: u8) -> bool {
        use Function::{ResetModule, ResetNullPosition, WriteEeprom, WriteRam};
        [ResetModule, WriteRam, WriteEeprom, ResetNullPosition]
            .iter()
            .any(|&function| function as u8 == command)
    }

    fn request(slot: &Slot) -> Option<(Address, Request)> {
        match slot.config.source {
            Source::Isu { address } => Some((address, Request::READ_ANGLE)),
            _ => None,
        }
    }

    fn sample(answer: &Answer, _: &SlotConfig) -> Result<Sample, Status> {
        match answer.response {
            Response::Error(_) => Err(Status::DeviceError),
            _ => answer.angle().map(Sample::new).ok_or(Status::BadAnswer),
        }
    }

    fn refused(_: &DecodeError) -> Status {
        // The angle uses all 65 536 codes: there is no value out of range.
        Status::BadAnswer
    }

    fn note(turn: &mut Turn, config: &SlotConfig, sample: &Sample, asked: &Asked, at: Instant) -> bool {
        let fresh = turn.refresh.read(sample.angle.udeg(), asked.released, at);
        if let Some(next) = turn.refresh.next(asked.since, config.period) {
            turn.due = next;
        }
        fresh
    }

    fn named(frame: &[u8]) -> (u8, u8) {
        match *frame {
            [_, head, ..] => (head >> 4, head >> 1 & 0b111),
            _ => (0, 0),
        }
    }
}
