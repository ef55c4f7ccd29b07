//! STT ISU: binary protocol and ASCII lines.

mod answer;
mod arguments;
mod ascii;
mod command;
mod eeprom;
mod hunt;
mod memory;
mod names;
mod refusal;
mod request;
mod run;
mod verb;

use clino_codec::isu::{Answer, Request};

use crate::bad::Bad;
use crate::outcome::{DecodeVerdict, Failure};
use crate::{hex, report, stream};
use answer::AnswerObject;
pub use arguments::Tool;
use arguments::{Decode, Encode};
use command::CommandObject;
pub use hunt::Hunt;

pub fn run(tool: Tool) -> Result<DecodeVerdict, Failure> {
    match tool {
        Tool::Decode(Decode { command: true, frames }) => Ok(stream::run(&frames, command_of)?),
        Tool::Decode(Decode { command: false, frames }) => Ok(stream::run(&frames, answer_of)?),
        Tool::Encode(encode) => self::encode(encode),
        Tool::Ascii(lines) => ascii::run(&lines),
        Tool::Verb(verb) => run::run(verb),
    }
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
    let object = AnswerObject(Answer::decode(frame)?);
    Ok(serde_json::to_string(&object).unwrap_or_default())
}

fn command_of(text: &[u8]) -> Result<CommandObject, Bad> {
    Ok(CommandObject(Request::decode(&hex::parse(text)?)?))
}

fn answer_of(text: &[u8]) -> Result<AnswerObject, Bad> {
    Ok(AnswerObject(Answer::decode(&hex::parse(text)?)?))
}

fn encode(arguments: Encode) -> Result<DecodeVerdict, Failure> {
    let Encode { address, command, parameters, even_if_it_bricks_the_module } = arguments;
    let request = parameters.request(command).map_err(Failure::Usage)?;
    let frame = if even_if_it_bricks_the_module {
        request.encode_even_if_it_bricks_the_module(address)
    } else {
        request.encode(address)
    };
    report::frame(frame.map_err(|error| Failure::Usage(refusal::explain(error)))?.as_bytes())
}
