//! The PWM inputs, where a source with a known angle is connected.

use super::{Bench, shown};
use crate::board::VIRTUAL_PWM;
use crate::patience;

/// Slots of the inputs in the image as delivered.
const SLOTS: [u64; 2] = [4, 5];
/// Half a step of 360/4096 degrees, and the source's own error.
const TOLERANCE: f64 = 0.1;

pub fn check(bench: &mut Bench) -> Result<(), String> {
    if bench.arguments.on_qemu {
        bench.report.skip("PWM inputs", "QEMU's timers do not capture");
        return Ok(());
    }
    let given = [bench.arguments.pwm1, bench.arguments.pwm2];
    let truths = if bench.arguments.on_virtual_board { VIRTUAL_PWM.map(Some) } else { given };
    for (number, (slot, truth)) in (1..).zip(SLOTS.into_iter().zip(truths)) {
        let what = format!("PWM input {number}");
        let Some(truth) = truth else {
            bench.report.skip(what, format!("no source (--pwm{number} DEGREES)"));
            continue;
        };
        let measured = patience::until(patience::STATE, || {
            let object = bench.slot(slot)?;
            let shown = shown(&object);
            let near = object["angle_deg"].as_f64().is_some_and(|angle| (angle - truth).abs() <= TOLERANCE);
            Ok(if object["status"] == "ok" && near { Ok(shown) } else { Err(shown) })
        });
        bench.report.check(
            what,
            format!("{truth} deg, within {TOLERANCE}"),
            measured.map(|shown| (shown, true)),
            "PA1 and PA15 with 4.7 kohm in series; at PA15 the debugger has to use SWD (JTDI); the source's rate, about 30 Hz",
        );
    }
    Ok(())
}
