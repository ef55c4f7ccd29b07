//! The journal as words of memory that a reset does not change, with a checksum: random content after power-up, or
//! overwritten words, do not pass for a journal.
//!
//! ```text
//! 0        mark and version
//! 1        starts
//! 2        crashes
//! 3        fast crashes | crystal stopped << 8 | ending << 16 | cause << 24
//! 4        start of the crash, 5 its uptime in ms
//! 6 to 9   pc, lr, sp, exception | known << 16
//! 10 to 12 CFSR, HFSR, address
//! 13       detail
//! 14 to 17 place
//! 18       CRC-32/ISO-HDLC of all before, little-endian
//! ```

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::cause::StartCause;
use crate::crash::{Crash, FaultStatus, Registers};
use crate::journal::{Ending, Journal};

/// Words of a journal.
pub const WORDS: usize = 19;

/// "CLJ" and the version of the format.
const MARK: u32 = u32::from_be_bytes(*b"CLJ1");

/// Registers are known.
const KNOWN: u32 = 1 << 16;

fn checksum(words: &[u32]) -> u32 {
    let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    for word in words {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

/// How a time has ended, in the third byte of word 3.
const UNSAID: u8 = 0;
const CRASH: u8 = 1;
const RETRY: u8 = 2;

/// Writes a crash into its words, all but its cause.
fn put(words: &mut [u32; WORDS], crash: &Crash) {
    let [_, _, _, _, boot, uptime_ms, pc, lr, sp, level, cfsr, hfsr, address, detail, place @ .., _] = words;
    let at = crash.registers.unwrap_or_default();
    (*boot, *uptime_ms, *detail) = (crash.boot, crash.uptime_ms, crash.detail);
    (*pc, *lr, *sp) = (at.pc, at.lr, at.sp);
    *level = u32::from(at.exception) | if crash.registers.is_some() { KNOWN } else { 0 };
    (*cfsr, *hfsr, *address) = (crash.fault.cfsr, crash.fault.hfsr, crash.fault.address);
    for (word, bytes) in place.iter_mut().zip(crash.place.as_chunks().0) {
        *word = u32::from_le_bytes(*bytes);
    }
}

fn seal(words: &mut [u32; WORDS]) {
    if let Some((last, before)) = words.split_last_mut() {
        *last = checksum(before);
    }
}

fn is_journal(words: &[u32; WORDS]) -> bool {
    words.first() == Some(&MARK) && words.split_last().is_some_and(|(last, before)| *last == checksum(before))
}

impl Journal {
    /// The words to keep.
    #[must_use]
    pub fn to_words(&self) -> [u32; WORDS] {
        let ending = match self.ending {
            Ending::Unsaid => UNSAID,
            Ending::Crash => CRASH,
            Ending::Retry => RETRY,
        };
        let crash = self.crash.unwrap_or_default();
        let cause = if self.crash.is_some() { crash.cause as u8 } else { NO_CRASH };
        let mut words = [0; WORDS];
        let [mark, boots, crashes, state, ..] = &mut words;
        (*mark, *boots, *crashes) = (MARK, self.boots, self.crashes);
        *state = u32::from_le_bytes([self.fast_crashes, u8::from(self.crystal_stopped), ending, cause]);
        put(&mut words, &crash);
        seal(&mut words);
        words
    }

    /// Records a crash; a reset follows. Of two crashes in one start the first is kept: it is the cause of the other. If the
    /// words hold no journal, a new one begins. The function works in place, because little stack may be left.
    pub fn note(words: &mut [u32; WORDS], crash: &Crash, uptime_ms: u32) {
        if !is_journal(words) {
            *words = [0; WORDS];
        }
        let [mark, boots, _, state, ..] = words;
        let [fast_crashes, crystal, ending, _] = state.to_le_bytes();
        if ending == CRASH {
            return;
        }
        let boots = *boots;
        *mark = MARK;
        *state = u32::from_le_bytes([fast_crashes, crystal, CRASH, crash.cause as u8]);
        put(words, crash);
        let [_, _, _, _, boot, uptime, ..] = words;
        (*boot, *uptime) = (boots, uptime_ms);
        seal(words);
    }

    /// What the words say; `None` if they are no journal.
    #[must_use]
    pub fn from_words(words: &[u32; WORDS]) -> Option<Journal> {
        if !is_journal(words) {
            return None;
        }
        let [
            _,
            boots,
            crashes,
            state,
            boot,
            uptime_ms,
            pc,
            lr,
            sp,
            level,
            cfsr,
            hfsr,
            address,
            detail,
            places @ ..,
            _,
        ] = words;
        let [fast_crashes, crystal, ending, cause] = state.to_le_bytes();
        let mut place = [0; 16];
        for (bytes, word) in place.as_chunks_mut().0.iter_mut().zip(places) {
            *bytes = word.to_le_bytes();
        }
        let registers = Registers { pc: *pc, lr: *lr, sp: *sp, exception: *level as u16 };
        let crash = Crash {
            cause: StartCause::from_number(cause),
            boot: *boot,
            uptime_ms: *uptime_ms,
            registers: (level & KNOWN != 0).then_some(registers),
            fault: FaultStatus { cfsr: *cfsr, hfsr: *hfsr, address: *address },
            detail: *detail,
            place,
        };
        Some(Journal {
            boots: *boots,
            crashes: *crashes,
            fast_crashes,
            crystal_stopped: crystal != 0,
            ending: match ending {
                CRASH => Ending::Crash,
                RETRY => Ending::Retry,
                _ => Ending::Unsaid,
            },
            crash: (cause != NO_CRASH).then_some(crash),
        })
    }
}

/// In the place of a cause: nothing has crashed.
const NO_CRASH: u8 = u8::MAX;

/// Milliseconds since the start, kept for the next one: written at every tick, so guarded by a copy with every bit turned
/// alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Uptime(pub u32);

impl Uptime {
    /// The words to keep.
    #[must_use]
    pub const fn to_words(self) -> [u32; 2] {
        [self.0, !self.0]
    }

    /// What the words say; `None` if they do not fit together.
    #[must_use]
    pub const fn from_words([ms, turned]: [u32; 2]) -> Option<Uptime> {
        if ms == !turned { Some(Uptime(ms)) } else { None }
    }
}
