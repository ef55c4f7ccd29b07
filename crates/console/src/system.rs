//! The gateway as a whole: its Modbus port, what it keeps, why it has started.

use clino_gateway::order::Refusal;
use clino_modbus::settings::{ADDRESSES, BIT_RATES};
use clino_recovery::{Crash, Duty, Mode};

use crate::error::Error;
use crate::host::Saved;
use crate::job::{Job, Outcome};
use crate::reply::Reply;
use crate::value::Value;
use crate::words::{PortField, Words as _};

/// What a person is told who comes to the console, before the prompt.
pub const fn greeting(mode: Mode) -> &'static str {
    match mode {
        Mode::Normal => "\n",
        Mode::Safe => "\nsafe mode after crashes: no bus is served, see reset-cause\n",
        Mode::Bare => {
            "\nbare mode after crashes: no bus is served, nothing stored is read, see reset-cause\n"
        }
    }
}

/// `version`
pub fn version(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let start = job.host.start();
    let values = [
        job.host.version().into(),
        job.now.as_millis().into(),
        start.mode.name().into(),
        start.clock.name().into(),
    ];
    job.reply.line("clino", "version uptime_ms mode clock", &values);
    Ok(())
}

/// `reset-cause`
pub fn reset_cause(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let start = job.host.start();
    let values = [
        start.cause.name().into(),
        start.boots.into(),
        start.crashes.into(),
        start.mode.name().into(),
        start.clock.name().into(),
    ];
    job.reply.line("start", "cause boots crashes mode clock", &values);
    if let Some(crash) = &start.crash {
        write_crash(&mut job.reply, crash);
    }
    Ok(())
}

/// The last crash.
fn write_crash(reply: &mut Reply<'_>, crash: &Crash) {
    let hex = |bits: Option<u32>| bits.map_or(Value::None, Value::Hex);
    let registers = crash.registers;
    let fault = Some(crash.fault).filter(|fault| fault.is_fault());
    let values = [
        crash.cause.name().into(),
        crash.boot.into(),
        crash.uptime_ms.into(),
        crash.duty().map(Duty::name).into(),
        crash.file().into(),
        crash.line().into(),
        hex(registers.map(|at| at.pc)),
        hex(registers.map(|at| at.lr)),
        hex(registers.map(|at| at.sp)),
        registers.map(|at| at.exception).into(),
        hex(fault.map(|fault| fault.cfsr)),
        hex(fault.map(|fault| fault.hfsr)),
        hex(fault.and_then(|fault| fault.known_address())),
    ];
    let names = "cause boot uptime_ms duty file line pc lr sp exception cfsr hfsr address";
    reply.line("crash", names, &values);
}

/// `save`
pub fn save(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    match job.host.save() {
        Ok(Saved::Written) => job.reply.line("saved", "stored", &["written".into()]),
        Ok(Saved::Unchanged) => job.reply.line("saved", "stored", &["unchanged".into()]),
        Err(error) => return Err(job.refuse(&Error::Storage(error))),
    }
    Ok(())
}

/// `modbus`, and with a setting what is to change.
pub fn modbus(job: &mut Job<'_, '_>) -> Outcome {
    let Some(mut settings) = job.host.modbus() else { return Err(job.refuse(&Error::Absent("modbus"))) };
    let Some(word) = job.typed.next() else {
        job.end()?;
        let (parity, stop_bits) = (settings.parity.name(), settings.stop_bits as u8);
        let values = [settings.address.into(), settings.baud.into(), parity.into(), stop_bits.into()];
        job.reply.line("modbus", "address baud parity stop_bits", &values);
        return Ok(());
    };
    let field = job.meaning(word)?;
    let value = job.word("value")?;
    job.end()?;
    match field {
        PortField::Address => {
            settings.address = job.byte(value, "modbus_address", ADDRESSES.0, ADDRESSES.1)?
        }
        PortField::Baud => {
            settings.baud = job.up_to(value, "baud", u32::MAX)?;
            if !BIT_RATES.contains(&settings.baud) {
                let refusal = Refusal::BitRate { value: settings.baud, allowed: &BIT_RATES };
                return Err(job.refuse(&Error::Refused(refusal)));
            }
        }
        PortField::Parity => settings.parity = job.meaning(value)?,
        PortField::StopBits => settings.stop_bits = job.meaning(value)?,
    }
    job.host.set_modbus(settings);
    job.reply.done();
    Ok(())
}
