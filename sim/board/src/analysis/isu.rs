//! ISU frames in binary mode: length of what lies between it and the checksum, address and function with the
//! response bit, data, sum of all bytes but the first. Source: "Interfacing to an ISU Module", section 4.

use super::PollVerdict;

/// Length byte and checksum: not counted by the length.
const FRAME: usize = 2;
/// Lowest bit of byte 1: set in what the module sends.
const RESPONSE: u8 = 0x01;
/// First bytes of the three error answers: invalid function, invalid checksum, hard error.
const ERRORS: [u8; 3] = [0xFF, 0xFD, 0xF1];

/// The frame at the beginning of `bytes`, without length and checksum.
fn body(bytes: &[u8]) -> Option<&[u8]> {
    let (&length, rest) = bytes.split_first()?;
    let length = usize::from(length);
    let (body, checksum) = (rest.get(..length)?, rest.get(length)?);
    let sum = body.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    (sum == *checksum).then_some(body)
}

/// Whether a request keeps to the document.
pub fn is_request(request: &[u8]) -> bool {
    body(request).is_some_and(|body| {
        body.len() + FRAME == request.len() && body.first().is_some_and(|head| head & RESPONSE == 0)
    })
}

/// What an answer is worth.
pub fn judge(request: &[u8], heard: &[u8]) -> PollVerdict {
    let Some(&head) = request.get(1) else { return PollVerdict::BadAnswer };
    for start in 0..heard.len() {
        match heard.get(start..).and_then(body).and_then(<[u8]>::first) {
            Some(&first) if first == head | RESPONSE => return PollVerdict::Good,
            Some(first) if ERRORS.contains(first) => return PollVerdict::DeviceError,
            _ => {}
        }
    }
    PollVerdict::BadAnswer
}
