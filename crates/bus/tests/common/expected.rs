//! What no receiver can see: damaged characters that make a well-formed answer all the same. Written from the
//! documents, on top of nothing.

/// Where a well-formed T7 answer of `address` to `command`, `size` bytes long, begins in what was heard. Checked: the
/// header, the sum, and for angles the documented range.
pub fn t7_answers(heard: &[u8], address: u8, command: u8, size: usize) -> impl Iterator<Item = usize> {
    let fits = move |frame: &[u8]| {
        let sum = frame.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
        // Get All Angles is printed with length 0A.
        let length = usize::from(frame[1]) == size - 2 || (command == 0x80 && frame[1] == 0x0A);
        frame[0] == address && length && frame[2] == command && sum == 0
    };
    heard.windows(size).enumerate().filter(move |(_, frame)| fits(frame)).map(|(index, _)| index)
}

/// The same for an ISU: length, address with function, and the sum of all but the length. `memory` is what the answer
/// has to repeat of the command.
pub fn isu_answers(heard: &[u8], head: u8, size: usize, memory: Option<u8>) -> impl Iterator<Item = usize> {
    let fits = move |frame: &[u8]| {
        let (body, sum) = frame[1..].split_at(size - 2);
        let computed = body.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
        let place = memory.is_none_or(|start| body[1] == start);
        usize::from(frame[0]) == size - 2 && body[0] == head && place && sum == [computed]
    };
    heard.windows(size).enumerate().filter(move |(_, frame)| fits(frame)).map(|(index, _)| index)
}
