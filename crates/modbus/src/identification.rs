//! Function 43, MEI type 14: identification of the device.
//!
//! ```text
//! request   address 2B 0E code object
//! answer    address 2B 0E code conformity more next count (object length text …)…
//! ```
//!
//! Basic objects 0 to 2 and regular objects 3 to 5, as a stream or one by one. An object without a text is not there:
//! streams leave it out, and asked for alone it is exception 02. An object of length 0 would be allowed, but npm's
//! `modbus-serial` 8 waits for more of it for ever.
//!
//! Source: MODBUS Application Protocol V1.1b3, section 6.21.

use crate::exception::Exception;
use crate::frame::{Frame, MAX_FRAME};

/// Identification: the objects 0 to 5 in ASCII. Empty objects do not exist.
///
/// | object | |
/// |---|---|
/// | 0 | vendor |
/// | 1 | product code |
/// | 2 | version of the firmware |
/// | 3 | address of the vendor on the web |
/// | 4 | product name |
/// | 5 | model name |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identification(pub [&'static str; OBJECTS]);

const OBJECTS: usize = 6;
/// Of these, basic ones.
const BASIC_OBJECTS: usize = 3;

/// MEI type 14.
const READ_IDENTIFICATION: u8 = 0x0E;
/// Regular identification, as a stream and one by one.
const CONFORMITY: u8 = 0x82;
/// Where the number of objects is, and the two bytes before it, from the beginning of the frame.
const MORE: usize = 5;
const NEXT: usize = 6;
const COUNT: usize = 7;
/// Bytes before the objects.
const HEAD: usize = 8;
/// Room for an object's text: a frame without its head, its checksum, and the object's own number and length.
const LONGEST_TEXT: usize = MAX_FRAME - HEAD - 2 - 2;

mod code {
    pub const BASIC: u8 = 1;
    pub const REGULAR: u8 = 2;
    pub const EXTENDED: u8 = 3;
    pub const ONE: u8 = 4;
}

impl Identification {
    /// Makes the answer of the request.
    pub(crate) fn answer(&self, frame: &mut Frame) -> Result<(), Exception> {
        let (code, object) = match *frame.bytes() {
            [_, _, READ_IDENTIFICATION, code, object] => (code, object),
            [_, _, READ_IDENTIFICATION, ..] => return Err(Exception::IllegalDataValue),
            _ => return Err(Exception::IllegalFunction),
        };
        let asked = match code {
            code::BASIC => 0..BASIC_OBJECTS,
            // There are no extended objects: the answer holds the regular ones.
            code::REGULAR | code::EXTENDED => 0..OBJECTS,
            code::ONE if self.has(object.into()) => {
                let one = usize::from(object);
                one..one.saturating_add(1)
            }
            code::ONE => return Err(Exception::IllegalDataAddress),
            _ => return Err(Exception::IllegalDataValue),
        };
        // A stream that is asked for from an object that it does not have begins again.
        let from = usize::from(object);
        let first = if asked.contains(&from) && self.has(from) { from } else { asked.start };
        frame.truncate(HEAD / 2);
        frame.extend(&[CONFORMITY, 0, 0, 0]);
        let mut count = 0_u8;
        for number in (first..asked.end).filter(|&number| self.has(number)) {
            let Some(text) = self.0.get(number) else { break };
            let text = text.as_bytes().get(..text.len().min(LONGEST_TEXT)).unwrap_or_default();
            let room = MAX_FRAME.saturating_sub(4).saturating_sub(frame.bytes().len());
            if text.len() > room {
                frame.set(MORE, 0xFF);
                frame.set(NEXT, number as u8);
                break;
            }
            frame.extend(&[number as u8, text.len() as u8]);
            frame.extend(text);
            count = count.saturating_add(1);
        }
        frame.set(COUNT, count);
        Ok(())
    }

    fn has(&self, object: usize) -> bool {
        self.0.get(object).is_some_and(|text| !text.is_empty())
    }
}
