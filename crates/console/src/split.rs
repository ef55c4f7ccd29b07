//! A line in two.

/// The text before the first of these characters, and the rest. (The standard library's own knows all of Unicode.)
pub fn split_before(line: &str, character: u8) -> (&str, &str) {
    let before = line.bytes().take_while(|&byte| byte != character).count();
    line.split_at_checked(before).unwrap_or((line, ""))
}
