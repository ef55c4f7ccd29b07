//! T7 frames: address, length of what follows it, command, data, checksum that makes the sum of all bytes zero.
//! Get commands have no checksum. Source: "T7 Communication User Guide" 1.7, sections 1.1, 1.2 and 2.

use super::PollVerdict;

/// Address and length byte: not counted by the length.
const HEAD: usize = 2;
/// Get All Angles: its example prints the length 0A for an answer of 18 bytes (section 2.1.1).
const GET_ALL_ANGLES: u8 = 0x80;
const PRINTED_LENGTH: u8 = 0x0A;
const ALL_ANGLES_LENGTH: u8 = 0x10;
/// Set commands; answered with a status.
const SET_COMMANDS: [u8; 7] = [0x84, 0x86, 0x89, 0x8B, 0x8D, 0x8F, 0x91];

fn sums_to_zero(frame: &[u8]) -> bool {
    frame.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)) == 0
}

/// Whether a request keeps to the document.
pub fn is_request(request: &[u8]) -> bool {
    let [_, length, command, ..] = *request else { return false };
    let set = SET_COMMANDS.contains(&command);
    request.len() == HEAD + usize::from(length) && (set && sums_to_zero(request) || !set && length == 1)
}

/// What an answer is worth.
pub fn judge(request: &[u8], heard: &[u8]) -> PollVerdict {
    let [address, _, command, ..] = *request else { return PollVerdict::BadAnswer };
    let answer = (0..heard.len()).find_map(|start| frame(heard.get(start..)?, address, command));
    match answer {
        None => PollVerdict::BadAnswer,
        Some(data) if SET_COMMANDS.contains(&command) && data.first() != Some(&0) => PollVerdict::DeviceError,
        Some(_) => PollVerdict::Good,
    }
}

/// Data of the answer at the beginning of `bytes`, if it is one to this request.
fn frame(bytes: &[u8], address: u8, command: u8) -> Option<&[u8]> {
    let &[from, printed, to, ..] = bytes else { return None };
    let quirk = command == GET_ALL_ANGLES && printed == PRINTED_LENGTH;
    let length = if quirk { ALL_ANGLES_LENGTH } else { printed };
    let frame = bytes.get(..HEAD + usize::from(length))?;
    let mine = from == address && to == command && sums_to_zero(frame);
    if mine { frame.get(3..frame.len() - 1) } else { None }
}
