//! What the gateway does not do in times like these.
//!
//! A UART receives as long as both clocks together are off by no more than [`UART_TOLERANCE_PPM`]. The crystal is off by a
//! few tens of ppm; the internal oscillator by up to [`INTERNAL_OSCILLATOR_PPM`]. Near room temperature (1 %) sensors can be
//! read with it, and an answer that was spoilt is seen to be. What is *written* may be spoilt, too, and a sensor keeps it.

use crate::order::{Order, Refusal};
use crate::task;

/// The internal oscillator of an STM32F407 over temperature: −8 to +4.5 % (DS8626 table 39).
pub const INTERNAL_OSCILLATOR_PPM: u32 = 80_000;
/// By how much a USART's own clock and the other one may differ: 3.33 %, with a fraction in the divider and noise taken for
/// an error (RM0090 section 30.3.5).
pub const UART_TOLERANCE_PPM: u32 = 33_300;

/// What is refused, beside what is wrong in itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Restraint {
    /// Nothing.
    #[default]
    None,
    /// Bit rates come from the internal oscillator: tasks that write a sensor's non-volatile memory, or change a bit rate.
    InexactClock,
    /// The buses are not served: all tasks.
    NoBuses,
}

impl Restraint {
    /// Whether an order may be carried out.
    ///
    /// # Errors
    /// [`Refusal::Restrained`].
    pub(crate) fn check(self, order: &Order) -> Result<(), Refusal> {
        let refused = match self {
            Restraint::None => false,
            Restraint::InexactClock => writes(order),
            Restraint::NoBuses => matches!(order, Order::T7(_) | Order::Isu(_)),
        };
        if refused { Err(Refusal::Restrained(self)) } else { Ok(()) }
    }
}

/// Whether a sensor is different afterwards, also without power in between.
const fn writes(order: &Order) -> bool {
    match order {
        Order::T7(task) => !matches!(task, task::t7::Task::Identify(_) | task::t7::Task::Sweep(_)),
        Order::Isu(task) => !matches!(task, task::isu::Task::Identify(_) | task::isu::Task::Reset(_)),
        Order::Slot { .. }
        | Order::Bus { .. }
        | Order::Console(_)
        | Order::Cancel(_)
        | Order::ClearCounters => false,
    }
}

#[cfg(test)]
mod tests;
