//! US Digital T7.

mod answer;
mod arguments;
mod command;
mod names;
mod refusal;
mod request;
mod run;
mod typed;
mod verb;

use clino_codec::checks::{Checks, ValueRange};
use clino_codec::t7::{Answer, Request};

use crate::bad::Bad;
use crate::outcome::{DecodeVerdict, Failure};
use crate::{hex, report, stream};
use answer::AnswerObject;
pub use arguments::Tool;
use arguments::{Decode, Encode};
use command::CommandObject;
pub use typed::{axis, baud};

pub fn run(tool: Tool) -> Result<DecodeVerdict, Failure> {
    match tool {
        Tool::Decode(decode) => self::decode(&decode),
        Tool::Encode(encode) => self::encode(encode),
        Tool::Verb(verb) => run::run(verb),
    }
}

fn decode(arguments: &Decode) -> Result<DecodeVerdict, Failure> {
    let Decode { command, any_value, ref frames } = *arguments;
    if command {
        return Ok(stream::run(frames, command_of)?);
    }
    let values = if any_value { ValueRange::Off } else { ValueRange::AnyMode };
    let checks = Checks { values, ..Checks::ALL };
    Ok(stream::run(frames, |text| answer_of(text, checks))?)
}

/// A command's frame as JSON.
///
/// # Errors
/// It is none.
pub fn command_json(frame: &[u8]) -> Result<String, Bad> {
    let object = CommandObject(Request::decode(frame)?);
    Ok(serde_json::to_string(&object).unwrap_or_default())
}

/// An answer's frame as JSON.
///
/// # Errors
/// It is none.
pub fn answer_json(frame: &[u8]) -> Result<String, Bad> {
    let object =
        AnswerObject(Answer::decode_with(frame, Checks { values: ValueRange::AnyMode, ..Checks::ALL })?);
    Ok(serde_json::to_string(&object).unwrap_or_default())
}

fn command_of(text: &[u8]) -> Result<CommandObject, Bad> {
    Ok(CommandObject(Request::decode(&hex::parse(text)?)?))
}

fn answer_of(text: &[u8], checks: Checks) -> Result<AnswerObject, Bad> {
    Ok(AnswerObject(Answer::decode_with(&hex::parse(text)?, checks)?))
}

fn encode(arguments: Encode) -> Result<DecodeVerdict, Failure> {
    let Encode { address, command, parameters } = arguments;
    let request = parameters.request(command).map_err(Failure::Usage)?;
    let frame = request.encode(address).map_err(|error| Failure::Usage(refusal::explain(error)))?;
    report::frame(frame.as_bytes())
}
