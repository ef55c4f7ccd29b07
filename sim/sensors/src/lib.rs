//! Simulated inclinometers, written from the vendors' documents with their own byte handling, so that a
//! mistake in `clino-codec` cannot hide behind the same mistake here.
//!
//! What is modelled, from which section of which document, and which test shows it: see the README.
//!
//! Everything is sans-IO and deterministic: time comes in as nanoseconds, characters come in as
//! [`node::Heard`], and what a sensor sends goes out as [`node::Burst`]. Same options, same seed and same
//! input give the same output on every machine.
//!
//! | Module | What |
//! |---|---|
//! | [`node`] | the seam between a sensor and its line |
//! | [`motion`] | the true angle over time |
//! | [`t7`] | US Digital T7-1 and T7-3, binary protocol on RS485 |
//! | [`isu`] | STT ISU, binary protocol and ASCII mode |
//! | [`pwm`] | the ISU's PWM output |
//! | [`fault`] | spoilt, late, short and missing answers |
//! | [`latency`] | how long a sensor takes, fixed or jittered |
//! | [`said`] | what a sensor sent, for checkers |
//! | [`shared`] | a node that stays in reach after it has been put on a line |

pub mod fault;
pub mod isu;
pub mod latency;
pub mod motion;
pub mod node;
pub mod pwm;
pub mod said;
pub mod shared;
pub mod t7;
mod uart;

/// Its example is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
