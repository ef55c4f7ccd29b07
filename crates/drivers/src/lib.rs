#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::arithmetic_side_effects,
        clippy::expect_used,
        clippy::indexing_slicing,
        clippy::panic,
        clippy::unwrap_used
    )
)]
#![cfg_attr(feature = "nb", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "nb"),
    doc = "Drivers for US Digital T7 and STT ISU inclinometers; see the README."
)]

#[cfg(feature = "async")]
pub mod asynch;
mod exchange;
pub mod isu;
mod port;
pub mod rs485;
#[cfg(feature = "commissioning")]
pub mod run;
mod suspect;
pub mod t7;
pub mod uart;
mod upkeep;

#[cfg(feature = "async")]
pub use port::AsyncPort;
pub use port::Port;

pub use isu::SttIsu;
pub use rs485::{PortSettings, Rs485};
pub use suspect::Suspect;
pub use t7::UsDigitalT7;

pub use clino_bus::{Blame, BusCounters, Duration, Retry, Serial, Timing};
pub use clino_codec as codec;
#[cfg(feature = "commissioning")]
pub use clino_commissioning as commissioning;
