//! What happened on one serial line: every character, every driver and DE edge, everything the gateway
//! heard, each with its virtual time.
//!
//! The log is written by [`crate::segment::Segment`] and is the only source of the figures in
//! the analysis of the virtual board. Characters are logged when they end, so records are nearly, not exactly, in the order
//! of their times; [`SegmentLog::in_order`] sorts them.
//!
//! Text form ([`SegmentLog::write_text`]): one record per line, `time_ns line event node details`, documented in
//! `docs/scenario.md`.

use std::fmt;
use std::io;
use std::sync::{Arc, Mutex};

use clino_sim::node::Ns;

/// Picoseconds in a second: bit time in ps = `PS_PER_S / baud`.
pub const PS_PER_S: u64 = 1_000_000_000_000;

/// A transmitter (and receiver) on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Talker {
    /// The gateway's USART behind its DE pin.
    Gateway,
    /// A simulated sensor, by its place in the segment.
    Node(usize),
}

/// What became of a character between its transmitter and the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It was on the line from start to stop bit, and no other driver opposed it.
    Clean,
    /// Another driver drove the opposite level at some time during it.
    Fought,
    /// The line driver was switched off at `at`, before the end of the stop bit.
    Cut {
        /// When the driver was switched off.
        at: Ns,
    },
    /// The line driver was switched on at `at`, after the start bit had begun.
    Late {
        /// When the driver took the line.
        at: Ns,
    },
    /// The line driver was off all the time: nothing reached the line.
    Undriven,
}

/// One thing that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LineEvent {
    /// A transmitter shifted out a character.
    Char {
        /// The sender.
        who: Talker,
        /// Beginning of the start bit.
        start: Ns,
        /// End of the last stop bit.
        end: Ns,
        /// The data bits.
        word: u16,
        /// Length of a bit in picoseconds.
        bit_ps: u64,
        /// Whether it reached the line whole.
        fate: Fate,
    },
    /// The gateway's receiver got a character.
    Heard {
        /// Centre of the stop bit.
        at: Ns,
        /// The sampled bits.
        word: u16,
        /// The stop bit was low.
        framing_error: bool,
        /// A bit was sampled while two drivers fought.
        noise: bool,
    },
    /// The gateway's DE pin changed.
    De {
        /// When.
        at: Ns,
        /// The new level.
        high: bool,
    },
    /// A sensor's line driver was switched.
    Drive {
        /// The sensor.
        node: usize,
        /// When.
        at: Ns,
        /// On or off.
        on: bool,
    },
    /// Two or more drivers were on at once.
    Contention {
        /// The second driver came on.
        from: Ns,
        /// At most one was left.
        until: Ns,
        /// All senders that took part.
        who: Vec<Talker>,
        /// They drove opposite levels at some time, so something was spoiled.
        fought: bool,
    },
    /// A sensor was unplugged or plugged in.
    Power {
        /// The sensor.
        node: usize,
        /// When.
        at: Ns,
        /// Plugged in.
        on: bool,
    },
    /// Injected noise: these bits of a character (bit 0 is the start bit) were inverted for one receiver.
    Flipped {
        /// The receiver that was hit.
        receiver: Talker,
        /// Beginning of the start bit it sampled.
        at: Ns,
        /// The inverted bits.
        bits: u16,
    },
    /// Injected noise: one receiver lost a whole character.
    Dropped {
        /// The receiver that was hit.
        receiver: Talker,
        /// Centre of the stop bit.
        at: Ns,
    },
    /// Injected fault: a sensor's answer was changed before it was sent.
    Altered {
        /// The sensor.
        node: usize,
        /// Start of the answer.
        at: Ns,
        /// What was done.
        how: Alteration,
    },
    /// Injected fault: the pair was shorted, or is so no more.
    StuckLine {
        /// When.
        at: Ns,
        /// What every receiver reads from now on; `None` for what the drivers make of it.
        level: Option<bool>,
    },
    /// Injected fault: the gateway's driver cannot be switched off any more, or can again.
    DeShorted {
        /// When.
        at: Ns,
        /// Whether it is on regardless of the pin.
        on: bool,
    },
}

/// How an answer was changed on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alteration {
    /// Byte `index` was XORed with `mask`.
    Corrupted {
        /// Place of the byte in the answer.
        index: usize,
        /// The inverted bits, never zero.
        mask: u8,
    },
    /// Only the first `length` bytes were sent.
    Shortened {
        /// Bytes left.
        length: usize,
    },
}

impl LineEvent {
    /// When it happened (the beginning, for what lasts).
    pub fn at(&self) -> Ns {
        match *self {
            LineEvent::Char { start: at, .. }
            | LineEvent::Heard { at, .. }
            | LineEvent::De { at, .. }
            | LineEvent::Drive { at, .. }
            | LineEvent::Contention { from: at, .. }
            | LineEvent::Power { at, .. }
            | LineEvent::Flipped { at, .. }
            | LineEvent::Dropped { at, .. }
            | LineEvent::Altered { at, .. }
            | LineEvent::StuckLine { at, .. }
            | LineEvent::DeShorted { at, .. } => at,
        }
    }
}

/// The log of one segment.
#[derive(Clone, Debug, Default)]
pub struct SegmentLog {
    /// Name of each node, by its place in the segment.
    pub nodes: Vec<String>,
    /// What happened, characters at their ends.
    pub events: Vec<LineEvent>,
}

/// A log that the segment writes and the host reads, during the run or after it.
pub type SharedLog = Arc<Mutex<SegmentLog>>;

impl SegmentLog {
    /// All events sorted by [`LineEvent::at`]; those of the same instant stay in the order of recording.
    pub fn in_order(&self) -> Vec<&LineEvent> {
        let mut events: Vec<&LineEvent> = self.events.iter().collect();
        events.sort_by_key(|event| event.at());
        events
    }

    /// Name of a participant.
    pub fn name(&self, who: Talker) -> &str {
        match who {
            Talker::Gateway => "gateway",
            Talker::Node(node) => self.nodes.get(node).map_or("?", String::as_str),
        }
    }

    /// One event as a line of text, without its end.
    pub fn text(&self, line: &str, event: &LineEvent) -> String {
        let at = event.at();
        let head = |what: &str, who: Talker| format!("{at:>12} {line} {what:<10} {}", self.name(who));
        match *event {
            LineEvent::Char { who, end, word, bit_ps, fate, .. } => {
                format!("{} {word:02x} end={end} baud={} {fate}", head("char", who), PS_PER_S / bit_ps)
            }
            LineEvent::Heard { word, framing_error, noise, .. } => {
                let mut text = format!("{} {word:02x}", head("heard", Talker::Gateway));
                if framing_error {
                    text.push_str(" framing_error");
                }
                if noise {
                    text.push_str(" noise");
                }
                text
            }
            LineEvent::De { high, .. } => {
                format!("{} {}", head("de", Talker::Gateway), if high { "high" } else { "low" })
            }
            LineEvent::Drive { node, on, .. } => {
                format!("{} {}", head("drive", Talker::Node(node)), on_off(on))
            }
            LineEvent::Power { node, on, .. } => {
                format!("{} {}", head("power", Talker::Node(node)), on_off(on))
            }
            LineEvent::Contention { until, ref who, fought, .. } => {
                let names: Vec<&str> = who.iter().map(|&who| self.name(who)).collect();
                let fought = if fought { "fought" } else { "same_level" };
                format!("{at:>12} {line} {:<10} {} until={until} {fought}", "contention", names.join("+"))
            }
            LineEvent::Flipped { receiver, bits, .. } => {
                format!("{} bits={bits:#05x}", head("flipped", receiver))
            }
            LineEvent::Dropped { receiver, .. } => head("dropped", receiver),
            LineEvent::Altered { node, how, .. } => format!("{} {how}", head("altered", Talker::Node(node))),
            LineEvent::StuckLine { level, .. } => {
                let level = level.map_or("no", |high| if high { "high" } else { "low" });
                format!("{at:>12} {line} {:<10} line {level}", "stuck")
            }
            LineEvent::DeShorted { on, .. } => {
                format!("{} {}", head("de_shorted", Talker::Gateway), on_off(on))
            }
        }
    }

    /// Writes the whole log in order, every line naming the bus as `line`.
    pub fn write_text(&self, line: &str, out: &mut impl io::Write) -> io::Result<()> {
        for event in self.in_order() {
            writeln!(out, "{}", self.text(line, event))?;
        }
        Ok(())
    }
}

fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

impl fmt::Display for Fate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fate::Clean => write!(f, "clean"),
            Fate::Fought => write!(f, "fought"),
            Fate::Cut { at } => write!(f, "cut={at}"),
            Fate::Late { at } => write!(f, "late={at}"),
            Fate::Undriven => write!(f, "undriven"),
        }
    }
}

impl fmt::Display for Alteration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Alteration::Corrupted { index, mask } => write!(f, "byte={index} xor={mask:02x}"),
            Alteration::Shortened { length } => write!(f, "length={length}"),
        }
    }
}
