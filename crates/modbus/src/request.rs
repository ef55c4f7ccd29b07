//! Sorts frames with a right checksum: a request as long as its function says, or something else.
//!
//! | function | request, bytes | answer, bytes |
//! |---|---|---|
//! | 03, 04 | 8 | 5 + the number in its byte 2, which is even |
//! | 06 | 8 | is the request |
//! | 08 | 8; sub-function 0: 6 + data, an even number | as long as the request |
//! | 16 | 9 + the number in its byte 6 | 8 |
//! | 43 | 7 | 10 and more |
//! | 128 and more | | 5: an exception |
//!
//! The checksum is blind to zeros behind a frame (see `receiver.rs`), so the length decides. A request
//! that only reads is answered as if they were not there. One that changes something is not carried out: nothing says
//! any more that what came is what was sent.
//!
//! A frame that can only be an answer is not answered: our own has come back, or there is a second server with this
//! address. Answers that look like requests are remembered, see `repeat.rs`: those to 06 and 08, and one in 256 of those
//! with two registers, whose last byte is zero.
//!
//! Source: MODBUS Application Protocol V1.1b3, sections 6.3, 6.4, 6.6, 6.8, 6.12, 6.21, 7.

use crate::receiver::CHECKSUM;

pub mod function {
    pub const READ_HOLDING: u8 = 3;
    pub const READ_INPUT: u8 = 4;
    pub const WRITE_ONE: u8 = 6;
    pub const DIAGNOSTICS: u8 = 8;
    pub const WRITE_MANY: u8 = 16;
    pub const IDENTIFICATION: u8 = 43;
    /// Set in the function code of an exception.
    pub const EXCEPTION: u8 = 0x80;
}

use function::{DIAGNOSTICS, EXCEPTION, IDENTIFICATION, READ_HOLDING, READ_INPUT, WRITE_MANY, WRITE_ONE};

/// Sub-functions of function 08 that clear the counters.
pub mod clearing {
    pub const RESTART: u16 = 1;
    pub const CLEAR: u16 = 10;
}

/// Bytes of a request to read registers.
pub const READ: usize = 8;
/// Bytes of the other requests of a fixed length.
const FIXED: usize = 8;
/// Bytes of function 43's request.
const IDENTIFICATION_REQUEST: usize = 7;
/// Bytes of function 16's request before and behind its registers.
const WRITE_MANY_REQUEST: usize = 9;
/// Bytes of the answer to a reading request before and behind its registers.
const READ_ANSWER: usize = 5;
/// Bytes of function 16's answer.
const WRITE_MANY_ANSWER: usize = 8;
/// Bytes of the shortest answer of function 43.
const IDENTIFICATION_ANSWER: usize = 10;

/// What a frame is, its checksum included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A request, and its length: that of the frame if no request of its function is that long.
    Request(usize),
    /// A request that changes something, with zeros behind it.
    Appended,
    /// An answer.
    Answer,
}

/// What this frame is.
pub fn form(frame: &[u8]) -> Form {
    match length(frame).filter(|&length| is_padded(frame, length)) {
        Some(length) if length < frame.len() && changes(frame) => Form::Appended,
        Some(length) => Form::Request(length),
        None if is_answer(frame) => Form::Answer,
        None => Form::Request(frame.len()),
    }
}

/// Whether a request asks the server with this address for registers and nothing else.
pub fn only_reads(request: &[u8; READ], address: u8) -> bool {
    matches!(*request, [to, READ_HOLDING | READ_INPUT, ..] if to == address)
}

/// Whether a request changes anything: a setting, a sensor, the counters of the port.
pub fn changes(request: &[u8]) -> bool {
    match *request {
        [_, WRITE_ONE | WRITE_MANY, ..] => true,
        [_, DIAGNOSTICS, high, low, ..] => {
            matches!(u16::from_be_bytes([high, low]), clearing::RESTART | clearing::CLEAR)
        }
        _ => false,
    }
}

/// Whether a request may be its own answer.
pub fn is_its_answer(request: &[u8]) -> bool {
    matches!(request, [_, WRITE_ONE | DIAGNOSTICS, ..])
}

/// Bytes of a request that begins like this, if its function says so.
fn length(frame: &[u8]) -> Option<usize> {
    match *frame {
        // As much data as there is: what follows the last byte that is not zero is data only as far as that is needed.
        [_, DIAGNOSTICS, 0, 0, ..] => {
            let used = frame.iter().rposition(|&byte| byte != 0).map_or(0, |last| last.saturating_add(1));
            Some(used.max(FIXED).next_multiple_of(2))
        }
        [_, READ_HOLDING | READ_INPUT, ..] => Some(READ),
        [_, WRITE_ONE | DIAGNOSTICS, ..] => Some(FIXED),
        [_, WRITE_MANY, _, _, _, _, bytes, ..] => Some(WRITE_MANY_REQUEST.saturating_add(bytes.into())),
        [_, IDENTIFICATION, ..] => Some(IDENTIFICATION_REQUEST),
        _ => None,
    }
}

/// Whether a frame that is no request is an answer, zeros behind it or not.
fn is_answer(frame: &[u8]) -> bool {
    let length = match *frame {
        [_, function, ..] if function & EXCEPTION != 0 => return true,
        [_, READ_HOLDING | READ_INPUT, bytes, ..] if bytes != 0 && bytes & 1 == 0 => {
            READ_ANSWER.saturating_add(bytes.into())
        }
        [_, WRITE_MANY, ..] => WRITE_MANY_ANSWER,
        [_, IDENTIFICATION, ..] => return frame.len() >= IDENTIFICATION_ANSWER,
        _ => return false,
    };
    is_padded(frame, length)
}

/// Whether a frame has `length` bytes, and nothing but zeros behind them.
pub fn is_padded(frame: &[u8], length: usize) -> bool {
    length > CHECKSUM && frame.get(length..).is_some_and(|rest| rest.iter().all(|&byte| byte == 0))
}
