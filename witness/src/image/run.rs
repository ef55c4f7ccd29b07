//! One run of the image: what is on the lines, what is planted, and everything that was seen.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;

use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu};
use clino_sim::motion::Motion;
use clino_sim::node::{Node, Ns};
use clino_sim::pwm::{Cycle, Pwm};
use clino_sim::{isu, t7};
use rigless::device::{Level, ResetCause};
use rigless::emulator::{self, AccessKind, Driver, Host as Lent, Settled, Start, Stop};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::soc::stm32f427::peripherals::tim::Channel;
use rigless::time::VirtualNanos;

use super::bus::{Line, Sensors, Shared};
use super::core::{Order, SharedOrders};
use super::hosts::{Host, Talk};
use super::part::{Gateway, USART1, USART2, USART3, USART6};

/// A millisecond.
pub const MS: Ns = 1_000_000;
/// `BSRR` of the ports with a DE pin, and the pin: T7, ISU, Modbus (`docs/wiring.md`).
const DE: [(u64, u32); 3] = [(0x4002_0418, 8), (0x4002_0C18, 10), (0x4002_0818, 8)];
/// Status of the USARTs of the three.
const SR: [u64; 3] = [0x4001_1000, 0x4000_4800, 0x4001_1400];
/// `IWDG_KR`, and the key that feeds.
const IWDG_KR: u64 = 0x4000_3000;
const FEED: u64 = 0xAAAA;
/// A character of eleven bits at the Modbus port's rate.
const MODBUS_CHARACTER: Ns = 11 * 1_000_000_000 / 19_200;
/// PWM input 1 is channel 2 of TIM5, input 2 channel 1 of TIM2 (`docs/wiring.md`): timer, channel.
const PWM: [(usize, u8); 2] = [(3, 2), (0, 1)];
/// System memory (RM0090 section 39): the part's number, and the halfword with its flash in KiB. The emulator's is empty, and the
/// image says on a part with too little flash that it is the wrong one, and does nothing.
const UID: u64 = 0x1FFF_7A10;
const FLASH_SIZE: u64 = 0x1FFF_7A22;
const FLASH_KB: u16 = 1_024;
/// `RCC_CSR`.
const RCC_CSR: u64 = 0x4002_3874;

/// What a run consists of.
pub struct Setting {
    /// How long.
    pub until: Ns,
    /// The watchdog's oscillator.
    pub lsi_hz: u64,
    /// True angles: T7 1 to 3, ISU 1, the two PWM inputs.
    pub motion: [Motion; 6],
    /// Whether the sensors are there.
    pub is_connected: bool,
    /// The reset pin is pulled at these times.
    pub pin_resets: Vec<Ns>,
    /// The crystal stops.
    pub crystal_stops: Option<Ns>,
}

impl Default for Setting {
    fn default() -> Setting {
        Setting {
            until: 2_000 * MS,
            lsi_hz: 32_000,
            motion: std::array::from_fn(|_| Motion::Constant(0)),
            is_connected: true,
            pin_resets: Vec::new(),
            crystal_stops: None,
        }
    }
}

/// A reset of the part.
#[derive(Clone, Debug)]
pub struct Restart {
    /// When.
    pub at: Ns,
    /// Why.
    pub cause: String,
}

/// What was seen.
pub struct Seen {
    /// T7, ISU, Modbus.
    pub lines: [Shared; 3],
    /// Resets.
    pub restarts: Vec<Restart>,
    /// Complaints of the emulator.
    pub complaints: Vec<String>,
    /// Feeds of the watchdog: when.
    pub feeds: Vec<Ns>,
    /// What firmware read in `RCC_CSR` first after each start, and when.
    pub causes: Vec<(Ns, u32)>,
    /// Registers at the end.
    pub registers: Vec<(u64, Option<u32>)>,
    /// Instructions in all.
    pub instructions: u64,
}

/// The run's driver.
struct Watch {
    until: Ns,
    lines: [Shared; 3],
    edges: [VecDeque<(Ns, bool)>; 2],
    pin_resets: VecDeque<Ns>,
    crystal_stops: Option<Ns>,
    orders: SharedOrders,
    feeds: Vec<Ns>,
    causes: Vec<(Ns, u32)>,
    /// Addresses to be read at the end, and what they held.
    wanted: Vec<u64>,
    registers: Vec<(u64, Option<u32>)>,
    instructions: u64,
}

impl Watch {
    /// The next instant at which something comes from outside.
    fn next(&self, now: Ns) -> Ns {
        let edges = self.edges.iter().filter_map(|edges| edges.front().map(|(at, _)| *at));
        let others = self.pin_resets.front().copied().into_iter().chain(self.crystal_stops);
        let next = edges.chain(others).filter(|at| *at > now).min().unwrap_or(Ns::MAX);
        // Hosts are asked at every stop.
        next.min(now + MS).min(self.until)
    }
}

impl Driver<Gateway> for Watch {
    fn on_settled(&mut self, _: &mut Session<Gateway>, _: &mut dyn Lent, settled: Settled) {
        let Settled::Access { access, value } = settled else { return };
        let now = access.virtual_time.0;
        if access.kind == AccessKind::Write {
            for (line, (address, pin)) in DE.iter().enumerate() {
                if access.address == *address {
                    let mut line = self.lines[line].lock().expect("no panic");
                    if access.value >> pin & 1 != 0 {
                        line.drive(true, now);
                    } else if access.value >> (pin + 16) & 1 != 0 {
                        line.drive(false, now);
                    }
                }
            }
            if access.address == IWDG_KR && access.value == FEED {
                self.feeds.push(now);
            }
        } else if access.address == RCC_CSR {
            self.causes.push((now, value as u32));
        } else if let Some(line) = SR.iter().position(|address| *address == access.address) {
            self.lines[line].lock().expect("no panic").look(now);
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Gateway>,
        stop: Stop,
        host: &mut dyn Lent,
    ) -> Option<VirtualNanos> {
        let now = stop.at.0;
        self.instructions = stop.instruction_count;
        if now >= self.until {
            for address in std::mem::take(&mut self.wanted) {
                let value =
                    session.mcu().peek_at(stop.at, address).or_else(|| host.read(address, Width::W32).ok());
                self.registers.push((address, value.map(|value| value as u32)));
            }
            return None;
        }
        let mcu = &mut session.board_mut().mcu;
        for ((timer, channel), edges) in PWM.iter().zip(&mut self.edges) {
            while let Some((_, high)) = edges.front().copied().filter(|(at, _)| *at <= now) {
                edges.pop_front();
                let level = if high { Level::High } else { Level::Low };
                let channel = Channel::new(*channel).expect("a channel");
                mcu.drive_timer(stop.at, *timer, |tim, registers, context| {
                    tim.drive_input(channel, level, registers, context);
                });
            }
        }
        if self.crystal_stops.is_some_and(|at| at <= now) {
            self.crystal_stops = None;
            mcu.drive_clocks(stop.at, |rcc, registers, context| rcc.fail_hse(registers, context));
            let mut orders = self.orders.lock().expect("no panic");
            orders.crystal_is_dead = true;
            orders.due.push((now, Order::Nmi));
        }
        if self.pin_resets.front().is_some_and(|at| *at <= now) {
            self.pin_resets.pop_front();
            session.reset_by_pin(stop.at, stop.instruction_count, host);
        }
        Some(VirtualNanos(self.next(now)))
    }
}

/// A look at a register that changes nothing.
trait PeekAt {
    fn peek_at(&mut self, at: VirtualNanos, address: u64) -> Option<u64>;
}

impl PeekAt for dyn rigless::mcu::Mcu + '_ {
    fn peek_at(&mut self, at: VirtualNanos, address: u64) -> Option<u64> {
        rigless::mcu::Operate::peek(self, at, address, Width::W32).ok()
    }
}

/// The hosts of a run, and what is planted in it.
#[derive(Default)]
pub struct World {
    /// The console.
    pub console: Talk,
    /// The Modbus master.
    pub modbus: Talk,
    /// What is planted.
    pub orders: SharedOrders,
}

/// Runs the image.
pub fn run(
    elf: &Path,
    bytes: &[u8],
    setting: &Setting,
    world: &World,
    wanted: &[u64],
) -> Result<Seen, String> {
    let lines: [Shared; 3] = std::array::from_fn(|_| Shared::new(Line::default().into()));
    let said = |error: &dyn std::fmt::Display| error.to_string();
    let mut board = Gateway::new(Arc::clone(&world.orders), setting.lsi_hz).map_err(|error| said(&error))?;
    if setting.is_connected {
        board.attach(USART1, Sensors::new(t7_nodes(&setting.motion), Arc::clone(&lines[0]), 115_200));
        board.attach(
            USART3,
            Sensors::new(vec![isu_node(&setting.motion[3])], Arc::clone(&lines[1]), isu::BAUD),
        );
    }
    board.attach(USART2, Host::new(Arc::clone(&world.console)));
    board.attach(USART6, Host::on_pair(Arc::clone(&world.modbus), Arc::clone(&lines[2]), MODBUS_CHARACTER));
    let edges = std::array::from_fn(|input| {
        if setting.is_connected { edges(&setting.motion[4 + input], setting.until) } else { VecDeque::new() }
    });
    let driver = Watch {
        until: setting.until,
        lines: lines.clone(),
        edges,
        pin_resets: setting.pin_resets.iter().copied().collect(),
        crystal_stops: setting.crystal_stops,
        orders: Arc::clone(&world.orders),
        feeds: Vec::new(),
        causes: Vec::new(),
        wanted: wanted.to_vec(),
        registers: Vec::new(),
        instructions: 0,
    };
    let image = Image::new(elf, bytes.to_vec(), None).map_err(|error| said(&error))?;
    let system =
        Image::new(Path::new("system memory"), system_memory(), Some(UID)).map_err(|error| said(&error))?;
    let session = Session::new(Box::new(board), 0, VirtualNanos(MS)).map_err(|error| said(&error))?;
    let images = [image, system];
    let mut finished = emulator::run(session, &Start::new(&images), driver).map_err(|error| said(&error))?;
    let session = &mut finished.session;
    if let Some(error) = session.take_error() {
        return Err(error.to_string());
    }
    let mut complaints = Vec::new();
    complaints.extend(session.unmapped().iter().map(|it| it.to_string()));
    complaints.extend(
        session.refused().iter().map(|(address, fault)| format!("refused at={address:#010x} {fault}")),
    );
    complaints.extend(session.unimplemented().iter().map(|(address, it)| {
        format!(
            "unimplemented at={address:#010x} {}.{} reads={} writes={}",
            it.instance, it.register, it.reads, it.writes
        )
    }));
    complaints.extend(
        session
            .undefined()
            .iter()
            .map(|(address, it)| format!("undefined at={address:#010x} {}", it.instance)),
    );
    complaints
        .extend(session.unrouted().iter().map(|(instance, number)| format!("unrouted {instance} {number}")));
    complaints
        .extend(session.told().map(|it| format!("told {}.{}: {}", it.instance, it.register, it.reason)));
    let cause = |cause: ResetCause| match cause {
        ResetCause::Core => "software".to_owned(),
        ResetCause::Model(name) => name.to_owned(),
        other => format!("{other:?}").to_lowercase(),
    };
    let restarts =
        session.resets().iter().map(|it| Restart { at: it.at.0, cause: cause(it.cause) }).collect();
    let driver = finished.driver;
    Ok(Seen {
        lines,
        restarts,
        complaints,
        feeds: driver.feeds,
        causes: driver.causes,
        registers: driver.registers,
        instructions: driver.instructions,
    })
}

/// From the part's number to the size of flash.
fn system_memory() -> Vec<u8> {
    let mut bytes = b"WITNESS 0001".to_vec();
    bytes.resize((FLASH_SIZE - UID) as usize, 0);
    bytes.extend(FLASH_KB.to_le_bytes());
    bytes
}

fn t7_nodes(motion: &[Motion; 6]) -> Vec<Box<dyn Node>> {
    (1..=3)
        .map(|address| {
            let settings = t7::StoredSettings { address, ..t7::StoredSettings::default() };
            let mut options = t7::Options::default();
            options.motion = std::array::from_fn(|_| motion[usize::from(address) - 1].clone());
            let made = t7::T7::new(t7::Identity::default(), settings, options);
            let node: Box<dyn Node> = Box::new(made.unwrap_or_else(|error| panic!("{error}")));
            node
        })
        .collect()
}

fn isu_node(motion: &Motion) -> Box<dyn Node> {
    let content = Content { address: 1, null: 0, auto_shutoff: false };
    let eeprom = Eeprom::factory(content, ChecksumScope::default(), 1);
    Box::new(Isu::new(eeprom, isu::Options { motion: motion.clone(), ..isu::Options::default() }))
}

/// The edges of a PWM output.
fn edges(motion: &Motion, until: Ns) -> VecDeque<(Ns, bool)> {
    let mut output = Pwm::new(motion.clone());
    let mut edges = VecDeque::new();
    let mut now = 3 * MS;
    while now < until {
        match output.next_cycle(now) {
            Cycle::Pulse { period, high } => {
                edges.extend([(now, true), (now + high, false)]);
                now += period;
            }
            Cycle::Level { recheck_after, .. } => now += recheck_after,
        }
    }
    edges
}
