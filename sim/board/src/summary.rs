//! The summary of a run as people read it: the gateway's readings against the truth, the use of its buses, and
//! what is wrong.

use std::fmt::{self, Write};

use clino_sim::node::Ns;

use crate::analysis::{Analysis, Extremes, Tally};
use crate::checker::{Checker, Slot};
use crate::cpu::CpuStats;
use crate::edges::Edges;
use crate::incident::Incident;
use crate::modbus::Traffic;
use clino_segment::log::PS_PER_S;

/// Width of the names of figures.
const NAME: usize = 28;

/// Everything that a summary tells.
pub struct Summary<'a> {
    /// Virtual time that was run.
    pub end: Ns,
    /// The console's readings against the truth.
    pub checker: &'a Checker,
    /// Name and figures of each bus.
    pub buses: &'a [(&'static str, Analysis)],
    /// Name and figures of each PWM input that had something to say.
    pub pwm: &'a [(String, Edges)],
    /// What went over the Modbus port.
    pub modbus: Traffic,
    /// What the core did.
    pub core: CpuStats,
    /// The incidents of the chip.
    pub incidents: &'a [Incident],
    /// What is wrong with the run; empty if it worked.
    pub faults: &'a [String],
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nReadings against the truth")?;
        f.write_str(&slots(self.checker))?;
        for (name, bus) in self.buses {
            writeln!(f, "\nBus {name}{}", rate(bus))?;
            f.write_str(&polls(bus))?;
            f.write_str(&figures(bus))?;
        }
        for (name, edges) in self.pwm {
            writeln!(f, "\nInput {name}, {} readings", edges.readings)?;
            figure(f, "error against true edges", format!("at most {:.4} deg", edges.max_error / 1e6))?;
            figure(f, "first edge to end of line", format!("at most {}", ms(edges.max_delay)))?;
        }
        if self.modbus != Traffic::default() {
            let Traffic { sent, heard, spoilt } = self.modbus;
            writeln!(f, "\nModbus port")?;
            figure(f, "characters from the master", sent)?;
            figure(f, "characters to the master", format!("{heard} ({spoilt} spoilt)"))?;
        }
        writeln!(f, "\nRun")?;
        figure(f, "virtual time", format!("{:.3} s", self.end as f64 / 1e9))?;
        figure(f, "first T7 angle on console", self.checker.first_t7().map_or("-".into(), ms))?;
        let cycles = self.core.awake_cycles + self.core.asleep_cycles;
        let awake = self.core.awake_cycles as f64 * 100.0 / cycles.max(1) as f64;
        figure(f, "core awake", format!("{awake:.2} % ({} instructions)", self.core.instructions))?;
        if !self.incidents.is_empty() {
            writeln!(f, "\nThe chip")?;
            self.incidents.iter().try_for_each(|incident| writeln!(f, "{incident}"))?;
        }
        if self.faults.is_empty() {
            return writeln!(f, "\nAll well.");
        }
        writeln!(f, "\nNot well:")?;
        self.faults.iter().try_for_each(|fault| writeln!(f, "  - {fault}"))
    }
}

fn figure(f: &mut impl Write, name: &str, value: impl fmt::Display) -> fmt::Result {
    writeln!(f, "  {name:<NAME$}{value}")
}

fn slots(checker: &Checker) -> String {
    let mut rows = vec![
        ["sensor", "readings", "ok", "wrong", "max error", "tolerance", "max lag", "first ok", "last"]
            .map(String::from)
            .to_vec(),
    ];
    rows.extend(checker.slots().iter().map(|slot| {
        let Slot { truth, readings, ok, wrong, max_error, max_lag, first_ok, last, .. } = slot;
        vec![
            truth.who.to_string(),
            readings.to_string(),
            ok.to_string(),
            wrong.to_string(),
            if *ok == 0 { "-".into() } else { degrees(*max_error) },
            degrees(truth.tolerance),
            if *ok == 0 { "-".into() } else { ms(*max_lag) },
            first_ok.map_or("-".into(), ms),
            last.as_ref().map_or("-".into(), |(_, reading)| reading.status.clone()),
        ]
    }));
    table(&rows)
}

fn polls(bus: &Analysis) -> String {
    let row = |name: String, tally: &Tally| {
        let Tally { polls, good, no_answer, bad_answer, device_error } = tally;
        let mut row = vec![name];
        row.extend([polls, good, no_answer, bad_answer, device_error].map(u64::to_string));
        row
    };
    let mut rows = vec![
        ["address", "polls", "good", "no answer", "bad answer", "device error"].map(String::from).to_vec(),
    ];
    rows.extend(bus.by_address.iter().map(|(address, tally)| row(address.to_string(), tally)));
    if bus.by_address.len() != 1 {
        rows.push(row("all".into(), &bus.total()));
    }
    table(&rows)
}

fn figures(bus: &Analysis) -> String {
    let mut text = String::new();
    let mut put = |name: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = figure(&mut text, name, value);
    };
    let dash = || "-".to_owned();
    let bits =
        bus.lead_bits.map_or_else(dash, |lead| format!("{:.3} to {:.3} bit times", lead.min, lead.max));
    put("DE high to start bit", bits);
    put("stop bit to DE low", bus.tail.map_or_else(dash, us));
    put("answer to next DE high", bus.turnaround.map_or_else(dash, us));
    put("  the same, back to back", bus.back_to_back.map_or_else(dash, us));
    put("longest DE high", format!("{:.3} ms", bus.longest_de as f64 / 1e6));
    put("bus use", format!("{:.2} %", bus.utilisation * 100.0));
    let (contentions, fought) = bus.contentions;
    put("contentions", format!("{contentions} ({fought} with opposite levels)"));
    put("framing errors heard", bus.framing_errors.to_string());
    text
}

/// Bit rate of the gateway, as it sent, and how much of the run this is about.
fn rate(bus: &Analysis) -> String {
    let mut text = bus.polls.last().map_or(String::new(), |poll| {
        let requests = bus.polls.len();
        format!(", {} bit/s, {requests} requests", PS_PER_S / poll.bit_ps)
    });
    if bus.since > 0 {
        let _ = write!(text, ", since {:.3} s", bus.since as f64 / 1e9);
    }
    text
}

fn us(range: Extremes<i64>) -> String {
    format!("{:.3} to {:.3} us", range.min as f64 / 1e3, range.max as f64 / 1e3)
}

fn ms(at: Ns) -> String {
    format!("{:.1} ms", at as f64 / 1e6)
}

fn degrees(microdegrees: i64) -> String {
    format!("{:.4} deg", microdegrees as f64 / 1e6)
}

/// Columns as wide as they need to be: the first to the left, numbers and the rest to the right.
fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width =
        |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        for (n, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let _ = if n == 0 { write!(text, "  {cell:<width$}") } else { write!(text, "  {cell:>width$}") };
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::Protocol;
    use clino_segment::log::SegmentLog;

    #[test]
    fn columns_line_up() {
        let rows =
            [vec!["a", "bcd"], vec!["efghi", "1"]].map(|row| row.into_iter().map(String::from).collect());
        assert_eq!(table(&rows), "  a      bcd\n  efghi    1\n");
    }

    #[test]
    fn an_empty_run_has_a_summary() {
        let checker = Checker::new(vec![]);
        let buses = [("t7", Analysis::of(&SegmentLog::default(), Protocol::T7, 0..0))];
        let core = CpuStats::default();
        let well = Summary {
            end: 0,
            checker: &checker,
            buses: &buses,
            pwm: &[],
            modbus: Traffic::default(),
            core,
            incidents: &[],
            faults: &[],
        }
        .to_string();
        assert!(well.contains("stop bit to DE low          -\n"), "{well}");
        assert!(well.ends_with("\nAll well.\n"), "{well}");
        let faults = ["it broke".to_owned()];
        let ill = Summary {
            end: 0,
            checker: &checker,
            buses: &buses,
            pwm: &[],
            modbus: Traffic::default(),
            core,
            incidents: &[],
            faults: &faults,
        }
        .to_string();
        assert!(ill.ends_with("\nNot well:\n  - it broke\n"), "{ill}");
    }
}
