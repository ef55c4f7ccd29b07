//! The pair between one of the gateway's ports and a computer with an RS485 adapter: the Modbus master, or, where a bus of
//! sensors is served by another program, that program.

use clino_segment::chance::Chance;
use clino_segment::log::SharedLog;
use clino_segment::trace::Trace;
use clino_segment::wire::{Format, Received, Sent, Wire};
use clino_segment::{Noise, Segment, SegmentSettings};
use clino_sim::node::Ns;

use super::{Framing, SharedMaster};
use crate::gaps::Waiting;

/// The wire of the Modbus port.
pub struct ModbusLine {
    pair: Segment,
    master: SharedMaster,
    /// What the master's receiver is set to.
    framing: Framing,
    /// The character under way ends; the next begins, or the driver is switched off.
    sending_until: Option<Ns>,
    clock: Ns,
}

impl ModbusLine {
    /// A pair with a computer that listens; `name` is the computer's in the log.
    pub fn new(name: &str, framing: Framing) -> Self {
        let settings = SegmentSettings { chance: Chance::new(0), echo: false, noise: Noise::default() };
        let mut pair = Segment::new(settings, Vec::new()).with_second_master(name);
        pair.set_second_master_receiver(0, Some(framing.format()));
        let master = SharedMaster::default();
        master.lock().set_framing(framing);
        Self { pair, master, framing, sending_until: None, clock: 0 }
    }

    /// The host's handle.
    pub fn master(&self) -> SharedMaster {
        self.master.clone()
    }

    /// Everything that happens on the pair.
    pub fn log(&self) -> SharedLog {
        self.pair.log()
    }

    /// Records the level of the pair.
    pub fn trace(&mut self) -> Trace {
        self.pair.trace()
    }

    /// The master's next act of its own.
    fn next_act(&self) -> Option<Ns> {
        let master = self.master.lock();
        if master.framing != self.framing {
            return Some(self.clock);
        }
        let waiting = master.next_start().map(|at| at.max(self.clock));
        [self.sending_until.or(waiting), master.answer_ends()].into_iter().flatten().min()
    }

    /// Lets the master do what is due at `now`.
    fn act(&mut self, now: Ns) {
        let mut master = self.master.lock();
        if master.framing != self.framing {
            self.framing = master.framing;
            self.pair.set_second_master_receiver(now, Some(self.framing.format()));
        }
        if master.answer_ends().is_some_and(|end| end <= now) {
            master.end_answer();
        }
        if self.sending_until.is_some_and(|until| until > now) {
            return;
        }
        let due = master.next_start().is_some_and(|at| at <= now);
        if due != self.sending_until.is_some() {
            self.pair.drive_as_second_master(now, due);
        }
        self.sending_until = None;
        if due && let Some(Waiting { byte, .. }) = master.outgoing.pop_front() {
            let end = now + self.framing.character();
            let word = self.framing.put_together(byte);
            self.pair.send_as_second_master(Sent { start: now, word, format: self.framing.format() });
            self.sending_until = Some(end);
            master.sent_until = end;
            master.traffic.sent += 1;
        }
    }
}

impl Wire for ModbusLine {
    fn set_receiver(&mut self, now: Ns, format: Option<Format>) {
        self.advance(now);
        self.master.lock().gateway_has_listened |= format.is_some();
        self.pair.set_receiver(now, format);
    }

    fn send(&mut self, sent: Sent) {
        self.advance(sent.start);
        self.pair.send(sent);
    }

    fn drive_enable(&mut self, now: Ns, high: bool) {
        self.advance(now);
        self.pair.drive_enable(now, high);
        self.master.lock().drive_enabled(now, high);
    }

    fn next_event(&self) -> Option<Ns> {
        self.pair.next_event().into_iter().chain(self.next_act()).min()
    }

    fn advance(&mut self, now: Ns) {
        while let Some(at) = self.next_event().filter(|at| *at <= now) {
            self.pair.advance(at);
            self.clock = self.clock.max(at);
            while let Some(received) = self.pair.take_heard_by_second_master() {
                self.master.lock().hear(received);
            }
            if self.next_act().is_some_and(|due| due <= at) {
                self.act(at);
            }
        }
        self.pair.advance(now);
        self.clock = now;
    }

    fn take_received(&mut self) -> Option<Received> {
        self.pair.take_received()
    }
}
