//! Why a task failed, as a word that does not change.
//!
//! The whole sentence is in the `Display` of the cause; here it would cost twenty kilobytes of flash.

use clino_commissioning::{isu, t7};

/// Of a T7.
pub const fn t7(cause: &t7::Cause) -> &'static str {
    use t7::Cause;
    match cause {
        Cause::Refused(_) => "refused",
        Cause::WritesToAll { .. } => "writes_to_all",
        Cause::NoAnswer { .. } => "no_answer",
        Cause::Status { .. } => "device_status",
        Cause::OutOfRange { .. } => "out_of_range",
        Cause::NotTaken { .. } => "not_taken",
        Cause::NotZero { .. } => "not_zero",
        Cause::Moving { .. } => "moving",
        Cause::UnknownProduct { .. } => "unknown_product",
        Cause::WrongSerial { .. } => "wrong_serial",
        Cause::AddressTaken { .. } => "address_taken",
        Cause::StillAt { .. } => "still_at_old_address",
        Cause::StillAtRate { .. } => "still_at_old_rate",
        Cause::Lost { .. } => "lost",
        Cause::Cancelled => "cancelled",
    }
}

/// Of an ISU.
pub const fn isu(cause: &isu::Cause) -> &'static str {
    use isu::Cause;
    match cause {
        Cause::NoAnswer { .. } => "no_answer",
        Cause::Device { .. } => "device_error",
        Cause::HardError => "hard_error",
        Cause::Unsound(_) => "checksum_wrong",
        Cause::NotTheChecksum(_) => "not_the_checksum",
        Cause::ZeroOnSharedLine => "zero_on_shared_line",
        Cause::ReservedAddress => "reserved_address",
        Cause::AddressTaken { .. } => "address_taken",
        Cause::Mismatch { .. } => "mismatch",
        Cause::NotTaken { .. } => "not_taken",
        Cause::NotKept { .. } => "not_kept",
        Cause::StillAt { .. } => "still_at_old_address",
        Cause::NotBooted { .. } => "not_booted",
        Cause::NotZero { .. } => "not_zero",
        Cause::Moving { .. } => "moving",
        Cause::NotFound { .. } => "not_found",
        Cause::Cancelled => "cancelled",
    }
}
