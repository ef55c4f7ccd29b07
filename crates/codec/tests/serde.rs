//! The optional `serde` feature: values survive, and what cannot be does not come in.
#![cfg(feature = "serde")]

use std::fmt::Debug;

use clino_codec::angle::{Angle, Range};
use clino_codec::ascii::Centidegrees;
use clino_codec::checks::{CheckCounters, Checks, ValueRange};
use clino_codec::isu::eeprom::{Change, Image, Plan, ShutoffBit};
use clino_codec::pwm::{Law, Limits, Ticks};
use clino_codec::{isu, t7};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{from_str, to_string};

fn survives<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: T) -> String {
    let text = to_string(&value).unwrap();
    assert_eq!(from_str::<T>(&text).unwrap(), value);
    text
}

#[test]
fn values_survive() {
    assert_eq!(survives(Angle::from_udeg(-45_313_000)), "-45313000");
    survives(t7::Answer::decode(&[0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27]).unwrap());
    survives(t7::Request::decode(&[0x05, 0x03, 0x8F, 0x04, 0x65]).unwrap());
    survives(t7::Answer::decode(&[0x05, 0x07]).unwrap_err());
    assert_eq!(survives(t7::Status::new(200)), "200");
    survives(isu::Answer::decode(&[0x04, 0x05, 0x58, 0x40, 0x00, 0x9D]).unwrap());
    survives(isu::Request::READ_ANGLE);
    assert_eq!(survives(isu::Words::new(&[1, 0xFFFF]).unwrap()), "[1,65535]");
    assert_eq!(survives(isu::Data::new(&[1, 0xFF]).unwrap()), "[1,255]");
    survives(Plan::change(&Image::new([0; 256]), Change::NullPosition(7)).unwrap());
    survives(Change::AutoShutoff { bit: ShutoffBit::Bit0, enabled: true });
    survives(Checks { values: ValueRange::Mode(Range::Bidirectional), ..Checks::ALL });
    survives(CheckCounters::new());
    survives((Law::Idealised, Limits::new(84_000_000), Ticks { period: 3, high: 1 }));
    assert_eq!(survives(Centidegrees::new(-431).unwrap()), "-431");
}

#[test]
fn what_cannot_be_is_refused() {
    assert!(from_str::<t7::Address>("101").is_err());
    assert!(from_str::<isu::Address>("16").is_err());
    assert!(from_str::<Centidegrees>("18001").is_err());
    let long = |count| to_string(&vec![0; count]).unwrap();
    assert!(from_str::<isu::Data>(&long(253)).is_ok() && from_str::<isu::Data>(&long(254)).is_err());
    assert!(from_str::<isu::Words>(&long(126)).is_ok() && from_str::<isu::Words>(&long(127)).is_err());
    assert!(from_str::<isu::Data>("7").unwrap_err().to_string().contains("at most 253 bytes"));
    assert!(from_str::<isu::Words>("7").unwrap_err().to_string().contains("at most 126 words"));
}
