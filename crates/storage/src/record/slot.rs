//! How a slot is written: a byte for its kind, a byte for its address if there is a kind, and its differences.
//!
//! A slot as usual takes three bytes, one that is off two. An address of 255 was never set.

use clino_gateway::config::{Kind, SINGLE_AXIS};
use clino_gateway::settings::Tabled;
use clino_gateway::settings::slot::{self, id};
use clino_gateway::{SlotConfig, Source};

use super::Reject;
use super::base::base;
use super::bytes::{Reader, Writer};
use super::differences;

/// Bytes of the longest slot: kind and address are settings of the table, too.
pub(crate) const LONGEST: usize = differences::longest(&slot::TABLE);

/// In place of an address that was never set.
const NO_ADDRESS: u8 = u8::MAX;

pub(crate) fn encode(config: &SlotConfig, writer: &mut Writer<'_>) {
    let kind = config.source.kind();
    let base = base(start(config.source));
    writer.byte(kind as u8);
    match config.source {
        Source::Off | Source::Incomplete { kind: Kind::Off, .. } => {}
        Source::Incomplete { address: 0, .. } => writer.byte(NO_ADDRESS),
        source => writer.byte(source.address()),
    }
    let differs = |place: usize, _| {
        slot::SETTINGS.get(place).is_some_and(|setting| slot::differs(setting, config, &base))
    };
    differences::encode(&Tabled::new(&slot::SETTINGS, config), &differs, writer);
}

pub(crate) fn decode(reader: &mut Reader<'_>) -> Option<SlotConfig> {
    let code = reader.byte()?;
    let Some(kind) = Kind::from_code(code) else { return reader.refuse(Reject::Code { what: "kind", code }) };
    let source = match kind {
        Kind::Off => Source::Off,
        _ => match reader.byte()? {
            NO_ADDRESS => Source::held(kind, 0, SINGLE_AXIS),
            address => Source::of(kind, address, SINGLE_AXIS),
        },
    };
    let mut config = base(source);
    differences::decode(&mut Tabled::new(&slot::SETTINGS, &mut config), reader)?;
    // Its difference would be another way to write the same.
    if config.source.kind() != kind {
        return reader.refuse(Reject::Code { what: "kind", code: id::KIND });
    }
    Some(config)
}

/// The source that the differences are counted from: an unused slot may hold an address, a T7 have another axis.
fn start(source: Source) -> Source {
    match source {
        Source::Incomplete { kind: Kind::Off, .. } => Source::Off,
        Source::T7 { address, .. } => Source::T7 { address, axis: SINGLE_AXIS },
        source => source,
    }
}
