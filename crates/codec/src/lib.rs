#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]
#![doc = include_str!("../README.md")]

pub mod angle;
pub mod ascii;
mod bytes;
pub mod character;
#[doc = include_str!("../DOCUMENTS.md")]
pub mod documents {}
pub mod checks;
pub mod isu;
mod progress;
pub mod pwm;
mod stream;
pub mod t7;

pub use progress::DecodeProgress;

#[cfg(test)]
extern crate std;
