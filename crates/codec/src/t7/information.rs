//! Factory-defined properties of a device. Source: T7 guide §2.7.1.

/// What a device says about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DeviceInformation {
    /// Serial number, set at the factory.
    pub serial: u32,
    /// Firmware version, such as `0.32`.
    pub firmware: Text,
    /// Product type. The guide's text says `T7-1` where its example has `X4-1`: unknown names are no error.
    pub product: Text,
    /// Reserved by the manufacturer.
    pub calibration_state: u16,
}

/// Six ASCII characters, padded with blanks.
///
/// ```
/// use clino_codec::t7::Text;
///
/// assert_eq!(Text::new(*b"0.32  ").trimmed(), b"0.32");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Text([u8; 6]);

impl Text {
    /// The text of these six bytes, whatever they are.
    pub const fn new(bytes: [u8; 6]) -> Self {
        Self(bytes)
    }

    /// All six bytes as sent.
    pub const fn as_bytes(&self) -> &[u8; 6] {
        &self.0
    }

    /// The bytes without trailing blanks.
    pub fn trimmed(&self) -> &[u8] {
        let blanks = self.0.iter().rev().take_while(|&&byte| byte == b' ').count();
        self.0.get(..self.0.len().saturating_sub(blanks)).unwrap_or(&[])
    }

    /// The text without trailing blanks; `None` when it is not ASCII.
    pub fn as_str(&self) -> Option<&str> {
        let text = self.trimmed();
        let is_ascii = text.iter().all(u8::is_ascii);
        core::str::from_utf8(text).ok().filter(|_| is_ascii)
    }
}
