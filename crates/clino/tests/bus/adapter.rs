//! A bad adapter: two pseudo-terminals, and what goes wrong between them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use clino_pty::Terminal;

use super::port::Port;

/// A look at both ends.
const LOOK: Duration = Duration::from_millis(1);

/// The number of a frame and its bytes; how many of them go on.
pub type OnFrame = Box<dyn FnMut(usize, &[u8]) -> usize + Send>;

/// What it does.
#[derive(Default)]
pub struct Faults {
    /// What comes from the sensors is held back, and handed over in batches this far apart.
    pub batch: Duration,
    /// What comes from the sensors is handed over one byte at a time, this far apart.
    pub fragment: Duration,
    /// What the computer sends comes back.
    pub echo: bool,
    /// Every byte of that number from the sensors is lost; 0: none.
    pub drop_every: usize,
    /// Every byte of that number from the sensors comes twice; 0: none.
    pub double_every: usize,
    /// It is unplugged when this many bytes have come from the sensors; 0: never.
    pub unplug_after: usize,
    /// Is told of each frame of the computer, counted from 1; how many bytes of it go on.
    pub on_frame: Option<OnFrame>,
}

/// An adapter that works, until it is dropped.
pub struct Adapter {
    path: String,
    stop: Arc<AtomicBool>,
    frames: Arc<AtomicUsize>,
    thread: Option<JoinHandle<()>>,
}

impl Adapter {
    /// In front of the sensors at this port.
    pub fn new(sensors: &str, baud: u32, faults: Faults) -> Self {
        let terminal = Terminal::open(baud).unwrap();
        let path = terminal.path().to_owned();
        let (stop, frames) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let works = Works {
            terminal,
            sensors: Port::open(sensors),
            baud,
            faults,
            held: VecDeque::new(),
            next: Instant::now(),
            come: 0,
            frames: Arc::clone(&frames),
        };
        let ended = Arc::clone(&stop);
        let thread = Some(thread::spawn(move || works.run(&ended)));
        Self { path, stop, frames, thread }
    }

    /// Its port.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// How many frames the computer has sent.
    pub fn frames(&self) -> usize {
        self.frames.load(Ordering::SeqCst)
    }
}

impl Drop for Adapter {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        let ended = self.thread.take().expect("it is dropped once").join();
        assert!(ended.is_ok() || thread::panicking(), "the adapter failed");
    }
}

struct Works {
    terminal: Terminal,
    sensors: Port,
    baud: u32,
    faults: Faults,
    /// What is not handed over yet.
    held: VecDeque<u8>,
    /// When something is handed over next.
    next: Instant,
    /// Bytes that have come from the sensors.
    come: usize,
    frames: Arc<AtomicUsize>,
}

impl Works {
    fn run(mut self, stop: &AtomicBool) {
        while !stop.load(Ordering::SeqCst) {
            self.take_frames();
            let bytes = self.sensors.read_within(256, LOOK);
            bytes.iter().for_each(|&byte| self.take_answer(byte));
            if self.faults.unplug_after > 0 && self.come >= self.faults.unplug_after {
                // The terminal goes with the rest of it.
                return;
            }
            self.hand_over();
        }
    }

    fn take_frames(&mut self) {
        let mut buffer = [0; 256];
        let frame = self.terminal.read(&mut buffer).unwrap().to_vec();
        if let Some(baud) = self.terminal.baud().unwrap().filter(|&baud| baud != self.baud) {
            self.baud = baud;
            self.sensors.set_baud(baud);
        }
        if frame.is_empty() {
            return;
        }
        let number = self.frames.fetch_add(1, Ordering::SeqCst) + 1;
        let goes_on = self.faults.on_frame.as_mut().map_or(frame.len(), |on_frame| on_frame(number, &frame));
        if self.faults.echo {
            self.held.extend(&frame);
        }
        self.sensors.send(&frame[..goes_on]);
    }

    fn take_answer(&mut self, byte: u8) {
        self.come += 1;
        let befalls = |every: usize| every > 0 && self.come.is_multiple_of(every);
        let times = if befalls(self.faults.drop_every) {
            0
        } else {
            1 + usize::from(befalls(self.faults.double_every))
        };
        self.held.extend(std::iter::repeat_n(byte, times));
    }

    fn hand_over(&mut self) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        let Faults { batch, fragment, .. } = self.faults;
        let count = if fragment > Duration::ZERO { self.held.len().min(1) } else { self.held.len() };
        let bytes: Vec<u8> = self.held.drain(..count).collect();
        self.terminal.deliver(&bytes).unwrap();
        self.next = now + batch.max(fragment);
    }
}
