//! Why bytes are no ISU message, or why a command must not be sent.

use clino_codec::isu::{DecodeError, EncodeError};

use super::names;
use crate::bad::Bad;

impl From<DecodeError> for Bad {
    fn from(error: DecodeError) -> Self {
        use DecodeError as E;
        let bad = |kind| Self::new(kind, error);
        match error {
            E::Size { received, expected } => {
                bad("size").with("received", received).with("expected", u32::from(expected))
            }
            E::Length { length, function } => {
                let function = names::function(function);
                Self::new("length", format!("length byte {length:02X} cannot go with {function}"))
                    .with("received", length)
                    .with("function", function)
            }
            E::Checksum { received, computed } => {
                bad("checksum").with("received", received).with("computed", computed)
            }
            E::UnknownFunction { head } => bad("unknown_function").with("head", head),
            E::Direction { head } => bad("direction").with("head", head),
            E::ReservedAddress { head } => bad("reserved_address").with("head", head),
            // These need a receiver, or an expectation; text has neither.
            E::LineErrors { .. } => bad("line_errors"),
            E::Foreign { .. } => bad("foreign"),
            E::Memory { .. } => bad("memory"),
        }
    }
}

/// The refusal in the words of the arguments.
pub fn explain(error: EncodeError) -> String {
    match error {
        EncodeError::Undocumented { start, count } => format!(
            "{count} from {start:02X}H on: only RAM 58H-59H and EEPROM 48H-57H, 78H-7FH and D0H-D7H are documented as \
             writable, and other writes can destroy the module; --even-if-it-bricks-the-module permits them"
        ),
        EncodeError::BeyondEnd { start, count } => {
            format!("{count} from {start:02X}H on go beyond address FFH")
        }
        EncodeError::ReservedAddress | EncodeError::Count { .. } => error.to_string(),
    }
}
