//! One slot: its configuration, when it is due, and its last value.

use clino_bus::Micros;
use clino_codec::angle::Angle;
use clino_codec::isu::eeprom::Change as Eeprom;
use clino_commissioning::{Change, Report};

use crate::task::{News, isu, t7};
use crate::{Reading, SlotConfig, Source, Status};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub config: SlotConfig,
    pub due: Micros,
    pub changed: bool,
    /// Tries of the reading in hand that have failed.
    pub tried: u8,
    /// Readings in a row to which there was no answer.
    pub silent: u8,
    /// The node is taken for dead.
    pub dead: bool,
    status: Status,
    angle: Angle,
    measured: Option<Micros>,
    sequence: u32,
}

impl Slot {
    pub fn new(config: SlotConfig) -> Slot {
        Slot {
            config,
            due: Micros::ZERO,
            changed: true,
            tried: 0,
            silent: 0,
            dead: false,
            status: match config.source {
                Source::Off => Status::Disabled,
                _ => Status::NeverRead,
            },
            angle: Angle::from_udeg(0),
            measured: None,
            sequence: 0,
        }
    }

    /// From now on the slot means this: nothing was read yet.
    pub fn set(&mut self, config: SlotConfig) {
        *self = Slot { sequence: self.sequence.wrapping_add(1), ..Slot::new(config) };
    }

    /// A sensor that has moved to another address is followed there. Returns whether it is this one.
    pub fn follow(&mut self, news: &News) -> bool {
        let source = match (*news, self.config.source) {
            (
                News::T7(t7::News::Address(Report { change: Change::Changed { from, to }, .. })),
                Source::T7 { address, axis },
            ) if address == from => Source::T7 { address: to, axis },
            (
                News::Isu(isu::News::Programmed(Report {
                    change:
                        Change::Changed { from: Eeprom::ModuleAddress(from), to: Eeprom::ModuleAddress(to) },
                    ..
                })),
                Source::Isu { address },
            ) if address == from => Source::Isu { address: to },
            _ => return false,
        };
        self.set(SlotConfig { source, ..self.config });
        true
    }

    /// Books the next reading one period after this one was due: no drift. A reading that comes so late that
    /// the next one is due already is not made up for.
    pub fn book_next(&mut self, now: Micros) {
        let next = self.due + self.config.period;
        self.due = if next > now { next } else { now + self.config.period };
    }

    /// When the last angle was measured.
    pub fn last_read(&self) -> Option<Micros> {
        self.measured
    }

    /// A reading ended: with an angle measured at `at`, or with the reason why there is none.
    pub fn settle(&mut self, result: Result<Angle, Status>, at: Micros) {
        match result {
            Ok(angle) => {
                self.status = Status::Ok;
                self.angle = angle;
                self.measured = Some(at);
            }
            Err(status) => self.status = status,
        }
        self.sequence = self.sequence.wrapping_add(1);
        self.changed = true;
    }

    pub fn reading(&self, slot: u8) -> Reading {
        Reading {
            slot,
            source: self.config.source,
            sequence: self.sequence,
            status: self.status,
            angle: self.angle,
            measured: self.measured,
            stale_after: self.config.stale_after,
            period: self.config.period,
            report_every: self.config.report_every,
        }
    }
}
