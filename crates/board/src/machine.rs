//! The assembled board: image in, virtual time forward, and what can be looked at from outside.

use crate::cpu::{self, BusyFlash, Cpu, CpuStats, Fault};
use crate::crystal;
use crate::elf::Image;
use crate::flash::Sectors;
use crate::incident::{Chronicle, Incident};
use crate::narrow;
use crate::oscillators::{CrystalLife, Oscillators};
use crate::plant::{Bait, NoBait, Plant};
use crate::ports::{self, Ports};
use crate::pwm::{self, Pulse, PwmDevice, PwmWaveform, Source};
use crate::rtt;
use crate::timeline::{Actor, Timeline, lock};
use crate::usart::{self, Connections, UsartDevice};
use crate::wrapped::Wrapped;
use clino_segment::wire::Wire;
use clino_sim::node::Ns;
use rsemu::core::clock::GlobalTime;
use rsemu::core::device::Device;
use rsemu::core::error::Error;
use rsemu::core::props::Props;
use rsemu::core::space::{AddressSpace, MemAttrs};
use rsemu::core::value::Width;
use rsemu::machine::{self, BuildOptions, Instance, Machine, catalog};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

const TEXT: &str = include_str!("board.machine");

/// Length of a scheduler round, and how often the core is looked at for a fault: 1 ms.
const ROUND: Ns = 1_000_000;

/// The stock timers whose events the core may not run past; all on the APB1 timer clock.
const TIMERS: [&str; 4] = ["tim2", "tim3", "tim4", "tim5"];

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
    rtt: Option<Arc<rtt::Reader>>,
}

/// The board could not be put together: a fault of this crate.
#[derive(Debug)]
pub struct BuildError(String);

/// Why the board does not run on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// Firmware is stuck in a fault handler, or locked up, and no watchdog is running that would end it.
    Faulted {
        /// When this was noticed: up to 2 ms after the fault.
        at: Ns,
        /// What the core knows of it.
        fault: Fault,
        /// The exception frame on the main stack as far as it is in RAM: R0–R3, R12, LR, PC, xPSR. A handler that
        /// has pushed something itself hides it.
        frame: [Option<u32>; 8],
    },
    /// The supply failed in the middle of a step of the flash, as [`Board::cut_power_at`] wanted.
    PowerLost {
        /// Up to 1 ms after that.
        at: Ns,
    },
    /// The emulator gave up.
    Emulator(String),
}

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
        let Ports { t7, isu, console, modbus, pwm: [pwm1, pwm2] } = ports;
        let parts = Arc::new(Parts {
            timeline: Arc::clone(&timeline),
            chronicle: Arc::clone(&chronicle),
            life: oscillators.crystal,
            crystal: Mutex::new(None),
            wires: Mutex::new(BTreeMap::from([
                ("t7", t7),
                ("isu", isu),
                ("console", console),
                ("modbus", modbus),
            ])),
            waveforms: Mutex::new(BTreeMap::from([(1, pwm1), (2, pwm2)])),
            cpu: Mutex::new(None),
            actors: Mutex::new(Vec::new()),
            sources: Mutex::new(Vec::new()),
        });
        let mut registry = catalog::registry()?;
        for class in [cpu::class(), usart::class(), pwm::class()] {
            registry.add(class)?;
        }
        let mut options = catalog::build_options()?;
        bind(&mut options, &parts)?;
        options.realize.media.insert("firmware", image.flash());
        for (name, hz) in [("lsi-hz", oscillators.lsi_hz), ("hsi-hz", oscillators.hsi_hz)] {
            options.resolve = options.resolve.with_param(name, hz.to_string());
        }
        options.realize.scheduler.quantum = GlobalTime::from_nanos(ROUND);
        let machine = machine::build("board.machine", TEXT, &registry, &options)?;

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
        Ok(Board { machine, scheduled: 0, space, timeline, chronicle, cpu, watchdog, pwm, rtt })
    }

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

    /// Cuts the power in the middle of a step of the flash: a word programmed, or a sector erased. Steps are counted from
    /// power-up, from 1; what the torn step leaves behind follows from `seed`.
    pub fn cut_power_at(&mut self, step: u64, seed: u64) {
        self.cpu.cut_power_at(step, seed);
    }

    /// Plants a fault into the running image.
    ///
    /// # Errors
    ///
    /// [`NoBait`] if the image lacks what it takes.
    pub fn plant(&mut self, plant: Plant, image: &Image) -> Result<(), NoBait> {
        self.cpu.order(plant, Bait::find(image, plant.what)?);
        Ok(())
    }

    /// What has befallen the chip since power-up, in order: resets, planted faults, lockups.
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

    /// What firmware has logged through RTT since the last call, up to the last millisecond: raw frames.
    pub fn take_rtt(&mut self) -> Vec<u8> {
        self.rtt.as_ref().map_or_else(Vec::new, |rtt| rtt.take())
    }
}

/// What the constructors of the board's own classes take from and leave for the assembly.
struct Parts {
    timeline: Arc<Timeline>,
    chronicle: Arc<Chronicle>,
    life: CrystalLife,
    crystal: Mutex<Option<Arc<crystal::Pins>>>,
    wires: Mutex<BTreeMap<&'static str, Box<dyn Wire>>>,
    waveforms: Mutex<BTreeMap<u64, Box<dyn PwmWaveform>>>,
    cpu: Mutex<Option<Arc<Cpu>>>,
    actors: Mutex<Vec<Arc<dyn Actor>>>,
    sources: Mutex<Vec<Arc<Source>>>,
}

impl Parts {
    fn build_cpu(&self, props: &Props) -> rsemu::core::Result<Arc<Cpu>> {
        let cpu = Arc::new(Cpu::new(props, Arc::clone(&self.timeline), Arc::clone(&self.chronicle))?);
        *lock(&self.cpu) = Some(Arc::clone(&cpu));
        Ok(cpu)
    }

    fn build_crystal(&self, stock: Arc<dyn Instance>) -> rsemu::core::Result<Arc<Wrapped<crystal::Pins>>> {
        let controller = crystal::at(stock, self.life, Arc::clone(&self.chronicle))?;
        *lock(&self.crystal) = Some(controller.front());
        lock(&self.actors).push(controller.front());
        Ok(Arc::new(controller))
    }

    fn build_usart(&self, props: &Props) -> rsemu::core::Result<Arc<UsartDevice>> {
        let name = props.require("port")?.to_str("port")?;
        let wire = lock(&self.wires).remove(name);
        let (Some((clock, tx, rx)), Some(wire)) = (ports::pins(name), wire) else {
            return Err(Error::Property(format!("there is no serial port `{name}`, or it is taken")));
        };
        let connections = Connections { clock, tx, rx, wire };
        let device = Arc::new(UsartDevice::new(connections, Arc::clone(&self.timeline)));
        lock(&self.actors).push(device.actor());
        Ok(device)
    }

    fn build_pwm(&self, props: &Props) -> rsemu::core::Result<Arc<PwmDevice>> {
        let channel = props.require("channel")?.to_uint("channel")?;
        let Some(waveform) = lock(&self.waveforms).remove(&channel) else {
            return Err(Error::Property(format!("there is no PWM channel {channel}, or it is taken")));
        };
        let source = Arc::new(Source::new(waveform, Arc::clone(&self.timeline)));
        lock(&self.actors).push(Arc::clone(&source) as Arc<dyn Actor>);
        lock(&self.sources).push(Arc::clone(&source));
        Ok(Arc::new(PwmDevice(source)))
    }
}

/// Adds the board's own classes, the width adapter around the watchdog, and the crystal at the clock controller.
fn bind(options: &mut BuildOptions, parts: &Arc<Parts>) -> rsemu::core::Result<()> {
    let (a, b, c) = (Arc::clone(parts), Arc::clone(parts), Arc::clone(parts));
    options.bindings.bind(cpu::CLASS_NAME, move |props| Ok(a.build_cpu(props)?))?;
    options.bindings.bind(usart::CLASS_NAME, move |props| Ok(b.build_usart(props)?))?;
    options.bindings.bind(pwm::CLASS_NAME, move |props| Ok(c.build_pwm(props)?))?;
    if let Some(stock) = options.bindings.get(narrow::STOCK) {
        options.bindings.replace(narrow::STOCK, move |props| Ok(Arc::new(narrow::widened(stock(props)?)?)));
    }
    if let Some(stock) = options.bindings.get(crystal::STOCK) {
        let d = Arc::clone(parts);
        options.bindings.replace(crystal::STOCK, move |props| Ok(d.build_crystal(stock(props)?)?));
    }
    for schema in [cpu::schema(), usart::schema(), pwm::schema(), crystal::schema()] {
        options.classes.insert(schema);
    }
    Ok(())
}

impl From<NoBait> for BuildError {
    fn from(error: NoBait) -> BuildError {
        BuildError(error.to_string())
    }
}

type LazyDevice = (Arc<dyn Device>, rsemu::core::sched::LazyHandle);

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

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the virtual board cannot be built: {}", self.0)
    }
}

impl std::error::Error for BuildError {}

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Stopped::PowerLost { at } => {
                write!(f, "the power was cut at {:.6} s, while flash was written", *at as f64 / 1e9)
            }
            Stopped::Emulator(why) => write!(f, "the emulator stopped: {why}"),
            Stopped::Faulted { at, fault, frame } => {
                let what = if fault.lockup { "locked up" } else { "is in a fault handler" };
                write!(
                    f,
                    "firmware {what} at {:.6} s: exception {}, PC {:#010x}, CFSR {:#010x}, HFSR {:#010x}, BFAR \
                     {:#010x}; stack at {:#010x}:",
                    *at as f64 / 1e9,
                    fault.exception,
                    fault.pc,
                    fault.cfsr,
                    fault.hfsr,
                    fault.bfar,
                    fault.sp
                )?;
                frame.iter().flatten().try_for_each(|word| write!(f, " {word:08x}"))
            }
        }
    }
}

impl std::error::Error for Stopped {}

#[cfg(test)]
mod tests {
    use super::*;

    const STACK: u32 = 0x2000_1000;
    const RESET: u32 = 0x0800_0011;
    const HARD_FAULT: u32 = 0x0800_001d;
    const B_SELF: u32 = 0xe7fe;
    const UDF: u32 = 0xde00;
    const MS: Ns = 1_000_000;

    /// A board with a program of four vectors, three words at the reset vector and a word for HardFault.
    fn board(program: [u32; 3], hard_fault: u32) -> Board {
        let [a, b, c] = program;
        Board::new(&Image::of_words(&[STACK, RESET, 0, HARD_FAULT, a, b, c, hard_fault]), Ports::open())
            .unwrap()
    }

    #[test]
    fn an_idle_program_runs_on() {
        let mut board = board([B_SELF, 0, 0], B_SELF);
        board.run_until(3 * MS).unwrap();
        assert_eq!(board.pc(), RESET - 1);
        // 16 MHz from the internal oscillator: 48 000 cycles.
        assert_eq!(board.stats().awake_cycles / 100, 480);
        assert!(board.now().abs_diff(3 * MS) < 1_000, "{}", board.now());
    }

    #[test]
    fn a_fault_is_reported_with_the_place_it_happened_at() {
        let mut board = board([UDF, 0, 0], B_SELF);
        let Err(Stopped::Faulted { at, fault, frame }) = board.run_until(100 * MS) else {
            panic!("not noticed")
        };
        assert!(at <= 2 * MS, "{at}");
        assert_eq!((fault.exception, fault.lockup), (3, false));
        assert_eq!(frame[6], Some(RESET - 1));
    }

    #[test]
    fn an_access_to_nothing_tells_its_address() {
        // ldr r0, [pc, #4]; ldr r0, [r0]; the literal is an address of the FSMC, which is not there.
        let mut board = board([0x6800_4801, 0, 0xa000_0000], B_SELF);
        let Err(Stopped::Faulted { fault, .. }) = board.run_until(100 * MS) else { panic!("not noticed") };
        assert_eq!(fault.bfar, 0xa000_0000);
    }

    #[test]
    fn a_fault_within_the_handler_is_a_lockup() {
        let mut board = board([UDF, 0, 0], UDF);
        let Err(Stopped::Faulted { fault, .. }) = board.run_until(100 * MS) else { panic!("not noticed") };
        assert!(fault.lockup);
    }
}
