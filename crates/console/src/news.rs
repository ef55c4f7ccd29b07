//! Reports of tasks: findings and ends.

use core::fmt;

use clino_codec::angle::Angle;
use clino_codec::isu::eeprom;
use clino_codec::t7::Text;
use clino_commissioning::t7::{DeviceSetting, Found, Identity};
use clino_commissioning::{Report, SettingChange, isu as isu_commissioning, t7 as t7_commissioning};
use clino_gateway::task::{Reason, TaskEvent, isu, t7};

use crate::audience::Audience;
use crate::consequences;
use crate::out::Out;
use crate::reply::Reply;
use crate::value::{Value, thousandths};
use crate::words::Words as _;

/// Writes a report as one line, and what is left to be done at the gateway.
pub fn write(reply: &mut Reply<'_>, news: &TaskEvent) {
    line(reply, news);
    consequences::remind(reply, news);
}

/// Writes what an operation found, or how it ended, as the console does: one line, in words or in JSON. For programs
/// that run the operations without a gateway.
pub fn write_outcome(audience: Audience, news: &TaskEvent, out: &mut dyn fmt::Write) {
    /// Reports are ASCII.
    struct Taker<'o>(&'o mut dyn fmt::Write);
    impl Out for Taker<'_> {
        fn put(&mut self, text: &[u8]) {
            text.iter().for_each(|&byte| _ = self.0.write_char(char::from(byte)));
        }
    }
    line(&mut Reply { audience, out: &mut Taker(out) }, news);
}

#[inline(never)]
fn line(reply: &mut Reply<'_>, news: &TaskEvent) {
    match news {
        TaskEvent::T7(news) => t7(reply, news),
        TaskEvent::Isu(news) => isu(reply, news),
    }
}

#[inline(never)]
fn t7(reply: &mut Reply<'_>, news: &t7::TaskEvent) {
    match news {
        t7::TaskEvent::Found(Found::Device { address, rate, information }) => {
            let values = [
                address.get().into(),
                rate.bits_per_second().into(),
                text(&information.product),
                information.serial.into(),
                text(&information.firmware),
            ];
            reply.line("found address baud product serial firmware", &values);
        }
        t7::TaskEvent::Found(Found::Suspect { address, rate, .. }) => {
            reply.line("suspect address baud", &[address.get().into(), rate.bits_per_second().into()]);
        }
        t7::TaskEvent::Swept(swept) => {
            let (devices, suspects, asked) = (swept.devices, swept.suspects, swept.asked);
            let values = [devices.into(), suspects.into(), asked.into(), Value::Flag(swept.complete)];
            reply.line("swept devices suspects asked complete", &values);
        }
        t7::TaskEvent::Identity(identity) => t7_identity(reply, identity),
        t7::TaskEvent::Zeroed(zeroed) => {
            let values = [zeroed.before.0.into(), zeroed.after.0.into(), zeroed.writes.into()];
            reply.line("zeroed before_mdeg after_mdeg writes", &values);
        }
        t7::TaskEvent::Set(report) => changed(reply, report, setting),
        t7::TaskEvent::Address(report) => changed(reply, report, |address| ("address", address.get().into())),
        t7::TaskEvent::Baud(report) => changed(reply, report, |rate| ("baud", rate.bits_per_second().into())),
        t7::TaskEvent::Failed(failure) => {
            let values = [Reason::from(&failure.cause).name().into(), failure.writes.into()];
            let rate = match failure.cause {
                t7_commissioning::Cause::Moving { mdeg_per_s } => Some(mdeg_per_s),
                _ => None,
            };
            failed(reply, "failed why writes rate_deg_s", &values, rate);
        }
    }
}

#[inline(never)]
fn t7_identity(reply: &mut Reply<'_>, identity: &Identity) {
    let mut line = reply.open_line(
        "identity product serial firmware damping_ms range direction_0 direction_1 direction_2 \
         offset_0_mdeg offset_1_mdeg offset_2_mdeg",
    );
    line.next(text(&identity.information.product));
    line.count(identity.information.serial);
    line.next(text(&identity.information.firmware));
    line.count(identity.damping_ms.into());
    line.text(identity.range.name());
    identity.directions.iter().for_each(|direction| line.text(direction.name()));
    identity.offsets.iter().for_each(|offset| line.next(offset.0.into()));
    line.end();
}

#[inline(never)]
fn isu(reply: &mut Reply<'_>, news: &isu::TaskEvent) {
    match news {
        isu::TaskEvent::Identity(identity) => {
            let values = [
                identity.address.get().into(),
                identity.angle.into(),
                identity.null_position.into(),
                identity.auto_shutoff_word.into(),
                Value::Flag(identity.audit.is_sound()),
            ];
            let row = "identity address angle_deg null_position_deg auto_shutoff_word checksum_right";
            reply.line(row, &values);
        }
        isu::TaskEvent::Alive(alive) => reply.line("alive address", &[alive.at.get().into()]),
        isu::TaskEvent::Nulled(nulled) => {
            let [before, after] = [nulled.before, nulled.after].map(Angle::from_turn16);
            let values = [before.into(), after.into(), nulled.writes.into()];
            reply.line("nulled before_deg after_deg writes", &values);
        }
        isu::TaskEvent::Programmed(report) => changed(reply, report, programmed),
        isu::TaskEvent::Repaired(repaired) => {
            let (at, stored) = (repaired.at.get(), repaired.stored_address.get());
            let values = [at.into(), stored.into(), repaired.writes.into()];
            reply.line("repaired address stored_address writes", &values);
        }
        isu::TaskEvent::Failed(failure) => {
            let why = Reason::from(&failure.cause).name();
            let values = [why.into(), failure.writes.into(), Value::Flag(failure.repair)];
            let rate = match failure.cause {
                isu_commissioning::Cause::Moving { mdeg_per_s } => Some(mdeg_per_s),
                _ => None,
            };
            failed(reply, "failed why writes repair rate_deg_s", &values, rate);
        }
    }
}

/// A task has failed; because the sensor moved at this rate, in 0.001°/s.
#[inline(never)]
fn failed(reply: &mut Reply<'_>, row: &'static str, values: &[Value<'_>], mdeg_per_s: Option<u32>) {
    let mut line = reply.open_line(row);
    values.iter().for_each(|value| line.next(*value));
    if let Some(rate) = mdeg_per_s {
        line.next(thousandths(rate));
    }
    line.end();
}

/// `changed: x …, from …, writes …` or `unchanged: x …, writes …`.
fn changed<T>(
    reply: &mut Reply<'_>,
    report: &Report<T>,
    value: impl Fn(&T) -> (&'static str, Value<'static>),
) {
    let writes = report.writes.into();
    let (to, from) = match &report.change {
        SettingChange::Unchanged(is) => (value(is), None),
        SettingChange::Changed { from, to } => (value(to), Some(value(from).1)),
    };
    change(reply, to, from, writes);
}

#[inline(never)]
fn change(
    reply: &mut Reply<'_>,
    (name, to): (&'static str, Value<'static>),
    from: Option<Value<'static>>,
    writes: Value<'static>,
) {
    let what = if from.is_some() { "changed" } else { "unchanged" };
    reply.begin(what);
    reply.rest_of_line(name).next(to);
    reply.more("from", from.as_slice());
    reply.more("writes", &[writes]);
    reply.end();
}

fn setting(setting: &DeviceSetting) -> (&'static str, Value<'static>) {
    match *setting {
        DeviceSetting::Offset { offset, .. } => ("offset_mdeg", offset.0.into()),
        DeviceSetting::Direction { direction, .. } => ("direction", direction.name().into()),
        DeviceSetting::Damping(damping_ms) => ("damping_ms", damping_ms.into()),
        DeviceSetting::Range(range) => ("range", range.name().into()),
    }
}

fn programmed(change: &eeprom::Change) -> (&'static str, Value<'static>) {
    match *change {
        eeprom::Change::ModuleAddress(address) => ("address", address.get().into()),
        eeprom::Change::NullPosition(position) => ("null_position_deg", Angle::from_turn16(position).into()),
        eeprom::Change::AutoShutoff { enabled, .. } => ("auto_shutoff", Value::Flag(enabled)),
    }
}

fn text(text: &Text) -> Value<'_> {
    text.as_str().map_or(Value::None, Value::Text)
}
