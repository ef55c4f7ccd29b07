//! T7s on a bus: the console's operations, and two readings.

use clino_bus::{Serial, T7, Timing};
use clino_codec::t7::{Address, Axis, BaudRate, Millidegrees, Request, Response};
use clino_commissioning::t7::{
    Cause, ChangeAddress, ChangeBaud, Device, DeviceSetting, Failure, Identify, RESYNC, Rates, Set, SetZero,
    Sweep, Swept,
};
use clino_commissioning::{Operation, Report, SettingChange};
use clino_gateway::task::TaskEvent;

use super::names;
use super::refusal::explain;
use super::verb::{
    Baud, BusOptions, Damping, Offset, One, OneAxis, Scan, SetAddress, SetDirection, SetRange, Verb, Zero,
};
use crate::bus::{AskT7, Asked, Make};
use crate::outcome::{DecodeVerdict, Failure as Ended};
use crate::say::{Item, thousandths};
use crate::session::{Consent, Session, verdict};

type Outcome = Result<DecodeVerdict, Ended>;

/// A T7 asked on its bus.
struct Bench {
    session: Session<T7>,
    options: BusOptions,
}

/// Carries out a command.
pub fn run(verb: Verb) -> Outcome {
    match verb {
        Verb::Scan(scan) => self::scan(scan),
        Verb::Info(One { address, bus }) => {
            let operation = Identify::new(device(address)?).map_err(refused)?;
            Bench::open(bus)?.finish(operation)
        }
        Verb::Angle(angle) => self::angle(angle),
        Verb::All(One { address, bus }) => Bench::open(bus)?.read(address, Request::GetAllData),
        Verb::Zero(zero) => self::zero(zero),
        Verb::Offset(Offset { sensor: OneAxis { one, axis }, offset, consent }) => {
            set(one, DeviceSetting::Offset { axis, offset }, consent)
        }
        Verb::Direction(SetDirection { sensor: OneAxis { one, axis }, direction, consent }) => {
            set(one, DeviceSetting::Direction { axis, direction }, consent)
        }
        Verb::Damping(Damping { one, damping_ms, consent }) => {
            set(one, DeviceSetting::Damping(damping_ms), consent)
        }
        Verb::Range(SetRange { one, range, consent }) => set(one, DeviceSetting::Range(range), consent),
        Verb::Baud(baud) => self::baud(baud),
        Verb::Address(address) => self::address(address),
    }
}

/// A single-axis T7 answers zero for the axes that it does not have: it is asked what it is before one of them.
fn angle(OneAxis { one: One { address, bus }, axis }: OneAxis) -> Outcome {
    let mut bench = Bench::open(bus)?;
    if axis != Axis::Two {
        match bench.ask(address, Request::GetDeviceInformation)? {
            Ok(Response::GetDeviceInformation(information)) if !information.has_axis(axis) => {
                return bench.failed(&Failure { cause: Cause::NoSuchAxis { axis }, writes: 0 });
            }
            Ok(_) => {}
            Err(failure) => return bench.failed(&failure),
        }
    }
    bench.read(address, Request::GetAngle(axis))
}

fn scan(Scan { all, bus }: Scan) -> Outcome {
    let serial = Serial { baud: bus.baud.bits_per_second() };
    let (rates, asked) = match all {
        Some(_) => (Rates::ALL, Asked::ScanAll),
        None => (Rates::NONE.and(bus.baud), Asked::Scan),
    };
    let mut bench = Bench::open(bus)?;
    if all.is_some() {
        bench.session.can_change_baud()?;
    }
    let mut swept = bench.sweep(Sweep::new(serial, rates))?;
    // Once more, if all may have been deaf at the beginning. At all rates each has had time to hear again.
    let is_empty = swept.complete && swept.devices == 0 && swept.suspects == 0;
    if is_empty && all.is_none() && bench.session.rest(RESYNC)? {
        swept = bench.sweep(Sweep::new(serial, rates))?;
    }
    bench.session.say.task_event(swept)?;
    if !swept.complete {
        return Err(Ended::STOPPED);
    }
    if swept.suspects > 0 {
        bench.session.suspect()?;
    } else if swept.devices == 0 {
        bench.session.diagnose(asked)?;
    }
    Ok(verdict(swept.devices > 0))
}

fn zero(Zero { sensor: OneAxis { one: One { address, bus }, axis }, consent }: Zero) -> Outcome {
    let mut bench = Bench::open_to_write(bus, consent)?;
    // What the zero replaces.
    let old = match bench.ask(address, Request::GetAllAngleOffsets)? {
        Ok(Response::GetAllAngleOffsets { offsets }) => axis.of(offsets),
        Ok(_) => Millidegrees(0),
        Err(failure) => return bench.failed(&failure),
    };
    let name = address.get();
    let question = format!(
        "T7 {name}, axis {}: its offset is {} (0.001 degrees); this writes another to its memory, and the axis reads zero \
         as it stands",
        axis.get(),
        old.0
    );
    bench.session.confirm(consent, &question)?;
    let back = format!("offset {name} {} -a {}", old.0, axis.get());
    match bench.run(SetZero::new(device(address)?, axis))? {
        Ok(zeroed) => {
            bench.session.say.task_event(zeroed)?;
            bench.put_back(zeroed.writes, &back)?;
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed_to_write(&failure, &back),
    }
}

fn set(One { address, bus }: One, wanted: DeviceSetting, consent: Consent) -> Outcome {
    let operation = Set::new(device(address)?, wanted).map_err(refused)?;
    let mut bench = Bench::open_to_write(bus, consent)?;
    let old = match bench.ask(address, wanted.get())? {
        Ok(response) => wanted.read(&response).unwrap_or(wanted),
        Err(failure) => return bench.failed(&failure),
    };
    if old != wanted {
        let (name, [is, shall]) = (address.get(), [&old, &wanted].map(value));
        let question = format!(
            "T7 {name}: {} {is}, shall be {shall}; this writes to its memory; {}",
            label(&old),
            effect(&wanted)
        );
        bench.session.confirm(consent, &question)?;
    }
    let back = words(address, &old);
    match bench.run(operation)? {
        Ok(report) => {
            bench.session.say.task_event(report)?;
            bench.put_back(report.writes, &back)?;
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed_to_write(&failure, &back),
    }
}

fn baud(Baud { one: One { address, bus }, rate, consent }: Baud) -> Outcome {
    let old = bus.baud;
    let operation = ChangeBaud::new(device(address)?, old, rate).map_err(refused)?;
    let mut bench = Bench::open_to_write(bus, consent)?;
    bench.session.can_change_baud()?;
    if old != rate {
        let question = format!(
            "T7 {}: {} bit/s, shall be {} bit/s; this writes to its memory; sensors at the old rate do not hear it any more",
            address.get(),
            old.bits_per_second(),
            rate.bits_per_second()
        );
        bench.session.confirm(consent, &question)?;
    }
    let result = bench.run(operation)?;
    let back = format!("baud {} {}", address.get(), old.bits_per_second());
    match result {
        Ok(report) => {
            bench.session.say.task_event(report)?;
            bench.options.baud = changed(&report).unwrap_or(old);
            bench.put_back(report.writes, &back)?;
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed_to_write(&failure, &back),
    }
}

fn address(SetAddress { one: One { address: old, bus }, new, consent }: SetAddress) -> Outcome {
    let operation = ChangeAddress::new(old, new).map_err(refused)?;
    let mut bench = Bench::open_to_write(bus, consent)?;
    let (from, to) = (old.get(), new.get());
    if from != to {
        let question = format!("T7 {from}: shall have address {to}; this writes to its memory");
        bench.session.confirm(consent, &question)?;
    }
    let back = format!("address {to} {from}");
    match bench.run(operation)? {
        Ok(report) => {
            bench.session.say.task_event(report)?;
            if report.writes > 0 && old == Address::FACTORY {
                let why = "its old address was the factory's, 127, which cannot be given";
                bench.session.say.hint("kept", why)?;
            } else {
                bench.put_back(report.writes, &back)?;
            }
            Ok(DecodeVerdict::Good)
        }
        Err(failure) => bench.failed(&failure),
    }
}

impl Bench {
    fn open(options: BusOptions) -> Result<Self, Ended> {
        let serial = Serial { baud: options.baud.bits_per_second() };
        let session = options.port.open(Make::T7, serial, Timing::t7)?;
        Ok(Self { session, options })
    }

    /// For a command that writes: a program that did not say that it means it is refused before anything is touched.
    fn open_to_write(options: BusOptions, consent: Consent) -> Result<Self, Ended> {
        consent.refuse_programs(&mut options.port.say())?;
        Self::open(options)
    }

    fn sweep(&mut self, operation: Sweep) -> Result<Swept, Ended> {
        match self.session.run(operation)? {
            Ok(swept) => Ok(swept),
            Err(never) => match never {},
        }
    }

    /// Runs an operation on one sensor; once more if it was silent from the beginning, when it hears again for certain.
    fn run<O>(&mut self, operation: O) -> Result<Result<O::Report, Failure>, Ended>
    where
        O: Operation<Protocol = T7, Error = Failure> + Copy,
        O::Event: Into<TaskEvent>,
    {
        let result = self.session.run(operation)?;
        if let Err(Failure { cause: Cause::NoAnswer { .. }, writes: 0 }) = result
            && self.session.rest(RESYNC)?
        {
            return self.session.run(operation);
        }
        Ok(result)
    }

    /// Runs an operation whose result is told as it is.
    fn finish<O>(&mut self, operation: O) -> Outcome
    where
        O: Operation<Protocol = T7, Error = Failure> + Copy,
        O::Event: Into<TaskEvent>,
        O::Report: Into<TaskEvent>,
    {
        match self.run(operation)? {
            Ok(report) => {
                self.session.say.task_event(report)?;
                Ok(DecodeVerdict::Good)
            }
            Err(failure) => self.failed(&failure),
        }
    }

    fn ask(&mut self, address: Address, request: Request) -> Result<Result<Response, Failure>, Ended> {
        self.run(AskT7::new(address, request))
    }

    fn read(&mut self, address: Address, request: Request) -> Outcome {
        let response = match self.ask(address, request)? {
            Ok(response) => response,
            Err(failure) => return self.failed(&failure),
        };
        let address = ("address", Item::from(address.get()));
        match response {
            Response::GetAngle { axis, angle } => {
                let values = [address, ("axis", axis.get().into()), ("angle_deg", thousandths(angle.0))];
                self.session.say.line("angle", &values)?;
            }
            Response::GetAllData {
                angles: [a0, a1, a2],
                temperature,
                accelerations: [g0, g1, g2],
                serial,
            } => {
                // Rounded to what the sensor resolves: a step is a hundred-thousandth of g.
                let micro_g = |raw: clino_codec::t7::Acceleration| Item::Decimal(raw.micro_g(), 6);
                let values = [
                    address,
                    ("angle_0_deg", thousandths(a0.0)),
                    ("angle_1_deg", thousandths(a1.0)),
                    ("angle_2_deg", thousandths(a2.0)),
                    ("acceleration_0_g", micro_g(g0)),
                    ("acceleration_1_g", micro_g(g1)),
                    ("acceleration_2_g", micro_g(g2)),
                    ("temperature_c", Item::Decimal(temperature.centi_celsius().into(), 2)),
                    ("serial", serial.into()),
                ];
                self.session.say.line("all", &values)?;
            }
            _ => {}
        }
        Ok(DecodeVerdict::Good)
    }

    /// After a write: the command that gives the sensor its old value again.
    fn put_back(&mut self, writes: u8, words: &str) -> Result<(), Ended> {
        if writes == 0 {
            return Ok(());
        }
        let rate = match self.options.baud {
            BaudRate::B115200 => String::new(),
            rate => format!(" --baud {}", rate.bits_per_second()),
        };
        let port = self.options.port.words();
        Ok(self
            .session
            .say
            .hint("put_back", &format!("clino t7 {words} {port}{rate} puts the old value back"))?)
    }

    /// Tells why the sensor did not do it, and how to put back what it may have done all the same.
    fn failed_to_write(&mut self, failure: &Failure, back: &str) -> Outcome {
        let outcome = self.failed(failure);
        self.put_back(failure.writes, back)?;
        outcome
    }

    /// Tells why the sensor did not do it.
    fn failed(&mut self, failure: &Failure) -> Outcome {
        self.session.say.task_event(*failure)?;
        match failure.cause {
            Cause::Cancelled => return Err(Ended::STOPPED),
            Cause::NoAnswer { .. } | Cause::Lost { .. } => self.session.diagnose(Asked::One)?,
            Cause::AddressTaken { serial: None, .. } => self.session.suspect()?,
            cause => self.session.explain(&cause, clino_console::after_t7(&cause))?,
        }
        Ok(DecodeVerdict::Bad)
    }
}

fn changed<T: Copy>(report: &Report<T>) -> Option<T> {
    match report.change {
        SettingChange::Changed { to, .. } => Some(to),
        SettingChange::Unchanged(_) => None,
    }
}

/// The words of the command that sets this.
fn words(address: Address, setting: &DeviceSetting) -> String {
    let (address, value) = (address.get(), value(setting));
    match setting {
        DeviceSetting::Offset { axis, .. } => format!("offset {address} {value} -a {}", axis.get()),
        DeviceSetting::Direction { axis, .. } => format!("direction {address} {value} -a {}", axis.get()),
        DeviceSetting::Damping(_) => format!("damping {address} {value}"),
        DeviceSetting::Range(_) => format!("range {address} {value}"),
    }
}

fn value(setting: &DeviceSetting) -> String {
    match *setting {
        DeviceSetting::Offset { offset, .. } => offset.0.to_string(),
        DeviceSetting::Direction { direction, .. } => names::direction(direction).to_owned(),
        DeviceSetting::Damping(damping_ms) => damping_ms.to_string(),
        DeviceSetting::Range(range) => names::range(range).to_owned(),
    }
}

const fn label(setting: &DeviceSetting) -> &'static str {
    match setting {
        DeviceSetting::Offset { .. } => "offset_mdeg",
        DeviceSetting::Direction { .. } => "direction",
        DeviceSetting::Damping(_) => "damping_ms",
        DeviceSetting::Range(_) => "range",
    }
}

const fn effect(setting: &DeviceSetting) -> &'static str {
    match setting {
        DeviceSetting::Offset { .. } => "all angles of this axis move",
        DeviceSetting::Direction { .. } => "this axis counts the other way",
        DeviceSetting::Damping(_) => "all its axes average over this time",
        DeviceSetting::Range(_) => "all its axes are told in this range",
    }
}

fn device(address: Address) -> Result<Device, Ended> {
    Device::at(address).map_err(|error| Ended::Usage(error.to_string()))
}

fn refused(error: clino_codec::t7::EncodeError) -> Ended {
    Ended::Usage(explain(error))
}
