//! The examples do what they say.
#![cfg(all(feature = "embedded-io", feature = "nb"))]
#![allow(clippy::duplicate_mod, reason = "each example brings its board along")]

#[path = "../examples/isu_blocking.rs"]
mod isu_blocking;
#[path = "../examples/rs485.rs"]
mod rs485;
#[path = "../examples/t7_blocking.rs"]
mod t7_blocking;
#[path = "../examples/t7_nb.rs"]
mod t7_nb;

#[cfg(feature = "commissioning")]
#[path = "../examples/isu_address.rs"]
mod isu_address;
#[cfg(feature = "commissioning")]
#[path = "../examples/t7_address.rs"]
mod t7_address;

#[cfg(feature = "async")]
#[path = "../examples/isu_async.rs"]
mod isu_async;
#[cfg(feature = "async")]
#[path = "../examples/t7_async.rs"]
mod t7_async;

#[test]
fn t7_blocking() {
    t7_blocking::main().unwrap();
}

#[test]
fn t7_nb() {
    t7_nb::main().unwrap();
}

#[test]
fn isu_blocking() {
    isu_blocking::main().unwrap();
}

#[cfg(feature = "commissioning")]
#[test]
fn t7_address() {
    t7_address::main().unwrap();
}

#[cfg(feature = "commissioning")]
#[test]
fn isu_address() {
    isu_address::main().unwrap();
}

#[test]
fn rs485() {
    rs485::main().unwrap();
}

#[cfg(feature = "async")]
#[test]
fn t7_async() {
    t7_async::main().unwrap();
}

#[cfg(feature = "async")]
#[test]
fn isu_async() {
    isu_async::main().unwrap();
}
