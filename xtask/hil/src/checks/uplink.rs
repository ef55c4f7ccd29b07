//! The Modbus port: test patterns, the same angles as on the console, and what must not be answered.

use super::Bench;
use crate::modbus::{Master, NO_ANSWER};
use crate::patience;

const WIRES: &str =
    "A and B exchanged? even parity, 19200 bit/s; ground; an adapter that hears itself is no fault";
/// Slots of the buses' sensors.
const SENSORS: u16 = 4;
/// An angle that there is not.
const NONE: u32 = 0x8000_0000;

pub fn check(bench: &mut Bench, port: &str, sensors: bool) -> Result<(), String> {
    let mut master = match Master::open(port) {
        // Its clock jumps now and then, in the middle of a frame, too.
        Ok(master) if bench.arguments.on_qemu => master.repeating(),
        Ok(master) => master,
        Err(why) => {
            bench.report.check("Modbus: adapter", "a port with even parity", Err(why), "`clino ports`");
            return Ok(());
        }
    };
    let test = master.read(0x000C, 4);
    let good = test.is_ok();
    bench.report.check(
        "Modbus: test registers",
        "1234 5678 42f6 e979",
        test.map(|words| (hex(&words), words == [0x1234, 0x5678, 0x42F6, 0xE979])),
        WIRES,
    );
    if !good {
        return Ok(());
    }
    if sensors {
        let measured = same_angles(bench, &mut master);
        bench.report.check(
            "Modbus: angles",
            "those of the console",
            measured.map(|shown| (shown, true)),
            "registers 33 on; `list`",
        );
    }
    if bench.arguments.short {
        return Ok(());
    }
    bench.report.check(
        "Modbus: a register that does not exist",
        "exception 02",
        // 0x7000 is in no block of docs/modbus.md.
        master
            .exchange(&[3, 0x70, 0, 0, 1], patience::ANSWER)
            .map(|answer| (format!("{answer:02x?}"), answer == [0x83, 2])),
        WIRES,
    );
    bench.report.check(
        "Modbus: echo (function 08)",
        "08 00 00 a5 37",
        master
            .exchange(&[8, 0, 0, 0xA5, 0x37], patience::ANSWER)
            .map(|answer| (format!("{answer:02x?}"), answer == [8, 0, 0, 0xA5, 0x37])),
        "the first repeat within a second counts as an echo of the line (docs/modbus.md)",
    );
    // A read of the test registers with a wrong checksum, and one for another server.
    for (what, frame) in [
        ("Modbus: a wrong checksum", [1, 3, 0, 12, 0, 4, 0, 0]),
        ("Modbus: a request for address 2", [2, 3, 0, 12, 0, 4, 0x84, 0x39]),
    ] {
        let answer = master.raw(&frame, NO_ANSWER);
        let shown = |answer: Vec<u8>| {
            (if answer.is_empty() { "no answer".into() } else { format!("{answer:02x?}") }, answer.is_empty())
        };
        bench.report.check(what, "no answer", answer.map(shown), "another server on the pair");
    }
    let longest = master.longest.as_millis();
    bench
        .report
        .identity
        .push(format!("longest Modbus answer, this computer and its adapter included: {longest} ms"));
    Ok(())
}

/// The angles of the sensors' slots, read both ways.
fn same_angles(bench: &mut Bench, master: &mut Master) -> Result<String, String> {
    patience::until(patience::STATE, || {
        let words = master.read(0x0020, 2 * SENSORS)?;
        let angles: Vec<u32> = words
            .as_chunks::<2>()
            .0
            .iter()
            .map(|[high, low]| u32::from(*high) << 16 | u32::from(*low))
            .collect();
        let list = bench.console.ask("list")?;
        let same = |(slot, angle): (usize, &u32)| {
            let object = list.iter().find(|object| object["slot"] == slot);
            let degrees = object.and_then(|object| object["angle_deg"].as_f64());
            *angle != NONE
                && degrees.is_some_and(|degrees| (degrees * 1e3).round() as i32 == angle.cast_signed())
        };
        let shown: Vec<String> =
            angles.iter().map(|angle| format!("{:.3}", f64::from(angle.cast_signed()) / 1e3)).collect();
        let all = angles.iter().enumerate().all(same);
        Ok(if all { Ok(shown.join(", ")) } else { Err(shown.join(", ")) })
    })
}

fn hex(words: &[u16]) -> String {
    words.iter().map(|word| format!("{word:04x}")).collect::<Vec<_>>().join(" ")
}
