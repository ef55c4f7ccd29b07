//! Factory-defined properties of a device. Source: T7 guide §2.7.1.

use super::Axis;

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

impl DeviceInformation {
    /// Whether it is a single-axis T7, which has [axis 2](Axis::Two) only and answers zero for the others.
    ///
    /// Its product type ends in `-1`, whatever it begins with. Behind it are blanks, says the guide; zeros are no text, either.
    ///
    /// ```
    /// use clino_codec::t7::{DeviceInformation, Text};
    ///
    /// let product = |product| DeviceInformation {
    ///     serial: 25_033,
    ///     firmware: Text::new(*b"0.32  "),
    ///     product: Text::new(product),
    ///     calibration_state: 0,
    /// };
    /// assert!(product(*b"T7-1  ").is_single_axis() && product(*b"X4-1\0\0").is_single_axis());
    /// assert!(!product(*b"T7-3  ").is_single_axis());
    /// ```
    pub fn is_single_axis(&self) -> bool {
        let mut backwards = self.product.0.iter().rev().skip_while(|&&byte| matches!(byte, b' ' | 0));
        backwards.next() == Some(&b'1') && backwards.next() == Some(&b'-')
    }

    /// Whether it measures this axis: a single-axis T7 has axis 2 only.
    pub fn has_axis(&self, axis: Axis) -> bool {
        axis == Axis::Two || !self.is_single_axis()
    }
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
