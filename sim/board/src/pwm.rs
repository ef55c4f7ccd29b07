//! PWM sources: a level on a pin with edges at exact instants, and a log of the edges.
//!
//! A source that is not connected drives nothing: the pin is at the level of its pull resistor (PUPDR of its GPIO port), low
//! without one. A change of the resistor by firmware takes effect up to [`LOOK`] later.

use crate::timeline::{Actor, Timeline, lock};
use clino_sim::node::Ns;
pub use clino_sim::pwm::Cycle;
use rsemu::core::Result;
use rsemu::core::device::{Device, DeviceClass, RealizeCtx, ResetKind};
use rsemu::core::error::Error;
use rsemu::core::space::{AddressSpace, MemAttrs};
use rsemu::core::value::Width;
use rsemu::core::wire::{Level, WireSource};
use rsemu::machine::validate::{ClassSchema, PortDir, PropSchema};
use rsemu::machine::{BindCtx, Instance};
use std::sync::{Arc, Mutex, OnceLock};

/// Class name in the board text.
pub(crate) const CLASS_NAME: &str = "clino.pwm";

/// How often the pull resistor of an unconnected pin is looked at: 1 ms.
pub const LOOK: Ns = 1_000_000;

static CLASS: DeviceClass = DeviceClass {
    name: CLASS_NAME,
    version: 1,
    summary: "PWM source with exact edges",
    properties: &[],
    construct: |_| Err(Error::Unimplemented("built by the board only")),
};

/// The class as the emulator's registry wants it.
pub(crate) fn class() -> &'static DeviceClass {
    &CLASS
}

/// What the board text may say about the class.
pub(crate) fn schema() -> ClassSchema {
    ClassSchema::new(CLASS_NAME)
        .prop(PropSchema::new("channel", rsemu::core::props::ValueKind::Uint).required())
        .port("out", PortDir::Out)
}

/// Decides what a PWM source drives.
pub trait PwmWaveform: Send {
    /// What happens from `now` on. Called at power-up and at the end of each cycle. A pulse has no rising edge with
    /// `high` 0, and no falling one with `high` ≥ `period`.
    fn next_cycle(&mut self, now: Ns) -> Cycle;

    /// Whether the source is connected at `now`. If it is not, the level of its cycle does not matter.
    fn is_connected(&self, _now: Ns) -> bool {
        true
    }
}

impl<F: FnMut(Ns) -> Cycle + Send> PwmWaveform for F {
    fn next_cycle(&mut self, now: Ns) -> Cycle {
        self(now)
    }
}

/// A line that never moves.
pub struct Steady(
    /// Its level.
    pub bool,
);

impl PwmWaveform for Steady {
    fn next_cycle(&mut self, _now: Ns) -> Cycle {
        Cycle::Level { high: self.0, recheck_after: 1_000_000_000 }
    }
}

/// Nothing on the line.
pub struct Unconnected;

impl PwmWaveform for Unconnected {
    fn next_cycle(&mut self, _now: Ns) -> Cycle {
        Cycle::Level { high: false, recheck_after: LOOK }
    }

    fn is_connected(&self, _now: Ns) -> bool {
        false
    }
}

/// A waveform on a cable that is cut at times. A pulse under way is finished.
pub struct Cable {
    /// What is at its end.
    pub waveform: Box<dyn PwmWaveform>,
    /// When it is cut, `[from, until)`.
    pub open: Vec<(Ns, Ns)>,
}

impl Cable {
    /// Until when it is cut, if it is.
    fn open_until(&self, now: Ns) -> Option<Ns> {
        self.open.iter().find(|(from, until)| (*from..*until).contains(&now)).map(|&(_, until)| until)
    }
}

impl PwmWaveform for Cable {
    fn next_cycle(&mut self, now: Ns) -> Cycle {
        match self.open_until(now) {
            Some(until) => Cycle::Level { high: false, recheck_after: LOOK.min(until - now) },
            None => self.waveform.next_cycle(now),
        }
    }

    fn is_connected(&self, now: Ns) -> bool {
        self.open_until(now).is_none() && self.waveform.is_connected(now)
    }
}

/// One pulse as it was on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pulse {
    /// Rising edge.
    pub rising: Ns,
    /// Falling edge.
    pub falling: Ns,
    /// The rising edge that followed.
    pub next_rising: Ns,
}

/// One source.
pub(crate) struct Source {
    timeline: Arc<Timeline>,
    /// Base address of the GPIO port, and number of the pin.
    pin: (u64, u32),
    space: OnceLock<Arc<AddressSpace>>,
    out: Mutex<Vec<WireSource>>,
    state: Mutex<State>,
}

struct State {
    waveform: Box<dyn PwmWaveform>,
    high: bool,
    /// Falling edge of the cycle in progress, if one is still to come.
    fall_at: Option<Ns>,
    /// End of the cycle in progress.
    end_at: Ns,
    /// The last edges driven.
    rising: Option<Ns>,
    falling: Option<Ns>,
    log: Vec<Pulse>,
}

impl Source {
    /// A source that begins with a low line at power-up.
    pub fn new(waveform: Box<dyn PwmWaveform>, pin: (u64, u32), timeline: Arc<Timeline>) -> Source {
        Source {
            timeline,
            pin,
            space: OnceLock::new(),
            out: Mutex::new(Vec::new()),
            state: Mutex::new(State {
                waveform,
                high: false,
                fall_at: None,
                end_at: 0,
                rising: None,
                falling: None,
                log: Vec::new(),
            }),
        }
    }

    /// Whether the pin has a pull-up.
    fn is_pulled_up(&self) -> bool {
        const PUPDR: u64 = 0x0c;
        const PULL_UP: u64 = 0b01;
        let (port, number) = self.pin;
        let read = |space: &Arc<AddressSpace>| space.read(port + PUPDR, Width::U32, MemAttrs::DEBUG).ok();
        let pulls = self.space.get().and_then(read).unwrap_or(0);
        pulls >> (2 * number) & 0b11 == PULL_UP
    }

    /// Every complete pulse so far, in order.
    pub fn log(&self) -> Vec<Pulse> {
        lock(&self.state).log.clone()
    }

    /// Every edge so far, in order, with the level after it. The line begins low.
    pub fn edges(&self) -> Vec<(Ns, bool)> {
        let state = lock(&self.state);
        let complete = state.log.iter().flat_map(|pulse| [(pulse.rising, true), (pulse.falling, false)]);
        let rising = state.rising.map(|at| (at, true));
        let falling = state.falling.map(|at| (at, false));
        complete.chain(rising).chain(falling).collect()
    }
}

impl State {
    fn next_event(&self) -> Ns {
        self.fall_at.unwrap_or(self.end_at)
    }

    /// Takes the one step that is due at `now`.
    fn step(&mut self, now: Ns, pulled_up: bool) {
        if self.fall_at.take().is_some() {
            self.level(now, false);
            return;
        }
        match self.waveform.next_cycle(now) {
            Cycle::Level { high, recheck_after } => {
                let connected = self.waveform.is_connected(now);
                self.end_at = now + recheck_after.max(1);
                self.level(now, if connected { high } else { pulled_up });
            }
            Cycle::Pulse { period, high } => {
                let period = period.max(1);
                self.end_at = now + period;
                self.fall_at = (0 < high && high < period).then_some(now + high);
                self.level(now, high > 0);
            }
        }
    }

    fn level(&mut self, now: Ns, high: bool) {
        if high == self.high {
            return;
        }
        self.high = high;
        if !high {
            self.falling = Some(now);
            return;
        }
        if let (Some(rising), Some(falling)) = (self.rising, self.falling) {
            self.log.push(Pulse { rising, falling, next_rising: now });
        }
        (self.rising, self.falling) = (Some(now), None);
    }
}

impl Actor for Source {
    fn next_event(&self) -> Option<Ns> {
        Some(lock(&self.state).next_event())
    }

    fn act(&self, now: Ns) {
        let mut state = lock(&self.state);
        state.step(now, self.is_pulled_up());
        let level = Level::from(state.high);
        drop(state);
        for out in lock(&self.out).iter() {
            out.set(level);
        }
        self.timeline.nudge();
    }
}

/// A source in the emulator's machine.
#[derive(Debug)]
pub(crate) struct PwmDevice(pub Arc<Source>);

impl std::fmt::Debug for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Source").field("high", &lock(&self.state).high).finish_non_exhaustive()
    }
}

impl Device for PwmDevice {
    fn class(&self) -> &'static DeviceClass {
        &CLASS
    }

    fn realize(&self, _ctx: &mut RealizeCtx<'_>) -> Result<()> {
        Ok(())
    }

    fn reset(&self, _kind: ResetKind) {
        // The sensor behind the line knows nothing of the chip's reset.
    }

    fn connect(&self, _port: &str, source: WireSource) -> Result<()> {
        lock(&self.0.out).push(source);
        Ok(())
    }

    fn announce(&self, _port: &str) {
        let level = Level::from(lock(&self.0.state).high);
        for out in lock(&self.0.out).iter() {
            out.set(level);
        }
    }
}

impl Instance for PwmDevice {
    fn bind(&self, ctx: &BindCtx<'_>) -> Result<()> {
        if let Some(space) = ctx.space_named("mem") {
            let _ = self.0.space.set(Arc::clone(space));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(waveform: impl PwmWaveform + 'static, until: Ns) -> Source {
        let source = Source::new(Box::new(waveform), (0, 0), Arc::new(Timeline::new()));
        while let Some(at) = source.next_event().filter(|at| *at <= until) {
            source.act(at);
        }
        source
    }

    #[test]
    fn pulses_follow_each_other_without_a_gap() {
        let log = run(|_| Cycle::Pulse { period: 1_000, high: 366 }, 3_000).log();
        assert_eq!(log.len(), 3);
        assert_eq!(log[1], Pulse { rising: 1_000, falling: 1_366, next_rising: 2_000 });
    }

    #[test]
    fn a_full_or_empty_pulse_has_no_edge() {
        assert_eq!(run(|_| Cycle::Pulse { period: 1_000, high: 0 }, 5_000).log(), []);
        let full = run(|_| Cycle::Pulse { period: 1_000, high: 1_000 }, 5_000);
        assert_eq!(full.log(), []);
        assert!(lock(&full.state).high);
    }

    #[test]
    fn a_pulse_before_a_steady_level_ends_with_the_next_rising_edge() {
        let log = run(
            |now| match now {
                0 => Cycle::Pulse { period: 100, high: 40 },
                100 => Cycle::Level { high: false, recheck_after: 500 },
                _ => Cycle::Pulse { period: 100, high: 10 },
            },
            600,
        )
        .log();
        assert_eq!(log, [Pulse { rising: 0, falling: 40, next_rising: 600 }]);
    }

    #[test]
    fn the_pulse_under_way_has_its_edges_too() {
        let pulse = |_| Cycle::Pulse { period: 100, high: 40 };
        assert_eq!(run(pulse, 130).edges(), [(0, true), (40, false), (100, true)]);
        assert_eq!(run(pulse, 150).edges(), [(0, true), (40, false), (100, true), (140, false)]);
    }
}
