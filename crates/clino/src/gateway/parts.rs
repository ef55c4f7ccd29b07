//! A configuration in parts that can be changed one by one: each bus, the Modbus port, the console, each slot.

/// The lines that make one part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// `t7`, `isu`, `modbus`, `console`, `slot 3`.
    pub target: String,
    pub lines: Vec<String>,
}

/// The parts of a configuration, in order. Blank lines and those that begin with `#` are none.
///
/// # Errors
/// A line that `export` does not print.
pub fn parts<'a>(lines: impl Iterator<Item = &'a str>) -> Result<Vec<Part>, String> {
    let mut parts: Vec<Part> = Vec::new();
    for (line, number) in lines.zip(1_usize..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let target = target(line).ok_or_else(|| format!("line {number} is none of a backup: {line}"))?;
        match parts.iter_mut().find(|part| part.target == target) {
            Some(part) => part.lines.push(line.to_owned()),
            None => parts.push(Part { target, lines: vec![line.to_owned()] }),
        }
    }
    Ok(parts)
}

/// What a line is about. Only what changes settings is one of a backup.
fn target(line: &str) -> Option<String> {
    let mut words = line.split_whitespace();
    let (verb, of) = (words.next()?, words.next()?);
    let is_slot = of.bytes().all(|byte| byte.is_ascii_digit());
    match (verb, of) {
        ("slot" | "set", slot) if is_slot => Some(format!("slot {slot}")),
        ("set", "t7" | "isu" | "modbus" | "console") => Some(of.to_owned()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_belong_to_their_parts_and_other_commands_to_none() {
        let text =
            "# mine\nset t7 baud 115200\n\nslot 0 t7 1\nset 0 period 40\nset t7 echo off\nslot 1 off\n";
        let found = parts(text.lines()).unwrap();
        let found: Vec<_> = found.iter().map(|part| (part.target.as_str(), part.lines.len())).collect();
        assert_eq!(found, [("t7", 2), ("slot 0", 2), ("slot 1", 1)]);
        for line in
            ["reboot --yes", "factory-reset --yes", "t7 address 1 2 --yes", "set", "slot x off", "save"]
        {
            assert!(parts([line].into_iter()).is_err(), "{line}");
        }
    }
}
