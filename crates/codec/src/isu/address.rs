//! Module addresses on an ISU line. Source: AN #201 §4.

/// Highest address a module can have.
const LAST: u8 = 14;
/// Address that the three error answers carry.
const RESERVED: u8 = 15;

/// A 4-bit address.
///
/// ```
/// use clino_codec::isu::Address;
///
/// assert_eq!(Address::new(3).unwrap().get(), 3);
/// assert_eq!(Address::new(15), None);
/// assert!(Address::ANY.is_any());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u8", into = "u8"))]
pub struct Address(u8);

impl Address {
    /// 0: every module answers. Also the address of a module as it leaves the factory.
    pub const ANY: Self = Self(0);

    /// 15: no module. The error answers carry it, so that they name no module: they belong to the transaction in
    /// flight.
    pub const RESERVED: Self = Self(RESERVED);

    /// An address that a command may carry: 0 (every module) or 1–14.
    pub const fn new(address: u8) -> Option<Self> {
        if address <= LAST { Some(Self(address)) } else { None }
    }

    /// The address as a number, 0–15.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// Whether every module listens to this address.
    pub const fn is_any(self) -> bool {
        self.0 == Self::ANY.0
    }

    /// Whether this is 15, the address of no module.
    pub const fn is_reserved(self) -> bool {
        self.0 == RESERVED
    }

    /// Every address that tells modules on one line apart: 1–14.
    pub fn sweep() -> impl Iterator<Item = Self> {
        (1..=LAST).map(Self)
    }

    /// The address in the high half of a message's second byte.
    pub(super) const fn of_head(head: u8) -> Self {
        Self(head >> 4)
    }
}

impl From<Address> for u8 {
    fn from(address: Address) -> Self {
        address.get()
    }
}

/// An address has four bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InvalidAddress(pub u8);

impl core::fmt::Display for InvalidAddress {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} is not an ISU address (0-15)", self.0)
    }
}

impl core::error::Error for InvalidAddress {}

/// Any 4-bit address, the reserved one included.
impl TryFrom<u8> for Address {
    type Error = InvalidAddress;

    fn try_from(address: u8) -> Result<Self, InvalidAddress> {
        if address <= RESERVED { Ok(Self(address)) } else { Err(InvalidAddress(address)) }
    }
}
