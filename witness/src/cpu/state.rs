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

    /// Whether the next instruction is in an IT block.
    pub fn is_in_block(&self) -> bool {
        self.xpsr & 0x0600_0C00 != 0
    }

    fn fields(&self) -> Vec<(Place, u32)> {
        let mut fields: Vec<(Place, u32)> = Vec::new();
        fields.extend((0..).zip(&self.r).map(|(number, value)| (Place::R(number), *value)));
        fields.extend([
            (Place::Xpsr, self.xpsr),
            (Place::Primask, self.primask),
            (Place::Faultmask, self.faultmask),
            (Place::Basepri, self.basepri),
            (Place::Control, self.control),
            (Place::OtherSp, self.other_sp),
            (Place::Fpscr, self.fpscr),
            (Place::Cfsr, self.cfsr),
            (Place::Hfsr, self.hfsr),
            (Place::Bfar, self.bfar),
            (Place::LockedUp, u32::from(self.condition == Condition::LockedUp)),
        ]);
        fields.extend((0..).zip(&self.s).map(|(number, value)| (Place::S(number), *value)));
        fields
    }

    /// The registers in which `self` and `other` differ.
    pub fn differences(&self, other: &State) -> Vec<Difference> {
        let pairs = self.fields().into_iter().zip(other.fields());
        pairs
            .filter(|((_, ours), (_, theirs))| ours != theirs)
            .map(|((place, ours), (_, theirs))| Difference { place, ours, theirs })
            .collect()
    }
}

/// Where the two cores can differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `R0` to `R15`.
    R(u8),
    /// `S0` to `S31`.
    S(u8),
    /// A word of RAM.
    Memory(u32),
    Xpsr,
    Primask,
    Faultmask,
    Basepri,
    Control,
    OtherSp,
    Fpscr,
    Cfsr,
    Hfsr,
    Bfar,
    LockedUp,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::R(number) => write!(f, "r{number}"),
            Place::S(number) => write!(f, "s{number}"),
            Place::Memory(address) => write!(f, "[{address:#010x}]"),
            other => f.write_str(&format!("{other:?}").to_lowercase()),
        }
    }
}

/// A register or a word in which the two cores differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Which.
    pub place: Place,
    /// On the virtual board.
    pub ours: u32,
    /// On the second emulator.
    pub theirs: u32,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: board {:#010x}, witness {:#010x}", self.place, self.ours, self.theirs)
    }
}
