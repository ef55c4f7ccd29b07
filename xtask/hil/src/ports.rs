//! Where the ports of a board are on this computer.

/// Names of serial ports or pseudo-terminals.
#[derive(Clone, Debug)]
pub struct Ports {
    /// The console.
    pub console: String,
    /// The pairs, where there is an adapter.
    pub t7: Option<String>,
    pub isu: Option<String>,
    pub modbus: Option<String>,
}
