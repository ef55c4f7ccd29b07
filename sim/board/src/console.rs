//! The far end of the gateway's console: a terminal on a full-duplex line.
//!
//! What the gateway sends is sampled at the terminal's own bit rate and cut into lines, each with the time of
//! its first start bit and its last stop bit. The host may type: bytes go out one after the other while the
//! gateway's receiver is on.
//!
//! A gateway whose bit time is more than [`TOLERANCE_PERCENT`] off is not read at all: a terminal with its own
//! error on top could not read it reliably. Such characters are counted, not guessed at.

use std::collections::VecDeque;
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clino_sim::node::Ns;

use crate::gaps::{self, Gap, Waiting};

use clino_segment::log::PS_PER_S;
use clino_segment::trace::Trace;
use clino_segment::wire::{Format, Received, Sent, Wire};

/// Bit rate of the console in bit/s, 8N1.
pub const BAUD: u32 = 115_200;
/// Largest deviation of the gateway's bit time: half of what 8N1 can bear, the other half is the terminal's.
pub const TOLERANCE_PERCENT: u64 = 2;

const BIT_PS: u64 = PS_PER_S / BAUD as u64;
const DATA_BITS: u8 = 8;
/// Start bit, data bits, stop bit.
const FRAME_BITS: u64 = 10;

/// A line of text from the gateway.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// First start bit.
    pub began: Ns,
    /// End of the line feed.
    pub at: Ns,
    /// The text without its line end; bytes that are no UTF-8 are replaced.
    pub text: String,
}

/// Both ends' view of the terminal.
#[derive(Debug, Default)]
pub struct Terminal {
    lines: VecDeque<Line>,
    partial: Vec<u8>,
    partial_began: Ns,
    unreadable: u64,
    /// Every byte since the last look, if they are collected.
    bytes: Option<Vec<u8>>,
    /// What is to be typed.
    typed: VecDeque<Waiting>,
}

impl Terminal {
    /// The oldest line not yet taken.
    pub fn take_line(&mut self) -> Option<Line> {
        self.lines.pop_front()
    }

    /// What has come since the last line end.
    pub fn partial(&self) -> String {
        String::from_utf8_lossy(&self.partial).into_owned()
    }

    /// Characters that could not be read because of their bit rate or format.
    pub fn unreadable(&self) -> u64 {
        self.unreadable
    }

    /// Keeps every byte from now on for [`Terminal::take_bytes`].
    pub fn keep_bytes(&mut self) {
        self.bytes.get_or_insert_default();
    }

    /// Every byte since the last call, whether or not its line is complete.
    pub fn take_bytes(&mut self) -> Vec<u8> {
        self.bytes.as_mut().map_or_else(Vec::new, mem::take)
    }

    /// Types these bytes at `at`, or as soon as the line is free. `at` must not be in the board's past, and not be
    /// before what was typed earlier.
    pub fn type_bytes(&mut self, at: Ns, bytes: &[u8]) {
        self.type_with_gaps(at, bytes, &[]);
    }

    /// The same with pauses between them.
    pub fn type_with_gaps(&mut self, at: Ns, bytes: &[u8], gaps: &[Gap]) {
        self.typed.extend(gaps::waiting(at, bytes, gaps));
    }
}

/// A terminal that the host and the wire share.
#[derive(Clone, Debug, Default)]
pub struct SharedTerminal(Arc<Mutex<Terminal>>);

impl SharedTerminal {
    /// Access to the terminal; not to be held while the board runs.
    pub fn lock(&self) -> MutexGuard<'_, Terminal> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The console's wire.
#[derive(Debug, Default)]
pub struct Console {
    terminal: SharedTerminal,
    receiver: Option<Format>,
    /// The byte on its way to the gateway, and the centre of its stop bit.
    arriving: Option<(u8, Ns)>,
    /// The line towards the gateway is busy until then.
    busy_until: Ns,
    received: VecDeque<Received>,
    /// The gateway's TX over time, if it is wanted.
    trace: Option<Trace>,
}

impl Console {
    /// A console with nothing typed.
    pub fn new() -> Self {
        Self::default()
    }

    /// The host's handle.
    pub fn terminal(&self) -> SharedTerminal {
        self.terminal.clone()
    }

    /// Records the level of the gateway's TX from now on.
    pub fn trace(&mut self) -> Trace {
        self.trace.get_or_insert_default().clone()
    }

    /// When the next typed byte starts, if there is one and a receiver for it.
    fn next_start(&self) -> Option<Ns> {
        self.receiver?;
        let next = self.terminal.lock().typed.front().copied()?;
        Some(next.start(self.busy_until))
    }

    /// Starts the next typed byte at `start`.
    fn type_next(&mut self, start: Ns) {
        let typed = self.terminal.lock().typed.pop_front();
        if let Some(Waiting { byte, .. }) = typed {
            let after = |half_bits: u64| start + (half_bits * BIT_PS / 2).div_ceil(1_000);
            self.arriving = Some((byte, after(2 * FRAME_BITS - 1)));
            self.busy_until = after(2 * FRAME_BITS);
        }
    }
}

impl Wire for Console {
    fn set_receiver(&mut self, now: Ns, format: Option<Format>) {
        self.advance(now);
        // A character that began before is lost.
        self.busy_until = self.busy_until.max(now);
        self.receiver = format;
    }

    fn send(&mut self, sent: Sent) {
        self.advance(sent.start);
        if let Some(trace) = &self.trace {
            trace.note_character(&sent);
        }
        let mut terminal = self.terminal.lock();
        let Some(byte) = readable(&sent) else {
            terminal.unreadable += 1;
            return;
        };
        if let Some(bytes) = &mut terminal.bytes {
            bytes.push(byte);
        }
        if terminal.partial.is_empty() {
            terminal.partial_began = sent.start;
        }
        if byte != b'\n' {
            terminal.partial.push(byte);
            return;
        }
        let mut bytes = mem::take(&mut terminal.partial);
        if bytes.last() == Some(&b'\r') {
            bytes.pop();
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let at = sent.start + (FRAME_BITS * sent.format.bit_ps).div_ceil(1_000);
        let began = terminal.partial_began;
        terminal.lines.push_back(Line { began, at, text });
    }

    fn drive_enable(&mut self, _now: Ns, _high: bool) {}

    fn next_event(&self) -> Option<Ns> {
        match self.arriving {
            Some((_, centre)) => Some(centre),
            None => self.next_start(),
        }
    }

    fn advance(&mut self, now: Ns) {
        loop {
            match self.arriving {
                Some((_, centre)) if centre > now => break,
                Some((byte, at)) => {
                    self.arriving = None;
                    if let Some(Format { bit_ps, data_bits, .. }) = self.receiver {
                        let framing_error = !within_tolerance(bit_ps) || data_bits != DATA_BITS;
                        let word = u16::from(byte);
                        self.received.push_back(Received { at, word, framing_error, noise: false });
                    }
                }
                None => match self.next_start() {
                    Some(start) if start <= now => self.type_next(start),
                    _ => break,
                },
            }
        }
    }

    fn take_received(&mut self) -> Option<Received> {
        self.received.pop_front()
    }
}

/// The byte that the terminal samples, if the character is one that it can read.
fn readable(sent: &Sent) -> Option<u8> {
    let Format { bit_ps, data_bits, .. } = sent.format;
    if data_bits != DATA_BITS || !within_tolerance(bit_ps) {
        return None;
    }
    // Within the tolerance the terminal's bit centres fall into the bits they are meant for, so sampling
    // gives the byte itself.
    Some(sent.word as u8)
}

fn within_tolerance(bit_ps: u64) -> bool {
    bit_ps.abs_diff(BIT_PS) * 100 <= BIT_PS * TOLERANCE_PERCENT
}

#[cfg(test)]
mod tests {
    use super::*;

    fn format(bit_ps: u64) -> Format {
        Format { bit_ps, data_bits: 8, stop_halves: 2 }
    }

    fn send(console: &mut Console, text: &str, bit_ps: u64) {
        for (n, byte) in text.bytes().enumerate() {
            let start = 1_000_000 + n as u64 * 10 * bit_ps / 1_000;
            console.send(Sent { start, word: u16::from(byte), format: format(bit_ps) });
        }
    }

    #[test]
    fn lines_carry_the_times_of_their_first_and_last_character() {
        let mut console = Console::new();
        send(&mut console, "ab\r\ncd", BIT_PS);
        let terminal = console.terminal();
        let line = terminal.lock().take_line();
        let at = 1_000_000 + 3 * 10 * BIT_PS / 1_000 + (10 * BIT_PS).div_ceil(1_000);
        assert_eq!(line, Some(Line { began: 1_000_000, at, text: "ab".into() }));
        assert_eq!(terminal.lock().take_line(), None);
        assert_eq!(terminal.lock().partial(), "cd");
    }

    #[test]
    fn bytes_are_there_before_their_line_ends() {
        let mut console = Console::new();
        send(&mut console, "a", BIT_PS);
        let terminal = console.terminal();
        terminal.lock().keep_bytes();
        send(&mut console, "b\r\nc", BIT_PS);
        assert_eq!(terminal.lock().take_bytes(), b"b\r\nc");
        assert_eq!(terminal.lock().take_bytes(), b"");
        assert_eq!(terminal.lock().take_line().map(|line| line.text), Some("ab".into()));
    }

    #[test]
    fn a_bit_time_more_than_two_percent_off_is_not_read() {
        // 1/115200 s = 8680.56 ns; 2 % of it are 173.6 ns.
        for (bit_ps, read) in [(8_508_000, true), (8_853_000, true), (8_506_000, false), (8_855_000, false)] {
            let mut console = Console::new();
            send(&mut console, "x\n", bit_ps);
            let terminal = console.terminal();
            assert_eq!(terminal.lock().take_line().is_some(), read, "{bit_ps}");
            assert_eq!(terminal.lock().unreadable(), if read { 0 } else { 2 });
        }
    }

    #[test]
    fn typed_bytes_arrive_one_after_the_other_once_the_receiver_is_on() {
        let mut console = Console::new();
        console.terminal().lock().type_bytes(0, b"hi");
        assert_eq!(console.next_event(), None);
        console.set_receiver(5_000, Some(format(BIT_PS)));
        let mut got = Vec::new();
        while let Some(next) = console.next_event() {
            console.advance(next);
            while let Some(received) = console.take_received() {
                got.push((received.at, received.word, received.framing_error));
            }
        }
        // Stop-bit centres 9.5 bits after each start, starts 10 bits apart.
        let first = 5_000 + (19 * BIT_PS / 2).div_ceil(1_000);
        let second = 5_000 + (10 * BIT_PS).div_ceil(1_000) + (19 * BIT_PS / 2).div_ceil(1_000);
        assert_eq!(got, [(first, u16::from(b'h'), false), (second, u16::from(b'i'), false)]);
    }

    #[test]
    fn bytes_wait_for_their_time() {
        let mut console = Console::new();
        console.set_receiver(0, Some(format(BIT_PS)));
        console.terminal().lock().type_bytes(1_000_000, b"x");
        assert_eq!(console.next_event(), Some(1_000_000));
        console.advance(999_999);
        assert_eq!(console.next_event(), Some(1_000_000));
        console.advance(1_000_000);
        assert_eq!(console.next_event(), Some(1_000_000 + (19 * BIT_PS / 2).div_ceil(1_000)));
    }
}
