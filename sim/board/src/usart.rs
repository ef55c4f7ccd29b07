//! The chip's USART at character level with bit-exact instants (RM0090 §30).
//!
//! | Offset | Register | |
//! |---|---|---|
//! | 0x00 | SR | status flags |
//! | 0x04 | DR | data, nine bits |
//! | 0x08 | BRR | bit length in bus clocks: 16 × mantissa + fraction, or 8 × with OVER8 |
//! | 0x0C | CR1 | enables, word length, parity, interrupts |
//! | 0x10 | CR2 | stop bits |
//! | 0x14 | CR3 | error interrupt |
//! | 0x18 | GTPR | storage only |
//!
//! All may be accessed 8, 16 or 32 bits wide. A character written is handed to the [`Wire`] at its start bit and
//! one the wire sampled arrives at the centre of its stop bit; both only while the TX or RX pin is switched to
//! this USART by its GPIO port. The port has a clock gate and a reset line from the RCC.
//!
//! Not modelled: DMA, synchronous, smartcard, IrDA, LIN and single-wire modes, hardware flow control, mute mode,
//! break characters. A start bit begins at the very write to DR instead of the next edge of the baud generator.
//! IDLE is raised up to one character late, because the wire tells of a character only at its end.

mod device;
mod registers;

use crate::reception::Receptions;
use crate::timeline::{Actor, PS_PER_NS, Rate, Timeline, lock};
use clino_segment::wire::{Format, Received, Sent, Wire};
use clino_sim::node::Ns;
use registers::{Registers, cr1, sr};
use rsemu::core::space::AddressSpace;
use rsemu::core::sync::{AtomicBool, Ordering};
use rsemu::core::wire::WireSource;
use rsemu::dev::stm32::gate::ClockGate;
use rsemu::dev::stm32::{ClockOutput, Clocks};
use std::sync::{Arc, Mutex, OnceLock};

pub(crate) use device::{CLASS_NAME, Device as UsartDevice, class, schema};

/// A pin of the chip and the alternate function that connects it to a USART.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pin {
    /// Base address of the GPIO port.
    pub port: u64,
    /// Pin number, 0..=15.
    pub number: u32,
    /// Alternate function that selects the USART.
    pub function: u32,
}

/// What one instance is connected to.
pub(crate) struct Connections {
    /// The bus clock it runs on.
    pub clock: ClockOutput,
    /// Transmit pin.
    pub tx: Pin,
    /// Receive pin.
    pub rx: Pin,
    /// What hangs on the pins.
    pub wire: Box<dyn Wire>,
    /// Where it notes what arrives.
    pub receptions: Receptions,
}

/// One USART.
pub(crate) struct Usart {
    timeline: Arc<Timeline>,
    gate: ClockGate,
    clocks: OnceLock<Arc<Clocks>>,
    space: OnceLock<Arc<AddressSpace>>,
    irq: Mutex<Option<WireSource>>,
    irq_level: AtomicBool,
    state: Mutex<State>,
}

struct State {
    registers: Registers,
    clock: ClockOutput,
    tx: Pin,
    rx: Pin,
    wire: Box<dyn Wire>,
    receptions: Receptions,
    /// End of what is being shifted out (a character or the idle preamble), in picoseconds.
    shifting_until: Option<u64>,
    /// The shifter holds a character, not the preamble.
    shifting_character: bool,
    /// The format last given to the wire.
    listening: Option<Format>,
    /// When to decide whether the line is idle, and the latest start of a character that would deny it.
    idle_check: Option<(Ns, Ns)>,
}

impl Usart {
    fn new(connections: Connections, timeline: Arc<Timeline>) -> Usart {
        let Connections { clock, tx, rx, wire, receptions } = connections;
        Usart {
            timeline,
            gate: ClockGate::new(),
            clocks: OnceLock::new(),
            space: OnceLock::new(),
            irq: Mutex::new(None),
            irq_level: AtomicBool::new(false),
            state: Mutex::new(State {
                registers: Registers::default(),
                clock,
                tx,
                rx,
                wire,
                receptions,
                shifting_until: None,
                shifting_character: false,
                listening: None,
                idle_check: None,
            }),
        }
    }

    /// Runs `change` on the state at `now`, then drives the interrupt line and tells the core that the next
    /// event may have moved.
    fn change<T>(&self, now: Ns, change: impl FnOnce(&mut State) -> T) -> T {
        let mut state = lock(&self.state);
        let result = change(&mut state);
        self.follow_settings(&mut state, now);
        self.start_next(&mut state, now * PS_PER_NS);
        // A character we begin may be what brings the wire to the end of one that comes in.
        self.receive_all(&mut state);
        let irq = state.registers.interrupt();
        drop(state);
        self.drive_irq(irq);
        self.timeline.nudge();
        result
    }

    fn drive_irq(&self, high: bool) {
        if self.irq_level.swap(high, Ordering::Relaxed) == high {
            return;
        }
        if let Some(line) = &*lock(&self.irq) {
            line.set(high.into());
        }
    }

    /// Framing and bit length as the registers and the bus clock stand; `None` while they make no sense.
    fn format(&self, state: &State) -> Option<Format> {
        let rate = self.clocks.get().map_or(Rate { num: 0, den: 1 }, |c| crate::cpu::rate(c, state.clock));
        let bit_ps = rate.ps(state.registers.bit_ticks());
        if bit_ps == 0 || !self.gate.live() {
            return None;
        }
        let (data_bits, stop_halves) = (state.registers.data_bits(), state.registers.stop_halves());
        Some(Format { bit_ps, data_bits, stop_halves })
    }

    /// Tells the wire when the receiver's settings changed.
    fn follow_settings(&self, state: &mut State, now: Ns) {
        let on = state.registers.has(cr1::UE | cr1::RE);
        let format = if on { self.format(state) } else { None };
        if format != state.listening {
            state.listening = format;
            state.wire.set_receiver(now, format);
        }
    }

    /// Starts the next character if there is one and the shifter is free; `now` in picoseconds.
    fn start_next(&self, state: &mut State, now: u64) {
        if state.shifting_until.is_some() || !state.registers.has(cr1::UE | cr1::TE) {
            return;
        }
        let Some(format) = self.format(state) else { return };
        let Some(word) = state.registers.take_transmit() else { return };
        state.shifting_until = Some(now + character_ps(format));
        state.shifting_character = true;
        if self.connected(state.tx) {
            state.wire.send(Sent { start: now / PS_PER_NS, word, format });
        }
    }

    /// A transmitter just enabled sends one idle character first (RM0090 §30.3.2).
    fn start_preamble(&self, state: &mut State, now: Ns) {
        if state.shifting_until.is_none()
            && let Some(format) = self.format(state)
        {
            state.shifting_until = Some(now * PS_PER_NS + character_ps(format));
            state.shifting_character = false;
        }
    }

    /// Ends what was shifted out by `now` and chains what waits, without a gap.
    fn shift(&self, state: &mut State, now: Ns) {
        while let Some(end) = state.shifting_until.filter(|end| end.div_ceil(PS_PER_NS) <= now) {
            state.shifting_until = None;
            self.start_next(state, end);
            if state.shifting_until.is_none() && state.shifting_character {
                state.registers.transmission_complete();
            }
        }
    }

    fn receive_all(&self, state: &mut State) {
        while let Some(received) = state.wire.take_received() {
            self.receive(state, received);
        }
    }

    fn receive(&self, state: &mut State, received: Received) {
        let Some(format) = state.listening else { return };
        if !self.connected(state.rx) {
            return;
        }
        let reception = state.registers.receive(received);
        state.receptions.note(reception);
        let character = character_ps(format) / PS_PER_NS;
        let quiet_from = received.at + format.bit_ps / 2 / PS_PER_NS;
        // Idle once a whole character of ones has passed; known for sure when a character that began just
        // before that would have ended.
        let latest_start = quiet_from + character;
        state.idle_check = Some((latest_start + character, latest_start));
    }

    /// Whether `pin` is switched to this USART.
    fn connected(&self, pin: Pin) -> bool {
        self.space.get().is_some_and(|space| pin.is_connected(space))
    }
}

impl Actor for Usart {
    fn next_event(&self) -> Option<Ns> {
        let state = lock(&self.state);
        let shifted = state.shifting_until.map(|end| end.div_ceil(PS_PER_NS));
        let idle = state.idle_check.map(|(at, _)| at);
        [shifted, idle, state.wire.next_event()].into_iter().flatten().min()
    }

    fn act(&self, now: Ns) {
        self.change(now, |state| {
            self.shift(state, now);
            state.wire.advance(now);
            self.receive_all(state);
            if state.idle_check.is_some_and(|(at, _)| at <= now) {
                state.idle_check = None;
                state.registers.raise(sr::IDLE);
            }
        });
    }

    fn clocks_changed(&self, now: Ns) {
        self.change(now, |_| ());
    }
}

/// Length of one character, start and stop bits included.
fn character_ps(format: Format) -> u64 {
    format.bit_ps * (1 + u64::from(format.data_bits)) + format.bit_ps * u64::from(format.stop_halves) / 2
}
