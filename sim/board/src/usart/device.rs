//! The USART as a device of the emulator: register block, pins, clock gate.

use super::registers::{Registers, cr1, offset};
use super::{Connections, Pin, Usart};
use crate::timeline::{Timeline, lock};
use rsemu::core::device::{self, DeviceClass, ExportId, RealizeCtx, ResetKind, SinkPin};
use rsemu::core::error::{BusError, Error};
use rsemu::core::props::ValueKind;
use rsemu::core::space::{AccessConstraints, AddressSpace, MemAttrs, MemOps, MemResult, Region, RegionRef};
use rsemu::core::value::{Endian, Width};
use rsemu::core::wire::{Level, WireId, WireSink, WireSource};
use rsemu::dev::stm32::Clocks;
use rsemu::dev::stm32::gate::{self, ClockGate, Gated};
use rsemu::machine::validate::{ClassSchema, PortDir, PropSchema};
use rsemu::machine::{BindCtx, Instance};
use std::sync::Arc;

/// Class name in the board text.
pub(crate) const CLASS_NAME: &str = "clino.usart";

static CLASS: DeviceClass = DeviceClass {
    name: CLASS_NAME,
    version: 1,
    summary: "STM32F4 USART with bit-exact character timing",
    properties: &[],
    construct: |_| Err(Error::Unimplemented("built by the board only")),
};

/// The class as the emulator's registry wants it.
pub(crate) fn class() -> &'static DeviceClass {
    &CLASS
}

/// What the board text may say about the class.
pub(crate) fn schema() -> ClassSchema {
    let schema = ClassSchema::new(CLASS_NAME)
        .prop(PropSchema::new("port", ValueKind::Str).required())
        .region("")
        .port("irq", PortDir::Out)
        .port("de", PortDir::In);
    gate::ports(schema)
}

/// A USART in the emulator's machine.
pub(crate) struct Device {
    usart: Arc<Usart>,
    region: RegionRef,
    de: Arc<DriveEnable>,
}

impl Device {
    /// A USART connected as `connections` says.
    pub fn new(connections: Connections, timeline: Arc<Timeline>) -> Device {
        let usart = Arc::new(Usart::new(connections, timeline));
        let ops: Arc<dyn MemOps> = Arc::clone(&usart) as _;
        Device {
            region: Arc::new(Region::io(CLASS_NAME, offset::END, ops)),
            de: Arc::new(DriveEnable { usart: Arc::clone(&usart), level: Default::default() }),
            usart,
        }
    }

    /// The part that acts in time.
    pub fn actor(&self) -> Arc<Usart> {
        Arc::clone(&self.usart)
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct(CLASS_NAME).finish_non_exhaustive()
    }
}

impl std::fmt::Debug for Usart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Usart").field("registers", &lock(&self.state).registers).finish_non_exhaustive()
    }
}

impl device::Device for Device {
    fn class(&self) -> &'static DeviceClass {
        &CLASS
    }

    fn realize(&self, _ctx: &mut RealizeCtx<'_>) -> rsemu::core::Result<()> {
        Ok(())
    }

    fn reset(&self, _kind: ResetKind) {
        self.usart.gate_reset();
    }

    fn region(&self, name: &str) -> Option<RegionRef> {
        name.is_empty().then(|| Arc::clone(&self.region))
    }

    fn sink(&self, port: &str, sources: &[WireId]) -> Option<SinkPin> {
        if let Some(pin) = gate::sink(&self.usart, port, sources) {
            return Some(pin);
        }
        (port == "de").then(|| SinkPin { sink: Arc::clone(&self.de) as Arc<dyn WireSink>, line: 0 })
    }

    fn connect(&self, port: &str, source: WireSource) -> rsemu::core::Result<()> {
        if port != "irq" {
            return Err(Error::Config { at: port.to_string(), message: "a USART drives `irq` only".into() });
        }
        *lock(&self.usart.irq) = Some(source);
        Ok(())
    }
}

impl Instance for Device {
    fn bind(&self, ctx: &BindCtx<'_>) -> rsemu::core::Result<()> {
        let _ = self.usart.clocks.set(ctx.export_as::<Clocks>("rcc", ExportId::CLOCK_TREE)?);
        if let Some(space) = ctx.space_named("mem") {
            let _ = self.usart.space.set(Arc::clone(space));
        }
        Ok(())
    }
}

impl Gated for Usart {
    fn clock_gate(&self) -> &ClockGate {
        &self.gate
    }

    fn gate_reset(&self) {
        // What is on its way is cut off here but not on the wire: firmware that resets a USART in the middle
        // of a character is not served.
        self.change(self.timeline.now(), |state| {
            state.registers = Registers::default();
            state.shifting_until = None;
            state.idle_check = None;
        });
    }
}

/// The GPIO that enables the line driver.
struct DriveEnable {
    usart: Arc<Usart>,
    level: rsemu::core::sync::AtomicBool,
}

impl WireSink for DriveEnable {
    fn set_level(&self, _src: WireId, _line: u32, level: Level) {
        let high = level.is_high();
        if self.level.swap(high, rsemu::core::sync::Ordering::Relaxed) == high {
            return;
        }
        let now = self.usart.timeline.now();
        self.usart.change(now, |state| state.wire.drive_enable(now, high));
    }
}

impl MemOps for Usart {
    fn read(&self, offset: u64, dst: &mut [u8], attrs: MemAttrs) -> MemResult {
        let (register, shift) = (offset & !3, offset & 3);
        let value = if !self.gate.live() {
            0
        } else if attrs.debug || shift != 0 {
            lock(&self.state).registers.peek(register)
        } else {
            self.change(self.timeline.now(), |state| state.registers.read(register))
        };
        let bytes = u32::from(value).to_le_bytes();
        for (dst, byte) in dst.iter_mut().zip(bytes.into_iter().skip(shift as usize)) {
            *dst = byte;
        }
        Ok(())
    }

    fn write(&self, offset: u64, src: &[u8], attrs: MemAttrs) -> MemResult {
        if attrs.debug {
            return Err(BusError::BadAccess);
        }
        if !self.gate.live() {
            return Ok(());
        }
        let (register, shift) = (offset & !3, (offset & 3) as usize);
        let (mut value, mut mask) = ([0; 4], [0; 4]);
        for (i, byte) in src.iter().enumerate().take(4 - shift) {
            value[shift + i] = *byte;
            mask[shift + i] = 0xff;
        }
        let half = |bytes: [u8; 4]| u16::from_le_bytes([bytes[0], bytes[1]]);
        let now = self.timeline.now();
        self.change(now, |state| {
            let was_on = state.registers.has(cr1::UE | cr1::TE);
            state.registers.write(register, half(value), half(mask));
            if !was_on && state.registers.has(cr1::UE | cr1::TE) {
                self.start_preamble(state, now);
            }
        });
        Ok(())
    }

    fn constraints(&self) -> AccessConstraints {
        AccessConstraints::word(Width::U32, Endian::Little).with_widths(Width::U8, Width::U32)
    }
}

impl Pin {
    /// Offsets of MODER and AFRL in a GPIO port, and MODER's code for "alternate function" (RM0090 §8.4).
    const MODER: u64 = 0x00;
    const AFRL: u64 = 0x20;
    const ALTERNATE: u64 = 0b10;

    /// Whether the GPIO port has switched the pin to the alternate function.
    pub fn is_connected(self, space: &AddressSpace) -> bool {
        let read = |offset| space.read(self.port + offset, Width::U32, MemAttrs::DEBUG).unwrap_or(0);
        let mode = read(Pin::MODER) >> (2 * self.number) & 0b11;
        let function = read(Pin::AFRL + 4 * u64::from(self.number / 8)) >> (4 * (self.number % 8)) & 0xf;
        mode == Pin::ALTERNATE && function == u64::from(self.function)
    }
}
