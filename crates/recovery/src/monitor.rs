//! Monitored tasks: what must keep running, and how long each task may be silent.
//!
//! Any level of the program checks in for its task with one store; a single context calls [`TaskMonitor::tick`].

use core::sync::atomic::{AtomicU8, Ordering};

/// Milliseconds from one tick to the next.
pub const TICK_MS: u32 = 10;

/// A task that must keep running. The numbers never change their meaning: Modbus masters read them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum MonitoredTask {
    /// The T7 bus keeps its own deadlines.
    T7Bus = 1,
    /// The ISU bus does.
    IsuBus = 2,
    /// Captured PWM cycles are fetched.
    Pwm = 3,
    /// The Modbus server runs.
    Modbus = 4,
    /// The console's loop runs, or its characters go out.
    Console = 5,
    /// Storing makes progress and ends.
    Storage = 6,
}

impl MonitoredTask {
    /// All of them, by number.
    pub const ALL: [MonitoredTask; 6] = [
        MonitoredTask::T7Bus,
        MonitoredTask::IsuBus,
        MonitoredTask::Pwm,
        MonitoredTask::Modbus,
        MonitoredTask::Console,
        MonitoredTask::Storage,
    ];

    /// Its name in JSON and in the documentation.
    pub const fn name(self) -> &'static str {
        match self {
            MonitoredTask::T7Bus => "t7_bus",
            MonitoredTask::IsuBus => "isu_bus",
            MonitoredTask::Pwm => "pwm",
            MonitoredTask::Modbus => "modbus",
            MonitoredTask::Console => "console",
            MonitoredTask::Storage => "storage",
        }
    }

    /// What it stands for, for the documentation.
    pub const fn meaning(self) -> &'static str {
        match self {
            MonitoredTask::T7Bus => "the T7 bus keeps its own deadlines",
            MonitoredTask::IsuBus => "the ISU bus keeps its own deadlines",
            MonitoredTask::Pwm => "captured PWM cycles are fetched",
            MonitoredTask::Modbus => "the Modbus server runs",
            MonitoredTask::Console => "the console's loop runs, or its characters go out",
            MonitoredTask::Storage => "storing ends",
        }
    }

    /// The task with this number.
    pub fn from_number(number: u32) -> Option<MonitoredTask> {
        MonitoredTask::ALL.into_iter().find(|task| *task as u32 == number)
    }

    /// Longest silence in milliseconds.
    ///
    /// The clock wakes the bus and Modbus levels every 65.5 ms at least; seven of these may be lost. The console may have to
    /// wait for a few long lines of the levels above. Storing takes up to 0.52 s with its longest erase, during which no
    /// tick runs.
    pub const fn longest_silence_ms(self) -> u32 {
        match self {
            MonitoredTask::T7Bus | MonitoredTask::IsuBus | MonitoredTask::Pwm | MonitoredTask::Modbus => 500,
            MonitoredTask::Console | MonitoredTask::Storage => 900,
        }
    }

    /// Where it is in [`MonitoredTask::ALL`].
    const fn place(self) -> usize {
        (self as usize).saturating_sub(MonitoredTask::ALL[0] as usize)
    }

    const fn most_ticks(self) -> u8 {
        // At most 90.
        (self.longest_silence_ms() / TICK_MS) as u8
    }
}

/// The patience with a task that has nothing to do.
const RESTING: u8 = u8::MAX;

/// How long each task may still be silent.
#[derive(Debug)]
pub struct TaskMonitor {
    /// Ticks until it has to check in, by [`MonitoredTask::ALL`]. Counted down: the tick holds off every interrupt, DE's among
    /// them, and has only to look for a zero.
    left: [AtomicU8; MonitoredTask::ALL.len()],
}

impl TaskMonitor {
    /// A monitor whose tasks all rest.
    pub const fn new() -> TaskMonitor {
        TaskMonitor { left: [const { AtomicU8::new(RESTING) }; MonitoredTask::ALL.len()] }
    }

    /// The task runs. From now on the monitor expects it to check in.
    pub fn check_in(&self, task: MonitoredTask) {
        self.set(task, task.most_ticks());
    }

    /// The task has nothing to do until it checks in again.
    pub fn rest(&self, task: MonitoredTask) {
        self.set(task, RESTING);
    }

    fn set(&self, task: MonitoredTask, ticks: u8) {
        // By its number, without a search: every run of a level checks in.
        if let Some(left) = self.left.get(task.place()) {
            left.store(ticks, Ordering::Relaxed);
        }
    }

    /// Lets [`TICK_MS`] pass; returns the first task that has been silent for too long. Call it from one context only, and
    /// from one that no task's check-in interrupts.
    pub fn tick(&self) -> Option<MonitoredTask> {
        let mut is_stalled = false;
        for left in &self.left {
            match left.load(Ordering::Relaxed) {
                0 => is_stalled = true,
                RESTING => {}
                ticks => left.store(ticks.wrapping_sub(1), Ordering::Relaxed),
            }
        }
        if is_stalled { self.stalled() } else { None }
    }

    /// The first task that has been silent for too long.
    pub fn stalled(&self) -> Option<MonitoredTask> {
        let mut all = self.left.iter().zip(MonitoredTask::ALL);
        all.find(|(left, _)| left.load(Ordering::Relaxed) == 0).map(|(_, task)| task)
    }
}

impl Default for TaskMonitor {
    fn default() -> TaskMonitor {
        TaskMonitor::new()
    }
}
