//! Faults of the line by order of the scenario, as they come and go: a shorted pair, a shorted DE.

use super::Segment;
use super::line::{Ps, to_ps};
use crate::log::LineEvent;

impl Segment {
    /// Lets the faults of the line begin and end that are due.
    pub(super) fn change_faults(&mut self) {
        while let Some(at) = self.faults.next_change(self.faults_seen)
            && to_ps(at) <= self.clock
        {
            self.faults_seen = Some(at);
            let (stuck, de_shorted) = (self.faults.stuck_at(at), self.faults.de_shorted_at(at));
            if stuck != self.stuck {
                self.stuck = stuck;
                self.news.push(LineEvent::StuckLine { at, level: stuck });
                self.resolve(self.clock);
            }
            if de_shorted != self.de_shorted {
                self.de_shorted = de_shorted;
                self.news.push(LineEvent::DeShorted { at, on: de_shorted });
                self.switch_gateway(self.clock);
            }
        }
    }

    /// Switches the gateway's driver and receiver as its pin and its faults say.
    pub(super) fn switch_gateway(&mut self, at: Ps) {
        let on = self.de || self.de_shorted;
        let masks = !self.settings.echo;
        if masks && on {
            self.receiver.mask(at, true, &self.line, &self.settings.noise);
        }
        self.drivers[0].switch(at, on, &mut self.news);
        self.resolve(at);
        if masks && !on {
            self.receiver.mask(at, false, &self.line, &self.settings.noise);
        }
    }
}
