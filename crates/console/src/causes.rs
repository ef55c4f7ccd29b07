//! The next step after a failed task: one sentence for each group of causes.

use clino_commissioning::{isu, t7};

/// The next step after a task of a T7 has failed; `None` where the cause says it.
pub const fn after_t7(cause: &t7::Cause) -> Option<&'static str> {
    use t7::Cause;
    Some(match cause {
        Cause::NoAnswer { .. } | Cause::Lost { .. } => {
            "t7 scan all finds every T7 that answers, at every bit rate; if none does, check supply, A and B, ground"
        }
        Cause::Status { .. } | Cause::OutOfRange { .. } | Cause::NoSuchAxis { .. } => {
            "t7 info shows product, firmware and settings of the sensor"
        }
        Cause::NotTaken { .. } | Cause::StillAt { .. } | Cause::StillAtRate { .. } => {
            "the sensor has kept its old setting: try again"
        }
        Cause::NotZero { .. } | Cause::Moving { .. } => "hold the sensor still and try again",
        Cause::UnknownProduct { .. } | Cause::WrongSerial { .. } => "t7 scan lists the sensors of the bus",
        Cause::AddressTaken { .. } => "t7 scan lists the addresses in use",
        Cause::Refused(_) | Cause::WritesToAll { .. } | Cause::Cancelled => return None,
    })
}

/// The same of an ISU.
pub const fn after_isu(cause: &isu::Cause) -> Option<&'static str> {
    use isu::Cause;
    Some(match cause {
        Cause::NoAnswer { .. } | Cause::NotFound { .. } => {
            "check address, supply, A and B, ground; an ISU that is alone on its line also answers at address 0"
        }
        Cause::Device { .. } | Cause::NotBooted { .. } => "switch its supply off and on, then isu info",
        Cause::HardError | Cause::Unsound(_) | Cause::NotTheChecksum(_) | Cause::Mismatch { .. } => {
            "isu repair restores its memory"
        }
        Cause::NotTaken { .. } | Cause::NotKept { .. } | Cause::StillAt { .. } => {
            "isu info shows the settings of the sensor; try again"
        }
        Cause::NotZero { .. } | Cause::Moving { .. } => "hold the sensor still and try again",
        Cause::ZeroOnSharedLine => "give its address, or connect it alone",
        Cause::ReservedAddress => "choose an address from 1 to 14",
        Cause::AddressTaken { .. } => "another ISU has that address: choose a free one",
        Cause::Cancelled => return None,
    })
}
