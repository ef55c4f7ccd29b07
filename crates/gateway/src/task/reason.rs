//! Why a task failed, as a code and a word that do not change: for programs at the console and for Modbus masters.
//!
//! The whole sentence of a cause is in its `Display`; there it would cost twenty kilobytes of flash.

use clino_commissioning::{isu, t7};

macro_rules! reasons {
    ($($(#[doc = $text:literal])* $name:ident = $code:literal, $word:literal;)*) => {
        /// Why a task failed.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum Reason {
            $($(#[doc = $text])* $name = $code,)*
        }

        impl Reason {
            /// All of them with their words and meanings.
            pub const ALL: &[(Reason, &str, &str)] = &[$((Reason::$name, $word, concat!($($text),*)),)*];

            /// Its word.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Reason::$name => $word,)*
                }
            }
        }
    };
}

reasons! {
    /// the sensor has no such command or value
    Refused = 1, "refused";
    /// the value would be written to all sensors of the bus
    WritesToAll = 2, "writes_to_all";
    /// the sensor does not answer
    NoAnswer = 3, "no_answer";
    /// a T7 answers with a status other than *ok*
    DeviceStatus = 4, "device_status";
    /// a T7 rejects the value as out of range
    OutOfRange = 5, "out_of_range";
    /// the written value does not read back
    NotTaken = 6, "not_taken";
    /// the angle is not zero afterwards
    NotZero = 7, "not_zero";
    /// the sensor moves
    Moving = 8, "moving";
    /// the product type is not known
    UnknownProduct = 9, "unknown_product";
    /// another sensor than before answers
    WrongSerial = 10, "wrong_serial";
    /// another sensor has the new address
    AddressTaken = 11, "address_taken";
    /// the sensor answers at its old address
    StillAtOldAddress = 12, "still_at_old_address";
    /// the sensor answers at its old bit rate
    StillAtOldRate = 13, "still_at_old_rate";
    /// the sensor answers neither with its old setting nor with the new one
    Lost = 14, "lost";
    /// the task was cancelled
    Cancelled = 15, "cancelled";
    /// an ISU answers with an error
    DeviceError = 16, "device_error";
    /// an ISU is in hard error: its EEPROM's checksum is wrong
    HardError = 17, "hard_error";
    /// the checksum of an ISU's EEPROM is wrong
    ChecksumWrong = 18, "checksum_wrong";
    /// the word is not the checksum
    NotTheChecksum = 19, "not_the_checksum";
    /// address 0 on a line with other ISUs
    ZeroOnSharedLine = 20, "zero_on_shared_line";
    /// the address is reserved
    ReservedAddress = 21, "reserved_address";
    /// two readings of the EEPROM differ
    Mismatch = 22, "mismatch";
    /// the written value is lost after the module's restart
    NotKept = 23, "not_kept";
    /// the module does not restart
    NotBooted = 24, "not_booted";
    /// no module answers at any address
    NotFound = 25, "not_found";
    /// the gateway cannot store the change
    NotStored = 26, "not_stored";
    /// a single-axis T7 does not have the axis
    NoSuchAxis = 27, "no_such_axis";
}

impl From<&t7::Cause> for Reason {
    fn from(cause: &t7::Cause) -> Reason {
        use t7::Cause;
        match cause {
            Cause::Refused(_) => Reason::Refused,
            Cause::WritesToAll { .. } => Reason::WritesToAll,
            Cause::NoAnswer { .. } => Reason::NoAnswer,
            Cause::Status { .. } => Reason::DeviceStatus,
            Cause::OutOfRange { .. } => Reason::OutOfRange,
            Cause::NotTaken { .. } => Reason::NotTaken,
            Cause::NotZero { .. } => Reason::NotZero,
            Cause::Moving { .. } => Reason::Moving,
            Cause::NoSuchAxis { .. } => Reason::NoSuchAxis,
            Cause::UnknownProduct { .. } => Reason::UnknownProduct,
            Cause::WrongSerial { .. } => Reason::WrongSerial,
            Cause::AddressTaken { .. } => Reason::AddressTaken,
            Cause::StillAt { .. } => Reason::StillAtOldAddress,
            Cause::StillAtRate { .. } => Reason::StillAtOldRate,
            Cause::Lost { .. } => Reason::Lost,
            Cause::Cancelled => Reason::Cancelled,
        }
    }
}

impl From<&isu::Cause> for Reason {
    fn from(cause: &isu::Cause) -> Reason {
        use isu::Cause;
        match cause {
            Cause::NoAnswer { .. } => Reason::NoAnswer,
            Cause::Device { .. } => Reason::DeviceError,
            Cause::HardError => Reason::HardError,
            Cause::Unsound(_) => Reason::ChecksumWrong,
            Cause::NotTheChecksum(_) => Reason::NotTheChecksum,
            Cause::ZeroOnSharedLine => Reason::ZeroOnSharedLine,
            Cause::ReservedAddress => Reason::ReservedAddress,
            Cause::AddressTaken { .. } => Reason::AddressTaken,
            Cause::Mismatch { .. } => Reason::Mismatch,
            Cause::NotTaken { .. } => Reason::NotTaken,
            Cause::NotKept { .. } => Reason::NotKept,
            Cause::StillAt { .. } => Reason::StillAtOldAddress,
            Cause::NotBooted { .. } => Reason::NotBooted,
            Cause::NotZero { .. } => Reason::NotZero,
            Cause::Moving { .. } => Reason::Moving,
            Cause::NotFound { .. } => Reason::NotFound,
            Cause::Cancelled => Reason::Cancelled,
        }
    }
}
