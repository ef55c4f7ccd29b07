//! Identity of the gateway: greeting of a person, first line of a stream.

use clino_bus::Instant;
use clino_recovery::Mode;

use crate::host::Host;
use crate::reply::{Members, Reply};
use crate::value::Value;

/// The greeting of a person, before the first prompt.
pub const fn greeting(mode: Mode) -> &'static str {
    match mode {
        Mode::Normal => "\n",
        Mode::Safe => "\nsafe mode after crashes: no bus is served, see reset-cause\n",
        Mode::Bare => {
            "\nbare mode after crashes: no bus is served, stored settings are not read, see reset-cause\n"
        }
    }
}

/// The first line of the stream: identity of the gateway, and how to get a prompt.
#[inline(never)]
pub fn introduce(reply: &mut Reply<'_>, host: &dyn Host) {
    reply.begin_list("stream", "started".into());
    identify(reply.rest_of_line(IDENTITY), host);
    reply.more("prompt", &[HOW_TO_GET_A_PROMPT.into()]);
    reply.end_list();
}

/// `version`
#[inline(never)]
pub fn version(reply: &mut Reply<'_>, host: &dyn Host) {
    reply.begin("clino");
    identify(reply.rest_of_line(IDENTITY), host);
    reply.end();
}

/// What ends the stream, as its first line says.
pub const HOW_TO_GET_A_PROMPT: &str = "Enter or Ctrl-C";

/// Names of the values of [`identify`].
const IDENTITY: &str = "version uptime_ms mode clock power_ups boots uid";

/// Writes version, time since reset and start of the gateway.
fn identify(mut line: Members<'_, '_>, host: &dyn Host) {
    let start = host.start();
    line.text(host.version());
    line.next(host.now().millis_since(Instant::ZERO).into());
    line.text(start.mode.name());
    line.text(start.clock.name());
    line.count(start.power_ups);
    line.count(start.boots);
    line.next(Value::Uid(&start.uid));
}
