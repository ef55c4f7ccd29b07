//! What this gateway is: how a person is greeted, how a stream begins.

use clino_bus::Instant;
use clino_recovery::Mode;

use crate::host::Host;
use crate::reply::Reply;
use crate::value::Value;

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

/// The first line of the stream: who this is, and how to get a prompt.
pub fn introduce(reply: &mut Reply<'_>, host: &dyn Host) {
    who(host, &mut |values| {
        reply.begin_list("stream", "started".into());
        reply.members(WHO, values);
        reply.members("prompt", &[HOW_TO_GET_A_PROMPT.into()]);
        reply.end_list();
    });
}

/// What ends the stream, as its first line says.
pub const HOW_TO_GET_A_PROMPT: &str = "Enter or Ctrl-C";

/// Names of what [`who`] tells.
pub const WHO: &str = "version uptime_ms mode clock power_ups boots uid";

/// Who this is.
pub fn who(host: &dyn Host, tell: &mut dyn FnMut(&[Value<'_>])) {
    let start = host.start();
    let values = [
        host.version().into(),
        host.now().millis_since(Instant::ZERO).into(),
        start.mode.name().into(),
        start.clock.name().into(),
        start.power_ups.into(),
        start.boots.into(),
        Value::Words(&start.uid),
    ];
    tell(&values);
}
