//! Why bytes are no T7 message, or why a command must not be sent.

use clino_codec::t7::{DecodeError, EncodeError};

use super::names;
use crate::bad::Bad;

impl From<DecodeError> for Bad {
    fn from(error: DecodeError) -> Self {
        use DecodeError as E;
        let bad = |kind| Self::new(kind, error);
        match error {
            E::Size { received, expected } => {
                bad("size").with("received", received).with("expected", expected)
            }
            E::Length { received, expected } => {
                bad("length").with("received", received).with("expected", expected)
            }
            E::Checksum { received, computed } => {
                bad("checksum").with("received", received).with("computed", computed)
            }
            E::UnknownAddress { address } => bad("unknown_address").with("address", address),
            E::UnknownCommand { command } => bad("unknown_command").with("command", command),
            E::Value { field, value } => {
                let field = names::field(field);
                Self::new("value", format!("{field} cannot be {value}"))
                    .with("field", field)
                    .with("value", value)
            }
            // These need a receiver, or an expectation; text has neither.
            E::LineErrors { .. } => bad("line_errors"),
            E::Foreign { .. } => bad("foreign"),
        }
    }
}

/// The refusal in the words of the arguments.
pub fn explain(error: EncodeError) -> String {
    match error {
        EncodeError::NotForAll { opcode, response_length } => format!(
            "invalid value '126' for '--address <N>': {} cannot go to all devices, because the length value of its \
             response, {response_length}, exceeds 8",
            names::command(opcode)
        ),
        EncodeError::OutOfRange { field, value, min, max } => {
            format!("{} {value} is not in {min}..={max}", names::field(field))
        }
    }
}
