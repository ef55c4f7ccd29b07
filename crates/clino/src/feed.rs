//! Readings from a port that may vanish and come back: a thread reads, the caller draws or writes at its own pace.

use std::io;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use clino_bus::{Serial, Timing};
use clino_commissioning::TaskProgress;
use clino_gateway::Status;

use crate::bus::{Broken, Bus, Observer, Stop, TimingAt};
use crate::poll::{Measured, Measures, Poll, Polled, Question};
use crate::port::{self, PortError};
use crate::session::PortOptions;

/// From one attempt at a port that has vanished to the next.
const REOPEN: Duration = Duration::from_millis(500);
/// A look at whether the user wants to stop.
const LOOK: Duration = Duration::from_millis(50);

/// What comes from the port.
pub enum News {
    /// It is open.
    Open,
    /// It cannot be opened, or has vanished; it is tried again.
    Lost(PortError),
    /// A reading of the sensor of that number.
    Reading { sensor: usize, at: Instant, utc: SystemTime, result: Result<Measured, Status> },
}

/// How a bus is run.
#[derive(Clone)]
pub struct Line {
    pub port: PortOptions,
    pub serial: Serial,
    pub timing: TimingAt,
}

impl Line {
    /// A T7 bus.
    pub fn t7(port: PortOptions, serial: Serial) -> Self {
        Self { port, serial, timing: Timing::t7 }
    }

    /// An ISU bus.
    pub fn isu(port: PortOptions) -> Self {
        Self { port, serial: Serial::ISU, timing: |_| Timing::isu() }
    }

    /// Opens it.
    ///
    /// # Errors
    /// Those of the port.
    pub fn open<P: Measures>(&self) -> Result<Bus<P>, PortError> {
        let port = port::open(&self.port.port, self.serial.baud, self.port.wiring())?;
        let latency = self.port.latency.map_or_else(|| port.latency(), Duration::from_millis);
        Ok(Bus::new(port, self.serial, self.timing, latency, self.port.echo))
    }
}

/// Reads these sensors in a thread of its own, until `stop`; then the channel ends.
pub fn start<P>(
    line: Line,
    questions: Vec<Question<P>>,
    period: clino_bus::Duration,
    stop: Stop,
) -> Receiver<News>
where
    P: Measures + 'static,
    P::Address: Send,
    P::Request: Send,
{
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let mut teller = Teller(sender);
        while !stop.is_asked() {
            let questions = questions
                .iter()
                .map(|Question { address, request }| Question { address: *address, request: *request });
            let ended = match line.open() {
                Ok(mut bus) => {
                    let poll = Poll::<P>::new(questions, period);
                    teller
                        .tell(News::Open)
                        .map_err(Broken::Output)
                        .and_then(|()| bus.run(poll, &stop, &mut teller).map(|_| ()))
                }
                Err(error) => Err(Broken::Port(error)),
            };
            let Err(Broken::Port(error)) = ended else { return };
            if teller.tell(News::Lost(error)).is_err() {
                return;
            }
            let until = Instant::now() + REOPEN;
            while Instant::now() < until && !stop.is_asked() {
                thread::sleep(LOOK);
            }
        }
    });
    receiver
}

struct Teller(Sender<News>);

impl Teller {
    fn tell(&mut self, news: News) -> io::Result<()> {
        self.0.send(news).map_err(|_| io::ErrorKind::BrokenPipe.into())
    }
}

impl Observer<Polled> for Teller {
    fn event(&mut self, Polled { sensor, result }: Polled) -> io::Result<()> {
        self.tell(News::Reading { sensor, at: Instant::now(), utc: SystemTime::now(), result })
    }

    fn progress(&mut self, _: TaskProgress) {}

    fn stopping(&mut self) {}
}
