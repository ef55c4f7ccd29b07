//! What stands between a computer and a pair: a UART at the computer's bit rate, and a line driver that is on from the
//! first start bit to the last stop bit, as in an RS485 adapter with automatic direction control.
//!
//! What the computer sends goes out character by character, and what it hears it gets at the centre of each stop
//! bit: an answer comes at the pace it has on the pair, not as a whole when it is over, so that gaps in it and
//! collisions with it are where they are.
//!
//! No port of a computer turns a byte heard into a byte sent within microseconds, but a program on a pseudo-terminal
//! can, and would meet the sensor's driver still on. So the adapter begins to send one character after the last
//! character heard at the earliest.

use std::collections::VecDeque;

use clino_segment::Segment;
use clino_segment::wire::{Format, Received, Sent, Wire as _};
use clino_sim::node::Ns;

/// Bytes that wait to be sent: what a serial port of Linux holds.
const QUEUE: usize = 4_096;

const PS_PER_S: u64 = 1_000_000_000_000;
const PS_PER_NS: u64 = 1_000;
/// Start bit, eight data bits, stop bit.
const BITS: u64 = 10;

/// The adapter and the pair it is on.
pub struct Adapter {
    segment: Segment,
    format: Format,
    outgoing: VecDeque<u8>,
    /// When the next character begins, or the driver is switched off for want of one.
    next_character: Option<Ns>,
    /// The driver is on.
    drives: bool,
    /// No character begins before.
    guarded_until: Ns,
}

impl Adapter {
    /// An adapter that listens.
    pub fn new(mut segment: Segment, baud: u32) -> Self {
        let format = format(baud);
        segment.set_receiver(0, Some(format));
        Self {
            segment,
            format,
            outgoing: VecDeque::new(),
            next_character: None,
            drives: false,
            guarded_until: 0,
        }
    }

    /// The bit rate from the next character on; one that is being received is lost.
    pub fn set_baud(&mut self, now: Ns, baud: u32) {
        if format(baud) != self.format {
            self.format = format(baud);
            self.segment.set_receiver(now, Some(self.format));
        }
    }

    /// How many bytes can be given to it.
    pub fn room(&self) -> usize {
        QUEUE.saturating_sub(self.outgoing.len())
    }

    /// Sends these bytes after those that wait already.
    pub fn send(&mut self, now: Ns, bytes: &[u8]) {
        self.outgoing.extend(bytes);
        if self.next_character.is_none() && !bytes.is_empty() {
            self.next_character = Some(now.max(self.guarded_until));
        }
    }

    /// When something happens next, unless it is given bytes before.
    pub fn next_event(&self) -> Option<Ns> {
        self.segment.next_event().into_iter().chain(self.next_character).min()
    }

    /// Lets everything up to and including `now` happen; returns the bytes heard.
    ///
    /// A byte with a false stop bit comes as it was sampled, as from a Linux port without parity check.
    pub fn run(&mut self, now: Ns) -> Vec<u8> {
        while let Some(at) = self.next_event().filter(|at| *at <= now) {
            self.segment.advance(at);
            if self.next_character.is_some_and(|due| due <= at) {
                self.shift(at);
            }
        }
        self.segment.advance(now);
        let heard: Vec<Received> = core::iter::from_fn(|| self.segment.take_received()).collect();
        if let Some(last) = heard.last() {
            self.guarded_until = last.at + self.character();
        }
        heard.into_iter().map(|received| received.word as u8).collect()
    }

    /// Whether a character is on its way, or waits.
    pub fn is_sending(&self) -> bool {
        self.next_character.is_some()
    }

    /// The bit rate of the first sensor just now.
    pub fn first_baud(&self) -> Option<u32> {
        self.segment.node_baud(0)
    }

    /// Begins the next character, or ends the transmission.
    fn shift(&mut self, now: Ns) {
        let byte = self.outgoing.pop_front();
        if byte.is_some() != self.drives {
            self.drives = byte.is_some();
            self.segment.drive_enable(now, self.drives);
        }
        self.next_character = byte.map(|byte| {
            self.segment.send(Sent { start: now, word: u16::from(byte), format: self.format });
            now + self.character()
        });
    }

    /// Length of a character.
    pub fn character(&self) -> Ns {
        (BITS * self.format.bit_ps).div_ceil(PS_PER_NS)
    }
}

fn format(baud: u32) -> Format {
    Format { bit_ps: PS_PER_S / u64::from(baud.max(1)), data_bits: 8, stop_halves: 2 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::t7::T7;
    use clino_segment::chance::Chance;
    use clino_segment::{Noise, SegmentSettings};

    const ASK: [u8; 3] = [0x05, 0x01, 0x83];
    /// 12.345°.
    const ANSWER: [u8; 8] = [0x05, 0x06, 0x83, 0x00, 0x00, 0x30, 0x39, 0x09];
    const CHARACTER: Ns = 86_806;
    const LATENCY: Ns = 2_000_000;

    fn adapter(echo: bool) -> Adapter {
        let chance = Chance::new(0);
        let station = T7::parse("5,angle=12.345").unwrap().station(0, chance).unwrap();
        let segment = Segment::new(SegmentSettings { chance, echo, noise: Noise::default() }, vec![station]);
        Adapter::new(segment, 115_200)
    }

    /// What is heard from `from` on, with the times of [`Adapter::next_event`] at which it was.
    fn heard(adapter: &mut Adapter, until: Ns) -> Vec<(Ns, u8)> {
        let mut heard = Vec::new();
        while let Some(at) = adapter.next_event().filter(|at| *at <= until) {
            heard.extend(adapter.run(at).into_iter().map(|byte| (at, byte)));
        }
        heard
    }

    #[test]
    fn an_answer_comes_at_its_pace() {
        let mut adapter = adapter(false);
        adapter.run(1_000);
        adapter.send(1_000, &ASK);
        let heard = heard(&mut adapter, 10_000_000);
        let end = 1_000 + 3 * CHARACTER + LATENCY;
        for (place, (byte, (at, got))) in ANSWER.into_iter().zip(&heard).enumerate() {
            let centre = end + place as u64 * CHARACTER + CHARACTER * 19 / 20;
            assert!(at.abs_diff(centre) < 50, "byte {place} at {at}, not {centre}");
            assert_eq!(*got, byte);
        }
        assert_eq!(heard.len(), ANSWER.len());
    }

    #[test]
    fn the_next_command_leaves_the_sensor_time_to_let_go() {
        let mut adapter = adapter(false);
        adapter.send(0, &ASK);
        for _ in 0..100 {
            let answer = heard(&mut adapter, Ns::MAX / 1_000);
            assert_eq!(answer.iter().map(|&(_, byte)| byte).collect::<Vec<_>>(), ANSWER);
            // At once: in the middle of the answer's last stop bit.
            adapter.send(answer[7].0, &ASK);
        }
    }

    #[test]
    fn a_late_look_changes_nothing() {
        let mut adapter = adapter(false);
        adapter.send(0, &ASK);
        assert_eq!(adapter.run(1_000_000_000), ANSWER);
        adapter.send(1_000_000_000, &ASK);
        assert_eq!(adapter.run(1_001_000_000), b"");
        assert_eq!(adapter.run(2_000_000_000), ANSWER);
    }

    #[test]
    fn a_command_in_two_pieces_is_one() {
        let mut adapter = adapter(false);
        adapter.send(0, &ASK[..1]);
        adapter.run(10_000);
        adapter.send(10_000, &ASK[1..2]);
        assert_eq!(adapter.run(20_000_000), b"");
        adapter.send(20_000_000, &ASK[2..]);
        assert_eq!(adapter.run(1_000_000_000), ANSWER);
    }

    #[test]
    fn the_computer_hears_itself_only_with_echo() {
        let mut adapter = adapter(true);
        adapter.send(0, &ASK);
        assert_eq!(adapter.run(1_000_000_000), [&ASK[..], &ANSWER].concat());
    }

    #[test]
    fn at_a_wrong_bit_rate_no_sensor_answers() {
        let mut adapter = adapter(false);
        for baud in [9_600, 19_200, 38_400, 57_600] {
            let now = u64::from(baud) * 1_000_000;
            adapter.run(now);
            adapter.set_baud(now, baud);
            adapter.send(now, &ASK);
            assert_eq!(adapter.run(now + 1_000_000_000), b"", "{baud}");
        }
        let now = 100_000_000_000;
        adapter.run(now);
        adapter.set_baud(now, 115_200);
        adapter.send(now, &ASK);
        assert_eq!(adapter.run(now + 1_000_000_000), ANSWER);
    }

    #[test]
    fn it_takes_no_more_than_it_has_room_for() {
        let mut adapter = adapter(false);
        adapter.send(0, &[0; QUEUE]);
        assert_eq!(adapter.room(), 0);
        adapter.run(CHARACTER);
        assert_eq!(adapter.room(), 2);
    }
}
