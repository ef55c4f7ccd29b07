//! Function 08: the counters of a server on a serial line.
//!
//! Source: MODBUS Application Protocol V1.1b3, section 6.8; MODBUS over Serial Line V1.02, appendix A.

use crate::exception::Exception;
use crate::frame::Frame;

/// What happened on the port since reset, or since the counters were cleared. All wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Frames without a fault, for any address.
    pub messages: u16,
    /// Frames with a wrong checksum, a pause, a misread character, or too few or too many of them.
    pub errors: u16,
    /// Requests with an exception, those of broadcasts included.
    pub exceptions: u16,
    /// Requests to this server, broadcasts included.
    pub requests: u16,
    /// Of these, frames without any answer: broadcasts, answers of our own that came back, frames that change something
    /// and have zeros behind them; and requests that were over before they could be answered.
    pub unanswered: u16,
    /// Frames that lost characters because they were not fetched in time.
    pub overruns: u16,
}

/// One more.
pub fn bump(counter: &mut u16) {
    *counter = counter.wrapping_add(1);
}

/// Sub-functions.
mod sub {
    pub use crate::request::clearing::{CLEAR, RESTART};

    pub const ECHO: u16 = 0;
    pub const REGISTER: u16 = 2;
    pub const MESSAGES: u16 = 11;
    pub const ERRORS: u16 = 12;
    pub const EXCEPTIONS: u16 = 13;
    pub const REQUESTS: u16 = 14;
    pub const UNANSWERED: u16 = 15;
    pub const OVERRUNS: u16 = 18;
}

/// Restart: keep the event log, or clear it. There is none, both do the same.
const RESTART_KEEP: u16 = 0x0000;
const RESTART_CLEAR: u16 = 0xFF00;

/// Bytes before the data: address, function, sub-function.
const HEAD: usize = 4;

/// Makes the answer of the request. `register` is the diagnostic register.
pub fn answer(
    counters: &mut Counters,
    register: impl FnOnce() -> u16,
    frame: &mut Frame,
) -> Result<(), Exception> {
    let (code, data) = match *frame.bytes() {
        // At least one register, and only whole ones, is given back.
        [_, _, 0, 0, _, _, ref more @ ..] if more.len().is_multiple_of(2) => return Ok(()),
        [_, _, high, low, first, second] => {
            (u16::from_be_bytes([high, low]), u16::from_be_bytes([first, second]))
        }
        [_, _, high, low, ..] if !is_known(u16::from_be_bytes([high, low])) => {
            return Err(Exception::IllegalFunction);
        }
        _ => return Err(Exception::IllegalDataValue),
    };
    let value = match (code, data) {
        (sub::RESTART, RESTART_KEEP | RESTART_CLEAR) | (sub::CLEAR, 0) => {
            *counters = Counters::default();
            return Ok(());
        }
        (sub::REGISTER, 0) => register(),
        (sub::MESSAGES, 0) => counters.messages,
        (sub::ERRORS, 0) => counters.errors,
        (sub::EXCEPTIONS, 0) => counters.exceptions,
        (sub::REQUESTS, 0) => counters.requests,
        (sub::UNANSWERED, 0) => counters.unanswered,
        (sub::OVERRUNS, 0) => counters.overruns,
        (code, _) if is_known(code) => return Err(Exception::IllegalDataValue),
        _ => return Err(Exception::IllegalFunction),
    };
    frame.truncate(HEAD);
    frame.word(value);
    Ok(())
}

fn is_known(code: u16) -> bool {
    matches!(code, sub::ECHO..=sub::REGISTER | sub::CLEAR..=sub::UNANSWERED | sub::OVERRUNS)
}
