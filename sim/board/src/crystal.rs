//! The crystal, and the reaction of the reset and clock controller when it fails (RM0090 sections 7.2.1 and 7.2.7).
//!
//! The emulator's controller knows only crystals that start. This front of its registers adds:
//!
//! - HSEON does not get through to it while the crystal cannot swing, and reads as firmware has written it: HSERDY
//!   never comes.
//! - A clock that is fed from outside, as on a Nucleo, counts as a crystal that swings while the oscillator is bypassed
//!   (HSEBYP), and a crystal while it is not.
//! - If the crystal stops with the clock security system on (CSSON), and the core clock comes from it (directly or
//!   through the PLL), the core clock becomes the internal oscillator's, HSEON and PLLON fall, CSSF rises, and so does
//!   NMI until firmware writes CSSC. If the core clock does not come from it, only HSEON falls, with CSSF and NMI.
//! - Without the clock security system the core stands still until a reset or until the crystal is back.
//!
//! Not modelled: that everything else on the core's clock stands still with it (a character under way is finished; a
//! timer counts on, and no code reads it), and what a PLL gives for a moment that has lost its input. From the stop to the
//! switch it takes up to 1 µs.

mod pins;

use std::sync::Arc;

use rsemu::core::Result;
use rsemu::dev::stm32::rcc;
use rsemu::machine::Instance;
use rsemu::machine::validate::{ClassSchema, PortDir};

use crate::incident::Chronicle;
use crate::oscillators::CrystalLife;
use crate::wrapped::Wrapped;

pub(crate) use pins::Pins;

/// The stock class that is wrapped: the reset and clock controller.
pub(crate) const STOCK: &str = "st.rcc";
/// The output that is added to it: the failure, for NMI.
const NMI: &str = "nmi";

/// What the stock controller's class is with the line for NMI.
pub(crate) fn schema() -> ClassSchema {
    rcc::schema().port(NMI, PortDir::Out)
}

/// The stock controller with a crystal of this life at its pins, or a clock that is fed to it.
///
/// # Errors
///
/// The controller has no registers.
pub(crate) fn at(
    stock: Arc<dyn Instance>,
    life: CrystalLife,
    is_fed: bool,
    chronicle: Arc<Chronicle>,
) -> Result<Wrapped<Pins>> {
    Wrapped::new(stock, |registers| Pins::new(registers, life, is_fed, chronicle))
}
