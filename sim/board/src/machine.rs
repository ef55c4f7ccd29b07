//! The assembled board: takes an image, advances virtual time, and shows its state.

mod assembly;
mod parts;
mod stopped;
#[cfg(test)]
mod tests;

use crate::cpu::{Cpu, CpuStats, Fault};
use crate::elf::Image;
use crate::flash::Sectors;
use crate::incident::{Chronicle, Incident};
use crate::injection::{Injection, NoPayload, Payload};
use crate::ports::SerialPort;
use crate::pwm::{Pulse, Source};
use crate::reception::{Reception, Receptions};
use crate::rtt;
use crate::timeline::Timeline;
use clino_sim::node::Ns;
use rsemu::core::clock::GlobalTime;
use rsemu::core::device::Device;
use rsemu::core::space::{AddressSpace, MemAttrs};
use rsemu::core::value::Width;
use rsemu::machine::Machine;
use std::collections::BTreeMap;
use std::sync::Arc;

pub use assembly::BuildError;
pub use stopped::Stopped;

/// Length of a scheduler round, and how often the core is looked at for a fault: 1 ms.
const ROUND: Ns = 1_000_000;

/// A running board.
pub struct Board {
    machine: Machine,
    /// How far the scheduler has been driven: whole rounds.
    scheduled: Ns,
    space: Arc<AddressSpace>,
    timeline: Arc<Timeline>,
    chronicle: Arc<Chronicle>,
    cpu: Arc<Cpu>,
    watchdog: Arc<dyn Device>,
    pwm: [Arc<Source>; 2],
    receptions: BTreeMap<&'static str, Receptions>,
    rtt: Option<Arc<rtt::Reader>>,
}

impl Board {
    /// Lets virtual time run, by whole milliseconds, until `ns` since power-up has been reached.
    ///
    /// Whole ones, because the emulator converts between clocks afresh at the seams of its rounds: cut anywhere
    /// else, a timer could read one tick less, and a run would depend on how its caller slices it.
    ///
    /// # Errors
    ///
    /// [`Stopped`] if firmware faulted; the board may still be looked at.
    pub fn run_until(&mut self, ns: Ns) -> Result<(), Stopped> {
        // After a change of clocks the core stands before the end of the scheduler's round: it catches up in the
        // next one.
        while self.now() < ns {
            let was_faulted = self.cpu.fault().is_some();
            self.scheduled += ROUND;
            self.machine
                .run_until(GlobalTime::from_nanos(self.scheduled))
                .map_err(|error| Stopped::Emulator(error.to_string()))?;
            if self.cpu.is_without_power() {
                return Err(Stopped::PowerLost { at: self.now() });
            }
            // A handler that records the fault and resets is through long before it is seen twice.
            let stuck = self.cpu.fault().filter(|fault| was_faulted || fault.lockup);
            if let Some(fault) = stuck.filter(|_| !self.is_watched()) {
                return Err(self.stopped(fault));
            }
        }
        Ok(())
    }

    /// Whether the watchdog is running, or has just bitten: only then does it have an event ahead for long.
    fn is_watched(&self) -> bool {
        self.watchdog.next_event_tick().is_some() || self.cpu.is_about_to_be_reset()
    }

    fn stopped(&self, fault: Fault) -> Stopped {
        let frame = std::array::from_fn(|i| self.peek32(fault.sp.wrapping_add(4 * i as u32)));
        Stopped::Faulted { at: self.now(), fault, frame }
    }

    /// Where the core is in virtual time, in nanoseconds since power-up.
    pub fn now(&self) -> Ns {
        self.timeline.now()
    }

    /// The word at `address`, without side effects; `None` where there is nothing.
    pub fn peek32(&self, address: u32) -> Option<u32> {
        self.space.read(u64::from(address), Width::U32, MemAttrs::DEBUG).ok().map(|word| word as u32)
    }

    /// Fills `bytes` from `address` on, without side effects; false where there is nothing.
    pub fn peek(&self, address: u32, bytes: &mut [u8]) -> bool {
        self.space.read_bytes(u64::from(address), bytes, MemAttrs::DEBUG).is_ok()
    }

    /// What the core has done since power-up.
    pub fn stats(&self) -> CpuStats {
        self.cpu.stats()
    }

    /// Leaves every instruction to the emulator from now on: several times slower, and nothing else.
    pub fn without_fast_path(&mut self) {
        self.cpu.without_fast_path();
    }

    /// Cuts the power in the middle of a step of the flash: a word programmed, or a sector erased. Steps are counted from
    /// power-up, from 1; what the torn step leaves behind follows from `seed`.
    pub fn cut_power_at(&mut self, step: u64, seed: u64) {
        self.cpu.cut_power_at(step, seed);
    }

    /// Injects a fault into the running image.
    ///
    /// # Errors
    ///
    /// [`NoPayload`] if the image lacks what it takes.
    pub fn inject(&mut self, injection: Injection, image: &Image) -> Result<(), NoPayload> {
        self.cpu.order(injection, Payload::find(image, injection.what)?);
        Ok(())
    }

    /// The incidents of the chip since power-up, in order: resets, injected faults, lockups.
    pub fn incidents(&self) -> Vec<Incident> {
        self.chronicle.incidents()
    }

    /// What is in the sectors that firmware writes to, for [`Image::with_stored`].
    pub fn stored(&self) -> Vec<u8> {
        Sectors::read(&self.space).bytes()
    }

    /// Program counter of the core.
    pub fn pc(&self) -> u32 {
        self.cpu.pc()
    }

    /// The pulses that PWM source `index` (0 or 1) has driven, complete ones, in order.
    pub fn pwm_log(&self, index: usize) -> Vec<Pulse> {
        self.pwm.get(index).map_or_else(Vec::new, |source| source.log())
    }

    /// Every edge of PWM source `index`, with the level after it.
    pub fn pwm_edges(&self, index: usize) -> Vec<(Ns, bool)> {
        self.pwm.get(index).map_or_else(Vec::new, |source| source.edges())
    }

    /// The characters that have arrived at a serial port, with the flags that its receiver has raised, in order.
    pub fn receptions(&self, port: SerialPort) -> Vec<Reception> {
        self.receptions.get(port.name()).map_or_else(Vec::new, Receptions::all)
    }

    /// Drops those that came before `horizon`.
    pub fn forget_receptions(&mut self, horizon: Ns) {
        self.receptions.values().for_each(|receptions| receptions.forget(horizon));
    }

    /// What firmware has logged through RTT since the last call, up to the last millisecond: raw frames.
    pub fn take_rtt(&mut self) -> Vec<u8> {
        self.rtt.as_ref().map_or_else(Vec::new, |rtt| rtt.take())
    }
}
