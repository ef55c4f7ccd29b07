//! The levels of the board's lines as a value change dump (VCD, IEEE 1364 section 18), which GTKWave, PulseView and
//! sigrok read.
//!
//! | signal | what |
//! |---|---|
//! | `t7_pair`, `isu_pair`, `modbus_pair` | the pair as its receivers sample it: high while idle |
//! | `t7_de`, `isu_de`, `modbus_de` | the gateway's driver enable |
//! | `t7_adapter`, `isu_adapter` | the driver of the computer's adapter, where one is in place of the sensors |
//! | `console_tx` | what the gateway sends at the console |
//! | `pwm1`, `pwm2` | the PWM inputs |
//! | `nrst` | the reset pin: low for 20 us at each reset but that of power-up |
//!
//! On the part the core starts at the end of that pulse, here at its beginning. All have one bit. Time is in nanoseconds since power-up.

use std::io::{self, BufWriter, Write};

use clino_segment::log::{LineEvent, SegmentLog};
use clino_sim::node::Ns;
use vcd::{TimescaleUnit, Value, VarType};

use crate::incident::{Event, Incident};

/// How long the pulse generator keeps the reset pin low at least, whatever the cause (RM0090 section 7.1.1).
const RESET_PULSE: Ns = 20_000;

/// One line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal {
    /// Its name: letters, digits and underscores.
    pub name: String,
    /// Its level at power-up.
    pub initial: bool,
    /// Each change, in order, with the level from then on.
    pub changes: Vec<(Ns, bool)>,
}

/// Writes these lines, up to `end`.
///
/// # Errors
/// Those of `out`.
pub fn write(signals: &[Signal], end: Ns, out: impl Write) -> io::Result<()> {
    let mut writer = vcd::Writer::new(BufWriter::new(out));
    writer.comment("clino, virtual board")?;
    writer.timescale(1, TimescaleUnit::NS)?;
    writer.add_module("board")?;
    let mut codes = Vec::new();
    for signal in signals {
        codes.push(writer.add_var(VarType::Wire, 1, &signal.name, None)?);
    }
    writer.upscope()?;
    writer.enddefinitions()?;
    writer.timestamp(0)?;
    for (signal, code) in signals.iter().zip(&codes) {
        writer.change_scalar(*code, value(signal.initial))?;
    }
    let mut changes: Vec<(Ns, usize, bool)> = Vec::new();
    for (number, signal) in signals.iter().enumerate() {
        changes.extend(signal.changes.iter().map(|&(at, high)| (at, number, high)));
    }
    // Changes of one signal within a nanosecond stay in their order.
    changes.sort_by_key(|&(at, ..)| at);
    let mut now = 0;
    for (at, number, high) in changes.into_iter().take_while(|&(at, ..)| at <= end) {
        if at > now {
            now = at;
            writer.timestamp(now)?;
        }
        if let Some(code) = codes.get(number) {
            writer.change_scalar(*code, value(high))?;
        }
    }
    // How long the last levels lasted.
    if end > now {
        writer.timestamp(end)?;
    }
    writer.flush()
}

/// The gateway's driver enable over time: its pin, as the log has it.
pub fn driver_enable(log: &SegmentLog) -> Vec<(Ns, bool)> {
    let edge = |event: &&LineEvent| match **event {
        LineEvent::De { at, high } => Some((at, high)),
        _ => None,
    };
    log.in_order().iter().filter_map(edge).collect()
}

/// Whether a computer's line driver is on over time; it is the only node of its pair.
pub fn adapter(log: &SegmentLog) -> Vec<(Ns, bool)> {
    let edge = |event: &&LineEvent| match **event {
        LineEvent::Drive { at, on, .. } => Some((at, on)),
        _ => None,
    };
    log.in_order().iter().filter_map(edge).collect()
}

/// The reset pin over time.
pub fn reset_pin(incidents: &[Incident]) -> Vec<(Ns, bool)> {
    let resets = incidents.iter().filter(|incident| matches!(incident.event, Event::Reset(_)));
    resets.flat_map(|reset| [(reset.at, false), (reset.at + RESET_PULSE, true)]).collect()
}

fn value(high: bool) -> Value {
    if high { Value::V1 } else { Value::V0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dump_has_names_first_levels_changes_in_order_and_its_end() {
        let signals = [
            Signal {
                name: "pair".into(),
                initial: true,
                changes: vec![(10, false), (30, true), (90, false)],
            },
            Signal { name: "de".into(), initial: false, changes: vec![(10, true), (20, false)] },
        ];
        let mut dump = Vec::new();
        write(&signals, 50, &mut dump).unwrap();
        let dump = String::from_utf8(dump).unwrap();
        let (head, body) = dump.split_once("$enddefinitions $end").unwrap();
        for part in ["$timescale 1 ns $end", "$var wire 1 ! pair $end", "$var wire 1 \" de $end"] {
            assert!(head.contains(part), "{part}: {head}");
        }
        let expected = "#0 1! 0\" #10 0! 1\" #20 0\" #30 1! #50";
        assert_eq!(body.split_whitespace().collect::<Vec<_>>().join(" "), expected);
    }

    #[test]
    fn the_reset_pin_is_low_for_as_long_as_the_manual_says() {
        use crate::incident::ResetCause;
        let reset = |at| Incident { at, event: Event::Reset(ResetCause::Watchdog) };
        let lockup = Incident { at: 40_000, event: Event::Lockup };
        assert_eq!(reset_pin(&[lockup, reset(50_000)]), [(50_000, false), (70_000, true)]);
    }
}
