//! The clock controller's registers as firmware sees them, with a crystal that may fail behind them.

use std::fmt;
use std::sync::{Arc, Mutex, OnceLock};

use clino_sim::node::Ns;
use rsemu::core::space::{AccessConstraints, MemAttrs, MemOps, MemResult};
use rsemu::core::sync::{AtomicBool, Ordering};
use rsemu::core::wire::{Level, WireSource};

use super::NMI;
use crate::incident::{Chronicle, Event};
use crate::oscillators::CrystalLife;
use crate::timeline::{Actor, lock};
use crate::wrapped::Front;

/// Registers of the controller: offsets (RM0090 section 7.3).
mod offset {
    pub const CR: u64 = 0x00;
    pub const PLLCFGR: u64 = 0x04;
    pub const CFGR: u64 = 0x08;
    pub const CIR: u64 = 0x0c;
}

/// Bits of CR.
mod cr {
    pub const HSION: u32 = 1 << 0;
    pub const HSEON: u32 = 1 << 16;
    pub const HSERDY: u32 = 1 << 17;
    pub const HSEBYP: u32 = 1 << 18;
    pub const CSSON: u32 = 1 << 19;
    pub const PLLON: u32 = 1 << 24;
}

/// Bit of PLLCFGR: the PLL's input is the crystal.
const PLLSRC_HSE: u32 = 1 << 22;

/// Bits of CIR: the failure, and what clears it.
const CSSF: u32 = 1 << 7;
const CSSC: u32 = 1 << 23;

/// Fields of CFGR: the source wanted, and the source in use.
const SW: u32 = 0b11;
const SWS_AT: u32 = 2;
const SOURCE_HSI: u32 = 0b00;
const SOURCE_HSE: u32 = 0b01;
const SOURCE_PLL: u32 = 0b10;

/// How long after the failure, and again and again until it has happened, the switch of the clock is looked at.
const SWITCHING: Ns = 200;

/// What the registers and the crystal share.
pub(crate) struct Pins {
    /// The stock registers.
    words: Arc<dyn MemOps>,
    chronicle: Arc<Chronicle>,
    /// The core's clock comes from the crystal, and it has stopped.
    halted: AtomicBool,
    nmi: OnceLock<WireSource>,
    state: Mutex<State>,
}

/// The crystal, and what of the controller's state is kept here.
struct State {
    life: CrystalLife,
    /// There is a clock in its place, for which the oscillator has to be bypassed.
    is_fed: bool,
    /// It swings, or would.
    alive: bool,
    /// Firmware wants it on.
    wanted: bool,
    /// The clock security system is switching the core's clock; when it looks again.
    switching: Option<Ns>,
    /// CSSF.
    failed: bool,
}

impl Pins {
    /// The registers `words`, with a crystal of this life at them.
    pub fn new(words: Arc<dyn MemOps>, life: CrystalLife, is_fed: bool, chronicle: Arc<Chronicle>) -> Pins {
        let alive = life.stops_at != Some(0);
        let state = State { life, is_fed, alive, wanted: false, switching: None, failed: false };
        Pins {
            words,
            chronicle,
            halted: AtomicBool::new(false),
            nmi: OnceLock::new(),
            state: Mutex::new(state),
        }
    }

    /// Whether the core stands still for want of a clock.
    pub fn is_halted(&self) -> bool {
        self.halted.load(Ordering::Relaxed)
    }

    /// A stock register, as firmware would read it.
    fn get(&self, offset: u64) -> u32 {
        let mut bytes = [0; 4];
        // The offsets used here are registers.
        let _ = self.words.read(offset, &mut bytes, MemAttrs::DEFAULT);
        u32::from_le_bytes(bytes)
    }

    fn set(&self, offset: u64, value: u32) {
        let _ = self.words.write(offset, &value.to_le_bytes(), MemAttrs::DEFAULT);
    }

    fn signal(&self, failed: bool) {
        lock(&self.state).failed = failed;
        if let Some(nmi) = self.nmi.get() {
            nmi.set(Level::from_bool(failed));
        }
    }

    /// Whether the core's clock comes from the crystal.
    fn is_core_clock(&self) -> bool {
        match self.get(offset::CFGR) >> SWS_AT & SW {
            SOURCE_HSE => true,
            SOURCE_PLL => self.get(offset::PLLCFGR) & PLLSRC_HSE != 0,
            _ => false,
        }
    }

    /// The crystal stops.
    fn stop(&self, now: Ns) {
        self.chronicle.note(now, Event::Crystal { swings: false });
        lock(&self.state).alive = false;
        let control = self.get(offset::CR);
        if control & cr::HSERDY == 0 {
            self.set(offset::CR, control & !cr::HSEON);
        } else if control & cr::CSSON != 0 {
            if self.is_core_clock() {
                self.set(offset::CR, control | cr::HSION);
                lock(&self.state).switching = Some(now + SWITCHING);
            } else {
                self.fail(now, cr::HSEON);
            }
        } else if self.is_core_clock() {
            self.halted.store(true, Ordering::Relaxed);
        } else {
            self.set(offset::CR, control & !cr::HSEON);
        }
    }

    /// One look of the clock security system: wants the internal oscillator, or, when it is in use, is done.
    fn switch(&self, now: Ns) {
        let source = self.get(offset::CFGR);
        if source >> SWS_AT & SW == SOURCE_HSI {
            lock(&self.state).switching = None;
            // A PLL that it feeds goes with it.
            let fed = self.get(offset::PLLCFGR) & PLLSRC_HSE != 0;
            self.fail(now, cr::HSEON | if fed { cr::PLLON } else { 0 });
        } else {
            lock(&self.state).switching = Some(now + SWITCHING);
            self.set(offset::CFGR, source & !SW | SOURCE_HSI);
        }
    }

    /// Switches `off` what has no clock any more, and says so.
    fn fail(&self, now: Ns, off: u32) {
        self.set(offset::CR, self.get(offset::CR) & !off);
        lock(&self.state).wanted = false;
        self.chronicle.note(now, Event::ClockSecurity);
        self.signal(true);
    }

    /// The crystal swings again.
    fn come_back(&self, now: Ns) {
        self.chronicle.note(now, Event::Crystal { swings: true });
        let wanted = {
            let mut state = lock(&self.state);
            state.alive = true;
            state.wanted
        };
        self.halted.store(false, Ordering::Relaxed);
        if wanted {
            self.set(offset::CR, self.get(offset::CR) | cr::HSEON);
        }
    }
}

impl Front for Pins {
    const OUTPUT: Option<&str> = Some(NMI);

    fn connect(&self, nmi: WireSource) {
        let _ = self.nmi.set(nmi);
    }

    /// The chip is reset: the controller is on the internal oscillator.
    fn reset(&self) {
        {
            let mut state = lock(&self.state);
            (state.wanted, state.switching) = (false, None);
        }
        self.halted.store(false, Ordering::Relaxed);
        self.signal(false);
    }
}

impl Actor for Pins {
    fn next_event(&self) -> Option<Ns> {
        let state = lock(&self.state);
        let life = state.life;
        [life.stops_at, life.returns_at, state.switching].into_iter().flatten().min()
    }

    fn act(&self, now: Ns) {
        let (stops, returns, looks) = {
            let mut state = lock(&self.state);
            (
                state.life.stops_at.take_if(|at| *at <= now).is_some(),
                state.life.returns_at.take_if(|at| *at <= now).is_some(),
                state.switching.is_some_and(|at| at <= now),
            )
        };
        if stops {
            self.stop(now);
        }
        if returns {
            self.come_back(now);
        }
        if looks {
            self.switch(now);
        }
    }
}

impl MemOps for Pins {
    fn read(&self, offset: u64, dst: &mut [u8], attrs: MemAttrs) -> MemResult {
        self.words.read(offset, dst, attrs)?;
        let extra = {
            let state = lock(&self.state);
            match offset & !3 {
                offset::CR if state.wanted => cr::HSEON,
                offset::CIR if state.failed => CSSF,
                _ => 0,
            }
        };
        for (byte, extra) in dst.iter_mut().zip(extra.to_le_bytes()) {
            *byte |= extra;
        }
        Ok(())
    }

    fn write(&self, offset: u64, src: &[u8], attrs: MemAttrs) -> MemResult {
        let Some(word) = src.first_chunk().map(|bytes| u32::from_le_bytes(*bytes)) else {
            return self.words.write(offset, src, attrs);
        };
        let mut passed = word;
        match offset & !3 {
            offset::CR => {
                let mut state = lock(&self.state);
                state.wanted = word & cr::HSEON != 0;
                if !state.alive || (word & cr::HSEBYP != 0) != state.is_fed {
                    passed &= !cr::HSEON;
                }
            }
            offset::CIR if word & CSSC != 0 => self.signal(false),
            _ => {}
        }
        self.words.write(offset, &passed.to_le_bytes(), attrs)
    }

    fn constraints(&self) -> AccessConstraints {
        self.words.constraints()
    }
}

impl fmt::Debug for Pins {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pins").field("words", &self.words).finish_non_exhaustive()
    }
}
