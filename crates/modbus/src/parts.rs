//! What the parts of a gateway declare, as its [`Summary`](clino_gateway::summary::Summary) takes it: the console and the
//! Modbus server sum up the same.

use clino_gateway::summary::Parts;
use clino_gateway::{Bus, Gateway};
use clino_recovery::{Mode, Start};

/// What the buses declare, how the gateway has started, whether its configuration is not stored, and whether a command of
/// the Modbus master is under way.
pub fn parts(gateway: &Gateway, start: &Start, unsaved: bool, command: bool) -> Parts {
    Parts {
        t7: gateway.part(Bus::T7),
        isu: gateway.part(Bus::Isu),
        unsaved,
        command,
        safe_mode: start.mode != Mode::Normal,
        internal_clock: !start.clock.is_exact(),
        crashed: start.cause.is_crash(),
    }
}
