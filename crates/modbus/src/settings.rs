//! Settings of the port. Their table, and its times, are in the gateway's tables.

pub use clino_gateway::settings::port::{
    ADDRESSES, BIT_RATES, Parity, Pauses, PortSettings as Settings, StopBits,
};
