//! What a protocol has to say for its nodes to be polled: the request for a slot, the value in the answer, and its figures.

use clino_bus::{Duration, Instant, Protocol};

use crate::schedule::Turn;
use crate::schedule::queue::Asked;
use crate::slot::{Identity, Sample, Slot};
use crate::{Bus, SlotConfig, Status};

mod isu;
mod t7;

/// What makes a slot pollable with protocol `P`: the request, and the angle in its answer.
pub(crate) trait Poll: Protocol {
    const BUS: Bus;
    /// Dead nodes together get one part in this many of the bus.
    const PROBE_SHARE: u32;
    /// After this silence every node takes the next character for the beginning of a request, whatever it has taken
    /// noise for; zero if that is not known.
    const SILENCE: Duration;
    /// Two angles this close are the same, in µ°.
    const RESOLUTION: u32;
    /// From the end of an exchange that may change what a node says to the last instant at which it does.
    const SETTLES: Duration;
    /// Whether a request with this command may change what the node's angle means.
    fn alters(command: u8) -> bool;
    /// The request that reads a slot. One that confirms differs from the first, if the protocol has two that say the
    /// same.
    fn request(slot: &Slot) -> Option<(Self::Address, Self::Request)>;
    /// The sensor's identity, if the answer carries that and not a value.
    fn identity(_: &Self::Answer) -> Option<Identity> {
        None
    }
    fn sample(answer: &Self::Answer, config: &SlotConfig) -> Result<Sample, Status>;
    /// What a refused answer says about the slot.
    fn refused(error: &Self::DecodeError) -> Status;
    /// A good reading ended at `at`: returns whether the sensor has measured anew, and may change when the slot is due.
    fn note(turn: &mut Turn, config: &SlotConfig, sample: &Sample, asked: &Asked, at: Instant) -> bool;
    /// Address and command in a request.
    fn named(frame: &[u8]) -> (u8, u8);
}
