//! The core, watched: faults planted in its registers, registers of its own read, a crystal that is dead.
#![expect(unsafe_code, reason = "what maps memory into the core is passed on")]

use std::sync::{Arc, Mutex};

use clino_sim::node::Ns;
use rigless::emulator::{
    Access, AccessKind, BitAlias, CoreBus, DataModel, Error, Exit, HaltReason, HostCall, InterruptLine,
    Processor, Queued,
};
use rigless::soc::{Endian, Width};
use rigless::time::VirtualNanos;

/// The processor's numbers of registers for a debugger.
pub mod register {
    pub const SP: usize = 13;
    pub const PC: usize = 15;
    pub const XPSR: usize = 16;
    pub const PRIMASK: usize = 36;
}

/// `xPSR`: Thumb state, and nothing else.
const THUMB: u32 = 1 << 24;
/// `ICSR`, and its bit that pends NMI.
const ICSR: u64 = 0xE000_ED04;
const NMIPENDSET: u64 = 1 << 31;
/// `RCC_CR`, `HSERDY`.
const RCC_CR: u64 = 0x4002_3800;
const HSERDY: u64 = 1 << 17;

/// `DBGMCU_IDCODE`, its bits for the device, and the number of an F407 there (RM0090 section 38.6.1): the image says on any other
/// part that it is the wrong one, and does nothing.
const DBGMCU_IDCODE: u64 = 0xE004_2000;
const DEVICE: u64 = 0xFFF;
const F407: u64 = 0x413;

/// Where the part has nothing, and answers with a bus error (RM0090 section 2.3). The emulator reads 0 there.
const HOLES: [std::ops::Range<u64>; 5] = [
    0x0020_0000..0x0800_0000,
    0x0820_0000..0x1000_0000,
    0x1001_0000..0x1FFF_0000,
    0x2003_0000..0x2200_0000,
    0x2400_0000..0x4000_0000,
];

/// Something to be done to the core.
#[derive(Clone, Debug)]
pub enum Order {
    /// Registers are set, by their number, once the main loop executes.
    Set(Vec<(usize, u32)>),
    /// NMI becomes pending: the part's clock security system cannot do it here.
    Nmi,
    /// A word of the core's own, or of memory, is read.
    Look(u64),
}

/// What is asked of the core, and what it has shown.
#[derive(Debug, Default)]
pub struct Orders {
    /// When, what.
    pub due: Vec<(Ns, Order)>,
    /// What was read: address, value.
    pub seen: Vec<(u64, u32)>,
    /// When registers were set.
    pub planted: Vec<Ns>,
    /// `HSERDY` never reads 1.
    pub crystal_is_dead: bool,
}

/// Shared with the run.
pub type SharedOrders = Arc<Mutex<Orders>>;

/// The emulator's core, and the orders.
#[derive(Debug)]
pub struct Watched {
    inner: Box<dyn Processor>,
    orders: SharedOrders,
}

impl Watched {
    /// A core under orders.
    pub fn new(inner: Box<dyn Processor>, orders: SharedOrders) -> Watched {
        Watched { inner, orders }
    }

    fn number(&self, register: usize) -> u32 {
        let bytes = self.inner.gdb_register(register).unwrap_or_default();
        bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
    }

    /// Carries out what is due.
    fn obey(&mut self, now: Ns) {
        let orders = Arc::clone(&self.orders);
        let mut orders = orders.lock().expect("no panic");
        let mut later = Vec::new();
        for (at, order) in std::mem::take(&mut orders.due) {
            let is_main_loop = self.number(register::XPSR) & 0x1ff == 0;
            match &order {
                _ if at > now => later.push((at, order)),
                Order::Set(_) if !is_main_loop => later.push((at, order)),
                Order::Set(registers) => {
                    self.inner.set_gdb_register(register::XPSR, &THUMB.to_le_bytes());
                    for (number, value) in registers {
                        assert!(
                            self.inner.set_gdb_register(*number, &value.to_le_bytes()),
                            "register {number}"
                        );
                    }
                    orders.planted.push(now);
                }
                Order::Nmi => {
                    self.inner.debugger_access(Some(NMIPENDSET), ICSR, Width::W32, VirtualNanos(now));
                    orders.planted.push(now);
                }
                Order::Look(address) => {
                    let value = self.inner.debugger_access(None, *address, Width::W32, VirtualNanos(now));
                    orders.seen.push((*address, value.unwrap_or_default() as u32));
                }
            }
        }
        orders.due = later;
    }
}

/// The bus, with holes in it, and a crystal that may be dead.
struct Through<'a> {
    bus: &'a mut dyn CoreBus,
    crystal_is_dead: bool,
}

impl CoreBus for Through<'_> {
    fn access(&mut self, access: Access, from_code: bool) -> Option<u64> {
        if HOLES.iter().any(|hole| hole.contains(&access.address)) {
            return None;
        }
        let is_ready = access.kind == AccessKind::Read && access.address == RCC_CR && self.crystal_is_dead;
        let value = self.bus.access(access, from_code)?;
        Some(match access.address {
            _ if is_ready => value & !HSERDY,
            DBGMCU_IDCODE if access.kind == AccessKind::Read => value & !DEVICE | F407,
            _ => value,
        })
    }

    fn time(&self, instructions: u64) -> VirtualNanos {
        self.bus.time(instructions)
    }

    fn queued(&mut self) -> Vec<Queued> {
        self.bus.queued()
    }

    fn carry_on(&mut self, instructions: u64, event: Option<VirtualNanos>) -> Option<u32> {
        self.bus.carry_on(instructions, event)
    }

    fn acknowledge(&mut self, line: InterruptLine, instructions: u64) -> Option<u64> {
        self.bus.acknowledge(line, instructions)
    }

    fn stops_before(&mut self, access: &Access) -> bool {
        self.bus.stops_before(access)
    }

    fn send_trace(&mut self, bytes: &[u8]) {
        self.bus.send_trace(bytes);
    }
}

impl Processor for Watched {
    fn run(&mut self, budget: u32, bus: &mut dyn CoreBus) -> (Exit, u64) {
        let now = bus.time(self.inner.retired()).0;
        let (is_due, crystal_is_dead) = {
            let orders = self.orders.lock().expect("no panic");
            (orders.due.iter().any(|(at, _)| *at <= now), orders.crystal_is_dead)
        };
        if is_due {
            self.obey(now);
        }
        self.inner.run(budget, &mut Through { bus, crystal_is_dead })
    }

    // Everything else is the core's.
    fn waiting(&self) -> bool {
        self.inner.waiting()
    }
    fn retired(&self) -> u64 {
        self.inner.retired()
    }
    fn ask(&mut self, queued: Queued) {
        self.inner.ask(queued);
    }
    fn maps(&self, start: u64, length: u64) -> bool {
        self.inner.maps(start, length)
    }
    fn page_size(&self) -> u64 {
        self.inner.page_size()
    }
    unsafe fn map(&mut self, start: u64, length: u64, host: *mut u8, writable: bool) {
        // SAFETY: the caller's promise is passed on, and `inner` is dropped with `self`.
        unsafe { self.inner.map(start, length, host, writable) };
    }
    fn boot(&mut self, table: u64, read: &dyn Fn(u64, Width) -> Option<u64>) {
        self.inner.boot(table, read);
    }
    fn reset(&mut self) {
        self.inner.reset();
    }
    fn take_reset_request(&mut self) -> bool {
        self.inner.take_reset_request()
    }
    fn next_event(&self) -> Option<VirtualNanos> {
        self.inner.next_event()
    }
    fn on_event(&mut self, now: VirtualNanos) {
        self.inner.on_event(now);
    }
    fn pc(&self) -> u64 {
        self.inner.pc()
    }
    fn add_breakpoint(&mut self, address: u64) -> bool {
        self.inner.add_breakpoint(address)
    }
    fn remove_breakpoint(&mut self, address: u64) {
        self.inner.remove_breakpoint(address);
    }
    fn pass_breakpoint(&mut self, address: u64) {
        self.inner.pass_breakpoint(address);
    }
    fn attach_debugger(&mut self, attached: bool) {
        self.inner.attach_debugger(attached);
    }
    fn hold_interrupts(&mut self, held: bool) {
        self.inner.hold_interrupts(held);
    }
    fn gdb_register(&self, number: usize) -> Option<Vec<u8>> {
        self.inner.gdb_register(number)
    }
    fn set_gdb_register(&mut self, number: usize, bytes: &[u8]) -> bool {
        self.inner.set_gdb_register(number, bytes)
    }
    fn debugger_access(
        &mut self,
        write: Option<u64>,
        address: u64,
        width: Width,
        now: VirtualNanos,
    ) -> Option<u64> {
        self.inner.debugger_access(write, address, width, now)
    }
    fn take_debugger_trace(&mut self) -> Vec<u8> {
        self.inner.take_debugger_trace()
    }
    fn target_xml(&self) -> &'static str {
        self.inner.target_xml()
    }
    fn data_model(&self) -> DataModel {
        self.inner.data_model()
    }
    fn byte_order(&self, address: u64) -> Endian {
        self.inner.byte_order(address)
    }
    fn save(&self) -> Vec<u8> {
        self.inner.save()
    }
    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.inner.load(bytes)
    }
    fn debugger_halted(&mut self, why: HaltReason) -> bool {
        self.inner.debugger_halted(why)
    }
    fn bit_alias(&self, address: u64, width: Width) -> Option<BitAlias> {
        self.inner.bit_alias(address, width)
    }
    fn own_ranges(&self) -> Vec<std::ops::Range<u64>> {
        self.inner.own_ranges()
    }
    fn host_call(&self, read: &mut dyn FnMut(u64, Width) -> Option<u64>) -> Option<HostCall> {
        self.inner.host_call(read)
    }
    fn answer_host_call(&mut self, answer: Option<u64>) {
        self.inner.answer_host_call(answer);
    }
}
