//! The boards that can be simulated, and what is different about them: memories, supply, device number, the pins of the ISU bus,
//! where the clock comes from. What all have is in `board.machine`.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A kind of board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoardModel {
    /// STM32F407G-DISC1, with an STM32F407VG.
    #[default]
    F407Disc1,
    /// A black board with an STM32F407VE.
    F407Ve,
    /// NUCLEO-F446RE, with an STM32F446RE.
    NucleoF446re,
}

/// SRAM1 and SRAM2 (RM0090 section 2.3, RM0390 section 2.2). The end is a valid initial stack pointer.
const SRAM: RangeInclusive<u32> = 0x2000_0000..=0x2002_0000;
/// Core-coupled memory (RM0090 section 2.3).
const CCM: RangeInclusive<u32> = 0x1000_0000..=0x1001_0000;

/// What all boards have.
const COMMON: &str = include_str!("board.machine");

impl BoardModel {
    /// All of them.
    pub const ALL: [BoardModel; 3] = [BoardModel::F407Disc1, BoardModel::F407Ve, BoardModel::NucleoF446re];

    /// Its name on a command line.
    pub const fn name(self) -> &'static str {
        match self {
            BoardModel::F407Disc1 => "f407-disc1",
            BoardModel::F407Ve => "f407ve",
            BoardModel::NucleoF446re => "nucleo-f446re",
        }
    }

    /// Its chip.
    pub const fn chip(self) -> &'static str {
        match self {
            BoardModel::F407Disc1 => "STM32F407VG",
            BoardModel::F407Ve => "STM32F407VE",
            BoardModel::NucleoF446re => "STM32F446RE",
        }
    }

    /// Bytes of flash (RM0090 table 5, RM0390 table 5).
    pub const fn flash_size(self) -> u32 {
        match self {
            BoardModel::F407Disc1 => 1024 * 1024,
            BoardModel::F407Ve | BoardModel::NucleoF446re => 512 * 1024,
        }
    }

    /// Memory that a stack may begin in.
    pub fn stacks(self) -> impl Iterator<Item = RangeInclusive<u32>> {
        let has_ccm = !matches!(self, BoardModel::NucleoF446re);
        [SRAM].into_iter().chain(has_ccm.then_some(CCM))
    }

    /// Whether a clock is fed to the chip instead of a crystal: its oscillator has to be bypassed.
    pub const fn is_fed(self) -> bool {
        matches!(self, BoardModel::NucleoF446re)
    }

    /// Port (`d`) and numbers of TX and RX of the ISU bus.
    pub(crate) const fn isu_pins(self) -> (char, u32, u32) {
        match self {
            BoardModel::F407Disc1 | BoardModel::F407Ve => ('d', 8, 9),
            BoardModel::NucleoF446re => ('c', 10, 11),
        }
    }

    /// The chip and the wiring of its pins, in the emulator's words.
    pub(crate) fn text(self) -> String {
        let own = match self {
            BoardModel::F407Disc1 => include_str!("boards/f407_disc1.machine"),
            BoardModel::F407Ve => include_str!("boards/f407ve.machine"),
            BoardModel::NucleoF446re => include_str!("boards/nucleo_f446re.machine"),
        };
        format!("machine \"clino\" {{\n{COMMON}\n{own}}}\n")
    }
}

impl fmt::Display for BoardModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// There is no such board.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoSuchBoard(String);

impl fmt::Display for NoSuchBoard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = BoardModel::ALL.map(BoardModel::name).join(", ");
        write!(f, "there is no board `{}`, only {names}", self.0)
    }
}

impl std::error::Error for NoSuchBoard {}

impl FromStr for BoardModel {
    type Err = NoSuchBoard;

    fn from_str(name: &str) -> Result<BoardModel, NoSuchBoard> {
        let found = BoardModel::ALL.into_iter().find(|model| model.name() == name);
        found.ok_or_else(|| NoSuchBoard(name.to_owned()))
    }
}
