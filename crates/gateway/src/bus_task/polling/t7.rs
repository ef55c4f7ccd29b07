//! Polling a T7: one axis by Get Angle, or all there is by Get All Data.
//!
//! An angle is confirmed by Get All Angles, whose answer has another command, another length and the angle in another
//! place: neither a late answer nor the same damage can make the same value of it.
//!
//! A single-axis T7 measures axis 2 and says 0° for the others (T7 guide section 1). So a T7 that is to be read at another
//! axis is asked what it is before its first value, and again when it has not answered for once.

use clino_bus::{Duration, T7};
use clino_codec::t7::{Address, Answer, DecodeError, DeviceInformation, Field, Opcode, Request, Response};

use super::{Content, Poll, PollRules, reply};
use crate::config::Ask;
use crate::slot::{Identity, Sample, Slot, is_one_g};
use crate::{Bus, SlotConfig, Source, Status};

impl Poll for T7 {
    const RULES: PollRules = PollRules {
        bus: Bus::T7,
        // 4.8 %. On a bus that is never idle a dead T7, 2.5 ms a probe, is probed every 52 ms if it is alone, every 1.6 s if
        // it is one of 31.
        probe_share: 21,
        // A command has to arrive within 500 ms (T7 guide, section 1). 520 of ours are that many, and 3 more, if our clock is
        // as fast as a UART can bear (3.3 %).
        silence: Duration::from_millis(520),
        // 0.05°: half of its accuracy.
        resolution: 50_000,
        // A Set command is answered within 25 ms (T7 guide, section 1); one whose answer has not come then may be carried out
        // as late as its answer is still awaited.
        settles: Duration::from_millis(50),
        // It measures all the time.
        repeats: false,
        reply: reply::<T7>,
    };

    fn alters(command: u8) -> bool {
        // Damping changes how fast the angle follows the sensor, not what it means.
        Opcode::new(command).is_some_and(|opcode| opcode.is_set() && opcode != Opcode::SetDamping)
    }

    fn request(slot: &Slot) -> Option<(Address, Request)> {
        let Source::T7 { address, axis } = slot.config.source else { return None };
        let request = match (slot.is_to_confirm(), slot.config.ask) {
            _ if slot.is_to_identify() => Request::GetDeviceInformation,
            (true, _) => Request::GetAllAngles,
            (false, Ask::Angle) => Request::GetAngle(axis),
            (false, Ask::Everything) => Request::GetAllData,
        };
        Some((address, request))
    }

    fn read(answer: &Answer, config: &SlotConfig) -> Content {
        match &answer.response {
            Response::GetDeviceInformation(information) => Content::Identity(identity(information)),
            response => match sample(response, config) {
                Ok(sample) => Content::Sample(sample),
                Err(status) => Content::Nothing(status),
            },
        }
    }

    fn refused(error: &DecodeError) -> Status {
        match error {
            DecodeError::Value { field: Field::Angle, .. } => Status::OutOfRange,
            _ => Status::BadAnswer,
        }
    }
}

fn identity(information: &DeviceInformation) -> Identity {
    if information.is_single_axis() { Identity::SingleAxis } else { Identity::MultiAxis }
}

fn sample(response: &Response, config: &SlotConfig) -> Result<Sample, Status> {
    let Source::T7 { axis, .. } = config.source else { return Err(Status::BadAnswer) };
    let (angle, temperature, one_g, serial) = match response {
        Response::GetAngle { angle, .. } => (*angle, None, None, None),
        Response::GetAllAngles { angles, temperature } => (axis.of(*angles), Some(*temperature), None, None),
        Response::GetAllData { angles, temperature, accelerations, serial } => {
            let one_g = is_one_g(accelerations, config.tolerance);
            (axis.of(*angles), Some(*temperature), Some(one_g), Some(*serial))
        }
        // The decoder lets no other answer through.
        _ => return Err(Status::BadAnswer),
    };
    let angle = angle.angle().ok_or(Status::OutOfRange)?;
    let temperature = temperature.filter(|_| config.ask == Ask::Everything);
    Ok(Sample { angle, temperature: temperature.map(|t| t.centi_celsius()), one_g, serial })
}
