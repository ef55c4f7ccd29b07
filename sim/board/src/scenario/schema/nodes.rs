//! The nodes of the RS485 segments: T7 and ISU inclinometers.

use clino_segment::{Faults, Probability};
use serde::Deserialize;
use toml::Spanned;

use super::answers::{Fault, Latency};
use super::intervals::{Babble, Interval, bounds};
use super::motion::Moves;
use crate::scenario::units::{Chances, Number, Time};

/// Declares a node: its own keys, among those that every node has.
///
/// A macro, because the keys stand side by side in the file, and the schema does without `flatten`.
macro_rules! node {
    ($(#[$about:meta])* $name:ident { $($(#[$key_about:meta])* $visible:vis $key:ident: $type:ty,)* }) => {
        $(#[$about])*
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Its address.
            pub address: Spanned<u8>,
            /// How it moves; an ISU relative to its null position.
            pub motion: Moves,
            $($(#[$key_about])* $visible $key: $type,)*
            /// A fault of every n-th answer.
            pub fault: Option<Fault>,
            /// When it is unplugged.
            #[serde(default)]
            pub unplugged: Vec<Spanned<Interval>>,
            /// When it talks out of turn.
            #[serde(default)]
            pub babble: Vec<Spanned<Babble>>,
            /// Probability that a byte of an answer is changed.
            #[serde(default)]
            pub corrupt: Number<Chances>,
            /// Probability that an answer ends early.
            #[serde(default)]
            pub shorten: Number<Chances>,
        }

        impl $name {
            /// Its faults on the line, in the segment's terms.
            pub fn faults(&self) -> Faults {
                let babble = self.babble.iter().map(Spanned::get_ref);
                Faults {
                    unplugged: bounds(&self.unplugged),
                    babble: babble.map(Babble::in_segment).collect(),
                    corrupt: self.corrupt.0,
                    shorten: self.shorten.0,
                }
            }

            /// Whether some of its answers are lost or spoilt.
            pub fn is_unreliable(&self) -> bool {
                self.fault.is_some()
                    || self.corrupt.0 != Probability::NEVER
                    || self.shorten.0 != Probability::NEVER
            }
        }
    };
}

node! {
    /// A T7.
    T7 {
        /// Bit rate in bit/s.
        pub baud: Option<Spanned<u32>>,
        /// End of a Get command to the answer.
        pub latency: Option<Spanned<Latency>>,
        /// How long its driver holds the line after an answer.
        pub hold: Option<Time>,
        /// It answers Get All Angles with the length byte of the document's example.
        #[serde(default)]
        pub length_quirk: bool,
    }
}

node! {
    /// An ISU.
    Isu {
        /// End of a command to its line driver.
        pub latency: Option<Spanned<Latency>>,
        /// How long after the module has begun to run its refresh begins.
        pub phase: Option<Spanned<Time>>,
    }
}
