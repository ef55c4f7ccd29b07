//! What the [`Master`](crate::Master) has to know of a vendor's protocol.

use clino_codec::Progress;
use clino_codec::character::Character;

use crate::{Micros, Timing};

mod isu;
mod t7;

pub use isu::Isu;
pub use t7::T7;

/// A request/response protocol with one master.
pub trait Protocol {
    /// Who is asked.
    type Address: Copy;
    /// What is asked.
    type Request;
    /// What comes back.
    type Answer;
    /// The request cannot be put into a frame.
    type EncodeError;
    /// What came back is not the answer.
    type DecodeError: Clone;
    /// A request as bytes.
    type Frame: AsRef<[u8]>;
    /// Turns characters into the answer.
    type Decoder;

    /// The frame to send.
    fn encode(address: Self::Address, request: &Self::Request) -> Result<Self::Frame, Self::EncodeError>;

    /// A decoder that waits for the answer to `request` and nothing else.
    fn decoder(address: Self::Address, request: &Self::Request) -> Self::Decoder;

    /// Feeds the decoder.
    fn push(decoder: &mut Self::Decoder, character: Character) -> Progress<Self::Answer, Self::DecodeError>;

    /// The answer's time is over: settles what the decoder still holds back. To be called until it says `More`.
    fn idle(decoder: &mut Self::Decoder) -> Progress<Self::Answer, Self::DecodeError>;

    /// Characters the decoder passed over because they belong to no frame, since it was made.
    fn junk(decoder: &Self::Decoder) -> u32;

    /// Longest time from our last stop bit to the answer's first start bit.
    fn latency(request: &Self::Request, timing: &Timing) -> Micros;
}
