//! Why an operation on an ISU failed, and what was seen.

use core::fmt;

use clino_codec::isu::eeprom::{Audit, Change};
use clino_codec::isu::{Address, DecodeError, DeviceError, Function};

/// What is wrong with an exchange.
pub type Fault = clino_bus::Fault<DecodeError>;

/// An operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Failure {
    /// Why.
    pub cause: Cause,
    /// Commands sent that write non-volatile memory, whether or not they arrived.
    pub writes: u8,
    /// The EEPROM's checksum may be wrong: [`Repair`](super::Repair) the module before its next reset.
    pub repair: bool,
}

/// Why an operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cause {
    /// No good answer, however often it was asked.
    NoAnswer {
        /// What was asked.
        function: Function,
        /// The module that was asked.
        address: Address,
        /// The last fault.
        #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
        fault: Fault,
    },
    /// The module keeps saying that our command is damaged.
    Device {
        /// What was asked.
        function: Function,
        /// What it said.
        error: DeviceError,
    },
    /// The module is in its Hard Error state.
    HardError,
    /// The EEPROM's checksum is right in neither reading of the document: nothing was written.
    Unsound(Audit),
    /// The module is in its Hard Error state although its checksum is right: something else is broken.
    NotTheChecksum(Audit),
    /// Address 0 is every module's: one on a shared line must not be given it. Nothing was sent.
    ZeroOnSharedLine,
    /// Address 15 belongs to no module. Nothing was sent.
    ReservedAddress,
    /// Another module answers at the new address.
    AddressTaken {
        /// The new address.
        address: Address,
    },
    /// A word of the EEPROM is neither what it was when it was first read, nor what it shall be: one of the readings is
    /// wrong. It was not written.
    Mismatch {
        /// Its EEPROM address.
        word: u8,
        /// As first read.
        before: u16,
        /// As it shall be.
        wanted: u16,
        /// As read now.
        seen: u16,
    },
    /// A word of the EEPROM was written as often as is reasonable, and does not read as wished.
    NotTaken {
        /// Its EEPROM address.
        word: u8,
        /// As it shall be.
        wanted: u16,
        /// As read.
        seen: u16,
    },
    /// After the reset the setting is not what was written.
    NotKept {
        /// As it shall be.
        wanted: Change,
        /// As read.
        seen: Change,
    },
    /// After the reset the module still answers at its old address.
    StillAt {
        /// The old address.
        address: Address,
    },
    /// After the reset the module does not answer.
    NotBooted {
        /// The last fault.
        #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
        fault: Fault,
    },
    /// The angle does not read zero after the null position was reset: something moves it.
    NotZero {
        /// What it reads, in 360/65536°.
        seen: u16,
    },
    /// The module moves: a zero would not hold until it is read back.
    Moving {
        /// How fast, in 0.001° a second.
        mdeg_per_s: u32,
    },
    /// No module answers at any of the addresses.
    NotFound {
        /// The last fault.
        #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
        fault: Fault,
    },
    /// The caller stopped it.
    Cancelled,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (writes sent: {})", self.cause, self.writes)?;
        if self.repair { write!(f, "; the EEPROM needs a repair") } else { Ok(()) }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let checksum = |f: &mut fmt::Formatter<'_>, audit: &Audit| {
            write!(
                f,
                "EEPROM checksum {:04X}, computed {:04X} or {:04X}",
                audit.stored, audit.upper_bits_counted, audit.words_left_out
            )
        };
        match self {
            Self::NoAnswer { function, address, fault } => {
                write!(f, "no answer to {function:?} from address {}: {fault:?}", address.get())
            }
            Self::Device { function, error } => write!(f, "{function:?}: {error}"),
            Self::HardError => write!(f, "the module is in its hard error state"),
            Self::Unsound(audit) => checksum(f, audit),
            Self::NotTheChecksum(audit) => {
                write!(f, "hard error state with a right checksum: ")?;
                checksum(f, audit)
            }
            Self::ZeroOnSharedLine => write!(f, "address 0 must not be given on a shared line (1-14)"),
            Self::ReservedAddress => write!(f, "address 15 is reserved (1-14)"),
            Self::AddressTaken { address } => {
                write!(f, "another module answers at address {}", address.get())
            }
            Self::Mismatch { word, before, wanted, seen } => {
                write!(f, "EEPROM word {word:02X} reads {seen:04X}, neither {before:04X} nor {wanted:04X}")
            }
            Self::NotTaken { word, wanted, seen } => {
                write!(f, "EEPROM word {word:02X} reads {seen:04X}, not {wanted:04X}")
            }
            Self::NotKept { wanted, seen } => write!(f, "after the reset: {seen:?}, not {wanted:?}"),
            Self::StillAt { address } => write!(f, "the module is still at address {}", address.get()),
            Self::NotBooted { fault } => write!(f, "no answer after the reset: {fault:?}"),
            Self::NotZero { seen } => write!(f, "the angle reads {seen:04X} (360/65536 degrees), not 0"),
            Self::Moving { mdeg_per_s } => {
                write!(f, "the module moves at {mdeg_per_s} (0.001 degrees a second)")
            }
            Self::NotFound { fault } => write!(f, "no module found: {fault:?}"),
            Self::Cancelled => write!(f, "cancelled"),
        }
    }
}

impl core::error::Error for Failure {}
impl core::error::Error for Cause {}
