//! The log: messages over RTT to a connected probe, or nothing at all.

/// Logs a message of a level of `defmt`; without the log, its values are not even looked at.
macro_rules! log {
    ($level:ident, $message:literal $(, $value:expr)* $(,)?) => {{
        #[cfg(feature = "defmt")]
        defmt::$level!($message $(, $value)*);
        #[cfg(not(feature = "defmt"))]
        {
            $(let _ = &$value;)*
        }
    }};
}

pub(crate) use log;

#[cfg(feature = "defmt")]
use defmt_rtt as _;
