//! The main loop of an image without a console: deferred requests of the Modbus master, and sleep.

use core::cell::RefCell;

use crate::app::idle::{LocalResources, SharedResources};
use crate::main_loop::{self, Common};
use crate::shared;

/// Runs for ever.
pub fn serve(local: LocalResources<'_>, shared: SharedResources<'_>) -> ! {
    let LocalResources { start, writer, store, .. } = local;
    let common = Common { shared: RefCell::new(shared), writer: RefCell::new(writer) };
    loop {
        main_loop::end_safe_mode(start);
        if !main_loop::carry_out_deferred(&common, store) {
            shared::sleep_until_work();
        }
    }
}
