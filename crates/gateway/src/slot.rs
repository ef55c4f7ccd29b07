//! One slot: its configuration, when it is due, and its last value.

use clino_bus::Micros;
use clino_codec::angle::Angle;

use crate::{Reading, SlotConfig, Status};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot {
    pub config: SlotConfig,
    pub due: Micros,
    pub changed: bool,
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
            status: Status::NeverRead,
            angle: Angle::from_udeg(0),
            measured: None,
            sequence: 0,
        }
    }

    /// Books the next reading one period after this one was due: no drift. A reading that comes so late that
    /// the next one is due already is not made up for.
    pub fn book_next(&mut self, now: Micros) {
        let next = self.due + self.config.period;
        self.due = if next > now { next } else { now + self.config.period };
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
