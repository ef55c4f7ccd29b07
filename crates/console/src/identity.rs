//! Identity of the gateway: greeting of a person, first line of a stream.

use clino_bus::Instant;
use clino_recovery::Mode;

use crate::host::Host;
use crate::reply::Reply;
use crate::split::split_before;
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
pub fn introduce(reply: &mut Reply<'_>, host: &dyn Host) {
    identify(host, &mut |values| {
        reply.begin_list("stream", "started".into());
        let (_, names) = split_before(IDENTITY, b' ');
        reply.members(names, values);
        reply.members("prompt", &[HOW_TO_GET_A_PROMPT.into()]);
        reply.end_list();
    });
}

/// What ends the stream, as its first line says.
pub const HOW_TO_GET_A_PROMPT: &str = "Enter or Ctrl-C";

/// What answers `version`, and names of the values of [`identify`].
pub const IDENTITY: &str = "clino version uptime_ms mode clock power_ups boots uid";

/// Hands out version, time since reset and start of the gateway.
pub fn identify(host: &dyn Host, tell: &mut dyn FnMut(&[Value<'_>])) {
    let start = host.start();
    let values = [
        host.version().into(),
        host.now().millis_since(Instant::ZERO).into(),
        start.mode.name().into(),
        start.clock.name().into(),
        start.power_ups.into(),
        start.boots.into(),
        Value::Uid(&start.uid),
    ];
    tell(&values);
}
