//! ISUs on a bus: the console's operations, and the angle.

use clino_bus::{Duration, Isu, Serial, Timing};
use clino_codec::isu::Address;
use clino_codec::isu::eeprom::{Change, Image};
use clino_commissioning::isu::{
    Cause, Failure, Identify, Module, Program, ReadAngle, Repair as RepairModule, Reset, ResetNull,
};
use clino_commissioning::{Operation, Report, SettingChange, SingleDevice};
use clino_gateway::task::TaskEvent;

use super::eeprom::{Dumped, ReadEeprom};
use super::hunt::{FoundModule, Hunt, Hunted};
use super::verb::{AutoShutoff, Eeprom, Null, One, Repair, SetAddress, Verb, Zero};
use crate::bus::{Asked, Make};
use crate::outcome::{DecodeVerdict, Failure as Ended};
use crate::say::{Item, thousandths};
use crate::session::{Collected, Consent, PortOptions, Session, verdict};

/// A module that has heard half a command hears again after 400 ms (AN #201 section 4, Command Timeout), by its own clock.
const RESYNC: Duration = Duration::from_millis(450);

type Outcome = Result<DecodeVerdict, Ended>;

/// An ISU asked on its bus.
struct Bench {
    session: Session<Isu>,
    one: One,
}

/// Carries out a command.
pub fn run(verb: Verb) -> Outcome {
    match verb {
        Verb::Scan(port) => scan(port),
        Verb::Info(one) => info(one),
        Verb::Angle(one) => angle(one),
        Verb::Zero(zero) => self::zero(zero),
        Verb::Null(null) => self::null(null),
        Verb::Address(address) => self::address(address),
        Verb::Reset(one) => reset(one),
        Verb::Repair(repair) => self::repair(repair),
        Verb::AutoShutoff(shutoff) => auto_shutoff(shutoff),
        Verb::Eeprom(Eeprom::Dump(one)) => eeprom(one, dump),
        Verb::Eeprom(Eeprom::Audit(one)) => eeprom(one, audit),
    }
}

fn scan(port: PortOptions) -> Outcome {
    let mut session = port.open(Make::Isu, Serial::ISU, |_| Timing::isu())?;
    let (mut found, mut hunted) = hunt(&mut session)?;
    // Once more, if all may have been deaf at the beginning.
    if hunted.complete && hunted.devices == 0 && hunted.suspects == 0 && session.rest(RESYNC)? {
        (found, hunted) = hunt(&mut session)?;
    }
    for FoundModule { address, mdeg } in &found {
        let values = [("address", address.get().into()), ("angle_deg", mdeg.map_or(Item::None, thousandths))];
        session.say.line("found", &values)?;
    }
    let Hunted { devices, suspects, asked, complete } = hunted;
    let values = [
        ("devices", devices.into()),
        ("suspects", suspects.into()),
        ("asked", asked.into()),
        ("complete", Item::Flag(complete)),
    ];
    session.say.line("swept", &values)?;
    if !complete {
        return Err(Ended::STOPPED);
    }
    if suspects > 0 {
        session.suspect()?;
    } else if devices == 0 {
        session.diagnose(Asked::Scan)?;
    }
    Ok(verdict(devices > 0))
}

fn hunt(session: &mut Session<Isu>) -> Result<(Vec<FoundModule>, Hunted), Ended> {
    let Collected { found, result } = session.collect(Hunt::new())?;
    match result {
        Ok(hunted) => Ok((found, hunted)),
        Err(never) => match never {},
    }
}

fn auto_shutoff(AutoShutoff { one, enabled, bit, consent }: AutoShutoff) -> Outcome {
    let module = module(&one)?;
    let name = one.address.get();
    let (Some(enabled), Some(bit)) = (enabled, bit) else {
        let mut bench = Bench::open(one)?;
        return match bench.session.run(Identify::new(module))? {
            Ok(identity) => {
                let values =
                    [("address", name.into()), ("auto_shutoff_word", identity.auto_shutoff_word.into())];
                bench.session.say.line("auto_shutoff", &values)?;
                Ok(DecodeVerdict::Good)
            }
            Err(failure) => bench.failed(&failure),
        };
    };
    let operation = Program::new(module, Change::AutoShutoff { bit, enabled }).map_err(refused)?;
    let mut bench = Bench::open_to_write(one, consent)?;
    let old = match bench.session.run(Identify::new(module))? {
        Ok(identity) => identity.auto_shutoff_word,
        Err(failure) => return bench.failed(&failure),
    };
    let [is, shall] = [old >> (bit as u8) & 1 == 1, enabled].map(|on| if on { "on" } else { "off" });
    if is != shall {
        let question = format!(
            "ISU {name}: bit {} of its auto-shutoff word is {is}, shall be {shall}; this writes to its memory; it starts again",
            bit as u8
        );
        bench.session.confirm(consent, &question)?;
    }
    bench.program(operation, &format!("auto-shutoff {name} {is} --bit {}", bit as u8))
}

/// Reads the whole memory, and tells of it.
fn eeprom(one: One, told: fn(&mut Bench, &Image) -> Result<DecodeVerdict, Ended>) -> Outcome {
    // The address alone: this reads, and a module that is alone answers at 0.
    module(&one)?;
    let address = one.address;
    let mut bench = Bench::open(one)?;
    match bench.session.collect(ReadEeprom::new(address))?.result {
        Ok(Dumped { image, is_agreed: true }) => told(&mut bench, &image),
        Ok(Dumped { is_agreed: false, .. }) => {
            let next = "check termination at both ends, ground, and the length of the cable, and try again";
            bench.session.say.failure("unsteady", "two readings of the memory were not the same", next)?;
            Ok(DecodeVerdict::Bad)
        }
        Err(failure) => bench.failed(&failure),
    }
}

fn dump(bench: &mut Bench, image: &Image) -> Result<DecodeVerdict, Ended> {
    const IN_LINE: usize = 8;
    let address = bench.one.address.get();
    for (words, start) in image.words().chunks(IN_LINE).zip((0_u32..).step_by(IN_LINE)) {
        if bench.session.say.is_for_programs() {
            let list = words.iter().map(u16::to_string).collect::<Vec<_>>().join(",");
            let text = format!(
                "{{\"what\":\"eeprom\",\"address\":{address},\"start\":{start},\"words\":[{list}]}}\n"
            );
            bench.session.say.print(&text)?;
        } else {
            let list = words.iter().map(|word| format!("{word:04X}")).collect::<Vec<_>>().join(" ");
            bench.session.say.print(&format!("{start:02X}: {list}\n"))?;
        }
    }
    Ok(DecodeVerdict::Good)
}

fn audit(bench: &mut Bench, image: &Image) -> Result<DecodeVerdict, Ended> {
    let audit = image.audit();
    let values = [
        ("address", bench.one.address.get().into()),
        ("checksum_right", Item::Flag(audit.is_sound())),
        ("stored", audit.stored.into()),
        ("upper_bits_counted", audit.upper_bits_counted.into()),
        ("words_left_out", audit.words_left_out.into()),
    ];
    bench.session.say.line("audit", &values)?;
    if !audit.is_sound() {
        bench.advise_repair()?;
    }
    Ok(verdict(audit.is_sound()))
}

fn info(one: One) -> Outcome {
    let module = module(&one)?;
    let mut bench = Bench::open(one)?;
    match bench.session.run(Identify::new(module))? {
        Ok(identity) => {
            bench.session.say.task_event(identity)?;
            if !identity.audit.is_sound() {
                bench.advise_repair()?;
            }
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed(&failure),
    }
}

fn angle(one: One) -> Outcome {
    let module = module(&one)?;
    let mut bench = Bench::open(one)?;
    match bench.session.run(ReadAngle::new(module))? {
        Ok(angle) => {
            let values =
                [("address", bench.one.address.get().into()), ("angle_deg", thousandths(angle.mdeg()))];
            bench.session.say.line("angle", &values)?;
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed(&failure),
    }
}

fn reset(one: One) -> Outcome {
    let module = module(&one)?;
    let mut bench = Bench::open(one)?;
    match bench.session.run(Reset::new(module))? {
        Ok(alive) => {
            bench.session.say.task_event(alive)?;
            if alive.hard_error {
                bench.advise_repair()?;
            }
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed(&failure),
    }
}

fn zero(Zero { one, consent }: Zero) -> Outcome {
    let module = module(&one)?;
    let mut bench = Bench::open_to_write(one, consent)?;
    let old = match bench.null_position(module)? {
        Ok(old) => old,
        Err(failure) => return bench.failed(&failure),
    };
    let name = bench.one.address.get();
    let question = format!(
        "ISU {name}: its null position is {old}; this writes another to its memory, and it reads zero as it stands, at its \
         PWM output, too"
    );
    bench.session.confirm(consent, &question)?;
    let back = format!("null {name} {old}");
    match bench.session.run(ResetNull::new(module))? {
        Ok(nulled) => {
            bench.session.say.task_event(nulled)?;
            bench.put_back(nulled.writes, &back)?;
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed_to_write(&failure, &back),
    }
}

fn null(Null { one, position, consent }: Null) -> Outcome {
    let module = module(&one)?;
    let operation = Program::new(module, Change::NullPosition(position)).map_err(refused)?;
    let mut bench = Bench::open_to_write(one, consent)?;
    let old = match bench.null_position(module)? {
        Ok(old) => old,
        Err(failure) => return bench.failed(&failure),
    };
    let name = bench.one.address.get();
    if old != position {
        let question = format!(
            "ISU {name}: its null position is {old}, shall be {position}; this writes to its memory; all its angles move, \
             at its PWM output, too; it starts again"
        );
        bench.session.confirm(consent, &question)?;
    }
    bench.program(operation, &format!("null {name} {old}"))
}

fn address(SetAddress { one, new, consent }: SetAddress) -> Outcome {
    let module = module(&one)?;
    let operation = Program::new(module, Change::ModuleAddress(new)).map_err(refused)?;
    let mut bench = Bench::open_to_write(one, consent)?;
    let (from, to) = (bench.one.address.get(), new.get());
    if from != to {
        let question =
            format!("ISU {from}: shall have address {to}; this writes to its memory; it starts again");
        bench.session.confirm(consent, &question)?;
    }
    bench.program(operation, &format!("address {to} {from}"))
}

fn repair(Repair { one, new, consent }: Repair) -> Outcome {
    let module = module(&one)?;
    let operation = match new {
        None => RepairModule::new(module),
        Some(new) => {
            let to = Module::at(new).map_err(|error| Ended::Usage(error.to_string()))?;
            RepairModule::after_address_change(module, to)
        }
    };
    let mut bench = Bench::open_to_write(one, consent)?;
    let question = format!(
        "ISU {}: this writes the checksum of its memory, if it is wrong; it starts again",
        bench.one.address.get()
    );
    bench.session.confirm(consent, &question)?;
    bench.finish(operation)
}

impl Bench {
    fn open(one: One) -> Result<Self, Ended> {
        let session = one.port.open(Make::Isu, Serial::ISU, |_| Timing::isu())?;
        Ok(Self { session, one })
    }

    /// For a command that writes: a program that did not say that it means it is refused before anything is touched.
    fn open_to_write(one: One, consent: Consent) -> Result<Self, Ended> {
        consent.refuse_programs(&mut one.port.say())?;
        Self::open(one)
    }

    /// The null position, as it is stored.
    fn null_position(&mut self, module: Module) -> Result<Result<u16, Failure>, Ended> {
        let identity = self.session.run(Identify::new(module))?;
        Ok(identity.map(|identity| identity.null_position.to_turn16()))
    }

    /// Runs an operation whose result is told as it is.
    fn finish<O>(&mut self, operation: O) -> Outcome
    where
        O: Operation<Protocol = Isu, Error = Failure>,
        O::Event: Into<TaskEvent>,
        O::Report: Into<TaskEvent>,
    {
        match self.session.run(operation)? {
            Ok(report) => {
                self.session.say.task_event(report)?;
                Ok(DecodeVerdict::Good)
            }
            Err(failure) => self.failed(&failure),
        }
    }

    /// Changes a setting.
    fn program(&mut self, operation: Program, back: &str) -> Outcome {
        match self.session.run(operation)? {
            Ok(report) => {
                self.session.say.task_event(report)?;
                // A module that is alone may have had another address than the one it was asked at.
                let back = match from(&report) {
                    Some(Change::ModuleAddress(from)) => address_back(&report, from),
                    _ => back.to_owned(),
                };
                self.put_back(report.writes, &back)?;
                Ok(DecodeVerdict::Good)
            }
            Err(failure) => self.failed_to_write(&failure, back),
        }
    }

    /// After a write: the command that gives the module its old value again.
    fn put_back(&mut self, writes: u8, words: &str) -> Result<(), Ended> {
        if writes == 0 {
            return Ok(());
        }
        let alone = if self.one.alone { " --alone" } else { "" };
        let port = self.one.port.words();
        Ok(self
            .session
            .say
            .hint("put_back", &format!("clino isu {words}{alone} {port} puts the old value back"))?)
    }

    fn advise_repair(&mut self) -> Result<(), Ended> {
        let (address, port) = (self.one.address.get(), self.one.port.words());
        let why =
            format!("the checksum of its memory is wrong: clino isu repair {address} {port} makes it right");
        Ok(self.session.say.hint("repair", &why)?)
    }

    /// Tells why the module did not do it, and how to put back what it may have done all the same.
    fn failed_to_write(&mut self, failure: &Failure, back: &str) -> Outcome {
        let outcome = self.failed(failure);
        self.put_back(failure.writes, back)?;
        outcome
    }

    /// Tells why the module did not do it.
    fn failed(&mut self, failure: &Failure) -> Outcome {
        self.session.say.task_event(*failure)?;
        if failure.repair {
            self.advise_repair()?;
        }
        match failure.cause {
            Cause::Cancelled => return Err(Ended::STOPPED),
            Cause::NoAnswer { .. } | Cause::NotFound { .. } => self.session.diagnose(Asked::One)?,
            cause => self.session.explain(&cause, clino_console::after_isu(&cause))?,
        }
        Ok(DecodeVerdict::Bad)
    }
}

const fn from(report: &Report<Change>) -> Option<Change> {
    match report.change {
        SettingChange::Changed { from, .. } => Some(from),
        SettingChange::Unchanged(_) => None,
    }
}

fn address_back(report: &Report<Change>, old: Address) -> String {
    match report.change {
        SettingChange::Changed { to: Change::ModuleAddress(to), .. } => {
            format!("address {} {}", to.get(), old.get())
        }
        _ => String::new(),
    }
}

/// The module that is meant: the only one, if it is said to be, whatever its address is.
fn module(one: &One) -> Result<Module, Ended> {
    if one.alone {
        return Ok(Module::single(SingleDevice::i_have_attached_one_sensor_only()));
    }
    Module::at(one.address).map_err(|_| {
        Ended::Usage(
            "address 0 reaches every module: say --alone if it is connected alone, or give 1-14".to_owned(),
        )
    })
}

fn refused(cause: Cause) -> Ended {
    Ended::Usage(cause.to_string())
}
