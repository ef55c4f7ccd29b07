//! The gateway as a whole: Modbus port, stored settings, cause of the start.

use clino_gateway::order::Order;
use clino_gateway::settings::{Tabled, console, port};
use clino_recovery::{Crash, MonitoredTask};

use crate::error::ABSENT;
use crate::identity;
use crate::job::{Job, Outcome};
use crate::pending::{Next, Pending};
use crate::reply::Reply;
use crate::rows::{of_console, of_modbus};
use crate::settings::{Change, line};

/// `version`
pub fn version(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    identity::version(&mut job.reply, job.host);
    Ok(())
}

/// `reset-cause`
pub fn reset_cause(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let start = job.host.start();
    let mut line = job.reply.open_line("start cause boots crashes mode clock");
    line.text(start.cause.name());
    line.count(start.boots);
    line.count(start.crashes);
    line.text(start.mode.name());
    line.text(start.clock.name());
    line.end();
    if let Some(crash) = &start.crash {
        write_crash(&mut job.reply, crash);
    }
    Ok(())
}

/// The last crash.
#[inline(never)]
fn write_crash(reply: &mut Reply<'_>, crash: &Crash) {
    let registers = crash.registers;
    let fault = Some(crash.fault).filter(|fault| fault.is_fault());
    let mut line =
        reply.open_line("crash cause boot uptime_ms duty file line pc lr sp exception cfsr hfsr address");
    line.text(crash.cause.name());
    line.count(crash.boot);
    line.next(crash.uptime_ms.into());
    line.text_of(crash.task().map(MonitoredTask::name));
    line.text_of(crash.file());
    line.count_of(crash.line());
    for address in [registers.map(|at| at.pc), registers.map(|at| at.lr), registers.map(|at| at.sp)] {
        line.hex_of(address);
    }
    line.count_of(registers.map(|at| at.exception.into()));
    line.hex_of(fault.map(|fault| fault.cfsr));
    line.hex_of(fault.map(|fault| fault.hfsr));
    line.hex_of(fault.and_then(|fault| fault.known_address()));
    line.end();
}

/// `save`; asks for confirmation if it replaces settings that this start has not read.
pub fn save(job: &mut Job<'_, '_>) -> Outcome {
    if job.host.has_unread() {
        return job.confirmed(Pending::Save);
    }
    job.end()?;
    *job.next = Next::CarryOut(Pending::Save);
    Ok(())
}

/// `factory-reset`
pub fn factory_reset(job: &mut Job<'_, '_>) -> Outcome {
    job.confirmed(Pending::FactoryReset)
}

/// `reboot`
pub fn reboot(job: &mut Job<'_, '_>) -> Outcome {
    job.confirmed(Pending::Reboot)
}

/// `modbus`; with settings it changes them.
pub fn modbus(job: &mut Job<'_, '_>) -> Outcome {
    if job.typed.has_more() { set_modbus(job) } else { show_modbus(job) }
}

/// How the Modbus port is set.
pub fn show_modbus(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let Some(settings) = job.host.modbus() else { return Err(job.refuse(ABSENT, &["modbus".into()])) };
    line(&mut job.reply, "modbus", &Tabled::new(&port::SETTINGS, &settings));
    Ok(())
}

/// Sets the Modbus port.
pub fn set_modbus(job: &mut Job<'_, '_>) -> Outcome {
    let Some(now) = &job.host.modbus() else { return Err(job.refuse(ABSENT, &["modbus".into()])) };
    let mut change = Change::default();
    job.change(of_modbus, &mut change)?;
    job.end()?;
    match port::changed(now, &|id| change.of(id)) {
        Ok(settings) => job.host.set_modbus(settings),
        Err(refusal) => return Err(job.refused(&refusal)),
    }
    job.reply.done();
    Ok(())
}

/// How the console is set.
pub fn show_console(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let settings = job.host.console();
    line(&mut job.reply, "console", &Tabled::new(&console::SETTINGS, &settings));
    Ok(())
}

/// Sets the console.
pub fn set_console(job: &mut Job<'_, '_>) -> Outcome {
    let mut change = Change::default();
    job.change(of_console, &mut change)?;
    job.end()?;
    match console::changed(&job.host.console(), &|id| change.of(id)) {
        Ok(settings) => job.order(Order::Console(settings)),
        Err(refusal) => Err(job.refused(&refusal)),
    }
}
