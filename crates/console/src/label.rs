//! A name with its unit.

use crate::out::Out;

/// A name and its unit, as they stand in answers: `period_ms`.
#[derive(Clone, Copy)]
pub struct Label {
    pub name: &'static str,
    pub unit: &'static str,
}

impl Label {
    /// A name without a unit.
    pub const fn plain(name: &'static str) -> Label {
        Label { name, unit: "" }
    }

    #[inline(never)]
    pub fn write(&self, out: &mut dyn Out) {
        out.put(self.name.as_bytes());
        // Every bit rate is in bit/s.
        if self.unit.is_empty() || self.unit == "bit/s" {
            return;
        }
        out.put(b"_");
        for byte in self.unit.bytes() {
            out.put(&[if byte == b'/' { b'_' } else { byte }]);
        }
    }
}
