//! Everything about a simulated ISU that is not in its own memory: how it is built and how it behaves
//! where the document leaves a choice.

use super::frame::OthersAnswers;
use crate::latency::Latency;
use crate::motion::Motion;
use crate::node::Ns;

const MICROSECOND: Ns = 1_000;
const MILLISECOND: Ns = 1_000_000;

/// When new settings in the EEPROM take effect; the document does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Adoption {
    /// As soon as a Write EEPROM command is done.
    AtOnce,
    /// At the next reset or power-up.
    #[default]
    AfterReset,
}

/// When the module checks its EEPROM. The document has both: "During operation and at power-up".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Supervision {
    /// At power-up and reset.
    #[default]
    AtReset,
    /// And with every new angle: even a half-done sequence of writes leads to the Hard Error state.
    Continuous,
}

/// The address nibble of an answer to a command for address 0; the document does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AnswerAddress {
    /// The command's.
    #[default]
    AsAsked,
    /// The module's own.
    Own,
}

/// Byte 3 of the answer to Write RAM; the document prints the one, and the other for Write EEPROM.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WriteRamEcho {
    /// The first data byte.
    #[default]
    FirstDataByte,
    /// The number of bytes written.
    Count,
}

/// Everything about a simulated ISU that is not in its own memory.
#[derive(Clone, Debug)]
pub struct Options {
    /// True angle from the default null position.
    pub motion: Motion,
    /// A new angle comes this long after the module has begun to run, and every 8/15 s from there on; less
    /// than [`super::REFRESH`]. One more is there as soon as the module runs.
    pub phase: Ns,
    /// End of a command to TXEN. The document gives no limit.
    pub latency: Latency,
    /// Time to store one EEPROM word. The document does not say.
    pub word_write_time: Ns,
    /// How long after the last stop bit TXEN stays on. The document does not say.
    pub hold: Ns,
    /// Power-up or reset to the first angle and the first character heard. The document does not say.
    pub boot_time: Ns,
    /// When new settings take effect.
    pub adoption: Adoption,
    /// When the EEPROM is checked.
    pub supervision: Supervision,
    /// What answers carry that were asked for at address 0.
    pub answer_address: AnswerAddress,
    /// Byte 3 of the answer to Write RAM.
    pub write_ram_echo: WriteRamEcho,
    /// How answers of other modules are received.
    pub others_answers: OthersAnswers,
    /// Seed of the latency jitter.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            motion: Motion::Constant(0),
            phase: 0,
            // A 68HC05 that answers from its main loop; no source but plausibility.
            latency: Latency::fixed(5 * MILLISECOND),
            // Serial EEPROMs of 256 words of 16 bits take up to 10 ms a word.
            word_write_time: 10 * MILLISECOND,
            // One bit: TXEN falls by software, a little after the last stop bit.
            hold: 104 * MICROSECOND,
            boot_time: 50 * MILLISECOND,
            adoption: Adoption::default(),
            supervision: Supervision::default(),
            answer_address: AnswerAddress::default(),
            write_ram_echo: WriteRamEcho::default(),
            others_answers: OthersAnswers::default(),
            seed: 0,
        }
    }
}
