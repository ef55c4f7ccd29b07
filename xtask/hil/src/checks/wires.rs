//! Times on the wires, from a capture.

use std::path::Path;

use super::Bench;
use clino_hil::capture;
use clino_hil::measure::{Figures, measure};

/// The reset pin, in a capture of the virtual board.
const RESET: &str = "nrst";
/// Error of the gateway's bit time at most, per cent: crystal, divider and the capture's clock.
const BIT_ERROR_PERCENT: f64 = 0.5;
/// DE high to the start bit at most, in bits.
const LONGEST_LEAD_BITS: f64 = 1.0;
/// Last stop bit to DE low, us. A stop bit may look cut by as much as two samples of an analyser.
const TAIL_US: (f64, f64) = (-0.2, 10.0);

/// Takes a capture with a logic analyser and judges it.
pub fn captured(bench: &mut Bench, driver: &str) {
    match capture::take(driver) {
        Ok(path) => judge(bench, &path),
        Err(why) => {
            bench.report.check("capture", "by sigrok-cli", Err(why), "`sigrok-cli --scan`; its udev rules")
        }
    }
}

/// Judges the virtual board's own capture, of the whole run.
pub fn of_virtual_board(bench: &mut Bench, capture: &Path) {
    judge(bench, capture);
}

fn judge(bench: &mut Bench, path: &Path) {
    let lines = match capture::read(path) {
        Ok(lines) => lines,
        Err(why) => {
            bench.report.check("capture", "a value change dump", Err(why), "the file");
            return;
        }
    };
    for (bus, baud) in [("t7", 115_200), ("isu", 9_600)] {
        let line = |name: &str| lines.get(&format!("{bus}_{name}"));
        let (Some(pair), Some(de)) = (line("pair"), line("de")) else {
            bench.report.skip(format!("{bus}: times on the wires"), "not in the capture");
            continue;
        };
        // A reset lets the pins float, and the resistor at DE switches the driver off. A busy computer lets simulated sensors
        // answer so late that the next request is under way.
        let (reset, adapter) = (lines.get(RESET), line("adapter"));
        let disturbed = |rise, fall| {
            reset.is_some_and(|reset| !reset.level(fall))
                || adapter.is_some_and(|adapter| adapter.is_high_within(rise, fall))
        };
        figures(bench, bus, baud, &measure(pair, de, disturbed, baud));
    }
}

fn figures(bench: &mut Bench, bus: &str, baud: u64, figures: &Figures) {
    let nominal = 1e9 / baud as f64;
    let (Some(lead), Some(tail)) = (figures.lead_bits, figures.tail_ns) else {
        bench.report.skip(format!("{bus}: times on the wires"), "no frame of the gateway in the capture");
        return;
    };
    let error = (figures.bit_ns / nominal - 1.0) * 100.0;
    bench.report.check(
        format!("{bus}: bit time, mean over {} frames", figures.frames),
        format!("{nominal:.1} ns, within {BIT_ERROR_PERCENT} %"),
        Ok((
            format!(
                "{:.1} ns, {error:+.3} %, {} frames with a broken stop bit",
                figures.bit_ns, figures.broken
            ),
            error.abs() <= BIT_ERROR_PERCENT && figures.broken == 0,
        )),
        "the crystal, its load capacitors; `version` says which clock is in use; two drivers on one pair",
    );
    bench.report.check(
        format!("{bus}: DE high to the start bit"),
        format!("0 to {LONGEST_LEAD_BITS} bits"),
        Ok((
            format!("{:.3} to {:.3} bits", lead.least, lead.most),
            lead.least >= 0.0 && lead.most <= LONGEST_LEAD_BITS,
        )),
        "`bus`: --pre; channels of the analyser exchanged",
    );
    bench.report.check(
        format!("{bus}: last stop bit to DE low"),
        format!("{} to {} us", TAIL_US.0, TAIL_US.1),
        Ok((
            format!("{:.3} to {:.3} us", tail.least / 1e3, tail.most / 1e3),
            tail.least / 1e3 >= TAIL_US.0 && tail.most / 1e3 <= TAIL_US.1,
        )),
        "`bus`: --post; an RC element at DE that delays it; a debugger that halts",
    );
}
