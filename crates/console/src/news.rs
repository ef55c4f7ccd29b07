//! What tasks find and how they end.

use core::fmt::{self, Write};

use clino_codec::angle::{Angle, Range};
use clino_codec::isu::eeprom;
use clino_codec::t7::{Direction, Text};
use clino_commissioning::t7::{Found, Identity, Setting};
use clino_commissioning::{Change, Report, isu as isu_task};
use clino_gateway::task::{News, isu, t7};

use crate::causes;
use crate::fields::{Value, line};
use crate::shell::Audience;

/// Writes what is new, a line.
pub fn write(out: &mut dyn Write, audience: Audience, news: &News) -> fmt::Result {
    match news {
        News::T7(news) => t7(out, audience, news),
        News::Isu(news) => isu(out, audience, news),
    }
}

fn t7(out: &mut dyn Write, audience: Audience, news: &t7::News) -> fmt::Result {
    match news {
        t7::News::Found(Found::Device { address, rate, information }) => line(
            out,
            audience,
            "found",
            &[
                ("address", address.get().into()),
                ("baud", rate.bits_per_second().into()),
                ("product", text(&information.product)),
                ("serial", information.serial.into()),
                ("firmware", text(&information.firmware)),
            ],
        ),
        t7::News::Found(Found::Suspect { address, rate, .. }) => line(
            out,
            audience,
            "suspect",
            &[("address", address.get().into()), ("baud", rate.bits_per_second().into())],
        ),
        t7::News::Swept(swept) => line(
            out,
            audience,
            "swept",
            &[
                ("devices", swept.devices.into()),
                ("suspects", swept.suspects.into()),
                ("asked", swept.asked.into()),
                ("complete", Value::Flag(swept.complete)),
            ],
        ),
        t7::News::Identity(identity) => t7_identity(out, audience, identity),
        t7::News::Zeroed(zeroed) => line(
            out,
            audience,
            "zeroed",
            &[
                ("before_mdeg", zeroed.before.0.into()),
                ("after_mdeg", zeroed.after.0.into()),
                ("writes", zeroed.writes.into()),
            ],
        ),
        t7::News::Set(report) => changed(out, audience, report, setting),
        t7::News::Address(report) => {
            changed(out, audience, report, |address| ("address", address.get().into()))
        }
        t7::News::Baud(report) => {
            changed(out, audience, report, |rate| ("baud", rate.bits_per_second().into()))
        }
        t7::News::Failed(failure) => line(
            out,
            audience,
            "failed",
            &[("why", Value::Text(causes::t7(&failure.cause))), ("writes", failure.writes.into())],
        ),
    }
}

fn t7_identity(out: &mut dyn Write, audience: Audience, identity: &Identity) -> fmt::Result {
    let Identity { information, directions: [d0, d1, d2], damping_ms, range, offsets: [o0, o1, o2] } =
        *identity;
    line(
        out,
        audience,
        "identity",
        &[
            ("product", text(&information.product)),
            ("serial", information.serial.into()),
            ("firmware", text(&information.firmware)),
            ("damping_ms", damping_ms.into()),
            ("range", range_word(range)),
            ("direction_0", direction(d0)),
            ("direction_1", direction(d1)),
            ("direction_2", direction(d2)),
            ("offset_0_mdeg", o0.0.into()),
            ("offset_1_mdeg", o1.0.into()),
            ("offset_2_mdeg", o2.0.into()),
        ],
    )
}

fn isu(out: &mut dyn Write, audience: Audience, news: &isu::News) -> fmt::Result {
    match news {
        isu::News::Identity(identity) => line(
            out,
            audience,
            "identity",
            &[
                ("address", identity.address.get().into()),
                ("angle_deg", Value::Angle(identity.angle)),
                ("null_position_deg", Value::Angle(identity.null_position)),
                ("auto_shutoff_word", identity.auto_shutoff_word.into()),
                ("checksum_right", Value::Flag(identity.audit.is_sound())),
            ],
        ),
        isu::News::Alive(alive) => line(out, audience, "alive", &[("address", alive.at.get().into())]),
        isu::News::Nulled(nulled) => line(
            out,
            audience,
            "nulled",
            &[
                ("before_deg", Value::Angle(Angle::from_turn16(nulled.before))),
                ("after_deg", Value::Angle(Angle::from_turn16(nulled.after))),
                ("writes", nulled.writes.into()),
            ],
        ),
        isu::News::Programmed(report) => changed(out, audience, report, programmed),
        isu::News::Repaired(repaired) => line(
            out,
            audience,
            "repaired",
            &[
                ("address", repaired.at.get().into()),
                ("stored_address", repaired.stored_address.get().into()),
                ("writes", repaired.writes.into()),
            ],
        ),
        isu::News::Failed(isu_task::Failure { cause, writes, repair }) => line(
            out,
            audience,
            "failed",
            &[
                ("why", Value::Text(causes::isu(cause))),
                ("writes", (*writes).into()),
                ("repair", Value::Flag(*repair)),
            ],
        ),
    }
}

/// `changed: from_x …, to_x …, writes …` or `unchanged: x …`.
fn changed<T>(
    out: &mut dyn Write,
    audience: Audience,
    report: &Report<T>,
    value: impl Fn(&T) -> (&'static str, Value<'static>),
) -> fmt::Result {
    let writes = ("writes", report.writes.into());
    match &report.change {
        Change::Unchanged(is) => line(out, audience, "unchanged", &[value(is), writes]),
        Change::Changed { from, to } => {
            let ((name, to), (_, from)) = (value(to), value(from));
            line(out, audience, "changed", &[(name, to), ("from", from), writes])
        }
    }
}

fn setting(setting: &Setting) -> (&'static str, Value<'static>) {
    match *setting {
        Setting::Offset { offset, .. } => ("offset_mdeg", offset.0.into()),
        Setting::Direction { direction: sense, .. } => ("direction", direction(sense)),
        Setting::Damping(damping_ms) => ("damping_ms", damping_ms.into()),
        Setting::Range(range) => ("range", range_word(range)),
    }
}

fn programmed(change: &eeprom::Change) -> (&'static str, Value<'static>) {
    match *change {
        eeprom::Change::ModuleAddress(address) => ("address", address.get().into()),
        eeprom::Change::NullPosition(position) => {
            ("null_position_deg", Value::Angle(Angle::from_turn16(position)))
        }
        eeprom::Change::AutoShutoff { enabled, .. } => ("auto_shutoff", Value::Flag(enabled)),
    }
}

fn text(text: &Text) -> Value<'_> {
    text.as_str().map_or(Value::None, Value::Text)
}

const fn direction(direction: Direction) -> Value<'static> {
    Value::Text(match direction {
        Direction::Normal => "normal",
        Direction::Reversed => "reversed",
    })
}

const fn range_word(range: Range) -> Value<'static> {
    Value::Text(match range {
        Range::Bidirectional => "bidirectional",
        Range::Unidirectional => "unidirectional",
    })
}
