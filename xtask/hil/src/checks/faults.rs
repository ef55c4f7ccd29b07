//! Faults that are planted on QEMU: a wild program counter, a ruined stack pointer. The image restarts, and says why.

use crate::arguments::Arguments;
use crate::board::Board;
use crate::console::Console;
use crate::patience;
use crate::qemu::{PC, SP};
use crate::report::Report;

/// What is planted, and what is said of it: the cause, `CFSR` (ARM DDI 0403 B3.2.15: IACCVIOL, IBUSERR, STKERR).
const CASES: [(&str, u8, u32, &str, &str); 3] = [
    ("pc 0xF0000000", PC, 0xF000_0000, "memory_fault", "0x00000001"),
    ("pc 0x30000000", PC, 0x3000_0000, "bus_fault", "0x00000100"),
    ("sp 0x0FFFFFF0", SP, 0x0FFF_FFF0, "stack_overflow", "0x00001000"),
];

/// Each on a QEMU of its own: after a restart its clock stands still for as long as it has run before.
pub fn check(arguments: &Arguments, report: &mut Report) {
    for (what, register, value, cause, cfsr) in CASES {
        let said = planted(arguments, register, value);
        let is_right = |said: &String| said.contains(cause) && said.contains(cfsr);
        report.check(
            format!("a fault: {what}"),
            format!("{cause}, cfsr {cfsr}"),
            said.map(|said| (said.clone(), is_right(&said))),
            "docs/witness.md has what the other emulators show",
        );
    }
}

/// What the image says of the start after the fault.
fn planted(arguments: &Arguments, register: u8, value: u32) -> Result<String, String> {
    let (ports, board) = Board::ports(arguments)?;
    let Some(Board::Qemu(qemu)) = board else { return Err("there is no QEMU".to_owned()) };
    let mut console = Console::open(&ports.console)?.typed();
    let said = console.for_programs().and_then(|_| {
        qemu.plant(register, value);
        console.wait_for("stream", patience::START)?;
        console.for_programs()?;
        console.ask("reset-cause")
    });
    let said = said.map_err(|why| format!("{why}; QEMU: {}", qemu.last_words()))?;
    qemu.end()?;
    Ok(said.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "))
}
