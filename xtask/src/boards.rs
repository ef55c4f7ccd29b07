//! The boards that an image can be for: `--board NAME`.

use crate::command::Failure;

/// A board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Board {
    /// Its name here; its feature of the firmware is that after `board-`.
    pub name: &'static str,
    /// Its chip, as `probe-rs` names it.
    pub chip: &'static str,
    /// KiB of flash.
    pub flash_kb: u32,
}

/// All of them, the default one first.
pub const BOARDS: [Board; 3] = [
    Board { name: "f407-disc1", chip: "STM32F407VGTx", flash_kb: 1024 },
    Board { name: "f407ve", chip: "STM32F407VETx", flash_kb: 512 },
    Board { name: "nucleo-f446re", chip: "STM32F446RETx", flash_kb: 512 },
];

/// An STM32F407G-DISC1.
pub const DEFAULT: Board = BOARDS[0];

/// A NUCLEO-F446RE.
pub const NUCLEO: Board = BOARDS[2];

/// Takes `--board NAME` out of the arguments; without it, the default board.
///
/// # Errors
/// There is no such board.
pub fn take(arguments: &[String]) -> Result<(Board, Vec<String>), Failure> {
    let Some(at) = arguments.iter().position(|argument| argument == "--board") else {
        return Ok((DEFAULT, arguments.to_vec()));
    };
    let name = arguments.get(at + 1).map_or("", String::as_str);
    let Some(board) = BOARDS.into_iter().find(|board| board.name == name) else {
        let names = BOARDS.map(|board| board.name).join(", ");
        let message = format!("--board: there is no board `{name}`, only {names}");
        return Err(Failure { message, status: crate::BAD_USAGE });
    };
    let rest = arguments.iter().take(at).chain(arguments.iter().skip(at + 2));
    Ok((board, rest.cloned().collect()))
}
