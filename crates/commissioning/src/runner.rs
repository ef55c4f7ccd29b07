//! Runs an operation on a master, one step at a time.

use clino_bus::{ExchangeOutcome, Fault, Instant, Isu, Master, Protocol, Serial, T7};
use clino_codec::isu::{DeviceError, Response};

use crate::operation::{Operation, Step, TaskProgress};

/// A protocol whose answers tell whether the request arrived whole.
pub trait Commissionable: Protocol {
    /// Whether the sensor says that it heard something damaged: then it is worth asking again.
    fn heard_damaged(answer: &Self::Answer) -> bool;
}

impl Commissionable for T7 {
    /// Get commands carry no checksum, and Set commands are repeated by the operation, after reading.
    fn heard_damaged(_: &Self::Answer) -> bool {
        false
    }
}

impl Commissionable for Isu {
    /// No command of ours has an invalid function code or checksum, unless it was damaged on its way.
    fn heard_damaged(answer: &Self::Answer) -> bool {
        matches!(
            answer.response,
            Response::Error(DeviceError::InvalidChecksum | DeviceError::InvalidFunctionCode)
        )
    }
}

/// What the caller has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum RunnerAction<F, R, E> {
    /// Nothing before [`Runner::poll_at`].
    Idle,
    /// Submit this frame to the line.
    Send(F),
    /// Set the line to this bit rate and the master to [timing](clino_bus::Timing) for it, then poll again.
    Serial(Serial),
    /// The end.
    Done(Result<R, E>),
}

/// The action type of an operation.
pub type ActionOf<O> = RunnerAction<
    <<O as Operation>::Protocol as Protocol>::Frame,
    <O as Operation>::Report,
    <O as Operation>::Error,
>;

/// Leads one operation through a master, one step at a time.
///
/// ```text
///  loop:  Runner::poll ──▶ Send(frame)      submit it to the line; outcomes of the master now go to Runner::settle
///                     ├──▶ Serial(rate)     set the line and Master::set_timing, then poll again
///                     ├──▶ Idle             nothing before Runner::poll_at, or an exchange is in hand
///                     └──▶ Done(result)
/// ```
///
/// The runner borrows the master only while it begins an exchange, so that a gateway can put exchanges of its own in
/// between: while [`Runner::is_asking`], outcomes are the operation's; otherwise the gateway may poll unless
/// [`Runner::is_exclusive`]. Taking turns, one exchange each, is fair to both: polling keeps at least half of its rate,
/// and all of it while the operation waits.
///
/// A program with several operations on one bus gives them one report, event and error, and runs them as one
/// `Runner<dyn Operation<…>>`: the runner is in its image once for each protocol, not once for each operation.
///
/// ```
/// use clino_bus::{Instant, Master, Serial, T7, Timing};
/// use clino_codec::t7::Address;
/// use clino_commissioning::t7::{Device, Set, DeviceSetting};
/// use clino_commissioning::{RunnerAction, Runner};
///
/// let mut master = Master::<T7>::new(Timing::t7(Serial::T7_DEFAULT));
/// let device = Device::at(Address::new(5).unwrap()).unwrap();
/// let mut runner = Runner::new(Set::new(device, DeviceSetting::Damping(500)).unwrap());
/// let now = Instant::from_micros(1_000);
///
/// let RunnerAction::Send(frame) = runner.poll(&mut master, now) else { panic!() };
/// assert_eq!(frame.as_bytes(), [0x05, 0x01, 0x8A]); // Get Damping, to the line
/// assert!(runner.is_asking());
/// // Events of the line go to the master; its outcomes go to the runner.
/// if let Some(outcome) = master.poll(now) {
///     runner.settle(&outcome);
/// }
/// ```
#[derive(Debug)]
pub struct Runner<O: ?Sized> {
    asking: Asking,
    tries_left: Option<u8>,
    wait: Option<Instant>,
    /// The last field, so that a reference to a runner can become one to a `Runner<dyn Operation<…>>`.
    operation: O,
}

/// Which exchange the next outcomes of the master belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asking {
    None,
    One,
    All,
}

impl<O> Runner<O> {
    /// Has not begun.
    pub const fn new(operation: O) -> Self {
        Runner { operation, asking: Asking::None, tries_left: None, wait: None }
    }
}

impl<O: Operation + ?Sized> Runner<O>
where
    O::Protocol: Commissionable,
{
    /// The next thing to do. [`RunnerAction::Idle`] while an exchange is in hand, this operation's or another.
    pub fn poll(&mut self, master: &mut Master<O::Protocol>, now: Instant) -> ActionOf<O> {
        if self.is_asking() || master.is_asking() {
            return RunnerAction::Idle;
        }
        let step = self.operation.next(now);
        self.wait = match &step {
            Step::Wait { until } => Some(*until),
            Step::Ask { address, request, .. } | Step::Collect { address, request, .. } => {
                // Not before a late answer can be distinguished from its own.
                master.ask_at(*address, request).filter(|&at| at > now)
            }
            Step::Serial(_) | Step::Done => None,
        };
        if self.wait.is_some() {
            return RunnerAction::Idle;
        }
        let begun = match step {
            Step::Ask { address, ref request, tries } => {
                self.asking = Asking::One;
                let left = self.tries_left.replace(self.tries_left.unwrap_or(tries).saturating_sub(1));
                match left {
                    None => master.begin(address, request, now),
                    Some(_) => master.begin_retry(address, request, now),
                }
            }
            Step::Collect { address, ref request, window } => {
                self.asking = Asking::All;
                master.begin_collecting(address, request, window, now)
            }
            Step::Wait { .. } => return RunnerAction::Idle,
            Step::Serial(serial) => return RunnerAction::Serial(serial),
            Step::Done => {
                return self.operation.result().map_or(RunnerAction::Idle, RunnerAction::Done);
            }
        };
        match begun {
            Ok(frame) => RunnerAction::Send(frame),
            Err(_) => {
                // Operations ask only what they have had encoded before; if not, this ends them.
                let _no_event = self.settle(&ExchangeOutcome { result: Err(Fault::NotSent), at: now });
                RunnerAction::Idle
            }
        }
    }

    /// An exchange of this operation has ended; an answer has come, when it is collecting.
    pub fn settle(&mut self, outcome: &ExchangeOutcome<O::Protocol>) -> Option<O::Event> {
        match self.asking {
            Asking::None => return None,
            Asking::One => {
                self.asking = Asking::None;
                let failed = match &outcome.result {
                    Ok(answer) => O::Protocol::heard_damaged(answer),
                    Err(_) => true,
                };
                if failed && self.tries_left.is_some_and(|tries| tries > 0) {
                    // Asked again at the next poll.
                    return None;
                }
                self.tries_left = None;
            }
            Asking::All => {
                if let Err(Fault::Over { .. } | Fault::NotSent | Fault::LineBusy) = outcome.result {
                    self.asking = Asking::None;
                }
            }
        }
        self.operation.on(outcome)
    }

    /// Whether an exchange of the operation is under way: the master's outcomes belong to [`Runner::settle`].
    pub fn is_asking(&self) -> bool {
        self.asking != Asking::None
    }

    /// Whether the operation needs the line even between exchanges.
    pub fn is_exclusive(&self) -> bool {
        self.is_asking() || self.operation.is_exclusive()
    }

    /// When [`Runner::poll`] has something to do, once the master has no exchange in hand: [`Instant::ZERO`] for at once,
    /// `None` while an exchange of the operation is under way.
    pub fn poll_at(&self) -> Option<Instant> {
        if self.is_asking() { None } else { Some(self.wait.unwrap_or(Instant::ZERO)) }
    }

    /// How far the operation is.
    pub fn progress(&self) -> TaskProgress {
        self.operation.progress()
    }

    /// Stop at the next consistent point; go on polling until `Done`.
    pub fn cancel(&mut self) {
        self.operation.cancel();
        // The pause, or the request under repetition, may have become pointless.
        self.wait = None;
        self.tries_left = None;
    }

    /// The operation.
    pub fn operation(&self) -> &O {
        &self.operation
    }
}
