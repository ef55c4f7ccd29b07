//! The board: a STM32F427, which has the reference manual of the F407, with a crystal of 8 MHz and the sensors of
//! `docs/wiring.md`.

use std::num::{NonZeroU32, NonZeroU64};
use std::sync::Arc;

use rigless::chip::uart;
use rigless::cpu::armv7m::windows;
use rigless::emulator::CoreSpec;
use rigless::machine::armv7m::{Core, Fpu, MpuRegions, Variant};
use rigless::machine::{Board, Crystal, Supply, Target};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Error;
use rigless::soc::stm32f427::Stm32f427;

use super::core::{SharedOrders, Watched};

/// Indices of the serial ports in the part.
pub const USART1: usize = 0;
pub const USART2: usize = 1;
pub const USART3: usize = 2;
pub const USART6: usize = 3;

/// Instructions in a second of virtual time: 1.34 cycles of 168 MHz each, as the virtual board charges on the average.
pub const INSTRUCTIONS_PER_SECOND: u64 = 125_000_000;
/// The crystal.
const CRYSTAL_HZ: u64 = 8_000_000;
/// Its only part.
const NAME: &str = "stm32f427";

/// The board.
#[derive(Debug)]
pub struct Gateway {
    /// The part.
    pub mcu: Stm32f427,
    orders: SharedOrders,
}

rigless::snapshot::store!(Gateway { values: [], parts: [mcu], built: [orders] });

impl Gateway {
    /// The part, with its watchdog's oscillator at this rate.
    pub fn new(orders: SharedOrders, lsi_hz: u64) -> Result<Gateway, Error> {
        let mut mcu = Stm32f427::new()?;
        mcu.rcc.attach_crystals(Crystal(CRYSTAL_HZ).0, Crystal::NONE.0);
        mcu.rcc.calibrate_lsi(lsi_hz);
        mcu.set_supply(Supply(3_300).0);
        Ok(Gateway { mcu, orders })
    }

    /// Puts `peer` at the far end of a serial port.
    pub fn attach(&mut self, port: usize, peer: impl uart::Peer) {
        self.mcu.usart[port].attach(peer);
    }
}

impl Board for Gateway {
    fn name(&self) -> &'static str {
        "clino"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec![NAME]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let lines = u32::from(Operate::cpu(&self.mcu).interrupt_lines);
        let core = Core {
            variant: Variant::M4,
            clock_hz: NonZeroU64::new(168_000_000).expect("not 0"),
            interrupt_lines: NonZeroU32::new(lines).expect("not 0"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("not 0"),
            instructions_per_second: NonZeroU64::new(INSTRUCTIONS_PER_SECOND).expect("not 0"),
            boot: "flash",
        };
        let mut spec: CoreSpec =
            core.spec_with_parts(&windows(self.mcu.bus()), Fpu::FpV4Sp, MpuRegions::Eight);
        let (inner, orders) = (Arc::clone(&spec.processor), Arc::clone(&self.orders));
        spec.processor =
            Arc::new(move |endian| Ok(Box::new(Watched::new(inner(endian)?, Arc::clone(&orders)))));
        vec![Target::new(NAME, &mut self.mcu, spec)]
    }
}
