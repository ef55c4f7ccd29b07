//! Device addresses on a T7 bus. Source: T7 guide §1.1, §1.4, §2.8.

/// Highest address that Set Address can give. Source: §2.8.
const LAST_ASSIGNABLE: u8 = 100;
/// Address of a device as it leaves the factory. Source: §1.1.
const FACTORY: u8 = 127;
/// Address to which every T7 answers. Source: §1.4.
const ALL_RESPOND: u8 = 126;

/// An address: 1–100, 127, or the all-respond address 126.
///
/// ```
/// use clino_codec::t7::Address;
///
/// assert_eq!(Address::new(5).unwrap().get(), 5);
/// assert_eq!(Address::new(101), None);
/// assert_eq!(Address::new(126), None); // not a device: ask for it by name
/// assert!(Address::ALL.is_all());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u8", into = "u8"))]
pub struct Address(u8);

impl Address {
    pub(super) const LAST_ASSIGNABLE: u8 = LAST_ASSIGNABLE;

    /// 127, the address of a device as it leaves the factory.
    pub const FACTORY: Self = Self(FACTORY);

    /// 126: every device answers, all at once.
    ///
    /// Only commands whose response length value is at most eight may be sent to it; encoding any other one
    /// is refused. Answers of several devices overlap on a shared line. No answer ever carries this address.
    pub const ALL: Self = Self(ALL_RESPOND);

    /// The address of one device: 1–100 or 127. Everything else, 126 included, is `None`.
    pub const fn new(address: u8) -> Option<Self> {
        let assignable = address != 0 && address <= LAST_ASSIGNABLE;
        if assignable || address == FACTORY { Some(Self(address)) } else { None }
    }

    /// An address as it may stand in a request: that of a device, or 126.
    pub const fn of_request(address: u8) -> Option<Self> {
        match address {
            ALL_RESPOND => Some(Self::ALL),
            _ => Self::new(address),
        }
    }

    /// The address as a number.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// Whether this is the all-respond address.
    pub const fn is_all(self) -> bool {
        self.0 == ALL_RESPOND
    }

    /// Whether Set Address can give this address to a device: 1–100.
    pub const fn is_assignable(self) -> bool {
        self.0 <= LAST_ASSIGNABLE
    }

    /// Every address at which a device can be found, in the order 1–100, 127.
    ///
    /// There is no command that lists the devices of a bus (Roll Call was removed from the protocol in
    /// version 1.7), so that finding them means asking each of these, at each [baud
    /// rate](super::BaudRate::ALL).
    pub fn sweep() -> impl Iterator<Item = Self> {
        (1..=LAST_ASSIGNABLE).map(Self).chain([Self::FACTORY])
    }
}

impl From<Address> for u8 {
    fn from(address: Address) -> Self {
        address.get()
    }
}

/// No request can carry this address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InvalidAddress(pub u8);

impl core::fmt::Display for InvalidAddress {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} is not a T7 address (1-100, 127, or 126 for all)", self.0)
    }
}

impl core::error::Error for InvalidAddress {}

impl TryFrom<u8> for Address {
    type Error = InvalidAddress;

    /// As [`Address::of_request`].
    fn try_from(address: u8) -> Result<Self, InvalidAddress> {
        Self::of_request(address).ok_or(InvalidAddress(address))
    }
}
