//! Errors of a line.

use core::fmt::{self, Debug, Display};

use clino_bus::Duration;
use clino_codec::character::{Character, LineErrors};

use super::echo::Difference;

/// Why a line did not do what it was asked. DE is low in every case, unless the pin itself refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Error<U, P> {
    /// The UART's transmitter.
    Uart(U),
    /// The driver-enable pin.
    Pin(P),
    /// The UART did not send its characters in time: the driver was switched off in the middle of a frame.
    Stuck {
        /// For how long it was given time.
        waited: Duration,
    },
    /// What came back is not what was sent: another node transmitted, or the receiver is off. The frame is out, but
    /// the sensor may not have understood it.
    Echo {
        /// Place of the first difference in the frame.
        index: usize,
        /// The character sent.
        sent: u8,
        /// What came back in its place, if anything.
        heard: Option<Character>,
    },
    /// Only from `read`: the receiver complained about a character, which is lost.
    Receiver(LineErrors),
}

impl<U, P> From<Difference> for Error<U, P> {
    fn from(Difference { index, sent, heard }: Difference) -> Self {
        Self::Echo { index, sent, heard }
    }
}

impl<U: Debug, P: Debug> Display for Error<U, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uart(error) => write!(f, "UART: {error:?}"),
            Self::Pin(error) => write!(f, "driver-enable pin: {error:?}"),
            Self::Stuck { waited } => write!(
                f,
                "the UART did not send within {} µs: its transmitter is off, or it runs at a lower bit rate than \
                 `PortSettings` says",
                waited.as_micros()
            ),
            Self::Echo { index, sent, heard: Some(Character { byte, errors }) } => write!(
                f,
                "character {index} was sent as {sent:02X} and came back as {byte:02X} ({errors:?}): another node \
                 transmits, or A and B are short"
            ),
            Self::Echo { index, sent, heard: None } => write!(
                f,
                "character {index}, {sent:02X}, did not come back: set `Echo::Off` if /RE is tied to DE, or \
                 `PortSettings::handover` if the receiver is late"
            ),
            Self::Receiver(errors) => write!(f, "receiver: {errors:?}"),
        }
    }
}

impl<U: Debug, P: Debug> core::error::Error for Error<U, P> {}

#[cfg(feature = "embedded-io")]
impl<U: Debug, P: Debug> embedded_io::Error for Error<U, P> {
    fn kind(&self) -> embedded_io::ErrorKind {
        match self {
            Self::Stuck { .. } => embedded_io::ErrorKind::TimedOut,
            Self::Echo { .. } | Self::Receiver(_) => embedded_io::ErrorKind::InvalidData,
            Self::Uart(_) | Self::Pin(_) => embedded_io::ErrorKind::Other,
        }
    }
}
