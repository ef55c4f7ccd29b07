//! The numbers of a half-duplex line.

use clino_bus::{Duration, Serial};

/// When the last stop bit is out. It decides when DE falls: too early, and no sensor understands a word.
///
/// | HAL | UART | adapter | `Release` |
/// |---|---|---|---|
/// | `stm32f4xx-hal` 0.23 | `Serial` | `uart::Nb` | [`Flushed`](Self::Flushed) |
/// | `rp2040-hal` 0.12 | `UartPeripheral` | `uart::Nb` | [`Flushed`](Self::Flushed) |
/// | `esp-hal` 1.2 | `Uart`, blocking or async | `uart::Io` | [`Flushed`](Self::Flushed) |
/// | `embassy-stm32` 0.6 | `BufferedUart` | `uart::Io` | [`Flushed`](Self::Flushed) |
/// | `embassy-rp` 0.10 | `Uart`, blocking | `uart::Nb` | [`TRANSMIT_REGISTER_EMPTY`](Self::TRANSMIT_REGISTER_EMPTY) |
/// | `embassy-rp` 0.10 | `BufferedUart` | `uart::Io` | [`WHOLE_FRAME`](Self::WHOLE_FRAME) |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Release {
    /// When the UART's `flush` says so: it waits for *transmission complete*.
    Flushed,
    /// This many characters after the UART's `flush` returned, because it returns too early; never more than the
    /// frame has. One bit time in forty is added for the clocks, at least one.
    Held {
        /// Characters that the UART may still have to send after `flush`.
        characters: u8,
    },
}

impl Release {
    /// For a `flush` that returns at *transmit register empty*: the last character has just begun.
    pub const TRANSMIT_REGISTER_EMPTY: Self = Self::Held { characters: 1 };
    /// For a `flush` that does nothing while the UART (or a buffer in front of it) holds the whole frame.
    pub const WHOLE_FRAME: Self = Self::Held { characters: u8::MAX };
}

/// Whether we hear ourselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Echo {
    /// No: RE̅ is tied to DE.
    Off,
    /// Yes: RE̅ is always on. What was sent must come back, and is removed. Read everything before you write: what is
    /// left over would be taken for the echo.
    Expected,
}

/// The settings of a line. [`new`](Self::new) gives the usual ones; change single fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PortSettings {
    /// Bit rate of the UART; all other times are derived from it.
    pub serial: Serial,
    /// From DE high to the first start bit, µs, besides what the code takes; for slow transceivers or optocouplers.
    pub before: Duration,
    /// From the last stop bit to DE low, µs, besides what the code takes. An answer may begin at once: leave it 0
    /// unless the transceiver needs it.
    pub after: Duration,
    /// When the last stop bit is out.
    pub release: Release,
    /// Whether we hear ourselves.
    pub echo: Echo,
    /// How late the receiver may hand over a character: an echo is awaited for that much longer. It goes with
    /// [`Timing::handed_over_within`](clino_bus::Timing::handed_over_within), and is zero for a receiver that holds one
    /// character.
    pub handover: Duration,
}

impl PortSettings {
    /// No delays, a `flush` that is true, no echo.
    pub const fn new(serial: Serial) -> Self {
        Self {
            serial,
            before: Duration::ZERO,
            after: Duration::ZERO,
            release: Release::Flushed,
            echo: Echo::Off,
            handover: Duration::ZERO,
        }
    }

    /// How long DE is held after the UART's `flush` for a frame of `length` characters.
    pub(super) fn hold(&self, length: usize) -> Duration {
        match self.release {
            Release::Flushed => Duration::ZERO,
            Release::Held { characters } => {
                let characters = u32::from(characters).min(length as u32);
                // A bit in forty is 2.5 %: more than 8N1 lets two clocks be apart.
                self.serial.characters(characters) + self.serial.bits(characters.div_ceil(4))
            }
        }
    }

    /// How long the UART may take to send `length` characters before it counts as stuck: a quarter more than their
    /// own time, at least two characters.
    pub(super) fn longest(&self, length: usize) -> Duration {
        let length = length as u32;
        self.serial.characters(length.saturating_add(length.div_ceil(4).max(2)))
    }

    /// From handing over a character to its echo: its own time, an idle character that a buffered receiver may wait
    /// for before it hands it over, and one for the code.
    pub(super) fn echo_time(&self) -> Duration {
        self.serial.characters(3) + self.handover
    }

    /// Between two looks at a receiver that holds one character: often enough never to lose one, seldom enough
    /// that what the delay itself costs does not matter.
    pub(super) fn listen_step(&self) -> Duration {
        Duration::from_micros(self.serial.characters(1).as_micros() / LOOKS_PER_CHARACTER)
    }

    /// Between two looks at the transmitter: it decides how late DE falls.
    pub(super) fn send_step(&self) -> Duration {
        self.serial.half_bit()
    }
}

const LOOKS_PER_CHARACTER: u32 = 8;
