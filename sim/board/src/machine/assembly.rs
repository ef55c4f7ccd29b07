//! Assembles a board: the board text, the image in flash, and the circuits at the pins.

use std::fmt;
use std::sync::Arc;

use rsemu::core::clock::GlobalTime;
use rsemu::core::device::Device;
use rsemu::core::error::Error;
use rsemu::core::sched::LazyHandle;
use rsemu::machine::{self, Machine, catalog};

use super::parts::{self, Parts};
use super::{Board, ROUND};
use crate::cpu::BusyFlash;
use crate::elf::Image;
use crate::incident::Chronicle;
use crate::injection::NoPayload;
use crate::oscillators::Oscillators;
use crate::ports::Ports;
use crate::rtt;
use crate::timeline::{Actor, Timeline, lock};

/// The stock timers whose events the core may not run past; all on the APB1 timer clock.
const TIMERS: [&str; 4] = ["tim2", "tim3", "tim4", "tim5"];

/// The board could not be put together: a fault of this crate.
#[derive(Debug)]
pub struct BuildError(String);

impl Board {
    /// Puts a board together: `image` in flash, `ports` on the pins, power on.
    ///
    /// # Errors
    ///
    /// Only if the emulator refuses the board text.
    pub fn new(image: &Image, ports: Ports) -> Result<Board, BuildError> {
        Board::clocked_by(Oscillators::default(), image, ports)
    }

    /// The same with these oscillators.
    ///
    /// # Errors
    ///
    /// As [`Board::new`].
    pub fn clocked_by(oscillators: Oscillators, image: &Image, ports: Ports) -> Result<Board, BuildError> {
        Board::assemble(oscillators, image, ports).map_err(|error| BuildError(error.to_string()))
    }

    fn assemble(oscillators: Oscillators, image: &Image, ports: Ports) -> rsemu::core::Result<Board> {
        let timeline = Arc::new(Timeline::new());
        let chronicle = Arc::new(Chronicle::default());
        let model = image.model();
        let life = oscillators.crystal;
        let parts = Parts::new(model, Arc::clone(&timeline), Arc::clone(&chronicle), life, ports);
        let parts = Arc::new(parts);
        let mut registry = catalog::registry()?;
        let mut options = catalog::build_options()?;
        parts::offer(&parts, &mut registry, &mut options)?;
        options.realize.media.insert("firmware", image.flash());
        for (name, hz) in [("lsi-hz", oscillators.lsi_hz), ("hsi-hz", oscillators.hsi_hz)] {
            options.resolve = options.resolve.with_param(name, hz.to_string());
        }
        options.realize.scheduler.quantum = GlobalTime::from_nanos(ROUND);
        let machine = machine::build("board.machine", &model.text(), &registry, &options)?;

        let missing = |what: &str| Error::State(format!("the board text has no {what}"));
        let space = Arc::clone(machine.space("mem").ok_or_else(|| missing("space `mem`"))?);
        let cpu = lock(&parts.cpu).take().ok_or_else(|| missing("core"))?;
        let pwm = std::mem::take(&mut *lock(&parts.sources));
        let pwm = pwm.try_into().map_err(|_| missing("two PWM sources"))?;
        let mut actors = std::mem::take(&mut *lock(&parts.actors));
        let reader = |block| Arc::new(rtt::Reader::new(Arc::clone(&space), block));
        let rtt = image.symbol(rtt::SYMBOL).map(reader);
        actors.extend(rtt.clone().map(|reader| reader as Arc<dyn Actor>));
        cpu.surround(actors, timers(&machine)?);
        cpu.clock_from(lock(&parts.crystal).take().ok_or_else(|| missing("crystal"))?);
        let (device, handle) = lazy(&machine, "eflash")?;
        cpu.execute_from(BusyFlash::new(device, handle));
        let (watchdog, _) = lazy(&machine, "iwdg")?;
        let receptions = parts.receptions.clone();
        Ok(Board { machine, scheduled: 0, space, timeline, chronicle, cpu, watchdog, pwm, receptions, rtt })
    }
}

type LazyDevice = (Arc<dyn Device>, LazyHandle);

/// A stock device and the handle that catches it up.
fn lazy(machine: &Machine, name: &str) -> rsemu::core::Result<LazyDevice> {
    let missing = || Error::State(format!("the board text has no lazy device `{name}`"));
    let entry = machine.device(name).ok_or_else(missing)?;
    let handle = machine.scheduler().lazy_handle(entry.lazy().ok_or_else(missing)?);
    Ok((Arc::clone(entry.device()), handle.map_err(|error| Error::State(error.to_string()))?))
}

/// The stock timers and the handles that catch them up.
fn timers(machine: &Machine) -> rsemu::core::Result<Vec<LazyDevice>> {
    TIMERS.iter().map(|name| lazy(machine, name)).collect()
}

impl From<NoPayload> for BuildError {
    fn from(error: NoPayload) -> BuildError {
        BuildError(error.to_string())
    }
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the virtual board cannot be built: {}", self.0)
    }
}

impl std::error::Error for BuildError {}
