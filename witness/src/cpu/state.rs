//! What an instruction may change, but for memory: what is compared.

use std::fmt;

/// Whether the core goes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Condition {
    /// It executes.
    #[default]
    Runs,
    /// A fault within a fault: nothing is executed any more.
    LockedUp,
}

/// Registers of a core.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// `R0` to `R15`; `R13` is the stack pointer in use.
    pub r: [u32; 16],
    /// Flags, IT state, exception number.
    pub xpsr: u32,
    /// `PRIMASK`.
    pub primask: u32,
    /// `FAULTMASK`.
    pub faultmask: u32,
    /// `BASEPRI`.
    pub basepri: u32,
    /// `CONTROL`.
    pub control: u32,
    /// The stack pointer that is not in use.
    pub other_sp: u32,
    /// `S0` to `S31`.
    pub s: [u32; 32],
    /// `FPSCR`.
    pub fpscr: u32,
    /// Fault status: configurable faults, HardFault.
    pub cfsr: u32,
    /// `HFSR`.
    pub hfsr: u32,
    /// The address of a bus fault, 0 unless `CFSR` says that it is valid.
    pub bfar: u32,
    /// Whether it goes on.
    pub condition: Condition,
}

impl State {
    /// The number of the exception that is being handled.
    pub fn exception(&self) -> u32 {
        self.xpsr & 0x1ff
    }

    fn fields(&self) -> Vec<(String, u32)> {
        let mut fields: Vec<(String, u32)> = Vec::new();
        fields.extend(self.r.iter().enumerate().map(|(number, value)| (format!("r{number}"), *value)));
        let rest = [
            ("xpsr", self.xpsr),
            ("primask", self.primask),
            ("faultmask", self.faultmask),
            ("basepri", self.basepri),
            ("control", self.control),
            ("other_sp", self.other_sp),
            ("fpscr", self.fpscr),
            ("cfsr", self.cfsr),
            ("hfsr", self.hfsr),
            ("bfar", self.bfar),
            ("locked_up", u32::from(self.condition == Condition::LockedUp)),
        ];
        fields.extend(rest.map(|(name, value)| (name.to_owned(), value)));
        fields.extend(self.s.iter().enumerate().map(|(number, value)| (format!("s{number}"), *value)));
        fields
    }

    /// The registers in which `self` and `other` differ.
    pub fn differences(&self, other: &State) -> Vec<Difference> {
        let pairs = self.fields().into_iter().zip(other.fields());
        pairs
            .filter(|((_, ours), (_, theirs))| ours != theirs)
            .map(|((what, ours), (_, theirs))| Difference { what, ours, theirs })
            .collect()
    }
}

/// A register or a byte in which the two cores differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Which.
    pub what: String,
    /// On the virtual board.
    pub ours: u32,
    /// On the second emulator.
    pub theirs: u32,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: board {:#010x}, witness {:#010x}", self.what, self.ours, self.theirs)
    }
}
