//! Degraded modes: operations that are refused in them.
//!
//! A UART receives as long as both clocks together are off by no more than [`UART_TOLERANCE_PPM`]. The crystal is off
//! by a few tens of ppm; the internal oscillator by up to [`INTERNAL_OSCILLATOR_PPM`]. Near room temperature (1 %)
//! sensors can be read with it, and a damaged answer is detected. A *written* value may be damaged, too, and a sensor
//! keeps it.

/// The internal oscillator of an STM32F407 over temperature: −8 to +4.5 % (DS8626 table 39).
pub const INTERNAL_OSCILLATOR_PPM: u32 = 80_000;
/// By how much a USART's own clock and the other one may differ: 3.33 %, with a fraction in the divider and noise taken
/// for an error (RM0090 section 30.3.5).
pub const UART_TOLERANCE_PPM: u32 = 33_300;

/// Which valid orders are refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DegradedMode {
    /// Nothing.
    #[default]
    None,
    /// Bit rates come from the internal oscillator: tasks that write a sensor's non-volatile memory, or change a bit
    /// rate.
    InexactClock,
    /// The buses are not served: all tasks.
    NoBuses,
}
