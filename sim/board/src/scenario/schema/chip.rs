//! Faults of the chip itself: its oscillators, and fault injection into the running firmware.

use std::num::NonZeroU32;

use serde::Deserialize;
use toml::Spanned;

use super::File;
use crate::injection::{Level, What};
use crate::oscillators::{CrystalLife, HSI_HZ, LSI_HZ, Oscillators};
use crate::scenario::units::{Deviation, Number, Time};

/// The crystal.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Crystal {
    /// It never starts.
    pub dead: bool,
    /// When it stops.
    pub stops_at: Option<Spanned<Time>>,
    /// When it can swing again.
    pub returns_at: Option<Spanned<Time>>,
    /// Relative error of the internal oscillator.
    pub internal_error: Number<Deviation>,
}

impl File {
    /// The chip's oscillators in the board's terms.
    pub fn oscillators(&self) -> Oscillators {
        let Crystal { dead, stops_at, returns_at, internal_error } = &self.crystal;
        let at = |time: &Option<Spanned<Time>>| time.as_ref().map(|time| time.get_ref().0);
        Oscillators {
            lsi_hz: self.lsi_hz.as_ref().map_or(LSI_HZ, |hz| *hz.get_ref()),
            hsi_hz: HSI_HZ.saturating_add_signed(internal_error.0),
            crystal: CrystalLife {
                stops_at: if *dead { Some(0) } else { at(stops_at) },
                returns_at: at(returns_at),
            },
        }
    }
}

/// A fault planted into the running firmware.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Injection {
    /// From when on: it happens when the level executes next.
    pub at: Time,
    /// What it does.
    pub what: Spanned<What>,
    /// Where.
    pub level: Level,
    /// How often.
    #[serde(default = "once")]
    pub times: NonZeroU32,
    /// How long after the reset that it brought it is due again.
    #[serde(default)]
    pub again: Time,
}

fn once() -> NonZeroU32 {
    NonZeroU32::MIN
}
