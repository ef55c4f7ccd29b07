//! Polling an ISU: the angle in its RAM, when it is new.
//!
//! An angle is confirmed by reading the same cell again. That is often the same measurement, which is intended: the
//! line may be at fault, not the sensor. There is only one request for it, so only the time distinguishes the two
//! answers.

use clino_bus::{Duration, Isu};
use clino_codec::isu::{Address, Answer, DecodeError, Function, Request, Response};

use super::{Content, Poll, PollRules, reply};
use crate::slot::{Sample, Slot};
use crate::{Bus, SlotConfig, Source, Status};

impl Poll for Isu {
    const RULES: PollRules = PollRules {
        bus: Bus::Isu,
        // Half. A probe takes 58 ms, so that 13 dead ISUs are each probed every 1.5 s; a living one reads its new angle by
        // that much later.
        probe_share: 2,
        // The message timeout is 400 ms (AN #201 section 4); by a clock that is 3.3 % fast, as for a T7.
        silence: Duration::from_millis(416),
        // 0.05°: nine steps of 360/65536°.
        resolution: 50_000,
        // Until the next refresh it may say the angle before (AN #201 section 4: 533 ms), and longer by its clock.
        settles: Duration::from_millis(600),
        repeats: true,
        reply: reply::<Isu>,
    };

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

    fn read(answer: &Answer, _: &SlotConfig) -> Content {
        match answer.response {
            Response::Error(_) => Content::Nothing(Status::DeviceError),
            _ => match answer.angle() {
                Some(angle) => Content::Sample(Sample::new(angle)),
                None => Content::Nothing(Status::BadAnswer),
            },
        }
    }

    fn refused(_: &DecodeError) -> Status {
        // The angle uses all 65 536 codes: there is no value out of range.
        Status::BadAnswer
    }
}
